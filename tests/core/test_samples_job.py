"""Terrain from files to a file: grids, reference systems, data types, all outputs or none."""

import json
import os

import numpy as np
import pytest
from sample_files import EXTENT, FAST, UTM, made, thinned
from support import digest, hills, make_raster

from demsmith import Grid, Samples, from_samples, samples_file
from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.raster.crs import reproject

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")


def ground(x, y):
    """A slope of the UTM extent."""
    return 500 + 0.2 * (np.asarray(x) - 300000) - 0.1 * (np.asarray(y) - 4700000)


@pytest.fixture
def points():
    """Rows of x, y, elevation at 300 centres of cells of 10 m in the extent."""
    rng = np.random.default_rng(5)
    x = 300005 + 10 * rng.integers(0, 120, 300)
    y = 4700005 + 10 * rng.integers(0, 90, 300)
    return np.column_stack([x, y, ground(x, y)])


@pytest.fixture
def table(tmp_path, points):
    path = tmp_path / "points.csv"
    np.savetxt(path, points, delimiter=",", header="x,y,z", comments="", fmt="%.10g")
    return path


def geojson(path, *geometries, crs=UTM):
    """Write geometries of (kind, coordinates, attributes) as a vector file."""
    features = [
        {"type": "Feature", "properties": attributes,
         "geometry": {"type": kind, "coordinates": np.asarray(coordinates).tolist()}}
        for kind, coordinates, attributes in geometries
    ]  # fmt: skip
    layer = {"type": "FeatureCollection", "features": features,
             "crs": {"type": "name", "properties": {"name": crs}}}  # fmt: skip
    path.write_text(json.dumps(layer))
    return path


# --- grids ---------------------------------------------------------------------------------------


def test_grid_by_extent_and_resolution(tmp_path, table, points):
    result = samples_file(
        table, tmp_path / "out.tif", extent=EXTENT, resolution=10, crs=UTM, options=FAST
    )
    back = made(result)
    assert back.grid.geotransform == (300000, 10, 0, 4700900, 0, -10)
    assert "32631" in back.grid.crs and back.values.dtype == np.float32
    assert back.meta.unit == "m" and back.meta.nodata is None
    expected = from_samples(points, back.grid, options=FAST)
    np.testing.assert_array_equal(back.values, expected.values)
    assert (result.samples, result.samples_outside) == (300, 0)
    assert result.cells_known == expected.cells_known < 300
    assert result.cells_known + result.cells_filled == result.cells == 90 * 120
    assert json.loads(json.dumps(result.as_dict()))["output"] == str(tmp_path / "out.tif")


def test_grid_like_another_raster(tmp_path, table):
    like = make_raster(
        tmp_path / "like.tif", hills(30, 40), geotransform=(300000, 30, 0, 4700900, 0, -30), crs=UTM
    )
    result = samples_file([table], tmp_path / "out.tif", like=like, options=FAST)
    back, grid = made(result), raster.read(like).grid
    assert back.grid == grid and back.values.dtype == np.float32
    with pytest.raises(InputError, match="leave out extent, resolution and CRS"):
        samples_file([table], tmp_path / "no.tif", like=like, resolution=10)


def test_grid_of_the_samples(tmp_path, table):
    """Widened to multiples of the resolution."""
    result = samples_file(table, tmp_path / "out.tif", resolution=70, options=FAST)
    grid = made(result).grid
    x, _, _, top, _, _ = grid.geotransform
    assert x % 70 == top % 70 == 0
    assert x <= 300005 < x + 70 and top - 70 < 4700895 <= top
    assert result.samples_outside == 0


