"""Void filling with an auxiliary raster, good and bad, against the delta surface by distances.

The target is the NASADEM of ``pair_sangabriel``, with the real voids of other tiles laid over it;
the auxiliary is the Copernicus DEM of the same ground. Run it with
``.venv/bin/python benchmarks/voids_auxiliary.py``; with ``--write`` it puts its section into
``benchmarks/RESULTS.md``.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import tiles
from results import provenance, table, write_section
from voids_masks import SHAPES, mask, tile

from demsmith.core import raster
from demsmith.core.raster.peer import gdal_fill
from demsmith.core.reconstruction import ReconstructOptions, reconstruct_file

TARGET, AUXILIARY = "pair_sangabriel (NASADEM)", "pair_sangabriel (Copernicus)"
GOOD = "as it is"
IDW_DELTA = "auxiliary + IDW delta"
TURNED = ("transplanted", 0)
BAR, REPAIRED_BAR = 0.62, 1.10


def auxiliaries():
    """Give the auxiliary's elevations and grid as they are, and spoiled in different ways."""
    good = tile(AUXILIARY)
    rows, columns = np.indices(good.values.shape, np.float32)
    elsewhere = tile("sierra_nevada").values[: good.grid.shape.rows, : good.grid.shape.columns]
    x, dx, _, y, _, dy = good.grid.geotransform
    beside = replace(good.grid, geotransform=(x + 3 * dx, dx, 0.0, y - 3 * dy, 0.0, dy))
    return {
        GOOD: (good.values, good.grid),
        "shifted 3 cells east and north": (good.values, beside),
        "biased by 140 m, tilted by 60 and 36 m": (
            good.values + 140 + 0.05 * rows - 0.03 * columns,
            good.grid,
        ),
        "unrelated: upside down": (good.values[::-1], good.grid),
        "unrelated: sierra_nevada": (elsewhere, good.grid),
    }


def main():
    """Run all and print or write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update benchmarks/RESULTS.md")
    arguments = parser.parse_args()
    text = "\n\n".join([heading(), errors()]) + "\n"
    if arguments.write:
        write_section(text)
    print(text)


def heading():
    """Say what was measured, when and where."""
    return (
        "## Void filling with an auxiliary raster\n\n"
        f"{provenance('numpy', 'gdal')} Repeat with `.venv/bin/python "
        "benchmarks/voids_auxiliary.py`. NASADEM of `pair_sangabriel` with the real voids of "
        "another tile laid over it as they lie there; beside it *transplanted*: the shapes of all "
        "four on ground as steep as theirs, 5 % of the tile. The auxiliary is the Copernicus DEM, "
        "as it is and spoiled. *Auxiliary + IDW delta*: GDAL's fill of target less auxiliary, "
        "added to the auxiliary. *÷ good*: pooled RMSE beside that with the auxiliary as it is; "
        "*÷ none*: beside that without any."
    )


def errors():
    """Compare the errors on each mask and on all of them."""
    target = tile(TARGET)
    masks = [*(laid_over(name, target.values.shape) for name in SHAPES), mask(TARGET, *TURNED)]
    squares, shares = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for label, fill in methods(target, Path(folder)).items():
            done = [fill(void) for void in masks]
            squares[label] = np.array(
                [
                    np.sum((filled[void] - target.values[void].astype(np.float64)) ** 2)
                    for (filled, _), void in zip(done, masks, strict=True)
                ]
            )
            shares[label] = sum(from_auxiliary for _, from_auxiliary in done)
    cells = np.array([void.sum() for void in masks])
    laid = slice(len(SHAPES))
    pooled = {
        label: np.sqrt(each[laid].sum() / cells[laid].sum()) for label, each in squares.items()
    }
    rows = []
    for label, each in squares.items():
        ratios = (pooled[label] / pooled[beside] for beside in (IDW_DELTA, ours(GOOD), ours(None)))
        rmse = np.sqrt(each / cells)
        rows.append(
            [
                label,
                *(f"{value:.2f}" for value in rmse[laid]),
                f"**{pooled[label]:.2f}**",
                *(f"{ratio:.3f}" for ratio in ratios),
                f"{rmse[-1]:.2f}",
                f"{np.sqrt(each[-1] / squares[IDW_DELTA][-1]):.3f}",
                f"{100 * shares[label] / cells.sum():.0f}",
            ]
        )
    head = ["RMSE [m]", *SHAPES, "pooled", f"÷ aux + IDW (good: ≤ {BAR})"]
    head += [f"÷ good (first two: ≤ {REPAIRED_BAR})", "÷ none (≤ 1)"]
    head += ["transplanted", "÷ aux + IDW", "cells by auxiliary [%]"]
    return table(head, rows)


def laid_over(name, shape):
    """Give the voids of another tile as they lie there, cut to a shape."""
    return raster.read(tiles.DATA / tiles.RAW[name]).void[: shape[0], : shape[1]]


def ours(label):
    """Name Demsmith's fill from an auxiliary."""
    return f"Demsmith, auxiliary {label}" if label else "Demsmith, no auxiliary"


def methods(target, folder):
    """Give all ways of filling: from voids to elevations and the cells that the auxiliary gave."""
    truth, good = target.values, tile(AUXILIARY).values
    cases = {
        "GDAL, no auxiliary": lambda void: (gdal_fill(truth, void)[0], 0),
        "auxiliary pasted": lambda void: (good, void.sum()),
        IDW_DELTA: lambda void: (good + gdal_fill(truth - good, void)[0], void.sum()),
        ours(None): lambda void: reconstructed(target, void, folder, ()),
    }
    for number, (label, (values, grid)) in enumerate(auxiliaries().items()):
        path = folder / f"auxiliary{number}.tif"
        write(path, values, grid)
        cases[ours(label)] = lambda void, path=path: reconstructed(target, void, folder, [path])
    return cases


def write(path, values, grid, void=None):
    """Write elevations as a GeoTIFF."""
    void = np.zeros(values.shape, bool) if void is None else void
    meta = raster.BandMeta(np.dtype(np.float32), nodata=-32768.0)
    raster.write(path, values, like=raster.Raster(values, void, grid, meta), void=void)


def reconstructed(target, void, folder, paths):
    """Fill by ``demsmith reconstruct``."""
    with tempfile.TemporaryDirectory(dir=folder) as place:
        holed, filled = Path(place, "holed.tif"), Path(place, "filled.tif")
        write(holed, target.values, target.grid, void)
        result = reconstruct_file(
            holed, filled, auxiliaries=paths, options=ReconstructOptions(float_output=True)
        )
        by_source = result.cells_by_source
        given = sum(cells for name, cells in by_source.items() if name.startswith("auxiliary"))
        return raster.read(filled).values, given


if __name__ == "__main__":
    main()
