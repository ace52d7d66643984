"""Where cells are on the Earth and which way the grid runs there."""

import numpy as np
import pytest

from demsmith.core.errors import InputError
from demsmith.core.raster import Grid, Places, north_up, places_of

pytest.importorskip("osgeo.gdal", reason="GDAL is missing")


def all_places(grid):
    return places_of(grid, np.arange(grid.shape[0])[:, None], np.arange(grid.shape[1]))


def assert_frames(places):
    """Three unit vectors at right angles, right-handed, the third of them up."""
    products = places.frame @ places.frame.transpose(0, 2, 1)
    np.testing.assert_allclose(products, np.broadcast_to(np.eye(3), products.shape), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(places.frame), 1)
    np.testing.assert_allclose(places.frame[:, 2, 2], np.sin(np.radians(places.latitude)))


def test_a_geographic_grid_runs_true_north():
    places = all_places(Grid((4, 3), (10.0, 0.5, 0.0, 50.0, 0.0, -0.25), "EPSG:4326"))
    np.testing.assert_allclose(places.latitude, np.repeat([49.875, 49.625, 49.375, 49.125], 3))
    np.testing.assert_allclose(places.longitude, np.tile([10.25, 10.75, 11.25], 4))
    np.testing.assert_allclose(places.convergence, 0, atol=1e-9)
    assert_frames(places)


def test_south_up_and_westward_grids_are_where_they_are():
    grid = Grid((4, 3), (10.0, 0.5, 0.0, 50.0, 0.0, -0.25), "EPSG:4326")
    back = Grid((4, 3), (11.5, -0.5, 0.0, 49.0, 0.0, 0.25), "EPSG:4326")
    places, turned = all_places(grid), all_places(back)
    np.testing.assert_allclose(turned.latitude[::-1], places.latitude)
    np.testing.assert_allclose(turned.longitude[::-1], places.longitude)
    # North is where y grows, whichever way the rows run.
    np.testing.assert_allclose(turned.frame[::-1], places.frame)
    order, upright = north_up(back)
    assert upright == grid
    cells = np.arange(12).reshape(4, 3)
    np.testing.assert_array_equal(cells[order], cells[::-1, ::-1])
    order, same = north_up(grid)
    assert same == grid
    np.testing.assert_array_equal(cells[order], cells)


def test_across_the_date_line_frames_go_on():
    east = all_places(Grid((1, 4), (179.0, 0.5, 0.0, 10.0, 0.0, -0.5), "EPSG:4326"))
    west = all_places(Grid((1, 4), (-181.0, 0.5, 0.0, 10.0, 0.0, -0.5), "EPSG:4326"))
    np.testing.assert_allclose(east.longitude, [179.25, 179.75, -179.75, -179.25])
    np.testing.assert_allclose(west.longitude, east.longitude)
    np.testing.assert_allclose(west.frame, east.frame, atol=1e-12)


def test_another_prime_meridian_counts():
    # EPSG:4807: NTF in grads from Paris, 2.337° east of Greenwich.
    places = all_places(Grid((1, 1), (-0.5, 1.0, 0.0, 50.5, 0.0, -1.0), "EPSG:4807"))
    assert places.longitude[0] == pytest.approx(2.3372, abs=2e-3)
    assert places.latitude[0] == pytest.approx(45.0, abs=2e-3)


@pytest.mark.parametrize(("easting", "side"), [(300e3, -1), (500e3, 0), (700e3, 1)])
@pytest.mark.parametrize(("crs", "northing"), [("EPSG:32632", 5.5e6), ("EPSG:32732", 4.5e6)])
def test_the_convergence_of_utm(crs, northing, easting, side):
    places = all_places(Grid((1, 1), (easting - 15, 30, 0, northing + 15, 0, -30), crs))
    latitude, longitude = np.radians([places.latitude[0], places.longitude[0] - 9.0])
    # Snyder 1987, "Map projections - a working manual", equation 8-15, on the sphere.
    expected = np.degrees(np.arctan(np.tan(longitude) * np.sin(latitude)))
    assert places.convergence[0] == pytest.approx(expected, abs=0.005)
    assert np.sign(round(places.convergence[0], 3)) == side * np.sign(latitude)
    assert_frames(places)