def test_a_resolution_for_each_way(tmp_path, table):
    back = made(samples_file(
        table, tmp_path / "out.tif", extent=EXTENT, resolution=(20, 50), crs=UTM, options=FAST
    ))  # fmt: skip
    assert back.values.shape == (18, 60)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({}, "give a resolution .in units of the CRS.; the samples are about 59.* example 20"),
        (dict(crs="EPSG:4326"), "give a resolution .in degrees.*"),
        (dict(resolution=0), "resolution 0 must be positive"),
        (dict(resolution=-3), "resolution -3 must be positive"),
        (dict(resolution=float("nan")), "resolution nan must be positive"),
        (dict(resolution=(1, 2, 3)), "3 parts"),
        (dict(resolution=1e-5), "GB of memory"),
        (dict(resolution=10, extent=(0, 0, 1e12, 1e12)), "GB of memory"),
        (dict(resolution=5000, extent=EXTENT), "coarser than the whole extent 1200 × 900"),
        (dict(resolution=5000), "coarser than the whole extent"),
        (dict(resolution=10000, crs="EPSG:4326", source_crs=UTM), "10000 degrees is coarser"),
        (dict(resolution=10, extent=(9, 0, 0, 5)), "empty"),
        (dict(resolution=10, extent=(0, 0, 5)), "3 numbers"),
        (dict(resolution=10, extent=(0, 0, 500, 500)), "none of 300 samples lies in the grid"),
        (dict(resolution=10, crs="EPSG:nonsense"), "CRS cannot be understood"),
    ],
)
def test_grids_of_no_use(tmp_path, table, asked, said):
    with pytest.raises(InputError, match=said):
        samples_file(table, tmp_path / "out.tif", **asked)
    assert not (tmp_path / "out.tif").exists()


def test_nothing_at_all_needs_a_grid(tmp_path):
    with pytest.raises(InputError, match="give an extent and a resolution"):
        samples_file((), tmp_path / "out.tif", resolution=10)
    with pytest.raises(InputError, match="give a resolution"):
        samples_file((), tmp_path / "out.tif", extent=EXTENT)


# --- reference systems ---------------------------------------------------------------------------


def test_another_crs_is_reprojected(tmp_path, points):
    """Points in degrees on a grid in metres: the plane is the one of the metres."""
    degrees = points.copy()
    degrees[:, :2] = reproject(points[:, :2], UTM, "EPSG:4326")
    path = geojson(
        tmp_path / "p.geojson", *(("Point", each, {}) for each in degrees), crs="EPSG:4326"
    )
    result = samples_file(path, tmp_path / "out.tif", extent=EXTENT, resolution=10, crs=UTM)
    back = made(result)
    expected = from_samples(points, back.grid)
    assert result.cells_known == expected.cells_known
    np.testing.assert_allclose(back.values, expected.values, atol=0.05)


def test_the_samples_crs_is_the_outputs(tmp_path, points):
    path = geojson(tmp_path / "p.geojson", *(("Point", each, {}) for each in points))
    result = samples_file(path, tmp_path / "out.tif", resolution=10, options=FAST)
    assert "32631" in made(result).grid.crs and result.warnings == ()


def test_a_table_in_degrees(tmp_path, points):
    table = tmp_path / "p.csv"
    xy = reproject(points[:, :2], UTM, "EPSG:4326")
    rows = np.column_stack([xy, points[:, 2]])
    np.savetxt(table, rows, delimiter=",", header="lon,lat,z", comments="", fmt="%.12g")
    result = samples_file(
        table, tmp_path / "out.tif", extent=EXTENT, resolution=10, crs=UTM,
        source_crs="EPSG:4326", options=FAST,
    )  # fmt: skip
    expected = from_samples(points, made(result).grid, options=FAST)
    np.testing.assert_allclose(made(result).values, expected.values, atol=0.05)


def test_degrees_are_not_square(tmp_path):
    """At 60° a cell of a geographic grid is half as wide as high: a peak is round on the ground."""
    path = tmp_path / "p.csv"
    angle = np.linspace(0, 2 * np.pi, 13)[:-1]
    ring = [(10 + 0.02 * np.cos(a), 60 + 0.01 * np.sin(a), 0) for a in angle]
    path.write_text("\n".join(f"{x},{y},{z}" for x, y, z in [*ring, (10, 60, 100)]))
    result = samples_file(
        path, tmp_path / "out.tif", extent=(9.96, 59.98, 10.04, 60.02), resolution=0.0008,
        crs="EPSG:4326", options=FAST,
    )  # fmt: skip
    values = made(result).values
    peak = np.unravel_index(values.argmax(), values.shape)
    east, north = values[peak[0], peak[1] + 10], values[peak[0] - 5, peak[1]]
    assert abs(east - north) < 6


# --- vector files --------------------------------------------------------------------------------


