"""Learn what streams of `.sct` files know before their first decision: ``core/codec/priors.npz``.

Tiles of public-domain terrain are coded one after the other, at random, without forgetting. The
terrain is in ``../shared/data``; the other tiles there are left for trials. The result changes
the format: raise ``core.sct``'s version when files exist that must still be read.
"""

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "benchmarks"))

from tiles import DATA, RAW, VOID_FREE  # noqa: E402

from demsmith.core import raster  # noqa: E402
from demsmith.core.codec import _details, _residual, coding, pyramid, residual, search  # noqa: E402
from demsmith.core.codec._coder import (  # noqa: E402
    FRESH,
    INPUTS,
    SIZE_WEIGHT_SETS,
    buffer_for,
    coding_room,
)
from demsmith.core.codec.priors import kept  # noqa: E402
from demsmith.core.codec.tiling import Tiling  # noqa: E402

TERRAIN = ("white_mountains", "catalonia_raw", "rainier_raw", "taunus_raw", "bigtujunga_utm")
CASES = ((0, 700), (1, 700), (2, 700), (5, 700), (5, 1.5), (10, 1.5), (20, 1.5), (20, 3.0))
"""Maximum error, and the tree's step by the residual's."""


def main():
    """Train both streams and write what they know."""
    learned = {}
    for name, module in (("residual", _residual), ("details", _details)):
        room = coding_room(module.STATES, INPUTS, SIZE_WEIGHT_SETS)
        room["states"][:] = FRESH
        learned[name] = room
    for job in _jobs():
        _learn_tile(learned, **job)
    arrays = {}
    for name, room in learned.items():
        kinds = zip(("chances", "times", "weights"), kept(room["states"], room["weights"]),
                    strict=True)  # fmt: skip
        arrays |= {f"{name}_{kind}": array for kind, array in kinds}
    path = ROOT / "core" / "codec" / "priors.npz"
    np.savez_compressed(path, **arrays)
    print(f"{path}: {path.stat().st_size} bytes")


def _jobs():
    """Give every other tile of every terrain in every case, in a random order."""
    jobs = []
    for name in TERRAIN:
        source = raster.read(DATA / {**VOID_FREE, **RAW}[name])
        values = source.values.astype(np.int32)
        values -= np.int32(np.median(values[~source.void]))
        surface = coding.filled_surface(values, source.void)
        values[source.void] = 0
        plain = residual.plain_of(values, source.void)
        tiling = Tiling(values.shape, coding.TILE)
        analysis = pyramid.Analysis(surface, tiling)
        samples = search.sampled_tiles(source.void, tiling, "normal")
        for error, factor in CASES:
            tree = analysis.tree(factor * (2 * error + 1))
            below = tree.surface()
            weights, _ = search.fitted(
                values, source.void, below, tiling, error=error, plain=plain, tiles=samples
            )
            shared = dict(
                values=values, void=source.void, tree=tree, below=below, weights=weights,
                error=error, plain=plain, tiling=tiling,
            )  # fmt: skip
            jobs += [dict(shared, tile=tile) for tile in range(0, tiling.count, 2)]
        print(name)
    return [jobs[k] for k in np.random.default_rng(0).permutation(len(jobs))]


def _learn_tile(learned, *, values, void, tree, below, weights, error, plain, tiling, tile):
    rows, columns = tiling.slices(tile)
    cells = values[rows, columns].copy()
    around = np.pad(below, 1, mode="edge")
    around = around[rows.start : rows.stop + 2, columns.start : columns.stop + 2]
    room = _residual.workspace(*cells.shape)
    room |= {name: learned["residual"][name] for name in ("states", "weights")}
    _residual.code_tile(
        cells, np.ascontiguousarray(void[rows, columns]), np.ascontiguousarray(around), error,
        _residual.NO_PLAIN if plain is None else plain, _residual.fixed_weights(weights),
        data=buffer_for(128 * cells.size), decoding=False, **room,
    )  # fmt: skip
    room = learned["details"]
    room["coder"][:] = 0
    pyramid.code_bands(tree.bands(tile), tree.geometry.levels, 0, None, room)


if __name__ == "__main__":
    main()
