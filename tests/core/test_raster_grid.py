"""Where cells lie and how large they are, by CRS."""

import subprocess
import sys

import numpy as np
import pytest
from support import WGS84_3ARC

from demsmith.core.errors import InputError
from demsmith.core.geodesy import pixel_size_m
from demsmith.core.raster import Grid

pytest.importorskip("osgeo.gdal", reason="GDAL is missing")


def test_geographic_pixels_shrink_towards_the_pole():
    grid = Grid((1200, 10), WGS84_3ARC, "EPSG:4258")
    dx, dy = grid.pixel_size_m()
    assert dx.shape == dy.shape == (1200,)
    assert dx[0] < dx[-1]
    assert dx[0] == pytest.approx(92.77 * np.cos(np.radians(50)), rel=5e-3)
    assert grid.cell_area_m2() == pytest.approx(dx * dy, rel=1e-6)


@pytest.mark.parametrize(
    ("crs", "metres"),
    [
        ("EPSG:32633", 30.0),
        ("EPSG:2263", 30 * 1200 / 3937),  # New York, US survey feet
        ("EPSG:2222", 30 * 0.3048),  # Arizona, international feet
        ("EPSG:32633+5773", 30.0),  # compound: EGM96 heights
        ("", 30.0),
    ],
)
def test_projected_pixels_by_linear_unit(crs, metres):
    grid = Grid((4, 3), (5e5, 30.0, 0, 4e6, 0, -30.0), crs)
    dx, dy = grid.pixel_size_m()
    np.testing.assert_allclose([dx, dy], metres, rtol=1e-9)
    np.testing.assert_allclose(grid.cell_area_m2(), metres**2, rtol=1e-9)


def test_the_ellipsoid_is_that_of_the_crs():
    moon = (
        'GEOGCRS["Moon",DATUM["Moon",ELLIPSOID["Moon",1737400,0]],CS[ellipsoidal,2],'
        'AXIS["lat",north],AXIS["lon",east],ANGLEUNIT["degree",0.0174532925199433]]'
    )
    dx, dy = Grid((1, 1), (0, 0.1, 0, 0.05, 0, -0.1), moon).pixel_size_m()
    np.testing.assert_allclose([dx, dy], 2 * np.pi * 1737400 / 3600, rtol=1e-6)


def test_angular_units_other_than_degrees():
    """Grads: France's old maps, 400 to the circle."""
    grads = Grid((2, 2), (0, 0.01, 0, 52.0, 0, -0.01), "EPSG:4807")
    dx, dy = grads.pixel_size_m()
    edges = grads.row_edges() * 0.9
    expected = pixel_size_m(edges, 0.009, ellipsoid=(6378249.2, 1 / 293.466021293627))
    np.testing.assert_allclose([dx, dy], expected, rtol=1e-9)


def test_south_up_pixels_have_positive_sizes():
    rows = 5
    north_up = Grid((rows, 2), (10, 0.1, 0, 50, 0, -0.1), "EPSG:4326")
    south_up = Grid((rows, 2), (10, 0.1, 0, 49.5, 0, 0.1), "EPSG:4326")
    assert south_up.south_up and not north_up.south_up
    np.testing.assert_allclose(south_up.pixel_size_m().dx, north_up.pixel_size_m().dx[::-1])
    assert (south_up.pixel_size_m().dy > 0).all()


def test_xy_is_the_centre_of_the_cell():
    grid = Grid((100, 200), (1000.0, 10.0, 0, 5000.0, 0, -20.0))
    assert grid.xy(row=2, column=5) == (1055.0, 4950.0)
    x, y = grid.xy(np.array([0, 1]), np.array([3, 4]))
    np.testing.assert_array_equal(x, [1035, 1045])
    np.testing.assert_array_equal(y, [4990, 4970])


@pytest.mark.parametrize(
    ("shape", "geotransform", "complaint"),
    [
        ((0, 4), WGS84_3ARC, "no cells"),
        ((2, 2), (0, 1, 0.1, 0, 0, -1), "rotated or sheared.*gdalwarp"),
        ((2, 2), (0, 0, 0, 0, 0, -1), "no size"),
        ((2, 2), (0, 1, 0, float("nan"), 0, -1), "no size"),
    ],
)
def test_unusable_grids_are_refused(shape, geotransform, complaint):
    with pytest.raises(InputError, match=complaint):
        Grid(shape, geotransform, "")


def test_rounded_zero_rotation_is_no_rotation():
    Grid((1000, 1000), (0, 30, 1e-12, 0, -1e-12, -30), "")


def test_metres_called_degrees_are_refused():
    grid = Grid((10, 10), (500000, 30, 0, 4500000, 0, -30), "EPSG:4326")
    with pytest.raises(InputError, match="beyond the pole.*right CRS"):
        grid.pixel_size_m()


@pytest.mark.parametrize("crs", ["no crs at all", "EPSG:999999", "EPSG:4978"])
def test_unusable_crs_is_refused(crs):
    with pytest.raises(InputError, match="CRS"):
        Grid((2, 2), WGS84_3ARC, crs).pixel_size_m()


def test_without_gdal_degrees_still_work_and_reading_says_what_is_missing():
    code = """if True:
        import sys
        sys.modules["osgeo"] = None
        from demsmith.core import raster
        from demsmith.core.errors import DependencyError
        grid = raster.Grid((2, 2), (10, 0.1, 0, 50, 0, -0.1), "EPSG:4326")
        print(grid.pixel_size_m().dx[0] > 7000)
        try:
            raster.read("any.tif")
        except DependencyError as error:
            print("python3-gdal" in str(error))
    """
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "True"]


@pytest.mark.parametrize(
    ("extent", "resolution", "shape"),
    [
        ((500, 100, 590, 130), 10, (3, 9)),
        ((500, 100, 591, 131), 10, (4, 10)),
        ((500, 100, 590, 130), (30, 5), (6, 3)),
        ((500, 100, 501, 101), 10, (1, 1)),
        ((10, 49, 11, 50), 1 / 1200, (1200, 1200)),  # no 1201st cell by rounding
    ],
)
def test_grid_of_an_extent_covers_it_from_its_north_western_corner(extent, resolution, shape):
    grid = Grid.of_extent(extent, resolution, "EPSG:32631")
    xmin, _, _, ymax = extent
    width, height = np.broadcast_to(resolution, 2)
    assert grid.shape == shape
    assert grid.geotransform == (xmin, width, 0, ymax, 0, -height)
    assert grid.crs == "EPSG:32631"


@pytest.mark.parametrize(
    ("extent", "resolution", "complaint"),
    [
        ((0, 0, 0, 10), 1, "empty"),
        ((0, 10, 10, 0), 1, "give xmin, ymin, xmax, ymax"),
        ((0, 0, np.inf, 10), 1, "not finite"),
        ((0, np.nan, 10, 10), 1, "not finite"),
        ((0, 0, 10, 10), 0, "must be positive"),
        ((0, 0, 10, 10), (1, -1), "must be positive"),
        ((0, 0, 10, 10), np.nan, "must be positive"),
    ],
)
def test_grid_of_an_unusable_extent(extent, resolution, complaint):
    with pytest.raises(InputError, match=complaint):
        Grid.of_extent(extent, resolution)