def test_polar_stereographic_over_the_pole():
    # EPSG:3413: from the middle, 45° W is straight down.
    grid = Grid((5, 5), (-2500.0, 1000.0, 0.0, 2500.0, 0.0, -1000.0), "EPSG:3413")
    places = all_places(grid)
    x, y = (
        axis.ravel() for axis in np.broadcast_arrays(*grid.xy(np.arange(5)[:, None], np.arange(5)))
    )
    off_pole = np.hypot(x, y) > 1
    longitude = (np.degrees(np.arctan2(x, -y)) - 45 + 180) % 360 - 180
    apart = (places.longitude - longitude + 180) % 360 - 180
    np.testing.assert_allclose(apart[off_pole], 0, atol=1e-6)
    # The grid's north is straight up, true north towards the middle.
    turn = (places.convergence - (places.longitude + 45) + 180) % 360 - 180
    np.testing.assert_allclose(turn[off_pole], 0, atol=1e-5)
    assert places.latitude[12] == pytest.approx(90)
    np.testing.assert_allclose(
        places.frame[12, 1], [np.cos(np.radians(135)), np.sin(np.radians(135)), 0], atol=1e-6
    )
    # The frames of neighbours hardly differ, at the pole as elsewhere.
    assert np.abs(np.diff(places.frame.reshape(5, 5, 9), axis=0)).max() < 2e-4
    assert_frames(places)


def test_antarctica_has_its_north_outwards():
    places = all_places(Grid((1, 1), (-500.0, 1000.0, 0.0, 2000500.0, 0.0, -1000.0), "EPSG:3031"))
    assert places.latitude[0] == pytest.approx(-71.7, abs=0.1)
    assert places.longitude[0] == pytest.approx(0, abs=1e-6)
    assert places.convergence[0] == pytest.approx(0, abs=1e-6)


def test_feet_are_feet():
    # Long Island in US survey feet: the same place by its twin in metres.
    feet, metre = (1e6, 2e5), 1200 / 3937
    places = all_places(Grid((1, 1), (feet[0], 100, 0, feet[1], 0, -100), "EPSG:2263"))
    twin = Grid(
        (1, 1), (feet[0] * metre, 100 * metre, 0, feet[1] * metre, 0, -100 * metre), "EPSG:32118"
    )
    expected = all_places(twin)
    np.testing.assert_allclose(places.latitude, expected.latitude, atol=1e-7)
    np.testing.assert_allclose(places.convergence, expected.convergence, atol=1e-5)


def test_a_skewed_projection_turns_half_way():
    # Sinusoidal far from its meridian: x runs east, y leans by almost 45°.
    grid = Grid((1, 1), (5e6 - 50, 100.0, 0.0, 5e6 + 50, 0.0, -100.0), "+proj=sinu +datum=WGS84")
    places = all_places(grid)
    assert_frames(places)
    longitude = np.radians(places.longitude[0])
    lean = np.degrees(np.arctan(longitude * np.sin(np.radians(places.latitude[0]))))
    assert places.convergence[0] == pytest.approx(lean / 2, abs=0.2)


def test_off_the_globe_there_is_no_place():
    places = all_places(Grid((1, 2), (-5e6, 1e7, 0.0, 5e5, 0.0, -1e6), "+proj=ortho +datum=WGS84"))
    assert_frames(Places(places.latitude[:1], places.longitude[:1], places.frame[:1]))
    assert np.isnan(places.frame[1]).all()
    assert np.isnan(places.latitude[1])


@pytest.mark.parametrize(
    ("grid", "told"),
    [
        (Grid((2, 2), (0.0, 1.0, 0.0, 2.0, 0.0, -1.0)), "where on the Earth"),
        (Grid((2, 2), crs="EPSG:4326"), "where on the Earth"),
        (
            Grid((2, 2), (0.0, 1.0, 0.0, 2.0, 0.0, -1.0), "+proj=longlat +R=1737400 +type=crs"),
            "not one of the Earth",
        ),
    ],
)  # fmt: skip
def test_what_has_no_place_is_refused(grid, told):
    with pytest.raises(InputError, match=told):
        places_of(grid, 0, 0)
