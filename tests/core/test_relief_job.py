"""Terrain basics from file to file: units, directions, tags, and all of the output or none."""

import math
import os

import numpy as np
import pytest
from gdal_reading import read
from scenes import disc, fractal
from support import digest, make_raster

from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.relief import (
    ReliefOptions,
    aspect,
    hillshade,
    mean_deviation,
    relief_file,
    slope,
    topographic_position,
)
from demsmith.core.relief.options import KINDS

pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

UTM = "EPSG:32631"
SQUARE = (500_000.0, 20.0, 0.0, 4_700_000.0, 0.0, -20.0)
SHAPE = (60, 80)
VOID = disc(SHAPE, (30, 30), 9)
ARRAYS = {
    "slope": slope,
    "aspect": aspect,
    "deviation": mean_deviation,
    "position": topographic_position,
}


def tile(path, ground=None, *, geotransform=SQUARE, crs=UTM, **options):
    values = np.rint(fractal(SHAPE, relief=900)).astype(np.int16) if ground is None else ground
    values = np.where(VOID, -32768, values).astype(values.dtype)
    return make_raster(path, values, geotransform=geotransform, crs=crs, nodata=-32768, **options)


def made(source, folder, **options):
    path = folder / "out.tif"
    result = relief_file(source, path, options=ReliefOptions(**options), overwrite=True)
    return (*read(path), result)


@pytest.mark.parametrize("kind", sorted(ARRAYS))
def test_is_what_the_array_function_gives(tmp_path, kind):
    source = tile(tmp_path / "in.tif")
    before = digest(source)
    values, tag, geotransform, dtype, result = made(source, tmp_path, kind=kind)
    ground = read(source)[0]
    expected = ARRAYS[kind](ground, VOID, pixel_size=20)
    assert (tag, geotransform, dtype) == (-9999, SQUARE, np.float32)
    np.testing.assert_array_equal(values[VOID], -9999)
    known = ~np.isnan(expected)
    np.testing.assert_array_equal(values[known], expected[known])
    assert (result.kind, result.cells, result.cells_known) == (kind, 4800, known.sum())
    assert (result.minimum, result.maximum) == (expected[known].min(), expected[known].max())
    assert digest(source) == before


@pytest.mark.parametrize("many", [False, True])
def test_a_hillshade_is_bytes_from_1(tmp_path, many):
    source = tile(tmp_path / "in.tif")
    options = dict(azimuth=200, altitude=30, exaggeration=2, multidirectional=many)
    values, tag, _, dtype, result = made(source, tmp_path, kind="hillshade", **options)
    expected = hillshade(read(source)[0], VOID, pixel_size=20, **options)
    assert (tag, dtype) == (0, np.uint8)
    assert (values[VOID] == 0).all()
    assert np.abs(values[~VOID] - (1 + 254 * expected[~VOID])).max() <= 0.5 + 1e-4
    assert values[~VOID].min() == result.minimum >= 1
    assert result.maximum == values.max()


def test_options_reach_the_functions(tmp_path):
    source = tile(tmp_path / "in.tif")
    outputs = [
        made(source, tmp_path, **options)[0].tobytes()
        for options in (
            dict(kind="slope"), dict(kind="slope", unit="percent"),
            dict(kind="slope", method="zevenbergen-thorne"),
            dict(kind="deviation"), dict(kind="deviation", radius=100),
            dict(kind="hillshade"), dict(kind="hillshade", azimuth=90),
        )
    ]  # fmt: skip
    assert len(set(outputs)) == len(outputs)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("turn", "geotransform"),
    [
        (np.s_[::-1, :], (500_000.0, 20.0, 0.0, 4_698_800.0, 0.0, 20.0)),
        (np.s_[:, ::-1], (501_600.0, -20.0, 0.0, 4_700_000.0, 0.0, -20.0)),
    ],
    ids=["south up", "west right"],
)
def test_the_order_of_rows_and_columns_does_not_matter(tmp_path, kind, turn, geotransform):
    """The same ground, stored the other way round, gives the same result at each place."""
    values = fractal(SHAPE, relief=900).astype(np.float32)
    values[VOID] = -32768
    for name, ground, place in (("a", values, SQUARE), ("b", values[turn], geotransform)):
        make_raster(tmp_path / f"{name}.tif", ground, geotransform=place, crs=UTM, nodata=-32768)
    plain = made(tmp_path / "a.tif", tmp_path, kind=kind)[0].astype(float)
    turned = made(tmp_path / "b.tif", tmp_path, kind=kind)[0][turn].astype(float)
    np.testing.assert_allclose(turned, plain, atol=1e-3)