def test_lines_and_contours(tmp_path):
    x = np.linspace(300000, 301200, 9)

    def level(y, z):
        return ("LineString", np.column_stack([x, np.full(9, y)]), {"height": z})

    contours = geojson(
        tmp_path / "c.geojson", level(4700105, 100), level(4700305, 200), level(4700505, 300)
    )
    ridge = geojson(
        tmp_path / "l.geojson",
        ("LineString", [(300005, 4700805, 350), (301195, 4700805, 450)], {}),
    )
    result = samples_file(
        [ridge], tmp_path / "out.tif", contours=[contours], extent=EXTENT, resolution=10, crs=UTM
    )
    values = made(result).values
    np.testing.assert_array_equal(values[[79, 59, 39]], [[100] * 120, [200] * 120, [300] * 120])
    np.testing.assert_allclose(values[9], 350 + 100 * np.arange(120) / 119, atol=0.01)
    assert result.cells_known == 4 * 120 and result.samples == 3 * 9 + 2
    middle = values[:, 60]
    assert (np.diff(middle[39:86:4]) < -5).all()


def test_contours_are_lines_of_one_elevation(tmp_path):
    points = geojson(tmp_path / "p.geojson", ("Point", (300000, 4700000, 3), {}))
    with pytest.raises(InputError, match="holds points; contours are lines"):
        samples_file((), tmp_path / "out.tif", contours=points, resolution=10)
    slope = [(300000, 4700000, 3), (300100, 4700000, 4)]
    line = geojson(tmp_path / "l.geojson", ("LineString", slope, {}))
    with pytest.raises(InputError, match=r"l.geojson': contour 0 runs from 3 to 4 m"):
        samples_file((), tmp_path / "out.tif", contours=line, resolution=10)


def test_field_and_layer(tmp_path):
    path = geojson(tmp_path / "p.geojson",
                   ("Point", (300005, 4700005), {"one": 1, "two": 2}),
                   ("Point", (300095, 4700095), {"one": 3, "two": 4}))  # fmt: skip
    how = dict(resolution=10, options=FAST)
    result = samples_file(path, tmp_path / "out.tif", field="two", **how)
    assert made(result).values[[-1, 0], [0, -1]].tolist() == [2, 4]
    with pytest.raises(InputError, match="three"):
        samples_file(path, tmp_path / "no.tif", field="three", **how)
    with pytest.raises(InputError, match="attic"):
        samples_file(path, tmp_path / "no.tif", field="two", layer="attic", **how)


def test_samples_themselves(tmp_path, points, table):
    both = Samples(points[:150]), Samples(points[150:])
    how = dict(extent=EXTENT, resolution=10, crs=UTM, options=FAST)
    samples_file(both, tmp_path / "a.tif", **how)
    samples_file(table, tmp_path / "b.tif", **how)
    assert digest(tmp_path / "a.tif") == digest(tmp_path / "b.tif")


# --- elevations that mean none -------------------------------------------------------------------


@pytest.fixture
def dirty(tmp_path, points):
    """A table whose first four points hold what means no elevation, the last far away."""
    points[:3, 2] = -9999, -9999, -32768
    points[3] = 9e6, 9e6, 1e39
    path = tmp_path / "dirty.csv"
    np.savetxt(path, points, delimiter=",", header="x,y,z", comments="", fmt="%.10g")
    return path


def test_impossible_elevations_of_points_are_named(tmp_path, dirty):
    result = samples_file(dirty, tmp_path / "out.tif", resolution=10, options=FAST)
    huge, odd, *_ = result.warnings
    assert huge.endswith("dirty.csv': 1 sample holds values beyond 1e30; counted as voids")
    assert "dirty.csv': 3 samples hold values from -32768 to -9999, outside the -500 to" in odd
    assert odd.endswith("if they are voids, add --below -500")
    assert made(result).values.min() == -32768
    assert (result.rows, result.columns) == (90, 120)  # not as far as the point without elevation


@pytest.mark.parametrize("voids", [dict(nodata=(-9999, -32768)), dict(nodata=-9999, below=-10000)])
def test_elevations_that_mean_none_are_left_out(tmp_path, points, dirty, voids):
    how = dict(resolution=10, options=FAST)
    result = samples_file(dirty, tmp_path / "out.tif", **voids, **how)
    np.savetxt(tmp_path / "clean.csv", points[4:], delimiter=",", fmt="%.10g")
    clean = samples_file(tmp_path / "clean.csv", tmp_path / "clean.tif", **how)
    assert digest(tmp_path / "out.tif") == digest(tmp_path / "clean.tif")
    assert result.samples == clean.samples == 296
    assert not any("outside the -500" in warning for warning in result.warnings)
    given = samples_file(Samples(points), tmp_path / "given.tif", **voids, **how)
    assert digest(given.output) == digest(clean.output)
    given = samples_file(Samples(points), tmp_path / "odd.tif", **how)
    assert any(warning.startswith("3 samples hold values") for warning in given.warnings)


