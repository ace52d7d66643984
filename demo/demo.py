"""Fill the voids of a real elevation tile in the real QGIS, score the fill and draw it.

``make demo`` runs it on the SRTM clip that matplotlib ships, ``make demo TILE=path`` on a tile of
yours. Where QGIS or GDAL is missing it works on arrays, and says what it left out.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np
import picture
import qgis_process

import demsmith
from demsmith.core.errors import DemsmithError, InputError
from demsmith.core.validation import errors_by_size, punch_voids

OUT = Path("out")
SEED = 2007
NODATA = -32768


def main():
    """Run the demo and return its exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tile", type=Path, help="a raster, or .npz without GDAL")
    tile = parser.parse_args().tile
    OUT.mkdir(exist_ok=True)
    try:
        if not _has_gdal():
            on_arrays(tile)
        elif tile is None:
            on_clip()
        else:
            on_tile(tile)
    except DemsmithError as error:
        print(f"demo: {error}", file=sys.stderr)
        return error.exit_status
    return 0


def _has_gdal():
    try:
        from osgeo import gdal  # noqa: F401
    except ImportError:
        return False
    return True


# --- the three demos -----------------------------------------------------------------------------


def on_clip():
    """Punch voids into matplotlib's SRTM clip, fill them in QGIS, compare with the truth."""
    from demsmith.core import raster

    truth, geotransform = jacksboro()
    grid = raster.Grid(truth.shape, geotransform, "EPSG:4326")
    meta = raster.BandMeta(dtype=truth.dtype, nodata=NODATA, unit="m")
    void = punch_voids(truth, seed=SEED)
    nothing = np.zeros(truth.shape, bool)
    like = raster.Raster(truth, nothing, grid, meta)
    raster.write(OUT / "truth.tif", truth, like=like, overwrite=True)
    raster.write(OUT / "holed.tif", truth, like=like, void=void, overwrite=True)
    say(
        f"{OUT / 'holed.tif'}: SRTM 3 arc-seconds, Jacksboro fault, Tennessee, "
        f"{truth.shape[0]} × {truth.shape[1]} cells, {void.sum()} of them punched out"
    )
    filled, seconds = fill_in_qgis(OUT / "holed.tif", OUT / "filled.tif")
    report(truth, void, filled, tuple(grid.pixel_size_m()), seconds, "SRTM, Jacksboro fault")


def on_tile(tile):
    """Fill the voids of the user's tile; score on voids punched into its known ground."""
    from demsmith.core import raster

    source = raster.read(tile)
    for note in source.notes:
        say(f"note: {note}")
    name = tile.name.split(".")[0]
    output = OUT / f"{name}_filled.tif"
    result, seconds = fill_in_qgis(tile, output)
    say(f"{output}: {source.void.sum()} void cells filled in {seconds:.1f} s")
    punched = punch_voids(source.values, known=~source.void, seed=SEED)
    if not punched.any():
        raise InputError(f"'{tile}' is too small to punch voids into; its own are filled")
    sizes = tuple(source.grid.pixel_size_m())
    begin = time.perf_counter()
    again = demsmith.fill_voids(source.values, source.void | punched, pixel_size=sizes).values
    report(
        result, punched, again, sizes, time.perf_counter() - begin, name,
        own=source.void, values=source.values,
    )  # fmt: skip


def on_arrays(tile):
    """Do the same without GDAL: arrays in, table and picture out."""
    say("left out, for want of GDAL and QGIS: GeoTIFF, qgis_process and GDAL's own fill")
    if tile is None:
        truth, (_, _, _, north, _, height) = jacksboro()
        dy = 111_000 * abs(height)
        sizes = (dy * np.cos(np.radians(north + height * np.arange(truth.shape[0]))), dy)
        void, name = punch_voids(truth, seed=SEED), "SRTM, Jacksboro fault"
    else:
        truth, name, sizes = read_npz(tile), tile.stem, None
        own = ~np.isfinite(truth) if truth.dtype.kind == "f" else truth == NODATA
        truth = demsmith.fill_voids(truth, own).values
        np.savez_compressed(OUT / f"{name}_filled.npz", elevation=truth)
        void = punch_voids(truth, known=~own, seed=SEED)
    demsmith.fill_voids(truth, void)  # compiles
    begin = time.perf_counter()
    filled = demsmith.fill_voids(truth, void, pixel_size=sizes).values
    report(truth, void, filled, sizes, time.perf_counter() - begin, name)


