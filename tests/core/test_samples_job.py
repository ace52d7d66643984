"""Terrain from files to a file: grids, reference systems, data types, all outputs or none."""

import json
import os

import numpy as np
import pytest
from support import digest, hills, make_raster

from demsmith import Grid, Samples, from_samples, samples_file
from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.raster.crs import reproject
from demsmith.core.samples import SampleOptions

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

UTM = "EPSG:32631"
EXTENT = (300000, 4700000, 301200, 4700900)
FAST = SampleOptions(variant="relaxed")


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


def make_image(path, pixels):
    oiio = pytest.importorskip("OpenImageIO", reason="OpenImageIO is missing")
    pixels = np.atleast_3d(pixels)
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], str(pixels.dtype))
    spec.attribute("oiio:UnassociatedAlpha", 1)
    image = oiio.ImageOutput.create(str(path))
    assert image.open(str(path), spec) and image.write_image(np.ascontiguousarray(pixels))
    image.close()
    return path


def made(result):
    """Read an output; nothing in it may be void."""
    back = raster.read(result.output)
    assert not back.void.any()
    assert back.values.shape == (result.rows, result.columns)
    return back


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


# --- thinned rasters -----------------------------------------------------------------------------


def thinned(path, *, dtype="int16", nodata=-9999, **options):
    values = hills(60, 80, dtype=dtype)
    lost = np.random.default_rng(1).random(values.shape) > 0.1
    return make_raster(path, np.where(lost, nodata, values).astype(dtype), nodata=nodata, **options)


@pytest.mark.parametrize("dtype", ["int16", "float32", "float64"])
def test_a_thinned_raster_comes_back_complete(tmp_path, dtype):
    source = thinned(tmp_path / "in.tif", dtype=dtype)
    before = raster.read(source)
    result = samples_file(source, tmp_path / "out.tif")
    back = made(result)
    assert back.grid == before.grid and back.values.dtype == dtype
    np.testing.assert_array_equal(back.values[~before.void], before.values[~before.void])
    assert result.samples == result.cells_known == (~before.void).sum()
    truth = hills(60, 80)
    assert np.abs(back.values - truth).mean() < 0.1 * np.abs(truth - truth.mean()).mean()


def test_floating_point_if_asked(tmp_path):
    source = thinned(tmp_path / "in.tif")
    whole = made(samples_file(source, tmp_path / "a.tif", options=FAST))
    options = SampleOptions(variant="relaxed", float_output=True)
    real = made(samples_file(source, tmp_path / "b.tif", options=options))
    assert (whole.values.dtype, real.values.dtype) == (np.int16, np.float32)
    np.testing.assert_array_equal(whole.values, np.rint(real.values))


