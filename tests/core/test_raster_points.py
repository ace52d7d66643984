"""Writing points with elevations, whole or not at all; files of samples of either kind."""

import itertools

import numpy as np
import pytest

from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.raster import read_features, read_samples_file, write_points
from demsmith.core.raster.points import check_points_output

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

UTM31 = "EPSG:32631"


class CancelAt:
    """Cancels once this much has been reported."""

    def __init__(self, fraction):
        self.fraction, self.seen = fraction, []

    def report(self, fraction):
        self.seen.append(fraction)

    def cancelled(self):
        return bool(self.seen) and self.seen[-1] >= self.fraction


@pytest.mark.parametrize("extension", ["gpkg", "geojson", "csv"])
def test_written_points_come_back(tmp_path, extension):
    rng = np.random.default_rng(2)
    x, y, z = rng.uniform(4e5, 5e5, 500), rng.uniform(5e6, 6e6, 500), rng.normal(size=500)
    path = tmp_path / f"points.{extension}"
    assert write_points(path, x, y, z, crs=UTM31) == str(path)
    features = read_samples_file(path, source_crs=UTM31)
    # GeoJSON has 17 decimals, the others all digits.
    exact = 0 if extension != "geojson" else 1e-16
    np.testing.assert_allclose(features.points, np.column_stack([x, y, z]), rtol=0, atol=exact)
    assert [part.name for part in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("extension", ["gpkg", "geojson"])
def test_written_layer_for_others(tmp_path, extension):
    path = write_points(
        tmp_path / f"points.{extension}", [1.5], [2.5], np.float32([3.5]), crs=UTM31, field="ground"
    )
    dataset = gdal.OpenEx(path, gdal.OF_VECTOR)
    layer = dataset.GetLayer(0)
    feature = layer.GetNextFeature()
    assert layer.GetSpatialRef().GetAuthorityCode(None) == "32631"
    assert feature.GetField("ground") == 3.5
    assert feature.GetGeometryRef().GetPoint() == (1.5, 2.5, 3.5)
    feature = layer = dataset = None


def test_float32_elevations_keep_their_few_digits(tmp_path):
    path = write_points(tmp_path / "a.csv", [0.1], [1e7], np.float32([0.1]))
    assert (tmp_path / "a.csv").read_text() == "x,y,z\n0.1,10000000.0,0.1\n"
    assert read_samples_file(path).points[0].tolist() == [0.1, 1e7, 0.1]


def test_no_points(tmp_path):
    for extension in ("gpkg", "csv"):
        path = write_points(tmp_path / f"a.{extension}", [], [], [], crs=UTM31)
        with pytest.raises(InputError):
            read_samples_file(path)


def test_layer_without_crs(tmp_path):
    path = write_points(tmp_path / "a.gpkg", [1], [2], [3])
    assert read_features(path).crs == ""


@pytest.mark.parametrize("crs", ["", "+proj=laea +lat_0=45 +lon_0=7 +datum=WGS84"])
def test_geojson_cannot_tell_every_crs(tmp_path, crs):
    with pytest.raises(InputError, match="EPSG"):
        write_points(tmp_path / "a.geojson", [1], [2], [3], crs=crs)
    assert not list(tmp_path.iterdir())


def test_refused_outputs(tmp_path):
    with pytest.raises(InputError, match=r"shapefile.*\.gpkg"):
        write_points(tmp_path / "a.shp", [1], [2], [3])
    with pytest.raises(InputError, match="must end in"):
        write_points(tmp_path / "a.tif", [1], [2], [3])
    with pytest.raises(InputError, match="as many"):
        write_points(tmp_path / "a.csv", [1, 2], [2], [3])
    with pytest.raises(InputError, match="finite"):
        write_points(tmp_path / "a.csv", [1], [2], [np.nan])
    with pytest.raises(OutputError, match="no folder"):
        write_points(tmp_path / "none" / "a.csv", [1], [2], [3])
    (tmp_path / "a.gpkg").write_text("precious")
    with pytest.raises(OutputError, match="exists already"):
        write_points(tmp_path / "a.gpkg", [1], [2], [3])
    with pytest.raises(InputError, match="is an input"):
        check_points_output(tmp_path / "a.gpkg", inputs=[tmp_path / "a.gpkg"], overwrite=True)
    (tmp_path / "a.gpkg-wal").write_text("unfinished")
    with pytest.raises(OutputError, match="open in another program"):
        write_points(tmp_path / "a.gpkg", [1], [2], [3], overwrite=True)
    assert (tmp_path / "a.gpkg").read_text() == "precious"


@pytest.mark.parametrize("extension", ["gpkg", "geojson", "csv"])
def test_cancelled_writing_leaves_the_old_file(tmp_path, extension):
    path = tmp_path / f"a.{extension}"
    path.write_text("old")
    points = np.random.default_rng(1).random((3, 30_000))
    with pytest.raises(Cancelled):
        write_points(path, *points, crs=UTM31, overwrite=True, progress=CancelAt(0.3))
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_overwriting(tmp_path):
    path = tmp_path / "a.gpkg"
    write_points(path, [1], [2], [3], crs=UTM31)
    write_points(path, [4, 5], [2, 2], [3, 3], crs=UTM31, overwrite=True)
    assert read_features(path).points[:, 0].tolist() == [4, 5]
    assert read_features(path).notes == ()


def test_options_that_do_not_fit_the_file(tmp_path):
    table = write_points(tmp_path / "a.csv", [1], [2], [3])
    layer = write_points(tmp_path / "a.gpkg", [1], [2], [3], crs=UTM31)
    with pytest.raises(InputError, match="no layer"):
        read_samples_file(table, layer="points")
    with pytest.raises(InputError, match="is no table"):
        read_samples_file(layer, x="x")
    assert read_samples_file(table, field="z").points[0, 2] == 3


def test_many_points_in_order(tmp_path):
    """More than one block of features: order and place are kept across them."""
    n = 11_000
    values = np.arange(n, dtype=float)
    path = write_points(tmp_path / "a.gpkg", values, values + 1, values + 2, crs=UTM31)
    points = read_features(path, crs="EPSG:32632").points
    assert len(points) == n
    np.testing.assert_array_equal(points[:, 2], values + 2)
    assert all(one[0] < other[0] for one, other in itertools.pairwise(points))
