"""Drainage against pyflwdir, GRASS and SAGA: time, memory, and the same areas.

Run it with ``make bench`` or ``.venv/bin/python benchmarks/drainage.py``; with ``--write`` it puts
its section into ``benchmarks/RESULTS.md``. Peers that are not installed are left out, and named.
"""

import argparse
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import tiles
from results import provenance, table, write_section

import demsmith
from demsmith.core import raster
from demsmith.core.hydrology.accumulation import accumulate_d8, accumulate_dinf, accumulate_mfd
from demsmith.core.hydrology.depressions import fill_depressions
from demsmith.core.hydrology.directions import d8_directions
from demsmith.core.hydrology.flats import resolve_flats
from demsmith.core.hydrology.particles import drop_particles
from demsmith.core.hydrology.traversal import Surface

ROUNDS = 5
METHODS = ("d8", "mfd", "dinf")
NUMBERS = (10**4, 10**5, 10**6, 10**7, 10**8)
TIME_LIMIT = 1800  # seconds for one run of another program


def main():
    """Run all parts, print each, and write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update benchmarks/RESULTS.md")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="repetitions of what is timed")
    parser.add_argument("--peak", metavar="METHOD", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.peak:
        print(peak_rise(arguments.peak))
        return
    warm_up()
    parts = []
    for part in (heading, speed, steps, memory, same_areas, balance, particles):
        parts.append(part(arguments.rounds) if part in (speed, steps) else part())
        print(parts[-1], end="\n\n", flush=True)
    if arguments.write:
        write_section("\n\n".join(parts) + "\n")


def heading():
    """Say when and where this was measured, and with which peers."""
    found = [f"{name} {said}" for name, said in versions().items() if said]
    missing = [name for name, said in versions().items() if not said]
    without = f" Not installed, so left out: {', '.join(missing)}." if missing else ""
    return (
        "## Drainage (`drainage`)\n\n"
        f"{provenance('numba', 'numpy')} {', '.join(found)}.{without} Repeat with "
        "`.venv/bin/python benchmarks/drainage.py`. *large*: `sierra_nevada` mirrored 3 × 3 and "
        "cut to 3601 × 3601. Medians; caches warm; two threads where the program has them."
    )


def versions():
    """Tell the version of each peer; empty if it is not there."""
    try:
        import pyflwdir

        found = {"pyflwdir": pyflwdir.__version__}
    except ImportError:
        found = {"pyflwdir": ""}
    for name, command in (("GRASS", ["grass", "--version"]), ("SAGA", ["saga_cmd", "--version"])):
        said = ""
        if shutil.which(command[0]):
            run = subprocess.run(command, capture_output=True, text=True)
            number = re.search(r"\d+\.\d+\.\d+", run.stdout + run.stderr)
            said = number.group() if number else "?"
        found[name] = said
    return found


# --- chains --------------------------------------------------------------------------------------


def ground(name):
    """Give elevations, voids, pixel sizes and cell areas of a tile."""
    z, (dx, dy) = tiles.large() if name == "large" else tiles.void_free(name)
    return z, np.zeros(z.shape, bool), dx, dy, dx * dy


def chain(z, void, dx, dy, cell_area, method, threads):
    """Go from elevations to upstream area step by step; gives the seconds of each."""
    seconds = {}

    def timed(name, step):
        begin = time.perf_counter()
        result = step()
        seconds[name] = time.perf_counter() - begin
        return result

    filled = timed("fill", lambda: fill_depressions(z, void, threads=threads))
    flat = timed("flats", lambda: resolve_flats(filled, void, threads=threads))
    if method == "d8":
        codes = timed(
            "directions", lambda: d8_directions(filled, flat, void, dx, dy, threads=threads)
        )
        timed("area, d8", lambda: accumulate_d8(codes, cell_area, threads=threads))
        return seconds
    accumulate = accumulate_mfd if method == "mfd" else accumulate_dinf
    surface = filled, flat, void, dx, dy, cell_area
    timed(f"area, {method}", lambda: accumulate(*surface, threads=threads))
    return seconds


def drained(surface, method):
    """Go from elevations to upstream area as users do."""
    z, void, dx, dy, cell_area = surface
    return demsmith.drainage_area(
        z, void, pixel_size=(dx, dy), cell_area=cell_area, method=method, threads=2
    )


def warm_up():
    """Compile, or load what was compiled."""
    small = [part[:300] for part in ground("sierra_nevada")]
    for method in METHODS:
        drained(small, method)


def median_of(rounds, step):
    """Call a step so many times and give the median of the seconds it tells, or takes."""
    seconds = []
    for _ in range(rounds):
        begin = time.perf_counter()
        told = step()
        seconds.append(told if isinstance(told, float) else time.perf_counter() - begin)
    return statistics.median(seconds)


def speed(rounds):
    """Time whole chains, every program in turn."""
    rows = []
    for name in ("sierra_nevada", "large"):
        surface = ground(name)
        ours = {
            method: median_of(rounds, lambda method=method, on=surface: drained(on, method) is None)
            for method in METHODS
        }
        peers = peer_seconds(name, surface, min(rounds, 3))
        rows += [
            [name, f"Demsmith {method}", f"**{seconds:.2f}**", *against(seconds, peers)]
            for method, seconds in ours.items()
        ]
        rows += [[name, peer, f"{seconds:.2f}", "", "", ""] for peer, seconds in peers.items()]
    return (
        "### Elevations to upstream area [s]\n\n"
        "`demsmith.drainage_area`, arrays in memory: depressions filled, flats, directions, area. "
        "GRASS: `r.watershed` alone, its raster imported before. SAGA: filling by Wang and Liu, "
        "and area, with files.\n\n"
        + table(["raster", "chain", "s", "pyflwdir ÷", "GRASS MFD ÷", "GRASS D8 ÷"], rows)
    )


def against(seconds, peers):
    """Say how many times as long peers take."""
    names = "pyflwdir", "GRASS MFD", "GRASS D8"
    return [f"**{peers[name] / seconds:.1f}**" if name in peers else "–" for name in names]


def peer_seconds(name, surface, rounds):
    """Time the peers that are there."""
    there = versions()
    seconds = {}
    if there["pyflwdir"]:
        z = surface[0]
        by_pyflwdir(z[:200, :200])
        seconds["pyflwdir"] = median_of(rounds, lambda: by_pyflwdir(z))
    with tempfile.TemporaryDirectory() as folder:
        if there["GRASS"] or there["SAGA"]:
            write_tile(name, surface, folder)
        if there["GRASS"]:
            for peer, flag in (("GRASS MFD", ""), ("GRASS D8", "-s")):
                seconds[peer] = median_of(rounds, lambda flag=flag: by_grass(folder, flag))
        if there["SAGA"]:
            for peer, method in (("SAGA MFD", 4), ("SAGA D8", 0)):
                seconds[peer] = median_of(1, lambda method=method: by_saga(folder, method))
    return {peer: each for peer, each in seconds.items() if each == each}


def by_pyflwdir(z):
    """Fill, find directions, and count cells upstream by pyflwdir."""
    import pyflwdir

    pyflwdir.from_dem(z, nodata=-9999).upstream_area()


def write_tile(name, surface, folder):
    """Write the elevations as other programs read them, in pixels of 90 m."""
    z = surface[0]
    grid = raster.Grid(z.shape, (0.0, 90.0, 0.0, 0.0, 0.0, -90.0), "EPSG:32611")
    meta = raster.BandMeta(np.dtype(np.float32), nodata=-9999.0)
    raster.write(f"{folder}/in.tif", z, like=raster.Raster(z, surface[1], grid, meta))


def by_grass(folder, flag):
    """Give the seconds that r.watershed takes, NaN if it fails."""
    command = (
        "r.in.gdal -o --quiet --overwrite input=in.tif output=dem && g.region raster=dem && "
        "date +%s.%N && "
        f"r.watershed --quiet --overwrite {flag} elevation=dem accumulation=area drainage=dir && "
        "date +%s.%N"
    )
    said = program(["grass", "--tmp-location", "in.tif", "--exec", "sh", "-c", command], folder)
    moments = [float(word) for word in re.findall(r"^\d{9,}\.\d+$", said, re.M)]
    return moments[1] - moments[0] if len(moments) == 2 else float("nan")


def by_saga(folder, method):
    """Give the seconds that filling and area take, NaN if they fail."""
    steps = [
        ["saga_cmd", "ta_preprocessor", "5", "-ELEV", "in.tif", "-FILLED", "filled.sdat"],
        ["saga_cmd", "ta_hydrology", "0", "-ELEVATION", "filled.sdat", "-FLOW", "area.sdat",
         "-METHOD", str(method)],
    ]  # fmt: skip
    begin = time.perf_counter()
    done = all(program(step, folder) for step in steps)
    return time.perf_counter() - begin if done else float("nan")


def program(command, folder):
    """Run a program and give what it says; nothing if it fails."""
    try:
        run = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=TIME_LIMIT, check=True
        )
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
        print(f"{command[0]} failed: {error}", file=sys.stderr)
        return ""
    return run.stdout + run.stderr


# --- steps, memory -------------------------------------------------------------------------------


def steps(rounds):
    """Time the steps, and D8 alone by one thread where nothing is to be filled."""
    surface = ground("large")
    seconds = {1: {}, 2: {}}
    for threads, medians in seconds.items():
        runs = {}
        for method in METHODS:
            for _ in range(rounds):
                for step, each in chain(*surface, method, threads).items():
                    runs.setdefault(step, []).append(each)
        medians.update({step: statistics.median(each) for step, each in runs.items()})
    rows = [
        [step, f"{seconds[1][step]:.2f}", f"{seconds[2][step]:.2f}",
         f"{surface[0].size / seconds[1][step] / 1e6:.0f}"]
        for step in seconds[1]
    ]  # fmt: skip
    alone = seconds[1]["directions"] + seconds[1]["area, d8"]
    return (
        "### Steps, large [s]\n\n"
        + table(["step", "1 thread", "2 threads", "M cells/s and core"], rows)
        + f"\n\nD8 alone, directions and area of a filled raster, one thread: "
        f"**{surface[0].size / alone / 1e6:.1f}** M cells/s (≥ 20)."
    )


def memory():
    """Measure, in processes of their own, how far each chain raises the peak memory."""
    rows = []
    for method in METHODS:
        run = subprocess.run(
            [sys.executable, __file__, "--peak", method], capture_output=True, text=True, check=True
        )
        rows.append([method, f"**{float(run.stdout):.1f}**"])
    return (
        "### Memory, large\n\nRise of the peak resident memory over a warm chain, with elevations "
        "and voids there before: bytes per cell (≤ 16).\n\n" + table(["method", "bytes"], rows)
    )


def peak_rise(method):
    """Give the rise in bytes per cell."""
    surface = ground("large")
    drained([part[:600] for part in surface], method)
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far
    before = status_bytes("VmRSS")
    result = drained(surface, method)
    rise = (status_bytes("VmHWM") - before) / surface[0].size
    del result
    return rise


def status_bytes(key):
    """Read a memory figure of this process."""
    return 1024 * int(re.search(key + r":\s+(\d+)", Path("/proc/self/status").read_text())[1])


# --- what must hold ------------------------------------------------------------------------------


def same_areas():
    """Compare areas along the same codes with pyflwdir's, cell by cell."""
    if not versions()["pyflwdir"]:
        return "### Same areas as pyflwdir\n\nNot compared: it is not installed."
    import pyflwdir

    rows = []
    for name in (*tiles.VOID_FREE, "large"):
        z, void, dx, dy, _ = ground(name)
        filled = fill_depressions(z, void)
        codes = d8_directions(filled, resolve_flats(filled, void), void, dx, dy)
        area = accumulate_d8(codes, np.ones(len(z)))
        theirs = pyflwdir.from_array(codes, ftype="d8").upstream_area()
        rows.append([name, f"{z.size}", int((area != theirs).sum()), int(area.max())])
    return (
        "### Same areas as pyflwdir\n\nCells upstream along our codes, `from_array(codes, "
        "ftype='d8').upstream_area()`.\n\n" + table(["tile", "cells", "differ", "largest"], rows)
    )