def test_scaled_elevations_are_real_ones(tmp_path):
    """Stored in decimetres above 1000 m: the options speak of metres, the file of decimetres."""

    def scaled(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(1000)

    source = thinned(tmp_path / "in.tif", setup=scaled)
    before = raster.read(source)
    back = made(samples_file(source, tmp_path / "out.tif"))
    assert (back.meta.scale, back.meta.offset) == (0.1, 1000)
    np.testing.assert_array_equal(back.values[~before.void], before.values[~before.void])
    assert abs(back.values - hills(60, 80)).mean() < 30
    other = samples_file(source, tmp_path / "o.tif", resolution=1 / 1200, crs="EPSG:4326")
    assert made(other).values.mean() == pytest.approx(1000 + 0.1 * back.values.mean(), abs=2)


def test_a_raster_on_another_grid_gives_points(tmp_path):
    """Known cells of 30 m become samples of a finer grid in another place."""
    values = np.full((30, 40), -9999, np.int16)
    values[::5, ::5] = 700
    source = make_raster(
        tmp_path / "in.tif", values, nodata=-9999, geotransform=(300000, 30, 0, 4700900, 0, -30),
        crs=UTM,
    )  # fmt: skip
    result = samples_file(
        source, tmp_path / "out.tif", extent=(300300, 4700000, 301200, 4700900), resolution=10,
        options=FAST,
    )  # fmt: skip
    back = made(result)
    assert back.values.dtype == np.float32 and (back.values == 700).all()
    assert (result.samples, result.samples_outside) == (6 * 6, 6 * 2)
    warped = samples_file(
        source, tmp_path / "w.tif", resolution=0.001, crs="EPSG:4326", options=FAST
    )
    assert warped.samples == 48 and "4326" in made(warped).grid.crs


def test_points_beside_a_raster(tmp_path):
    """The raster's grid; a point is believed rather than its cell."""
    source = thinned(tmp_path / "in.tif")
    before = raster.read(source)
    row, column = (int(each[0]) for each in np.nonzero(~before.void))
    x, y = before.grid.xy(row, column)
    result = samples_file([Samples([(x, y, 4321.5)]), source], tmp_path / "out.tif", options=FAST)
    back = made(result)
    assert back.grid == before.grid and back.values[row, column] == 4321.5
    assert result.samples == (~before.void).sum() + 1


def test_rasters_are_read_as_elsewhere(tmp_path):
    values = hills(20, 30)
    values[5:15, 5:15] = 7
    bands = np.stack([np.zeros_like(values), values])
    source = make_raster(tmp_path / "in.tif", bands)
    result = samples_file(source, tmp_path / "out.tif", band=2, nodata=[7])
    assert result.cells_filled == 100
    with pytest.raises(InputError, match="band 3 asked"):
        samples_file(source, tmp_path / "no.tif", band=3)
    with pytest.raises(InputError, match="no known cell"):
        samples_file(source, tmp_path / "no.tif", band=1, nodata=0)


# --- sketches and noise --------------------------------------------------------------------------


def test_a_sketch_in_its_extent(tmp_path):
    pixels = np.zeros((9, 12), np.uint8)
    pixels[2, 2:10] = 255
    pixels[6, :] = 51
    sketch = make_image(tmp_path / "s.png", pixels)
    result = samples_file(
        (), tmp_path / "out.tif", sketch=sketch, sketch_low=100, sketch_high=600, extent=EXTENT,
        crs=UTM,
    )  # fmt: skip
    back = made(result)
    assert back.grid.geotransform == (300000, 100, 0, 4700900, 0, -100)
    assert (back.values[2, 2:10] == 600).all()
    np.testing.assert_allclose(back.values[6], 200, atol=1e-4)
    assert result.cells_known == 8 + 12 and result.samples == 0
    finer = samples_file(
        (), tmp_path / "f.tif", sketch=sketch, extent=EXTENT, resolution=10, options=FAST
    )
    assert finer.cells_known == 100 * result.cells_known


def test_what_is_unpainted(tmp_path):
    gray = np.full((4, 4), 255, np.uint8)
    gray[0, 0] = 0
    plain = make_image(tmp_path / "plain.png", gray)
    seen = np.stack([gray, np.where(gray == 255, 0, 255).astype(np.uint8)], axis=2)
    veiled = make_image(tmp_path / "veiled.png", seen)

    def known(sketch, **how):
        out = tmp_path / "out.tif"
        return samples_file((), out, sketch=sketch, overwrite=True, **how).cells_known

    assert known(plain) == 15
    assert known(plain, sketch_background="white") == 1
    assert known(plain, sketch_background="none") == 16
    assert known(veiled) == known(veiled, sketch_background="none") == 1
    blank = make_image(tmp_path / "blank.png", np.zeros((4, 4), np.uint8))
    with pytest.raises(InputError, match="all of it is black"):
        known(blank)
    with pytest.raises(InputError, match="background is 'grey'"):
        known(plain, sketch_background="grey")
    with pytest.raises(InputError, match="must be finite"):
        known(plain, sketch_high=np.inf)
    with pytest.raises(InputError, match="does not exist"):
        known(tmp_path / "no.png")


def test_nothing_but_noise(tmp_path):
    for name, seed, threads in (("a", 3, 1), ("b", 3, 2), ("c", 4, 1)):
        result = samples_file(
            (), tmp_path / f"{name}.tif", extent=EXTENT, resolution=5, crs=UTM, threads=threads,
            options=SampleOptions(seed=seed),
        )  # fmt: skip
    assert (result.samples, result.cells_known) == (0, 0)
    assert np.ptp(made(result).values) > 200
    a, b, c = (digest(tmp_path / f"{name}.tif") for name in "abc")
    assert a == b != c


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
