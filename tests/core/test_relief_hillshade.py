"""Hillshade: light on planes, from many directions, and as gdaldem has it."""

import math

import numpy as np
import pytest
from scenes import disc, fractal

from demsmith.core.errors import InputError
from demsmith.core.relief import hillshade, light


def plane(east, north, shape=(6, 7)):
    """Ground that rises by ``east`` a column and ``north`` a row upward."""
    row, column = np.indices(shape)
    return 50 + east * column - north * row


@pytest.mark.parametrize(("east", "north"), [(0, 0), (0.5, 0), (-1, 2), (0.3, -0.4)])
@pytest.mark.parametrize("azimuth", [0, 90, 200, 315])
@pytest.mark.parametrize("altitude", [5, 45, 90])
def test_light_on_a_plane_is_the_cosine_to_its_normal(east, north, azimuth, altitude):
    angle, height = math.radians(azimuth), math.radians(altitude)
    toward = np.array(
        [math.sin(angle) * math.cos(height), math.cos(angle) * math.cos(height), math.sin(height)]
    )
    normal = np.array([-east, -north, 1]) / math.sqrt(1 + east**2 + north**2)
    expected = max(0.0, float(toward @ normal))
    lit = hillshade(plane(east, north), azimuth=azimuth, altitude=altitude)
    np.testing.assert_allclose(lit, expected, atol=1e-6)
    np.testing.assert_allclose(
        light(np.float32([east]), np.float32([north]), azimuth=azimuth, altitude=altitude),
        expected, atol=1e-6,
    )  # fmt: skip


def test_exaggeration_steepens_the_ground():
    ground = fractal((30, 30), relief=30)
    np.testing.assert_allclose(
        hillshade(ground, exaggeration=3, pixel_size=5),
        hillshade(3 * ground, pixel_size=5), atol=1e-5,
    )  # fmt: skip


def test_south_up_is_the_mirrored_raster():
    ground = fractal((20, 30), relief=30)
    np.testing.assert_array_equal(hillshade(ground[::-1], south_up=True)[::-1], hillshade(ground))


def test_voids_have_no_light_and_do_not_darken_their_rims():
    void = disc((20, 20), (10, 10), 4)
    ground = np.where(void, -32768, plane(0.5, 0.2, (20, 20)))
    for many in (False, True):
        lit = hillshade(ground, void, multidirectional=many)
        assert np.isnan(lit[void]).all()
        assert np.ptp(lit[~void]) < 1e-6


def test_four_lights_on_level_ground_are_as_one():
    level = hillshade(np.zeros((4, 4)), multidirectional=True, altitude=30)
    np.testing.assert_allclose(level, 0.5, atol=1e-6)


def test_four_lights_show_a_ridge_along_the_light():
    """A ridge that runs toward the light of 315° is dim to it, and seen by the others."""
    row, column = np.indices((60, 60))
    ground = -np.abs(row - column) * 0.5
    contrast = {}
    for many in (False, True):
        lit = hillshade(ground, multidirectional=many)
        contrast[many] = abs(float(lit[20, 40] - lit[40, 20]))
    assert contrast[False] < 1e-6
    assert contrast[True] > 0.1


@pytest.mark.parametrize("many", [False, True])
def test_agrees_with_gdaldem(tmp_path, many):
    gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
    ground = fractal((80, 90), relief=2000).astype(np.float32)
    dataset = gdal.GetDriverByName("MEM").Create("", 90, 80, 1, gdal.GDT_Float32)
    dataset.SetGeoTransform((0, 25, 0, 0, 0, -40))
    dataset.GetRasterBand(1).WriteRaster(0, 0, 90, 80, ground.tobytes())
    how = dict(multiDirectional=True) if many else dict(azimuth=300)
    made = gdal.DEMProcessing(
        str(tmp_path / "shade.tif"), dataset, "hillshade", altitude=40, zFactor=1.5,
        computeEdges=True, **how,
    )  # fmt: skip
    theirs = np.frombuffer(made.ReadRaster(), np.uint8).reshape(80, 90)
    ours = 1 + 254 * hillshade(
        ground, azimuth=300, altitude=40, exaggeration=1.5, multidirectional=many,
        pixel_size=(25, 40),
    )  # fmt: skip
    assert np.abs(ours - theirs)[1:-1, 1:-1].max() <= 1.01


@pytest.mark.parametrize(
    "options", [{"azimuth": -1}, {"altitude": 91}, {"exaggeration": 0}, {"method": "sobel"}]
)
def test_refused(options):
    (name,) = options
    with pytest.raises(InputError, match=f"{name} is"):
        hillshade(np.zeros((3, 3)), **options)


def test_threads_do_not_matter():
    ground = fractal((200, 300))
    for many in (False, True):
        one = hillshade(ground, multidirectional=many, threads=1)
        assert hillshade(ground, multidirectional=many, threads=4).tobytes() == one.tobytes()
