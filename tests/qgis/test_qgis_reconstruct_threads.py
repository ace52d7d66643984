"""The tool *Reconstruct SRTM voids* in a worker thread: progress and cancel."""

import os

import numpy as np
import pytest
from qgis_runs import TaskRun
from support import hills, make_raster

VOID = -32768


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """Make a raster of 4 million cells with voids of several sizes."""
    values = np.tile(hills(400, 400), (5, 5))
    for side in range(2, 32):
        values[side * 50 : side * 51, side * 50 : side * 51] = VOID
    return make_raster(tmp_path_factory.mktemp("large") / "large.tif", values, nodata=VOID)


def test_the_window_stays_responsive(plugin, large, tmp_path):
    run = TaskRun(
        "reconstructsrtm",
        {"INPUT": large, "OUTPUT": str(tmp_path / "o.tif"), "REPORT": str(tmp_path / "r.html")},
    )
    assert run.fine
    assert run.outputs["CELLS_FILLED"] == sum(side**2 for side in range(2, 32))
    assert max(run.gaps) < 0.5
    assert len(run.progress) >= 5
    assert run.progress == sorted(run.progress)
    assert run.progress[-1] == 100


@pytest.mark.parametrize("percent", [1, 20, 50, 90])
def test_cancel_is_prompt_and_leaves_nothing(plugin, large, tmp_path, percent):
    folder = tmp_path / "out"
    folder.mkdir()
    old = folder / "filled.tif"
    old.write_bytes(b"the user's older result")
    names = {"SOURCE_MAP": "s.tif", "UNCERTAINTY": "u.tif", "VOIDS_LAYER": "v.gpkg",
             "REPORT": "r.html"}  # fmt: skip
    paths = {name: str(folder / file) for name, file in names.items()}
    run = TaskRun(
        "reconstructsrtm", {"INPUT": large, "OUTPUT": str(old), **paths}, cancel_at=percent
    )
    assert run.cancelled_at is not None
    assert run.ended_at - run.cancelled_at < 1
    assert not run.fine
    assert os.listdir(folder) == ["filled.tif"]
    assert old.read_bytes() == b"the user's older result"
    assert "cancelled; nothing was written" in run.feedback.textLog()
