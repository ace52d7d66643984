"""Auxiliary rasters that cannot be used are named at once."""

import os
import shutil

import numpy as np
import pytest
from scenes import fractal
from support import WGS84_3ARC, make_raster

import demsmith
from demsmith.core import raster
from demsmith.core.auxiliary import check_auxiliary
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.reconstruction import ReconstructOptions, plan

X, STEP, _, Y, *_ = WGS84_3ARC
VALUES = fractal((60, 80)).astype(np.float32)


@pytest.fixture
def target(tmp_path):
    values = VALUES.copy()
    values[20:30, 20:40] = -9999
    return make_raster(tmp_path / "target.tif", values, nodata=-9999)


def truncated(folder):
    path = make_raster(folder / "short.tif", VALUES)
    with open(path, "r+b") as file:
        file.truncate(os.path.getsize(path) // 2)
    return path


def missing(folder):
    return folder / "nowhere.tif"


def empty(folder):
    (folder / "empty").mkdir()
    return folder / "empty"


def no_raster(folder):
    (folder / "text.tif").write_text("no raster")
    return folder / "text.tif"


def elsewhere(folder):
    return make_raster(folder / "far.tif", VALUES, geotransform=(X + 5, STEP, 0, Y, 0, -STEP))


def beside(folder):
    east = X + 80 * STEP
    return make_raster(folder / "east.tif", VALUES, geotransform=(east, STEP, 0, Y, 0, -STEP))


def without_crs(folder):
    return make_raster(folder / "plain.tif", VALUES, crs="")


def itself(folder):
    return folder / "target.tif"


def linked(folder):
    os.link(folder / "target.tif", folder / "link.tif")
    return folder / "link.tif"


def among_others(folder):
    (folder / "tiles").mkdir()
    os.symlink(folder / "target.tif", folder / "tiles" / "a.tif")
    shutil.copy(beside(folder), folder / "tiles" / "b.tif")
    return folder / "tiles"


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (missing, "does not exist"),
        (empty, "no elevation rasters"),
        (no_raster, "text.tif"),
        (truncated, "short.tif"),
        (elsewhere, "does not overlap"),
        (beside, "does not overlap"),
        (without_crs, "no CRS"),
        (itself, "is the input itself"),
        (linked, "is the input itself"),
        (among_others, "is the input itself"),
    ],
)
def test_a_bad_one_is_named_before_anything_is_learned(tmp_path, target, monkeypatch, make, said):
    def never(*_, **__):
        raise AssertionError("learned already")

    monkeypatch.setattr(plan, "learn_faults", never)
    path = make(tmp_path)
    with pytest.raises(InputError, match=said) as error:
        demsmith.reconstruct_file(target, tmp_path / "out.tif", auxiliaries=[path])
    assert f"auxiliary '{path}' cannot be used" in str(error.value)
    with pytest.raises(InputError, match=said):
        demsmith.reconstruct_mosaic(
            [target], tmp_path / "out", auxiliaries=[path], workers=0,
            options=ReconstructOptions(outliers=False),
        )  # fmt: skip
    assert not (tmp_path / "out.tif").exists()
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("side", "step"), [(8, 1), (600, 0.2), (40, 4)])
def test_one_that_overlaps_in_part_passes(tmp_path, target, side, step):
    geotransform = X + 70 * STEP, step * STEP, 0, Y - 30 * STEP, 0, -step * STEP
    path = make_raster(
        tmp_path / "part.tif", np.ones((side, side), np.float32), geotransform=geotransform
    )
    grid = raster.read_header(target)[0]
    assert check_auxiliary(path, grid, inputs=[target]) == [str(path)]


def test_one_in_the_middle_in_another_crs_passes(tmp_path):
    grid = raster.Grid((3601, 3601), (1.0, 1 / 3600, 0, 43.0, 0, -1 / 3600), "EPSG:4326")
    path = make_raster(
        tmp_path / "utm.tif", np.ones((9, 9), np.float32), crs="EPSG:32631",
        geotransform=(380_000, 30, 0, 4_700_000, 0, -30),
    )  # fmt: skip
    assert check_auxiliary(path, grid) == [str(path)]


def test_it_can_be_cancelled(tmp_path, target):
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    path = make_raster(tmp_path / "copy.tif", VALUES)
    with pytest.raises(Cancelled):
        check_auxiliary(path, raster.read_header(target)[0], progress=Stop())