def test_feet_and_scaled_elevations_become_metres(tmp_path):
    ground = 30.0 * np.indices(SHAPE)[1]

    def in_feet(dataset):
        dataset.GetRasterBand(1).SetUnitType("ft")

    def scaled(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(50)

    for factor, setup in ((1, None), (1 / 0.3048, in_feet), (10, scaled)):
        source = tile(tmp_path / "in.tif", (ground * factor).astype(np.float32), setup=setup)
        steep = made(source, tmp_path, kind="slope", unit="percent")[0]
        np.testing.assert_allclose(steep[~VOID], 150, rtol=1e-5)


def test_a_geographic_raster_is_steep_in_metres(tmp_path):
    third = (20.0, 1 / 1200, 0.0, 60.05, 0.0, -1 / 1200)
    ground = (46.51 * np.indices(SHAPE)[1]).astype(np.float32)
    steep = made(tile(tmp_path / "in.tif", ground, geotransform=third, crs="EPSG:4326"), tmp_path)[
        0
    ]
    np.testing.assert_allclose(steep[~VOID], 45, atol=0.1)


def test_level_ground_has_no_aspect_and_says_so(tmp_path):
    source = tile(tmp_path / "in.tif", np.full(SHAPE, 5, np.int16))
    values, tag, _, _, result = made(source, tmp_path, kind="aspect")
    assert (values == tag).all()
    assert (result.minimum, result.maximum, result.cells_known) == (None, None, 0)


def test_one_pixel(tmp_path):
    source = make_raster(tmp_path / "in.tif", np.full((1, 1), 7, np.int16))
    assert made(source, tmp_path, kind="slope")[0].tolist() == [[0]]


def test_result_does_not_depend_on_threads(tmp_path):
    source = tile(tmp_path / "in.tif")
    files = set()
    for threads in (1, 3):
        path = tmp_path / f"{threads}.tif"
        relief_file(source, path, threads=threads)
        files.add(path.read_bytes())
    assert len(files) == 1


def test_no_ground_at_all(tmp_path):
    source = make_raster(tmp_path / "in.tif", np.full((4, 4), -9999, np.int16), nodata=-9999)
    with pytest.raises(InputError, match=r"in\.tif.*every cell is a void"):
        relief_file(source, tmp_path / "out.tif")
    assert os.listdir(tmp_path) == ["in.tif"]


def test_existing_output_and_wrong_places_are_refused_first(tmp_path):
    source = tile(tmp_path / "in.tif")
    (tmp_path / "out.tif").write_text("precious")
    with pytest.raises(OutputError, match="overwrite"):
        relief_file(source, tmp_path / "out.tif")
    with pytest.raises(OutputError):
        relief_file(source, tmp_path / "none" / "out.tif")
    with pytest.raises(InputError):
        relief_file(source, source, overwrite=True)
    assert (tmp_path / "out.tif").read_text() == "precious"


class _StopAt:
    def __init__(self, fraction):
        self.at, self.done = fraction, 0.0

    def report(self, fraction):
        assert fraction >= self.done
        self.done = fraction

    def cancelled(self):
        return self.done >= self.at


@pytest.mark.parametrize("fraction", [0, 0.3, 0.7, math.nextafter(1, 0)])
def test_cancelled_leaves_nothing(tmp_path, fraction):
    source = tile(tmp_path / "in.tif")
    with pytest.raises(Cancelled):
        relief_file(source, tmp_path / "out.tif", progress=_StopAt(fraction))
    assert os.listdir(tmp_path) == ["in.tif"]
