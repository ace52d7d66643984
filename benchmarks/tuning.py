"""What tuning gains, on holes that it neither fitted nor chose by.

Run it with ``.venv/bin/python benchmarks/tuning.py``; with ``--write`` it puts its section into
``benchmarks/RESULTS.md``.
"""

import argparse
import datetime
import os
import time

import nlopt
import numpy as np
import tiles
from results import write_section

from demsmith.core import raster
from demsmith.core.samples.options import SampleOptions
from demsmith.core.tuning import tune_fill, tune_samples
from demsmith.core.voids import FillOptions

FILLS = (*tiles.VOID_FREE, "pyrenees_raw")
FILL_VARIANTS = ("relaxed", "weighted", "paper")
SAMPLED = ("white_mountains", "sierra_nevada")
SAMPLE_VARIANTS = ("converged", "relaxed", "weighted")
SIDE, DENSITY = 1025, 0.034


def main():
    """Run all parts and print or write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update benchmarks/RESULTS.md")
    arguments = parser.parse_args()
    text = "\n\n".join([heading(), fills(), samples()]) + "\n"
    if arguments.write:
        write_section(text)
    print(text)


def heading():
    """Say when and where this was measured, and how to read it."""
    return (
        "## Tuning (`--tune`)\n\n"
        f"{datetime.date.today()}, {os.cpu_count()} cores, nlopt {nlopt.__version__}, NumPy "
        f"{np.__version__}. Repeat with `.venv/bin/python benchmarks/tuning.py`. Gain: share by "
        "which the RMSE fell, as the mean of the logarithms over the size classes, on the third of "
        "three holdouts without a cell in common, ± its standard error (bootstrap over the holes). "
        "Where the gain is not larger than two standard errors on the first two, the parameters "
        "stay as they are and the gain is 0."
    )


def fills():
    """Tune fills, from the defaults."""
    lines = ["### Fills, from the defaults, on punched voids", "", *head("largest class")]
    for name in FILLS:
        values, void, pixel_size = fill_case(name)
        for variant in FILL_VARIANTS:
            begin = time.perf_counter()
            tuned = tune_fill(
                values,
                void,
                options=FillOptions(method="mcmd", variant=variant),
                pixel_size=pixel_size,
            )
            lines.append(row(name, variant, tuned, time.perf_counter() - begin))
    return "\n".join(lines)


def samples():
    """Tune reconstructions from random samples, from the defaults."""
    lines = [
        f"### Samples: {100 * DENSITY:g} % of {SIDE} × {SIDE} cells at random, from the defaults",
        "",
        *head("held-back samples"),
    ]
    for name in SAMPLED:
        values, sizes = tiles.void_free(name)
        values, sizes = values[:SIDE, :SIDE], tuple(size[:SIDE] for size in sizes)
        known = np.random.default_rng(0).random(values.shape) < DENSITY
        for variant in SAMPLE_VARIANTS:
            begin = time.perf_counter()
            tuned = tune_samples(
                values, known, options=SampleOptions(variant=variant), pixel_size=sizes
            )
            lines.append(row(name, variant, tuned, time.perf_counter() - begin))
    return "\n".join(lines)


def fill_case(name):
    """Read a tile: elevations, its real voids, and its pixel sizes."""
    if name in tiles.VOID_FREE:
        values, pixel_size = tiles.void_free(name)
        return values, np.zeros(values.shape, bool), pixel_size
    tile = raster.read(tiles.DATA / tiles.RAW[name])
    return tile.values, tile.void, tile.grid.pixel_size_m()


def head(last):
    """Give the head of a table."""
    return [
        f"| tile | variant | gain | tuned, or why not | RMSE [m], {last} | s |",
        "|---|---|---|---|---|---|",
    ]


def row(name, variant, tuned, seconds):
    """Give a row of a table."""
    if not tuned.accepted:
        return f"| {name} | {variant} | 0 | {tuned.note} | | {seconds:.0f} |"
    found = ", ".join(f"{key} {after:.4g}" for key, (_, after) in tuned.parameters.items())
    largest = tuned.errors[-1]
    return (
        f"| {name} | {variant} | **{100 * tuned.gain:.1f} ± {100 * tuned.noise:.1f} %** | {found} "
        f"| {largest.before:.2f} → {largest.after:.2f} | {seconds:.0f} |"
    )


if __name__ == "__main__":
    main()
