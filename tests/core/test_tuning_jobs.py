"""Tuning as a part of filling and of making terrain from samples, from file to file."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scenes import fractal, holed
from support import make_raster

from demsmith.core import raster
from demsmith.core.cli.fill import _summary
from demsmith.core.raster import Grid
from demsmith.core.samples import SampleOptions, from_samples, samples_file
from demsmith.core.voids import FillOptions, fill_file, fill_voids

SHAPE = (320, 360)
TAUT = FillOptions(method="mcmd", tension=90.0, tune=True)
CURVED = {"variant": "weighted", "l": 2.0, "l_bu": 10.0, "tune": True}
VOID = holed(SHAPE, (100, 130, 140, 180))


@pytest.fixture(scope="module")
def ground():
    return fractal(SHAPE, exponent=2.5, relief=2000).astype(np.float32)


@pytest.fixture
def dem(tmp_path, ground):
    return make_raster(tmp_path / "dem.tif", np.where(VOID, -9999, ground), nodata=-9999)


def test_a_tuned_fill_is_the_fill_with_the_tuned_options(ground):
    filled = fill_voids(ground, VOID, options=TAUT, pixel_size=90)
    assert filled.tuned.accepted
    again = fill_voids(
        ground, VOID, options=replace(filled.tuned.options, tune=False), pixel_size=90
    )
    np.testing.assert_array_equal(filled.values, again.values)
    assert again.tuned is None
    plain = fill_voids(ground, VOID, options=replace(TAUT, tune=False), pixel_size=90).values
    error = [np.abs(values - ground)[VOID].mean() for values in (filled.values, plain)]
    assert error[0] < error[1]


def test_tuning_is_of_mcmd_whatever_the_method(ground):
    auto, mcmd = (
        fill_voids(ground, VOID, options=replace(TAUT, method=method), pixel_size=90)
        for method in ("auto", "mcmd")
    )
    assert auto.tuned.parameters == mcmd.tuned.parameters
    np.testing.assert_array_equal(auto.values, mcmd.values)
    assert auto.sigma is None


def test_without_voids_there_is_nothing_to_tune(ground):
    filled = fill_voids(ground, options=TAUT)
    assert filled.tuned is None
    np.testing.assert_array_equal(filled.values, ground)


def test_the_gain_is_told(dem, tmp_path):
    report = tmp_path / "report.json"
    result = fill_file(dem, tmp_path / "filled.tif", options=TAUT, report=report)
    tuning = json.loads(report.read_text())["tuning"]
    assert tuning == json.loads(json.dumps(result.tuning))
    assert tuning["accepted"] and tuning["gain"] > 0.1
    assert tuning["parameters"]["tension"]["after"] > 1000
    assert ", tuned tension " in _summary(result)
    assert result.warnings == ()


def test_too_small_a_raster_is_filled_all_the_same_and_warned_of(tmp_path):
    ground = fractal((40, 50), relief=300).astype(np.int16)
    ground[10:13, 20:24] = -9999
    dem = make_raster(tmp_path / "dem.tif", ground, nodata=-9999)
    result = fill_file(dem, tmp_path / "filled.tif", options=TAUT)
    assert result.cells_unfilled == 0
    assert ["not tuned: too little known ground" in each for each in result.warnings] == [True]
    assert not result.tuning["accepted"]
    plain = fill_file(dem, tmp_path / "plain.tif", options=replace(TAUT, tune=False))
    assert plain.tuning is None and plain.warnings == ()
    np.testing.assert_array_equal(
        raster.read(result.output).values, raster.read(plain.output).values
    )


def test_samples_are_tuned(ground, tmp_path):
    grid = Grid(SHAPE, (0.0, 90.0, 0.0, 0.0, 0.0, -90.0), "")
    row, column = np.nonzero(np.random.default_rng(1).random(SHAPE) < 0.05)
    points = np.column_stack([*grid.xy(row, column), ground[row, column]])
    made = from_samples(points, grid, **CURVED)
    assert made.tuned.accepted and made.tuned.options.l_bu < 5
    again = from_samples(points, grid, options=replace(made.tuned.options, tune=False))
    np.testing.assert_array_equal(made.values, again.values)
    assert again.tuned is None


def test_samples_of_a_file_are_tuned_or_warned_of(dem, tmp_path):
    thinned = make_raster(
        tmp_path / "thinned.tif",
        np.where(
            np.random.default_rng(1).random(SHAPE) < 0.05, raster.read(dem).values, -9999
        ),
        nodata=-9999,
    )  # fmt: skip
    result = samples_file(thinned, tmp_path / "a.tif", options=SampleOptions(**CURVED))
    assert result.as_dict()["tuning"]["accepted"]
    few = np.full(SHAPE, -9999.0, np.float32)
    few[::100, ::100] = 7
    few = make_raster(tmp_path / "few.tif", few, nodata=-9999)
    result = samples_file(few, tmp_path / "b.tif", options=SampleOptions(**CURVED))
    assert "not tuned: too little known ground" in result.warnings[-1]
