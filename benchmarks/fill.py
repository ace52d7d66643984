"""Void filling by the fast engine against GDAL: error, time, memory, and the same bytes.

Run it with ``make bench`` or ``.venv/bin/python benchmarks/fill.py``; with ``--write`` it puts its
section into ``benchmarks/RESULTS.md``.
"""

import argparse
import hashlib
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import tiles
from osgeo import osr
from results import provenance, write_section

import demsmith
from demsmith.core import raster
from demsmith.core.raster.peer import gdal_fill
from demsmith.core.validation import errors_by_size, punch_voids
from demsmith.core.voids import FillOptions

osr.UseExceptions()
SEEDS = (0, 1, 2)
ROUNDS = 9
CLASSES = ("1–16", "17–100", "101–1k", "> 1k", "all")
VARIANTS = {
    "relaxed (default)": {},
    "weighted, diamond–square": {"variant": "weighted", "scheme": "diamond-square"},
    "weighted": {"variant": "weighted"},
    "paper, diamond–square": {"variant": "paper", "scheme": "diamond-square"},
    "paper": {"variant": "paper"},
}


def main():
    """Run all parts and print or write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update benchmarks/RESULTS.md")
    parser.add_argument("--peak", metavar="NPZ", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.peak:
        print(peak_rise(arguments.peak))
        return
    parts = [heading(), accuracy(), speed(), memory(), whole_process(), raw_tiles(), same_bytes()]
    text = "\n\n".join(parts) + "\n"
    if arguments.write:
        write_section(text)
    print(text)


def heading():
    """Say when and where this was measured."""
    return (
        "## Void filling: the fast engine (`fill --method mcmd`)\n\n"
        f"{provenance('numpy', 'gdal')} Repeat with `.venv/bin/python benchmarks/fill.py`. "
        "Masks as punched by `demsmith.core.validation.punch_voids`: about 5 % of the cells "
        "in voids of all sizes."
    )


# --- error ---------------------------------------------------------------------------------------


def accuracy():
    """Compare the error by void size, seeds pooled."""
    from skimage.restoration import inpaint_biharmonic

    lines = [
        "### Error: RMSE [m] by void size in cells, seeds 0, 1, 2 pooled",
        "",
        "| tile | method | " + " | ".join(CLASSES) + " |",
        "|---|---|" + "---|" * len(CLASSES),
    ]
    worst = np.zeros(len(CLASSES))
    ratios = []
    for name in tiles.VOID_FREE:
        truth, pixel_size = tiles.void_free(name)
        methods = {
            "GDAL FillNodata": lambda z, void: gdal_fill(z, void)[0],
            "GDAL, 2 smoothings": lambda z, void: gdal_fill(z, void, smoothings=2)[0],
            "scikit-image biharmonic": lambda z, void: inpaint_biharmonic(
                np.where(void, 0, z), void, split_into_regions=True
            ),
        }
        for label, options in VARIANTS.items():
            methods["Demsmith " + label] = lambda z, void, options=options, pixel_size=pixel_size: (
                demsmith.fill_voids(z, void, pixel_size=pixel_size, method="mcmd", **options).values
            )
        masks = [punch_voids(truth, seed=seed) for seed in SEEDS]
        rmse = {label: pooled(method, truth, masks) for label, method in methods.items()}
        for label, row in rmse.items():
            cells = " | ".join(f"{value:.2f}" for value in row)
            lines.append(f"| {name} | {label} | {cells} |")
        ratio = rmse["Demsmith relaxed (default)"] / rmse["GDAL FillNodata"]
        ratios.append(ratio)
        worst = np.maximum(worst, ratio)
    for label, row in (("mean", np.mean(ratios, axis=0)), ("worst tile", worst)):
        cells = " | ".join(f"{value:.3f}" for value in row)
        lines.append(f"| **{label}** | relaxed ÷ GDAL FillNodata | {cells} |")
    return "\n".join(lines)


def pooled(method, truth, masks):
    """Give the RMSE by size class over several masks."""
    squares, cells = np.zeros(len(CLASSES)), np.zeros(len(CLASSES))
    for void in masks:
        for n, error in enumerate(errors_by_size(method(truth, void), truth, void)):
            if error.cells:
                squares[n] += error.rmse**2 * error.cells
                cells[n] += error.cells
    return np.sqrt(squares / cells)


# --- time and memory -----------------------------------------------------------------------------


def speed():
    """Time the fill itself, arrays in memory, GDAL and Demsmith in turn."""
    lines = [
        f"### Time in process [ms], 5 % voids, array and mask in memory, median of {ROUNDS}",
        "",
        "GDAL fills in place; so does *in place*. *Copy* returns a new array.",
        "",
        "| raster | GDAL | in place, 2 threads | GDAL ÷ it | copy, 2 threads | in place, 1 |",
        "|---|---|---|---|---|---|",
    ]
    cases = {name: tiles.void_free(name) for name in tiles.VOID_FREE}
    cases["large"] = tiles.large()
    for name, (truth, pixel_size) in cases.items():
        void = punch_voids(truth, seed=0)
        times = {"gdal": [], "place": [], "copy": [], "single": []}
        for _ in range(ROUNDS + 1):  # the first warms up
            times["gdal"].append(gdal_fill(truth, void)[1])
            times["place"].append(ours(truth, void, pixel_size, 2, in_place=True))
            times["copy"].append(ours(truth, void, pixel_size, 2))
            times["single"].append(ours(truth, void, pixel_size, 1, in_place=True))
        ratio = statistics.median(
            g / o for g, o in zip(times["gdal"][1:], times["place"][1:], strict=True)
        )
        median = {key: 1000 * statistics.median(value[1:]) for key, value in times.items()}
        lines.append(
            f"| {name} {truth.shape[0]} × {truth.shape[1]} | {median['gdal']:.1f} "
            f"| {median['place']:.1f} | **{ratio:.2f}** | {median['copy']:.1f} "
            f"| {median['single']:.1f} |"
        )
    return "\n".join(lines)


def ours(truth, void, pixel_size, threads, *, in_place=False):
    """Time one fill."""
    values = truth.copy()
    values[void] = 0
    begin = time.perf_counter()
    demsmith.fill_voids(
        values,
        void,
        pixel_size=pixel_size,
        method="mcmd",
        threads=threads,
        out=values if in_place else None,
    )
    return time.perf_counter() - begin


def memory():
    """Measure, in a process of its own, how far a warm fill raises the peak memory."""
    truth, (dx, dy) = tiles.large()
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "large.npz")
        np.savez(path, values=truth, void=punch_voids(truth, seed=0), dx=dx, dy=dy)
        rise = subprocess.run(
            [sys.executable, __file__, "--peak", path], capture_output=True, text=True, check=True
        ).stdout.split()
    return (
        "### Memory\n\n"
        f"Rise of the peak resident memory over a warm call, large, bytes per cell: "
        f"**{rise[0]}** returning a new array, **{rise[1]}** in place."
    )


def peak_rise(path):
    """Give the rise in bytes per cell of a fill with a new array and of one in place."""
    with np.load(path) as data:
        values, void, sizes = data["values"], data["void"], (data["dx"], data["dy"])
    demsmith.fill_voids(values, void, pixel_size=sizes, method="mcmd", threads=2)
    out = []
    for target in (None, values):
        Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far
        before = status_bytes("VmRSS")
        filled = demsmith.fill_voids(
            values, void, pixel_size=sizes, method="mcmd", out=target, threads=2
        )
        out.append((status_bytes("VmHWM") - before) / values.size)
        del filled
    return f"{out[0]:.1f} {out[1]:.1f}"


def status_bytes(key):
    """Read a memory figure of this process."""
    return 1024 * int(re.search(key + r":\s+(\d+)", Path("/proc/self/status").read_text())[1])


def whole_process():
    """Time `demsmith fill` from start to end on a raw tile."""
    tile = tiles.DATA / tiles.RAW["pyrenees_raw"]
    program = Path(sys.executable).with_name("demsmith")
    seconds = []
    with tempfile.TemporaryDirectory() as folder:
        command = [str(program), "fill", str(tile), f"{folder}/out.tif", "--overwrite", "--quiet"]
        command += ["--method", "mcmd"]
        for _ in range(ROUNDS + 1):
            begin = time.perf_counter()
            subprocess.run(command, check=True)
            seconds.append(time.perf_counter() - begin)
    return (
        "### Whole process\n\n"
        "`demsmith fill N42E001.hgt out.tif --method mcmd` (1201 × 1201, 671 real voids), caches "
        f"warm: median **{statistics.median(seconds[1:]):.2f} s**, slowest "
        f"{max(seconds[1:]):.2f} s."
    )


# --- what must hold ------------------------------------------------------------------------------


def raw_tiles():
    """Fill every raw tile and check the result against the input."""
    lines = [
        "### Raw tiles",
        "",
        "| tile | voids | void cells | largest | unfilled | known changed | type, place kept | s |",
        "|---|---|---|---|---|---|---|---|",
    ]
    with tempfile.TemporaryDirectory() as folder:
        for name, path in tiles.RAW.items():
            out = os.path.join(folder, "out.tif")
            result = demsmith.fill_file(
                tiles.DATA / path, out, options=FillOptions(method="mcmd"), overwrite=True
            )
            before, after = raster.read(tiles.DATA / path), raster.read(out)
            changed = int((before.values != after.values)[~before.void].sum())
            kept = before.values.dtype == after.values.dtype and same_place(before.grid, after.grid)
            lines.append(
                f"| {name} | {result.voids} | {result.cells_void} | {result.largest_void} "
                f"| {int(after.void.sum())} | {changed} | {'yes' if kept else 'NO'} "
                f"| {result.seconds:.2f} |"
            )
    return "\n".join(lines)


def same_place(one, other):
    """Tell whether two grids lie on the same ground, however their CRS is spelled."""
    crs = [osr.SpatialReference(grid.crs) for grid in (one, other)]
    same_crs = crs[0].IsSame(crs[1]) if one.crs and other.crs else one.crs == other.crs
    same_cells = np.allclose(one.geotransform, other.geotransform, rtol=1e-12, atol=0)
    return one.shape == other.shape and same_cells and bool(same_crs)


def same_bytes():
    """Compare the bytes of fills by 1 and 2 threads."""
    truth, pixel_size = tiles.void_free("sierra_nevada")
    void = punch_voids(truth, seed=0)
    digests = {
        hashlib.sha256(
            demsmith.fill_voids(
                truth, void, pixel_size=pixel_size, method="mcmd", threads=threads, **options
            ).values.tobytes()
        ).hexdigest()
        for threads in (1, 2)
        for options in ({},)
    }
    return (
        "### Same bytes\n\n"
        f"1 and 2 threads, `sierra_nevada`: {'the same' if len(digests) == 1 else 'DIFFERENT'} "
        f"(SHA-256 {sorted(digests)[0][:16]}…). NumPy 1.26 and the newest 2.x: compared in "
        "`tests/test_house_numpy2.py`."
    )


if __name__ == "__main__":
    main()
