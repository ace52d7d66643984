"""Void filling against every peer: error by size of the voids, uncertainty, time.

Run it with ``.venv/bin/python benchmarks/voids.py``; with ``--write`` it puts its section into
``benchmarks/RESULTS.md``. The slow peers' results are kept, see `voids_peers`.
"""

import argparse
import statistics
import time

import numpy as np
import tiles
from results import provenance, table, write_section
from voids_masks import KINDS, PATHS, SEEDS, SHAPES, SINGLE_HOLES
from voids_peers import TIME_LIMIT
from voids_scores import FEWEST_HOLES, PEERS, Scores, engines

import demsmith
from demsmith.core.validation import SIZE_CLASSES, punch_voids

BARS = (0.88, 0.92, 0.96, 0.97)
WORST_BAR = 1.03
ROUNDS = 3
SIZES = range(len(SIZE_CLASSES))
CLASSES = ("1–16", "17–100", "101–1k", "> 1k")


def main():
    """Run all parts and print or write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update benchmarks/RESULTS.md")
    parser.add_argument("--tile", choices=PATHS, nargs="+", default=list(PATHS))
    arguments = parser.parse_args()
    scores = Scores(arguments.tile)
    engine = "auto" if "auto" in engines() else "mcmd"
    parts = [
        heading(scores),
        summary(scores, engine),
        by_kind(scores, engine),
        coverage(scores, engine),
        by_tile(scores, engine),
        times(),
    ]
    text = "\n\n".join(parts) + "\n"
    if arguments.write:
        write_section(text)
    print(text)


def heading(scores):
    """Say what was measured, when, where, and how to read it."""
    all_cases = len(scores.cases("GDAL"))
    done = ", ".join(f"{peer} {len(scores.cases(peer))}" for peer in PEERS)
    return (
        "## Void filling: accuracy against every peer\n\n"
        f"{provenance('numpy', 'gdal', 'scikit-image')} GRASS 8.2.1, SAGA 8.5.0. Repeat with "
        "`.venv/bin/python benchmarks/voids.py`. Every void-free and paired tile, three kinds of "
        "masks: *mixture* (`demsmith.core.validation.punch_voids`), *transplanted* (the shapes of "
        f"the real voids of {', '.join(SHAPES)}, on ground as steep), *single* (compact holes of "
        f"{', '.join(map(str, SINGLE_HOLES))} cells as far as they fit); each about 5 % of the "
        f"cells, seeds {', '.join(map(str, SEEDS))}. Errors are pooled over masks and seeds; "
        f"classes (cells of a void, 4-connected) with fewer than {FEWEST_HOLES} voids are left "
        f"out.\n\nMasks done, of {all_cases}: {done} (GRASS is slow: what "
        f"took it longer than {TIME_LIMIT // 60} minutes of computing or was not run is missing). "
        "A peer is compared with Demsmith on the masks that it did. *÷ best*: Demsmith's error "
        "divided by that of the best peer. Slope: by Horn's 3 × 3 cells."
    )


def summary(scores, engine):
    """Compare with the best peer, over tiles."""
    rows = []
    for size in SIZES:
        rmse = [scores.ratio(engine, size, name=name) for name in scores.names]
        slope = [scores.ratio(engine, size, "slope_rmse", name=name) for name in scores.names]
        worst = scores.names[np.nanargmax(rmse)] if np.isfinite(rmse).any() else "–"
        rows.append(
            [
                CLASSES[size],
                np.isfinite(rmse).sum(),
                f"**{np.nanmean(rmse):.3f}** (≤ {BARS[size]})",
                f"{np.nanmax(rmse):.3f} (≤ {WORST_BAR}), {worst}",
                f"{np.nanmean(slope):.3f}",
                f"{np.nanmax(slope):.3f}",
            ]
        )
    head = ["class", "tiles", "RMSE ÷ best, mean", "worst tile", "slope RMSE ÷ best, mean", "worst"]
    return f"### `{engine}` against the best peer of each tile\n\n" + table(head, rows)


def by_kind(scores, engine):
    """Compare with the best peer, over tiles, for each kind of mask."""
    rows = []
    for kind in KINDS:
        row = [kind]
        for size in SIZES:
            ratios = [scores.ratio(engine, size, name=name, kind=kind) for name in scores.names]
            ratios = np.array(ratios)[np.isfinite(ratios)]
            row.append(f"{ratios.mean():.3f} ({ratios.max():.3f})" if ratios.size else "–")
        rows.append(row)
    return (
        "By kind of mask: mean of RMSE ÷ best over tiles (worst tile), seeds pooled.\n\n"
        + table(["kind", *CLASSES], rows)
    )


def coverage(scores, engine):
    """Tell how many cells lie in the intervals that the engine states."""
    errors = scores.errors(engine, scores.cases(engine))
    if np.isnan(errors[-1].within_68):
        return f"### Uncertainty\n\n`{engine}` states none."
    rows = [
        [label, error.cells, f"{100 * error.within_68:.1f}", f"{100 * error.within_95:.1f}"]
        for label, error in zip((*CLASSES, "all"), errors, strict=True)
    ]
    return "### Uncertainty: cells [%] within the stated interval, pooled over tiles\n\n" + table(
        ["class", "cells", "68 % (63 to 73)", "95 % (92 to 98)"], rows
    )


def by_tile(scores, engine):
    """List every method's error on every tile."""
    head = ["tile", "class", "voids", *PEERS, *(f"**{each}**" for each in engines())]
    head += ["÷ best", "slope RMSE [%]", "slope ÷ best", "68 %", "95 %"]
    rows = [
        tile_row(scores, engine, name, size)
        for name in scores.names
        for size in SIZES
        if np.isfinite(scores.ratio(engine, size, name=name))
    ]
    return (
        "### RMSE [m] by tile and class\n\n"
        "In brackets: of a peer that did not do every mask, so not to be compared with its "
        "neighbours.\n\n" + table(head, rows)
    )


