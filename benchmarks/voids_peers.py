"""Other programs that fill voids, and what they made of our masks.

GDAL is quick and runs every time. The results of the slow ones are kept by mask in
``voids_peers.json``: sums by size class, no rasters. To fill in what is missing there (hours, with
GRASS and SAGA installed): ``.venv/bin/python benchmarks/voids_peers.py``.
"""

import argparse
import hashlib
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from voids_masks import KINDS, PATHS, SEEDS, mask, tile

from demsmith.core import raster
from demsmith.core.raster.peer import gdal_fill
from demsmith.core.validation.scoring import Holes, Tally

CACHE = Path(__file__).resolve().with_name("voids_peers.json")
TIME_LIMIT = 1200  # seconds of computing for one fill by another program
NOTHING = {"peers": {}}


def biharmonic(ground, void):
    """Fill by scikit-image."""
    from skimage.restoration import inpaint_biharmonic

    values = np.where(void, 0, ground.values).astype(np.float64)
    return inpaint_biharmonic(values, void, split_into_regions=True)


def saga_spline(ground, void):
    """Fill by SAGA's "Close Gaps with Spline"."""
    return _by_program(
        ground,
        void,
        "saga_cmd grid_tools 25 -GRID in.tif -CLOSED out.sdat",
        "out.sdat",
    )


def grass(method):
    """Give the fill by GRASS's r.fillnulls."""

    def fill(ground, void):
        steps = (
            "r.in.gdal input=in.tif output=dem",
            "g.region raster=dem",
            f"r.fillnulls input=dem output=filled method={method}",
            "r.out.gdal input=filled output=out.tif type=Float64 nodata=-32768 -c",
        )
        return _by_program(
            ground,
            void,
            f"grass --tmp-location in.tif --exec sh -c '{' && '.join(steps)}'",
            "out.tif",
        )

    return fill


QUICK = {
    "GDAL": lambda ground, void: gdal_fill(ground.values, void)[0],
    "GDAL, 2 smoothings": lambda ground, void: gdal_fill(ground.values, void, smoothings=2)[0],
}
SLOW = {
    "scikit-image biharmonic": biharmonic,
    "SAGA spline": saga_spline,
    "GRASS bilinear": grass("bilinear"),
    "GRASS bicubic": grass("bicubic"),
}


def _by_program(ground, void, command, output):
    """Run a command on ``in.tif`` in a folder of its own and read what it wrote there."""
    like = raster.Raster(
        ground.values, void, ground.grid, raster.BandMeta(np.dtype(np.float32), nodata=-32768.0)
    )
    with tempfile.TemporaryDirectory() as folder:
        raster.write(f"{folder}/in.tif", ground.values, like=like, void=void)
        subprocess.run(
            ["/bin/sh", "-c", f"ulimit -t {TIME_LIMIT}; {command}"],
            cwd=folder,
            check=True,
            capture_output=True,
            env={**os.environ, "OMP_NUM_THREADS": "1"},  # GRASS's threads mostly wait in loops
        )
        filled = raster.read(f"{folder}/{output}")
    return np.where(filled.void, np.nan, filled.values)  # none was left so far


# --- kept results --------------------------------------------------------------------------------


def kept():
    """Read what `voids_peers.json` holds: by mask, by peer, a tally; None if it failed."""
    return json.loads(CACHE.read_text()) if CACHE.exists() else {}


def kept_tallies(ground, void):
    """Give the tallies by peer that are kept of a mask."""
    entry = kept().get(key(ground, void), NOTHING)
    return {peer: unpacked(rows) for peer, rows in entry["peers"].items() if rows is not None}


def key(ground, void):
    """Name a mask on its ground by what is in them."""
    digest = hashlib.sha256(ground.values.tobytes())
    digest.update(np.packbits(void).tobytes())
    return digest.hexdigest()[:16]


def complete(names, kinds, seeds, peers):
    """Run what is missing among the kept results, the quicker peers first."""
    for seed in seeds:
        for kind in kinds:
            for peer in peers:
                for name in names:
                    _complete(name, kind, seed, peer)


def _complete(name, kind, seed, peer):
    ground, void = tile(name), mask(name, kind, seed)
    here = key(ground, void)
    if peer in kept().get(here, NOTHING)["peers"]:
        return
    begin = time.perf_counter()
    try:
        filled = SLOW[peer](ground, void)
    except subprocess.CalledProcessError as error:
        print(error.stderr.decode()[-2000:])
        rows = None
    else:
        holes = Holes(ground.values, void, pixel_size=ground.pixel_size)
        rows = packed(holes.tally(filled))
    print(f"{name}, {kind}, {seed}: {peer}, {time.perf_counter() - begin:.0f} s", flush=True)
    results = kept()
    entry = results.setdefault(here, {"mask": f"{name}, {kind}, {seed}", "peers": {}})
    entry["peers"][peer] = rows
    _keep(results)


def packed(tally):
    """Bring a tally to lists of numbers; those for intervals, which no peer states, are None."""
    columns = np.column_stack([tally.sums, tally.greatest])
    return [[None if np.isnan(x) else float(f"{x:.7g}") for x in row] for row in columns]


def unpacked(rows):
    """Give back the tally."""
    columns = np.array(rows, np.float64)
    return Tally(columns[:, :-1], columns[:, -1])


def _keep(results):
    lines = [f"{json.dumps(mask_key)}: {json.dumps(entry)}" for mask_key, entry in results.items()]
    part = CACHE.with_suffix(".part")
    part.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    os.replace(part, CACHE)


def main():
    """Run what is missing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tile", choices=PATHS, nargs="*", default=list(PATHS))
    parser.add_argument("--kind", choices=KINDS, nargs="*", default=KINDS)
    parser.add_argument("--seed", type=int, nargs="*", default=SEEDS)
    parser.add_argument("--peer", choices=SLOW, nargs="*", default=list(SLOW))
    arguments = parser.parse_args()
    complete(arguments.tile, arguments.kind, arguments.seed, arguments.peer)


if __name__ == "__main__":
    main()
