"""The command line as a process of its own: exit status, signals, streams and start-up."""

import importlib
import json
import os
import signal
import stat
import subprocess
import sys
import time

import numpy as np
import pytest
from support import digest, hills, make_raster

from demsmith.core.cli import main
from demsmith.core.errors import DependencyError

COMMAND = [sys.executable, "-m", "demsmith.core.cli"]


def start(*words, stderr=subprocess.PIPE, **how):
    return subprocess.Popen(
        [*COMMAND, *map(str, words)], stdout=subprocess.PIPE, stderr=stderr, text=True,
        # A job in a script's background would hand its ignored Ctrl-C down to us.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL), **how,
    )  # fmt: skip


def call(*words, **how):
    process = start(*words, **how)
    out, err = process.communicate(timeout=120)
    return process.returncode, out, err


@pytest.fixture
def dem(tmp_path):
    ground = hills()
    ground[10:13, 20:24] = -9999
    return make_raster(tmp_path / "dem.tif", ground, nodata=-9999)


@pytest.fixture
def large(tmp_path):
    """Raster that takes some seconds to fill."""
    ground = np.tile(hills(600, 600), (8, 8))
    holes = np.arange(4800) % 200 < 130
    ground[np.ix_(holes, holes)] = -9999
    return make_raster(tmp_path / "large.tif", ground, nodata=-9999)


@pytest.fixture
def output(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder / "filled.tif"


def test_done(dem, output):
    status, out, err = call("fill", dem, output, "--json")
    assert (status, err) == (0, "")
    assert json.loads(out)["cells_filled"] == 12


def test_bad_usage_and_bad_input(output):
    assert call("fill", "--nonsense")[0] == 2
    status, out, err = call("fill", "absent.tif", output, "--json")
    assert (status, out, err) == (2, "", "error: 'absent.tif' does not exist\n")


def test_second_interrupt_kills():
    """Work that never asks whether to stop dies of the second signal."""
    deaf = (
        "import sys, time\n"
        "from demsmith.core.cli import running, main\n"
        "def deaf(argv):\n"
        "    print('working', flush=True)\n"
        "    while True: time.sleep(0.05)\n"
        "running.run = deaf\n"
        "sys.exit(main())\n"
    )
    process = subprocess.Popen([sys.executable, "-c", deaf], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "working\n"
        process.send_signal(signal.SIGTERM)
        time.sleep(0.5)
        assert process.poll() is None
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=10) == -signal.SIGTERM
    finally:
        process.kill()
        process.communicate()


def test_handlers_are_given_back(dem, output):
    before = signal.getsignal(signal.SIGINT)
    assert main(["fill", dem, str(output), "--quiet"]) == 0
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root writes anywhere")
def test_unwritable_folder_as_a_user(dem, output):
    output.parent.chmod(stat.S_IRUSR | stat.S_IXUSR)
    try:
        status, _, err = call("fill", dem, output)
    finally:
        output.parent.chmod(stat.S_IRWXU)
    assert status == 2
    assert "not writable" in err


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="needs a folder nobody can write to")
def test_folder_that_takes_no_files(dem):
    status, out, err = call("fill", dem, "/proc/self/filled.tif")
    assert (status, out) == (2, "")
    assert err.startswith("error: cannot write '/proc/self/filled.tif'")
    assert len(err.splitlines()) == 1


def test_full_disk(tmp_path, output):
    """A limit on the size of files is as good as a full disk."""
    resource = pytest.importorskip("resource", reason="no file size limits on this system")
    noise = np.random.default_rng(1).integers(0, 3000, (600, 600)).astype(np.int16)
    noise[5, 5] = -9999
    dem = make_raster(tmp_path / "dem.tif", noise, nodata=-9999)
    process = subprocess.run(
        [*COMMAND, "fill", dem, str(output)], capture_output=True, text=True, timeout=120,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000)),
    )  # fmt: skip
    assert process.returncode == 2
    assert process.stderr.startswith("error: cannot write ")
    assert "Traceback" not in process.stderr
    assert os.listdir(output.parent) == []


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this system")
def test_result_that_cannot_be_printed(dem, output):
    with open("/dev/full", "w") as full:
        process = subprocess.run(
            [*COMMAND, "fill", dem, str(output), "--json"],
            stdout=full, stderr=subprocess.PIPE, text=True, timeout=120,
        )  # fmt: skip
    assert (process.returncode, process.stderr) == (1, "error: No space left on device\n")