# --- maps and source map -------------------------------------------------------------------------


def test_maps(tmp_path, table):
    how = dict(extent=EXTENT, resolution=10, crs=UTM, options=FAST, overwrite=True)
    smooth = made(samples_file(table, tmp_path / "smooth.tif", **how)).values
    r_s = np.zeros((90, 120), np.float32)
    r_s[:, 60:] = 0.2
    path = make_raster(
        tmp_path / "r_s.tif", r_s, geotransform=(300000, 10, 0, 4700900, 0, -10), crs=UTM
    )
    rough = made(samples_file(table, tmp_path / "rough.tif", maps={"r_s": path}, **how)).values
    assert abs(rough - smooth)[:, 60:].mean() > 3 * abs(rough - smooth)[:, :50].mean()
    with pytest.raises(InputError, match="no map of colour"):
        samples_file(table, tmp_path / "no.tif", maps={"colour": path}, **how)
    with pytest.raises(InputError, match="cells"):
        samples_file(table, tmp_path / "no.tif", maps={"r_s": path}, **{**how, "resolution": 20})


def test_source_map(tmp_path, table):
    result = samples_file(
        table, tmp_path / "out.tif", resolution=10, source_map=tmp_path / "map.tif", options=FAST
    )
    back = raster.read(tmp_path / "map.tif")
    assert back.values.dtype == np.uint8 and back.grid == made(result).grid
    assert (back.values == 0).sum() == result.cells_known
    assert (back.values == 1).sum() == result.cells_filled


# --- outputs -------------------------------------------------------------------------------------


def test_outputs_that_cannot_be(tmp_path, table):
    how = dict(resolution=10, options=FAST)
    with pytest.raises(InputError, match="must be a GeoTIFF"):
        samples_file(table, tmp_path / "out.png", **how)
    with pytest.raises(OutputError, match="no folder"):
        samples_file(table, tmp_path / "no" / "out.tif", **how)
    with pytest.raises(InputError, match="different files"):
        samples_file(table, tmp_path / "out.tif", source_map=tmp_path / "." / "out.tif", **how)
    (tmp_path / "there.tif").write_text("precious")
    with pytest.raises(OutputError, match="exists"):
        samples_file(table, tmp_path / "there.tif", **how)
    assert (tmp_path / "there.tif").read_text() == "precious"
    source = thinned(tmp_path / "in.tif")
    with pytest.raises(InputError, match="is an input"):
        samples_file(source, source, overwrite=True)
    assert sorted(os.listdir(tmp_path)) == ["in.tif", "points.csv", "there.tif"]


@pytest.mark.parametrize("text", ["", "x,y,z\n", "x,y,z\n1,2,\n3,4,nan\n", "not a table"])
def test_tables_of_no_use(tmp_path, text):
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(InputError, match=r"bad\.csv"):
        samples_file(tmp_path / "bad.csv", tmp_path / "out.tif", resolution=1)
    with pytest.raises(InputError, match="does not exist"):
        samples_file(tmp_path / "no.csv", tmp_path / "out.tif", resolution=1)
    assert os.listdir(tmp_path) == ["bad.csv"]


@pytest.mark.parametrize("after", [0, 3, 8])
def test_cancelled_leaves_nothing(tmp_path, table, after):
    class Stop:
        seen = 0

        def report(self, fraction):
            self.seen += 1

        def cancelled(self):
            return self.seen > after

    with pytest.raises(Cancelled):
        samples_file(table, tmp_path / "out.tif", resolution=10, progress=Stop())
    assert os.listdir(tmp_path) == ["points.csv"]


def test_progress_only_grows(tmp_path, table):
    class Seen(list):
        report = list.append

        def cancelled(self):
            return False

    seen = Seen()
    samples_file(table, tmp_path / "out.tif", resolution=10, progress=seen)
    assert seen == sorted(seen) and seen[-1] == 1.0 and len(seen) > 10


def test_grids_without_georeference(tmp_path):
    cells = np.ma.masked_less(hills(20, 30), 400)
    result = samples_file(
        Samples(cells=cells), tmp_path / "out.tif", extent=(0, 0, 30, 20), resolution=1
    )
    assert result.samples == cells.count()
    made_here = from_samples(Samples(cells=cells), Grid((20, 30)))
    np.testing.assert_array_equal(made(result).values, made_here.values)