# --- their parts ---------------------------------------------------------------------------------


def jacksboro():
    """Read the clip: int16 elevations and their geotransform.

    The file's ``ymin`` and ``ymax`` are swapped: its first row is the northern one.
    """
    from matplotlib import cbook

    with np.load(cbook.get_sample_data("jacksboro_fault_dem.npz", asfileobj=False)) as data:
        values = np.ascontiguousarray(data["elevation"], np.int16)
        west, north = float(data["xmin"]), max(float(data["ymin"]), float(data["ymax"]))
        dx, dy = abs(float(data["dx"])), abs(float(data["dy"]))
    return values, (west, dx, 0.0, north, 0.0, -dy)


def read_npz(path):
    """Read the array ``elevation`` of an .npz file, or its first one."""
    try:
        with np.load(path) as data:
            return data["elevation" if "elevation" in data.files else data.files[0]]
    except (OSError, ValueError, IndexError) as error:
        raise InputError(f"'{path}' holds no arrays that NumPy reads: {error}") from None


def fill_in_qgis(source, output):
    """Fill by the plugin in ``qgis_process``, by the library where QGIS is missing."""
    from demsmith.core import raster

    begin = time.perf_counter()
    if qgis_process.find():
        say("running demsmith:fillvoids in qgis_process (kernels compile the first time)")
        results = qgis_process.run(
            "demsmith:fillvoids", {"INPUT": source, "OUTPUT": output}, folder=OUT / "qgis"
        )
        say(f"QGIS says: {results['CELLS_FILLED']:.0f} cells in {results['VOIDS']:.0f} voids")
        seconds = results["SECONDS"]
    else:
        say("left out, for want of QGIS: qgis_process; the library fills instead")
        demsmith.fill_file(source, output, overwrite=True)
        seconds = time.perf_counter() - begin
    return raster.read(output).values, seconds


def report(truth, void, filled, sizes, seconds, name, *, own=None, values=None):
    """Score the punched voids, print the table and draw the picture.

    ``own`` are voids that the tile had before, and ``values`` its elevations as they were.
    """
    rows = [("Demsmith", errors_by_size(filled, truth, void))]
    holes = void if own is None else void | own
    if _has_gdal():
        from demsmith.core.raster.peer import gdal_fill

        for title, smoothings in (("GDAL FillNodata", 0), ("GDAL, 2 smoothings", 2)):
            ground = truth if values is None else values
            theirs, _ = gdal_fill(ground, holes, smoothings=smoothings)
            rows.append((title, errors_by_size(theirs, truth, void)))
    print_table(rows)
    error = np.where(void, filled.astype(float) - truth, np.nan)
    ours, *peers = (row[-1].rmse for _, row in rows)
    against = f", GDAL's {peers[0]:.1f} m" if peers else ""
    cell = tuple(float(np.mean(size)) for size in sizes) if sizes is not None else (1.0, 1.0)
    picture.draw(
        OUT / "demo.png", holed=truth, void=holes, filled=filled, error=error, cell=cell,
        title=f"{name}: {void.sum()} cells punched out and filled",
        caption=f"Root mean square error {ours:.1f} m{against}; filled in {seconds:.2f} s. "
        "Red: voids. Elevation data: SRTM, NASA/USGS, public domain."
        if name.startswith("SRTM")
        else f"Root mean square error {ours:.1f} m{against} on voids punched for the test.",
    )  # fmt: skip
    say(f"picture: {OUT / 'demo.png'}")


def print_table(rows):
    """Print each method's root mean square error by void size."""
    classes = rows[0][1]
    print("\nRoot mean square error [m] by void size in cells")
    heads = [f"{c.smallest}–{c.largest}" if c.largest else f"≥ {c.smallest}" for c in classes]
    heads[-1] = "all"
    print(f"{'':22}" + "".join(f"{head:>10}" for head in heads))
    print(f"{'voids':22}" + "".join(f"{c.voids:10d}" for c in classes))
    for title, row in rows:
        print(f"{title:22}" + "".join(f"{c.rmse:10.2f}" if c.cells else f"{'–':>10}" for c in row))
    print()


def say(text):
    """Print a step of the demo."""
    print(f"==> {text}")


if __name__ == "__main__":
    sys.exit(main())
