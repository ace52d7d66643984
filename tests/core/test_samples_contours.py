"""Contours: uphill on one side, downhill on the other, in every variant."""

import numpy as np
import pytest
from scenes import fractal

from demsmith import Grid, Samples, from_samples

GRID = Grid.of_extent((-600, -600, 600, 600), 10)
VARIANTS = ("converged", "relaxed", "weighted", "paper")
RADII = np.arange(100, 600, 100)
ANGLE = np.linspace(0, 2 * np.pi, 181)


def circle(radius, elevation):
    ring = [radius * np.cos(ANGLE), radius * np.sin(ANGLE), np.full(ANGLE.size, elevation)]
    return np.column_stack(ring)


def distance():
    """Of each cell's centre from the middle."""
    row, column = np.indices(GRID.shape)
    return np.hypot(*GRID.xy(row, column))


@pytest.fixture(scope="module", params=VARIANTS)
def cone(request):
    """A cone of slope 2, 1000 m high, from its contours every 200 m."""
    rings = [circle(radius, 1000 - 2.0 * radius) for radius in RADII]
    return from_samples(Samples(contours=rings), GRID, variant=request.param)


def test_elevation_falls_from_contour_to_contour(cone):
    """Means of rings 20 m wide: none is as high as the one within, so there is no terrace."""
    rings = [
        cone.values[(distance() >= inner) & (distance() < inner + 20)].mean()
        for inner in range(100, 500, 20)
    ]
    fall = -np.diff(rings)
    assert fall.min() > 10  # the cone falls by 40


def test_between_contours_the_slope_is_the_cones(cone):
    between = (distance() > 110) & (distance() < 490)
    error = cone.values - (1000 - 2 * distance())
    assert np.sqrt(np.square(error[between]).mean()) < 25
    assert cone.values[between].max() < 810 and cone.values[between].min() > 0


def test_the_summit_is_above_the_highest_contour(cone):
    summit = cone.values[distance() < 70]
    assert np.median(summit) > 800 + 5
    assert summit.max() < 1000


def test_outside_the_ground_falls_on(cone):
    beside = (distance() > 512) & (distance() < 528)
    assert cone.values[beside].mean() < -3


def test_only_contours_are_known(cone):
    """What the treatment adds beside them is made, not measured."""
    assert abs(cone.values[cone.known] - (1000 - 2 * distance()[cone.known])).max() <= 2 * 7.1
    assert set(np.unique(cone.values[cone.known])) == set(1000 - 2.0 * RADII)
    assert 8 * RADII.sum() / 10 * 0.6 < cone.cells_known < 8 * RADII.sum() / 10


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_basin_is_below_its_lowest_contour(variant):
    rings = [circle(radius, 2.0 * radius) for radius in RADII]
    made = from_samples(Samples(contours=rings), GRID, variant=variant, datum=-50)
    assert np.median(made.values[distance() < 70]) < 200 - 5
    assert made.values.min() > -50 - 1


@pytest.mark.parametrize("variant", ["relaxed", "weighted", "paper"])
def test_as_lines_the_same_rings_have_a_flat_summit(variant):
    """What the treatment is for: without it there is no way to know up from down."""
    rings = [circle(radius, 1000 - 2.0 * radius) for radius in RADII]
    made = from_samples(Samples(lines=rings), GRID, variant=variant)
    assert np.median(made.values[distance() < 70]) <= 800 + 0.01


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_spot_height_within_the_highest_contour(variant):
    rings = [circle(radius, 1000 - 2.0 * radius) for radius in RADII]
    made = from_samples(Samples([(5, 5, 980)], contours=rings), GRID, variant=variant)
    assert made.values[59, 60] == 980
    assert np.median(made.values[distance() < 70]) > 805


@pytest.fixture(scope="module")
def mapped():
    """Fractal ground of 1000 m relief and its contours every 50 m, by GDAL."""
    gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
    from osgeo import ogr

    ground = fractal((150, 200), seed=4).astype(np.float32)
    dataset = gdal.GetDriverByName("MEM").Create("", 200, 150, 1, gdal.GDT_Float32)
    dataset.SetGeoTransform((0, 30, 0, 4500, 0, -30))
    dataset.GetRasterBand(1).WriteRaster(0, 0, 200, 150, ground.tobytes())
    source = ogr.GetDriverByName("Memory").CreateDataSource("")
    layer = source.CreateLayer("contours")
    layer.CreateField(ogr.FieldDefn("z", ogr.OFTReal))
    gdal.ContourGenerate(dataset.GetRasterBand(1), 50, 0, [], 0, 0, layer, -1, 0)
    lines = []
    for feature in layer:
        vertices = np.array(feature.geometry().GetPoints())[:, :2]
        lines.append(np.column_stack([vertices, np.full(len(vertices), feature["z"])]))
    return ground, lines


@pytest.mark.parametrize("variant", ["relaxed", "weighted", "paper"])
def test_contours_of_a_whole_landscape(mapped, variant):
    """Against the same lines without the treatment: less error, and hardly a terrace."""
    ground, lines = mapped
    grid = Grid.of_extent((0, 0, 6000, 4500), 30)
    made, plain = (
        from_samples(Samples(**{kind: lines}), grid, variant=variant).values
        for kind in ("contours", "lines")
    )
    error, plain_error = (np.sqrt(np.square(each - ground).mean()) for each in (made, plain))
    flat, plain_flat = (np.mean(abs(np.diff(each)) < 0.01) for each in (made, plain))
    assert error < (0.95 if variant == "relaxed" else 0.85) * plain_error
    assert flat < plain_flat and flat < 0.12
