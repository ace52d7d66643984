"""Pictures of reports: lit as ground is, to scale, and nothing filled is too small to be seen."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from demsmith.core.errors import OutputError
from demsmith.core.images import encode_jpeg
from demsmith.core.raster import Grid
from demsmith.core.report.pictures import (
    LEFT_COLOR,
    TINTS,
    Frame,
    Ground,
    Shading,
    coloured,
    laid_over,
    relief,
    shading_of,
    visible,
)
from demsmith.core.report.scene import Scene, overview
from demsmith.core.voids.sources import COVARIANCE, LEFT, SOURCE_COLORS

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")


def decoded(jpeg):
    gdal.FileFromMemBuffer("/vsimem/report-test.jpg", jpeg)
    picture = gdal.Open("/vsimem/report-test.jpg").ReadAsArray()
    gdal.Unlink("/vsimem/report-test.jpg")
    return np.moveaxis(picture, 0, -1).astype(int)


def slope_towards(row, column, *, side=1.0, steepness=0.4):
    """Ground that falls towards a direction, as it is lit."""
    y, x = np.mgrid[:9, :9] * side
    z = -steepness * (row * y + column * x) / np.hypot(row, column)
    return relief(Ground(z.astype(np.float32), side), Shading(-10, 10, 1.0), tinted=False).mean()


def test_light_comes_from_the_north_west():
    flat = relief(Ground(np.zeros((5, 5), np.float32), 1.0), Shading(0, 1, 1.0), tinted=False)
    north_west, south_east = slope_towards(-1, -1), slope_towards(1, 1)
    assert north_west > flat.mean() > slope_towards(1, -1) * 0.9
    assert flat.mean() > south_east
    assert slope_towards(-1, 0) == pytest.approx(slope_towards(0, -1), rel=0.1)


def test_light_does_not_depend_on_the_size_of_pixels():
    assert slope_towards(0, 1, side=90) == pytest.approx(slope_towards(0, 1, side=1), rel=1e-4)


def test_a_picture_is_to_scale_on_the_ground():
    assert Frame((100, 100), (5.0, 10.0), longest=50).shape == (50, 25)
    north = Grid((1201, 1201), (10.0, 1 / 1200, 0, 61.0, 0, -1 / 1200), "EPSG:4326")
    rows, columns = Frame(north.shape, north.pixel_size_m()).shape
    assert rows == 900
    assert columns / rows == pytest.approx(0.4932, abs=0.0006)  # cos 60.5°, and the ellipsoid


@given(
    shape=st.tuples(st.integers(1, 40), st.integers(1, 40)), longest=st.integers(1, 90),
    width=st.floats(0.3, 3),
)  # fmt: skip
def test_the_mean_of_a_picture_is_the_mean_of_the_raster(shape, longest, width):
    values = np.random.default_rng(1).random(shape)
    frame = Frame(shape, (width, 1.0), longest=longest)
    picture = frame.mean(values)
    assert picture.shape == frame.shape
    assert max(frame.shape) == longest
    assert picture.mean() == pytest.approx(values.mean(), rel=1e-5)


def test_the_mean_of_some_cells_does_not_see_the_others():
    values = np.full((8, 8), 7.0)
    known = np.random.default_rng(0).random((8, 8)) < 0.5
    values[~known] = -32768
    known[:2, :2] = False
    picture = Frame((8, 8), (1.0, 1.0), longest=4).mean_where(values, known)
    assert np.isnan(picture[0, 0])
    np.testing.assert_allclose(picture[np.isfinite(picture)], 7.0)


def test_enlarged_ground_is_smooth():
    """A plane drawn larger than its cells is as bright everywhere: steps would be dark."""
    z = np.add.outer(np.arange(12.0), 2 * np.arange(12.0))
    frame = Frame(z.shape, (1.0, 1.3), longest=300)
    ground = frame.ground(z, np.zeros(z.shape, bool))
    picture = frame.fitted(relief(ground, Shading(0, 40, 1.0), tinted=False))
    assert picture.shape == (*frame.shape, 3)
    assert np.ptp(picture[40:-40, 40:-40]) < 8


def test_unknown_ground_is_painted_and_makes_no_cliff():
    z = np.full((20, 20), 1000.0, np.float32)
    z[8:12, 8:12] = np.nan
    picture = relief(Ground(z, 30.0), Shading(900, 1100, 5.0))
    assert (picture[9, 9] == LEFT_COLOR).all()
    known = np.isfinite(z)
    assert np.ptp(picture[known], axis=0).max() == 0


def test_tints_go_from_low_to_high_and_flat_ground_is_exaggerated():
    np.testing.assert_array_equal(coloured(np.array([[-1.0, 2.0]]), TINTS)[0, 0], TINTS[0][1])
    np.testing.assert_array_equal(coloured(np.array([[-1.0, 2.0]]), TINTS)[0, 1], TINTS[-1][1])
    y = np.mgrid[:30, :30][0]
    steep, flat = (shading_of(Ground((k * y).astype(np.float32), 1.0)) for k in (0.55, 0.01))
    assert (steep.exaggeration, flat.exaggeration) == (pytest.approx(1.0, abs=0.01), 10.0)
    assert shading_of(Ground(np.full((3, 3), np.nan, np.float32), 1.0)).exaggeration == 1


def test_the_sea_is_blue():
    z = np.array([[0, 0, 0.5, 3]] * 4, np.float32)
    picture = relief(Ground(z, 1000.0), Shading(0, 3, 1.0))
    assert picture[1, 0, 2] > picture[1, 0, 0] + 30
    assert picture[1, 2, 2] < picture[1, 2, 1]


def test_jpeg_comes_back():
    picture = np.zeros((40, 60, 3), np.uint8)
    picture[:, 30:] = (200, 100, 50)
    back = decoded(encode_jpeg(picture))
    assert back.shape == picture.shape
    assert abs(back[:, 40:] - (200, 100, 50)).max() < 8


def test_without_temporary_files_there_is_no_picture(monkeypatch, tmp_path):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    with pytest.raises(OutputError, match="temporary files"):
        encode_jpeg(np.zeros((4, 4, 3), np.uint8))


def scene_with(source, *, sigma=None, values=None):
    values = np.full(source.shape, 100.0) if values is None else values
    return Scene(values, source, (30.0, 30.0), sigma)


def test_one_cell_of_a_large_raster_is_seen_in_every_picture():
    source = np.zeros((2700, 2700), np.uint8)
    source[1350:1353, 300:303] = COVARIANCE  # one pixel of the picture
    source[600, 600] = COVARIANCE  # a ninth of one
    sigma = np.where(source, 5.0, np.nan)
    gallery = overview(scene_with(source, sigma=sigma))
    before, after, sources, uncertainty = (decoded(each.jpeg) for each in gallery.pictures)
    assert before.shape == (900, 900, 3)
    for picture in (before, sources, uncertainty):
        surroundings = picture[195:198, 195:198].mean(axis=(0, 1))
        assert abs(picture[200, 200] - surroundings).max() > 60
        assert abs(picture[450, 100] - surroundings).max() > 60
    assert abs(after[200, 200] - after[195, 195]).max() < 10


def test_sources_have_their_colours_and_left_voids_stay_dark():
    source = np.zeros((90, 90), np.uint8)
    source[:30] = COVARIANCE
    source[60:] = LEFT
    values = np.full(source.shape, 100.0)
    values[60:] = -32768
    gallery = overview(scene_with(source, values=values))
    assert len(gallery.pictures) == 3  # no uncertainty without sigma
    _, after, sources = (decoded(each.jpeg) for each in gallery.pictures)
    assert abs(after[800, 450] - LEFT_COLOR).max() < 8
    assert abs(sources[150, 450] - SOURCE_COLORS[COVARIANCE][:3]).max() < 30
    assert "learned covariance" in gallery.pictures[2].below
    assert "MCMD" not in gallery.pictures[2].below


def test_window_around_a_void_stays_in_the_raster():
    scene = Scene(
        np.zeros((100, 80)), np.zeros((100, 80), np.uint8), (np.arange(100.0), np.arange(100.0))
    )
    window = scene.window_around((95, 100), (0, 4))
    assert window.values.shape == window.source.shape == (40, 40)
    np.testing.assert_array_equal(window.pixel_size[0], np.arange(60.0, 100.0))
    assert scene.window_around((0, 100), (0, 80)).values.shape == (100, 80)


def test_overlay_shares():
    picture = np.zeros((1, 3, 3), np.float32)
    shares = visible(np.array([[0.0, 0.01, 1.0]]), least=0.5)
    over = laid_over(picture, (200, 200, 200), shares)
    np.testing.assert_allclose(over[0, :, 0], [0, 100, 200])
