"""The experiments of the MCMD paper (Belhadj 2007) and what the issue asks beside them.

Run all with ``.venv/bin/python benchmarks/mcmd.py``; with ``--write`` the section goes into
``benchmarks/RESULTS.md``. ``--only`` runs one part, ``--quick`` a small version that only shows
that everything works.
"""

import argparse
import statistics
import time

import mcmd_roughness
import mcmd_samples
from results import provenance, table, write_section

import demsmith
from demsmith.core.samples.presets import PRESETS

PARTS = {
    "washington": mcmd_samples.washington,
    "curve": mcmd_samples.curve,
    "thinned": mcmd_samples.thinned,
    "roughness": mcmd_roughness.roughness,
    "axes": mcmd_roughness.axes,
    "scratch": lambda quick: scratch(quick),
}


def main():
    """Run the parts asked for and print or write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update benchmarks/RESULTS.md")
    parser.add_argument("--only", choices=PARTS, help="run this part alone")
    parser.add_argument("--quick", action="store_true", help="less ground, fewer repetitions")
    arguments = parser.parse_args()
    if arguments.write and (arguments.only or arguments.quick):
        parser.error("only the whole section is written: leave --only and --quick out")
    names = [arguments.only] if arguments.only else list(PARTS)
    text = "\n\n".join([heading(), *(PARTS[name](arguments.quick) for name in names)]) + "\n"
    if arguments.write:
        write_section(text)
    print(text)


def heading():
    """Say when and where this was measured."""
    return (
        "## MCMD: terrain from samples, natural roughness, noise\n\n"
        f"{provenance('numpy', 'scipy', 'numba', 'gdal')} "
        "Repeat with `.venv/bin/python benchmarks/mcmd.py`. Two threads, kernels warm."
    )


def scratch(quick):
    """Time terrain from nothing."""
    side, rounds = (257, 3) if quick else (1025, 10)
    grid = demsmith.Grid.of_extent((0, 0, 30 * side, 30 * side), 30)
    rows = []
    rough = [name for name, preset in PRESETS.items() if preset.r_s]  # without noise: nothing
    for preset in ("none", *rough):
        seconds = []
        for seed in range(rounds + 1):  # the first warms up
            begin = time.perf_counter()
            demsmith.from_samples(None, grid, preset=preset, seed=seed, threads=2)
            seconds.append(time.perf_counter() - begin)
        name = "default noise" if preset == "none" else f"`{preset}`"
        rows.append([name, f"**{statistics.median(seconds[1:]):.3f}**", f"{max(seconds[1:]):.3f}"])
    return (
        f"### Terrain from nothing, {side} × {side} cells\n\n"
        f"`from_samples(None, grid, preset=…)`, {rounds} seeds. The paper: 0.25 s for a million "
        "cells in 2007.\n\n" + table(["parameters", "median [s]", "slowest [s]"], rows)
    )


if __name__ == "__main__":
    main()
