"""Writing several bands: one after another, described, whole or not at all."""

import os

import numpy as np
import pytest
from support import make_raster

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

SHAPE = (70, 300)
NAMES = ("first", "second", "third")


@pytest.fixture
def like(tmp_path):
    values = np.ones(SHAPE, np.int16)
    values[3, 4:9] = -1

    def scaled(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetUnitType("ft")

    return raster.read(make_raster(tmp_path / "in.tif", values, nodata=-1, setup=scaled))


def layers(count=3):
    for number in range(count):
        yield np.full(SHAPE, 1.5 * number)


def test_bands_are_what_was_given(tmp_path, like):
    path = tmp_path / "out.tif"
    written = raster.write_bands(
        path, layers(), like=like, descriptions=NAMES, nodata=-9999, void=like.void, unit="°"
    )
    assert written == (str(path), -9999)
    dataset = gdal.Open(str(path))
    assert dataset.RasterCount == 3
    assert dataset.GetMetadata("IMAGE_STRUCTURE")["INTERLEAVE"] == "BAND"
    for number, name in enumerate(NAMES):
        band = dataset.GetRasterBand(number + 1)
        assert (band.GetDescription(), band.GetUnitType()) == (name, "°")
        assert (band.GetNoDataValue(), band.GetScale()) == (-9999, None)
        assert gdal.GetDataTypeName(band.DataType) == "Float32"
        values = np.frombuffer(band.ReadRaster(), np.float32).reshape(SHAPE)
        np.testing.assert_array_equal(values, np.where(like.void, -9999, 1.5 * number))
    assert raster.read(path).grid == like.grid


def test_each_is_written_before_the_next_is_made(tmp_path, like):
    """The progress of writing one comes before the next is asked for."""
    events = []

    class Listening:
        def report(self, fraction):
            events.append(round(fraction, 3))

        def cancelled(self):
            return False

    def made():
        for number, layer in enumerate(layers()):
            events.append(NAMES[number])
            yield layer

    raster.write_bands(
        tmp_path / "out.tif", made(), like=like, descriptions=NAMES, nodata=-1, progress=Listening()
    )
    assert events == ["first", 0.333, "second", 0.667, "third", 1.0, 1.0]


def test_cancelled_while_a_band_is_made_leaves_nothing(tmp_path, like):
    def made():
        yield from layers(2)
        raise Cancelled()

    before = os.listdir(tmp_path)
    with pytest.raises(Cancelled):
        raster.write_bands(
            tmp_path / "out.tif", made(), like=like, descriptions=NAMES, nodata=-9999
        )
    assert os.listdir(tmp_path) == before


def test_a_layer_of_another_shape_is_refused(tmp_path, like):
    before = os.listdir(tmp_path)
    with pytest.raises(InputError, match="shape"):
        raster.write_bands(
            tmp_path / "out.tif", [np.ones((2, 2))], like=like, descriptions=["one"], nodata=-9999
        )
    assert os.listdir(tmp_path) == before


def test_outputs_of_one_run_must_be_different_files(tmp_path):
    with pytest.raises(InputError, match="two outputs are"):
        raster.check_outputs({"a": tmp_path / "x.tif", "b": f"{tmp_path}/./x.tif", "c": None})
    paths = raster.check_outputs({"a": tmp_path / "x.tif", "b": None})
    assert paths == {"a": str(tmp_path / "x.tif"), "b": None}