def tile_row(scores, engine, name, size):
    """Give one line: every method's error in a class of a tile."""
    every = scores.cases(engine, name=name)
    ours = scores.errors(engine, every)[size]
    row = [name, CLASSES[size], ours.voids]
    for method in (*PEERS, *engines()):
        cases = scores.cases(method, name=name)
        rmse = scores.errors(method, cases)[size].rmse if cases else float("nan")
        if np.isnan(rmse):
            row.append("–")
        else:
            row.append(f"{rmse:.3g}" if len(cases) == len(every) else f"({rmse:.3g})")
    return [
        *row,
        f"**{scores.ratio(engine, size, name=name):.3f}**",
        f"{100 * ours.slope_rmse:.3g}",
        f"{scores.ratio(engine, size, 'slope_rmse', name=name):.3f}",
        *("–" if np.isnan(x) else f"{100 * x:.0f}" for x in (ours.within_68, ours.within_95)),
    ]


def times():
    """Time the engines on a whole tile and on one nine times as large."""
    rows = []
    for label, (truth, pixel_size) in {
        "sierra_nevada": tiles.void_free("sierra_nevada"),
        "large": tiles.large(),
    }.items():
        void = punch_voids(truth, seed=0)
        holed = np.where(void, 0, truth)
        seconds = {engine: [] for engine in engines()}
        for _ in range(ROUNDS + 1):  # the first warms up
            for engine, taken in seconds.items():
                begin = time.perf_counter()
                demsmith.fill_voids(holed, void, pixel_size=pixel_size, method=engine)
                taken.append(time.perf_counter() - begin)
        medians = (f"{statistics.median(taken[1:]):.2f}" for taken in seconds.values())
        rows.append([f"{label}, {truth.shape[0]} × {truth.shape[1]}", *medians])
    return f"### Time in process [s], 5 % voids, median of {ROUNDS}\n\n" + table(
        ["raster", *engines()], rows
    )


if __name__ == "__main__":
    main()
