"""The tool on a worker thread: the window stays alive, and cancel is prompt and clean."""

import os
import subprocess
import sys

import numpy as np
import pytest
from qgis.core import QgsProcessingException, QgsProcessingFeedback
from qgis_runs import TaskRun
from support import hills, make_raster

VOID = -32768

LATE_NUMBA = """
import sys
from qgis.core import *
from qgis.PyQt.QtCore import QEventLoop
application = QgsApplication([], True)
application.initQgis()
sys.path.append("/usr/share/qgis/python/plugins")
from processing.core.Processing import Processing
Processing.initialize()
import demsmith
plugin = demsmith.classFactory(None)
plugin.initProcessing()
heavy = {"numba", "scipy", "skimage", "geographiclib", "threadpoolctl"} & set(sys.modules)
if heavy:
    sys.exit(f"loading the plugin imports {heavy}")
tool = QgsApplication.processingRegistry().createAlgorithmById("demsmith:fillvoids")
context, feedback = QgsProcessingContext(), QgsProcessingFeedback()
loop, outcome = QEventLoop(), []
task = QgsProcessingAlgRunnerTask(
    tool, {"INPUT": sys.argv[1], "OUTPUT": sys.argv[2]}, context, feedback)
task.executed.connect(lambda fine, outputs: (outcome.append(fine), loop.quit()))
QgsApplication.taskManager().addTask(task)
loop.exec()
if not outcome[0] or "numba" not in sys.modules:
    sys.exit("the run failed: " + feedback.textLog())
plugin.unload()
print("filled", flush=True)
"""


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """Make a raster of 9 million cells with a hole of 150² cells in every 600²."""
    values = np.tile(hills(600, 600), (5, 5))
    for row in range(200, 3000, 600):
        for column in range(200, 3000, 600):
            values[row : row + 150, column : column + 150] = VOID
    return make_raster(tmp_path_factory.mktemp("large") / "large.tif", values, nodata=VOID)


def _fill_once(holed, tmp_path):
    """Compile or load the kernels, which no run can be interrupted in."""
    assert TaskRun("fillvoids", {"INPUT": holed[0], "OUTPUT": str(tmp_path / "first.tif")}).fine


def test_the_window_stays_responsive(plugin, holed, large, tmp_path):
    _fill_once(holed, tmp_path)
    run = TaskRun("fillvoids", {"INPUT": large, "OUTPUT": str(tmp_path / "filled.tif")})
    assert run.fine
    assert run.outputs["CELLS_FILLED"] == 25 * 150**2
    assert max(run.gaps) < 0.5
    assert len(run.progress) >= 5
    assert run.progress == sorted(run.progress)
    assert run.progress[-1] == 100


@pytest.mark.parametrize("percent", [1, 30, 85])
def test_cancel_is_prompt_and_leaves_nothing(plugin, holed, large, tmp_path, percent):
    _fill_once(holed, tmp_path)
    folder = tmp_path / "out"
    folder.mkdir()
    old = folder / "filled.tif"
    old.write_bytes(b"the user's older result")
    run = TaskRun(
        "fillvoids",
        {
            "INPUT": large,
            "OUTPUT": str(old),
            "SOURCE_MAP": str(folder / "source.tif"),
            "REPORT": str(folder / "report.json"),
        },
        cancel_at=percent,
    )
    assert run.cancelled_at is not None
    assert run.ended_at - run.cancelled_at < 1
    assert not run.fine
    assert os.listdir(folder) == ["filled.tif"]
    assert old.read_bytes() == b"the user's older result"
    assert "cancelled; nothing was written" in run.feedback.textLog()


def test_a_cancelled_script_gets_an_exception_not_a_result(fill, large):
    feedback = QgsProcessingFeedback()
    feedback.progressChanged.connect(lambda percent: feedback.cancel())
    with pytest.raises(QgsProcessingException, match="cancelled; nothing was written"):
        fill(large, feedback=feedback)


def test_failure_on_the_worker_is_a_failed_task(plugin, tmp_path):
    source = make_raster(tmp_path / "n.tif", np.full((9, 9), VOID, np.int16), nodata=VOID)
    run = TaskRun("fillvoids", {"INPUT": source, "OUTPUT": str(tmp_path / "filled.tif")})
    assert not run.fine
    assert "every cell is a void" in run.feedback.textLog()
    assert not (tmp_path / "filled.tif").exists()


def test_numba_can_be_imported_after_qgis_started(holed, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", LATE_NUMBA, holed[0], str(tmp_path / "filled.tif")],
        capture_output=True, text=True, timeout=240, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert "filled" in done.stdout, done.stderr
    assert (tmp_path / "filled.tif").exists()
