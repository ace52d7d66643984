"""``demsmith mosaic``: the command line, and what survives a kill."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from scenes import fractal
from support import WGS84_3ARC, digest, make_raster

from demsmith.core import raster

COMMAND = [sys.executable, "-m", "demsmith.core.cli", "mosaic"]
GRID = raster.Grid((513, 513), WGS84_3ARC, "EPSG:4326")
PROC = Path("/proc")
PATIENCE = 120  # seconds


def tiles_in(folder, side):
    """Write four tiles that share edges, with voids over them all."""
    ground = fractal((513, 513), seed=2)[:side, :side].astype(np.int16)
    rng = np.random.default_rng(0)
    for row, column in rng.integers(0, side, (side, 2)):
        ground[row : row + 4, column : column + 5] = -32768
    middle = side // 2
    ground[middle - 9 : middle + 9, middle - 9 : middle + 9] = -32768
    folder.mkdir()
    spans = slice(0, middle + 1), slice(middle, side)
    for number, (rows, columns) in enumerate((r, c) for r in spans for c in spans):
        grid = GRID.part(rows, columns)
        make_raster(
            folder / f"t{number}.tif", ground[rows, columns], geotransform=grid.geotransform,
            nodata=-32768,
        )  # fmt: skip
    return folder


def contents(folder):
    return {path.name: digest(path) for path in folder.glob("*.tif")}


def test_summary_and_outputs(demsmith, tmp_path):
    tiles, out = tiles_in(tmp_path / "tiles", 129), tmp_path / "out"
    status, told, err = demsmith(
        "mosaic", tiles, out, "--workers", 0, "--method", "mcmd", "--source-map", "--voids-layer",
        "--json",
    )  # fmt: skip
    result = json.loads(told)
    assert (status, err) == (0, "")
    assert {"output", "seconds", "version", "tiles", "voids", "cells_filled"} < set(result)
    assert len(result["tiles"]) == 4
    made = sorted(path.name for path in out.iterdir() if path.suffix != ".xml")
    assert made == [
        "mosaic.html", "mosaic.json", "mosaic.vrt", "t0.tif", "t0_source.tif", "t1.tif",
        "t1_source.tif", "t2.tif", "t2_source.tif", "t3.tif", "t3_source.tif", "voids.gpkg",
    ]  # fmt: skip
    again = demsmith("mosaic", tiles, out, "--workers", 0, "--method", "mcmd")
    assert again.status == 2
    assert "--overwrite" in again.err
    again = demsmith("mosaic", tiles, out, "--workers", 0, "--method", "mcmd", "--overwrite")
    assert again.err.startswith("filled ")
    assert "of 4 tiles" in again.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("tiles",), "give one tile or more"),
        (("nowhere", "out"), "'nowhere' does not exist"),
        (("tiles", "tiles"), "output folder"),
        (("tiles", "out", "--workers", "-1"), "workers is -1"),
        (("tiles", "out", "--nodata", "x"), "'x' is not a number"),
        (("tiles", "file.txt"), "file.txt"),
        (("tiles", "out", "--scheduler", "tcp://127.0.0.1:9"), "no Dask scheduler"),
    ],
)
def test_refused(demsmith, tmp_path, words, said, monkeypatch):
    if "--scheduler" in words:
        pytest.importorskip("distributed", reason="the extra distributed is missing")
    monkeypatch.chdir(tmp_path)
    tiles_in(tmp_path / "tiles", 65)
    (tmp_path / "file.txt").write_text("no folder")
    status, out, err = demsmith("mosaic", *words)
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert said in err
    assert not (tmp_path / "out").exists()
    assert (tmp_path / "file.txt").read_text() == "no folder"


def start(*words):
    return subprocess.Popen(
        [*COMMAND, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def finish(process):
    """Wait for a process; gives its exit status and what it said."""
    out, err = process.communicate(timeout=PATIENCE)
    return process.returncode, out, err


def workers_of(process):
    """Give the worker processes of a driver."""
    tasks = PROC / str(process.pid) / "task"
    try:
        children = [
            int(pid) for task in tasks.iterdir() for pid in (task / "children").read_text().split()
        ]
        return [
            pid for pid in children if b"spawn_main" in (PROC / str(pid) / "cmdline").read_bytes()
        ]
    except OSError:
        return []


def await_that(condition, process=None):
    end = time.monotonic() + PATIENCE
    while not (found := condition()):
        assert time.monotonic() < end, "time ran out"
        assert process is None or process.poll() is None, process.stderr.read()
        time.sleep(0.02)
    return found


def is_alive(pid):
    try:
        return b") Z " not in (PROC / str(pid) / "stat").read_bytes()
    except OSError:
        return False


needs_proc = pytest.mark.skipif(
    not (PROC / "self/task").exists(), reason="processes are found by /proc"
)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Four tiles, and what they become when nothing happens."""
    folder = tmp_path_factory.mktemp("undisturbed")
    tiles = tiles_in(folder / "tiles", 513)
    assert finish(start(tiles, folder / "out", "--workers", 0))[0] == 0
    return tiles, contents(folder / "out")


@needs_proc
def test_a_killed_worker_costs_only_its_tile(tmp_path, undisturbed):
    tiles, expected = undisturbed
    out = tmp_path / "out"
    process = start(tiles, out, "--workers", 2, "--json")
    work = out / ".demsmith-mosaic"
    await_that(lambda: list(work.glob("runs-*.npz")), process)
    killed = await_that(lambda: workers_of(process), process)
    os.kill(killed[0], signal.SIGKILL)
    status, told, err = finish(process)
    assert status == 0, err
    assert contents(out) == expected
    assert json.loads(told)["cells_unfilled"] == 0


@needs_proc
def test_a_killed_driver_is_gone_with_its_workers_and_the_next_goes_on(tmp_path, undisturbed):
    tiles, expected = undisturbed
    out = tmp_path / "out"
    process = start(tiles, out, "--workers", 2)
    work = out / ".demsmith-mosaic"
    await_that(lambda: list(work.glob("patch-*.npz")), process)
    workers = workers_of(process)
    process.kill()
    finish(process)
    await_that(lambda: not any(is_alive(pid) for pid in workers))
    for path in out.glob("*.tif"):
        assert digest(path) == expected[path.name]
    patches = {path: path.stat().st_mtime_ns for path in work.glob("patch-*.npz")}
    assert patches
    process = start(tiles, out, "--workers", 2)
    await_that(lambda: list(work.glob("tile-*.json")) or process.poll() is not None)
    for path, made in patches.items():
        assert not path.exists() or path.stat().st_mtime_ns == made
    status, _, err = finish(process)
    assert status == 0, err
    assert contents(out) == expected
    assert not work.exists()


@needs_proc
def test_interrupted(tmp_path, undisturbed):
    tiles, expected = undisturbed
    out = tmp_path / "out"
    process = start(tiles, out, "--workers", 1)
    await_that(lambda: list((out / ".demsmith-mosaic").glob("runs-*.npz")), process)
    process.send_signal(signal.SIGINT)
    status, _, err = finish(process)
    assert status == 130
    assert "the same command goes on there" in err
    assert finish(start(tiles, out, "--workers", 0))[0] == 0
    assert contents(out) == expected