def balance():
    """Compare what leaves with what fell."""
    z, void, dx, dy, cell_area = ground("large")
    filled = fill_depressions(z, void)
    flat = resolve_flats(filled, void)
    surface = filled, flat, void, dx, dy
    fell = cell_area.sum() * z.shape[1]
    codes = d8_directions(*surface)
    cases = {"d8": (accumulate_d8(codes, cell_area), codes)}
    for method, accumulate, exponent in (
        ("mfd", accumulate_mfd, 1.1),
        ("dinf", accumulate_dinf, None),
    ):
        receivers = Surface(*surface).receivers(exponent)
        cases[method] = accumulate(*surface, cell_area), receivers
    rows = [
        [method, f"{abs(area[receivers == 0].sum() / fell - 1):.1e}"]
        for method, (area, receivers) in cases.items()
    ]
    return (
        "### Balance, large\n\nWhat arrives at outlets, less what fell, by what fell (≤ 1e-9).\n\n"
        + table(["method", "relative"], rows)
    )


def particles():
    """Compare particles with MFD: their error against the stated one, and how it falls."""
    z, void, dx, dy, cell_area = ground("sierra_nevada")
    filled = fill_depressions(z, void)
    surface = filled, resolve_flats(filled, void), void, dx, dy, cell_area
    expected = accumulate_mfd(*surface)
    total = cell_area.sum() * z.shape[1]
    rows = []
    for number in NUMBERS:
        begin = time.perf_counter()
        area, error = drop_particles(*surface, particles=number)
        seconds = time.perf_counter() - begin
        many = expected * number / total > 20
        rms = np.sqrt(np.mean((area - expected) ** 2)) / 1e6
        score = np.sqrt(np.mean(((area - expected) / error)[many] ** 2))
        rows.append(
            [f"{number:,}", f"{rms:.3g}", f"{rms * np.sqrt(number):.0f}", f"{score:.3f}",
             f"{seconds:.2f}"]
        )  # fmt: skip
    head = ["particles", "RMSE [km²]", "RMSE · √n", "error ÷ stated, rms", "s"]
    return (
        "### Particles against MFD, sierra_nevada\n\nThe stated standard error is compared at "
        "cells through which 20 particles or more are expected.\n\n" + table(head, rows)
    )


if __name__ == "__main__":
    main()