def test_reader_went_away(dem, output):
    reader, writer = os.pipe()
    os.close(reader)
    process = subprocess.run(
        [*COMMAND, "fill", dem, str(output), "--json"],
        stdout=writer, stderr=subprocess.PIPE, text=True, timeout=120,
    )  # fmt: skip
    os.close(writer)
    assert (process.returncode, process.stderr) == (1, "")
    assert output.exists()


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (MemoryError("Unable to allocate 9 TiB"), 1, "error: not enough memory. Unable"),
        (OSError(28, "No space left on device", "x.tif"), 1, "No space left on device: 'x.tif'"),
        (DependencyError("numba is missing"), 1, "error: numba is missing"),
        (KeyboardInterrupt(), 130, "error: cancelled"),
        (ZeroDivisionError("oh"), 1, "Traceback"),
    ],
)
def test_errors_from_below(monkeypatch, demsmith, error, status, said):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(importlib.import_module("demsmith.core.cli.fill"), "fill_file", fail)
    outcome = demsmith("fill", "a.tif", "b.tif")
    assert (outcome.status, outcome.out) == (status, "")
    assert said in outcome.err
    assert ("Traceback" in outcome.err) == (said == "Traceback")


def imported_by(*words):
    """Modules that a command imports."""
    err = subprocess.run(
        [sys.executable, "-X", "importtime", *COMMAND[1:], *words],
        capture_output=True, text=True, timeout=120, check=True,
    ).stderr  # fmt: skip
    return {line.rsplit("|", 1)[1].strip() for line in err.splitlines() if "|" in line}


@pytest.mark.parametrize(
    ("words", "heavy"),
    [
        (["--version"], {"numpy", "numba", "scipy", "osgeo"}),
        (["--help"], {"numpy", "numba", "scipy", "osgeo"}),
        (["fill", "--help"], {"numba", "scipy", "osgeo"}),
    ],
)
def test_help_imports_nothing_heavy(words, heavy):
    modules = imported_by(*words)
    assert "cyclopts" in modules
    assert modules & heavy == set()


def test_a_fill_imports_no_rich_without_a_terminal(dem, output):
    modules = imported_by("fill", dem, str(output))
    assert "numba" in modules
    assert "rich" not in modules


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no terminals on this system")
@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["ctrl-c", "term"]
)
def test_interrupted_while_the_bar_runs_leaves_nothing(large, output, number, status):
    before = digest(large)
    ours, theirs = os.openpty()
    report = output.with_name("report.json")
    process = start(
        "fill", large, output, "--report", report, "--r-s", "0.1", stderr=theirs,
        env=os.environ | {"TERM": "xterm", "COLUMNS": "100"},
    )  # fmt: skip
    os.close(theirs)
    shown = read(ours, until=b"%")
    asked = time.monotonic()
    process.send_signal(number)
    shown += read(ours)
    os.close(ours)
    assert process.communicate(timeout=30) == ("", None), shown
    assert time.monotonic() - asked < 3
    assert process.returncode == status
    assert b"filling voids" in shown
    assert shown.rstrip().endswith(b"error: cancelled; nothing was written")
    assert os.listdir(output.parent) == []
    assert digest(large) == before


def read(terminal, until=None):
    """Read what a terminal shows, until a word comes or the other side is closed."""
    shown = b""
    try:
        while (until is None or until not in shown) and (more := os.read(terminal, 4096)):
            shown += more
    except OSError:  # how Linux tells that the other side is closed
        pass
    return shown
