"""Pixel sizes and areas on the ellipsoid against textbook values and GeographicLib itself."""

import math
import time

import numpy as np
import pytest
from geographiclib.geodesic import Geodesic
from hypothesis import given, settings
from hypothesis import strategies as st

from demsmith.core.errors import InputError
from demsmith.core.geodesy import WGS84, Ellipsoid, cell_area_m2, pixel_size_m

ARC_SECOND = 1 / 3600


def one_row(latitude, height=ARC_SECOND, width=ARC_SECOND, **options):
    dx, dy = pixel_size_m([latitude + height / 2, latitude - height / 2], width, **options)
    return dx[0], dy[0]


@pytest.mark.parametrize(
    ("latitude", "degree_east", "degree_north"),
    [(0, 111_320, 110_574), (45, 78_847, 111_132), (60, 55_800, 111_412), (-60, 55_800, 111_412)],
)
def test_arc_second_by_the_table_of_degree_lengths(latitude, degree_east, degree_north):
    dx, dy = one_row(latitude)
    assert (dx * 3600, dy * 3600) == pytest.approx((degree_east, degree_north), abs=0.7)


@given(latitude=st.floats(-89.9, 89.9), height=st.sampled_from([1e-5, ARC_SECOND, 0.01, 0.2]))
def test_agrees_with_geographiclib(latitude, height):
    height = min(height, 2 * (90 - abs(latitude)))
    dx, dy = one_row(latitude, height, width=0.001)
    north, south = latitude + height / 2, latitude - height / 2
    arc = Geodesic.WGS84.Inverse(north, 0, south, 0)["s12"]
    # GeographicLib is good to 15 nm, which is much for a pixel of a metre.
    assert dy == pytest.approx(arc, rel=1e-8, abs=3e-8)
    chord = Geodesic.WGS84.Inverse(latitude, 0, latitude, 0.001)["s12"]
    assert dx == pytest.approx(chord, rel=1e-8, abs=3e-8)


@given(latitude=st.floats(-89.99, 89.99))
def test_agrees_with_the_closed_radii_of_curvature(latitude):
    a, f = WGS84
    e2, phi = f * (2 - f), math.radians(latitude)
    root = math.sqrt(1 - e2 * math.sin(phi) ** 2)
    dx, dy = one_row(latitude)
    angle = math.radians(ARC_SECOND)
    assert dx == pytest.approx(a / root * math.cos(phi) * angle, rel=1e-8)
    assert dy == pytest.approx(a * (1 - e2) / root**3 * angle, rel=1e-8)


def test_sphere_and_other_planets():
    moon = Ellipsoid(1_737_400.0, 0.0)
    degree = math.radians(1) * moon.radius
    dx, dy = one_row(60, 1e-3, 1e-3, ellipsoid=moon)
    assert (dx, dy) == pytest.approx((degree * 1e-3 / 2, degree * 1e-3), rel=1e-9)
    mars = Ellipsoid(3_396_190.0, 1 / 169.894447)
    _, dy = one_row(30, 0.01, 0.01, ellipsoid=mars)
    arc = Geodesic(*mars).Inverse(30.005, 0, 29.995, 0)["s12"]
    assert dy == pytest.approx(arc, rel=1e-8)


@settings(max_examples=20)
@given(rows=st.integers(1, 400), top=st.floats(-80, 90))
def test_rows_add_up_to_the_meridian(rows, top):
    edges = np.linspace(top, max(-90, top - 10), rows + 1)
    _, dy = pixel_size_m(edges, 1.0)
    arc = Geodesic.WGS84.Inverse(edges[0], 0, edges[-1], 0)["s12"]
    assert dy.sum() == pytest.approx(arc, rel=1e-8)


def test_south_up_is_the_mirror():
    north_up = pixel_size_m([52, 51, 50], 1.0)
    south_up = pixel_size_m([50, 51, 52], 1.0)
    for one, other in zip(north_up, south_up, strict=True):
        np.testing.assert_allclose(one, other[::-1], rtol=1e-14)


def test_the_globe_has_the_area_of_the_ellipsoid():
    area = cell_area_m2(np.linspace(90, -90, 721), 0.25)
    assert area.sum() * 1440 == pytest.approx(510_065_621_724_000, rel=1e-8)


def test_cell_area_against_a_geodesic_polygon():
    polygon = Geodesic.WGS84.Polygon()
    # Many points on the parallels, as a geodesic between two corners bulges polewards.
    for longitude in np.linspace(0, 0.5, 200):
        polygon.AddPoint(45.0, longitude)
    for longitude in np.linspace(0.5, 0, 200):
        polygon.AddPoint(45.5, longitude)
    _, _, area = polygon.Compute()
    assert cell_area_m2([45.5, 45.0], 0.5)[0] == pytest.approx(area, rel=1e-6)


def test_row_that_straddles_a_pole_counts_its_part_on_the_globe():
    """Pixels of global grids are often centred on the pole."""
    dx, dy = pixel_size_m([90.5, 89.5, 88.5], 1.0)
    assert 0 < dx[0] < dx[1]
    assert dy[0] == pytest.approx(dy[1], rel=1e-3)


def test_rows_beyond_the_pole_are_refused():
    with pytest.raises(InputError, match=r"row 1 .* latitude 105°.*no degrees"):
        pixel_size_m([80, 100, 110], 1.0)


def test_a_large_tile_takes_no_time():
    edges = np.linspace(43, 42, 3602)
    pixel_size_m(edges, ARC_SECOND)
    start = time.perf_counter()
    dx, _ = pixel_size_m(edges, ARC_SECOND)
    assert time.perf_counter() - start < 0.06
    assert dx.shape == (3601,)
