"""Reading points and lines with elevations from vector layers, and writing points."""

import numpy as np
import pytest
from support import hills, make_raster, truncate

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.raster import read_features, write_points

ogr = pytest.importorskip("osgeo.ogr", reason="GDAL is missing")
gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
osr = pytest.importorskip("osgeo.osr", reason="GDAL is missing")

UTM31 = "EPSG:32631"


class CancelAt:
    """Cancels once this much has been reported."""

    def __init__(self, fraction):
        self.fraction, self.seen = fraction, []

    def report(self, fraction):
        self.seen.append(fraction)

    def cancelled(self):
        return bool(self.seen) and self.seen[-1] >= self.fraction


def make_layer(path, shapes, *, fields=(), crs=UTM31, driver="GPKG", layer="samples", kind=None):
    """Write a layer by OGR itself, or add it to the file; returns the path as text.

    ``shapes`` are pairs of a WKT, geometry or ``None``, and a dict of attributes; ``fields`` are
    pairs of a name and an OGR type.
    """
    reference = None
    if crs:
        reference = osr.SpatialReference()
        reference.SetFromUserInput(crs)
        reference.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    dataset = (
        gdal.OpenEx(str(path), gdal.OF_VECTOR | gdal.OF_UPDATE)
        if path.exists()
        else gdal.GetDriverByName(driver).Create(str(path), 0, 0, 0, gdal.GDT_Unknown)
    )
    made = dataset.CreateLayer(layer, reference, ogr.wkbUnknown if kind is None else kind)
    for name, type_ in fields:
        made.CreateField(ogr.FieldDefn(name, type_))
    for wkt, attributes in shapes:
        feature = ogr.Feature(made.GetLayerDefn())
        if wkt is not None:
            feature.SetGeometry(ogr.CreateGeometryFromWkt(wkt) if isinstance(wkt, str) else wkt)
        for name, value in attributes.items():
            feature.SetField(name, value)
        made.CreateFeature(feature)
    feature = made = dataset = None
    return str(path)


def shape(kind, *vertices):
    """A geometry of vertices that no WKT can say."""
    geometry = ogr.Geometry(kind)
    for vertex in vertices:
        geometry.AddPoint(*vertex)
    return geometry


def test_points_and_lines_with_z(tmp_path):
    path = make_layer(
        tmp_path / "a.gpkg", [("POINT Z (1 2 3)", {}), ("LINESTRING Z (0 0 1, 5 0 2, 5 5 3)", {})]
    )
    features = read_features(path)
    np.testing.assert_array_equal(features.points, [[1, 2, 3]])
    (line,) = features.lines
    np.testing.assert_array_equal(line, [[0, 0, 1], [5, 0, 2], [5, 5, 3]])
    assert "UTM zone 31N" in features.crs
    assert features.notes == ()


@pytest.mark.parametrize(
    ("wkt", "points", "lines"),
    [
        ("MULTIPOINT Z ((1 1 1), (2 2 2))", 2, []),
        ("MULTILINESTRING Z ((0 0 1, 1 1 1), (2 2 2, 3 3 2, 4 4 2))", 0, [2, 3]),
        ("POLYGON Z ((0 0 1, 9 0 1, 9 9 1, 0 0 1), (5 1 1, 6 1 1, 6 2 1, 5 1 1))", 0, [4, 4]),
        ("MULTIPOLYGON Z (((0 0 1, 9 0 1, 9 9 1, 0 0 1)))", 0, [4]),
        ("GEOMETRYCOLLECTION Z (POINT Z (1 1 1), LINESTRING Z (0 0 1, 1 1 1))", 1, [2]),
        ("TIN Z (((0 0 0, 0 1 1, 1 1 2, 0 0 0)))", 0, [4]),
        ("POINT ZM (1 2 3 4)", 1, []),
        ("LINESTRING ZM (0 0 1 7, 1 1 1 8)", 0, [2]),
    ],
)
def test_geometries_are_split(tmp_path, wkt, points, lines):
    features = read_features(make_layer(tmp_path / "a.gpkg", [(wkt, {})]))
    assert len(features.points) == points
    assert [len(line) for line in features.lines] == lines


def test_measures_are_no_elevations(tmp_path):
    shapes = [
        ("POINT M (1 2 99)", {}),
        ("POINT ZM (1 2 3 99)", {}),
        ("LINESTRING M (0 0 9, 1 1 9)", {}),
    ]
    features = read_features(make_layer(tmp_path / "a.gpkg", shapes))
    np.testing.assert_array_equal(features.points, [[1, 2, 3]])
    assert "2 of 3" in features.notes[0]


def test_curves_become_lines_on_the_arc(tmp_path):
    shapes = [("CIRCULARSTRING Z (0 0 5, 1 1 5, 2 0 5)", {})]
    (line,) = read_features(make_layer(tmp_path / "a.gpkg", shapes)).lines
    assert len(line) > 10
    np.testing.assert_allclose(np.hypot(line[:, 0] - 1, line[:, 1]), 1)
    np.testing.assert_array_equal(line[:, 2], 5)


def test_attribute_by_its_name(tmp_path):
    path = make_layer(
        tmp_path / "a.gpkg",
        [("POINT (1 2)", {"Elev": 7, "id": 1}), ("LINESTRING (0 0, 1 1)", {"Elev": 8, "id": 2})],
        fields=[("id", ogr.OFTInteger), ("Elev", ogr.OFTInteger)],
    )
    features = read_features(path)
    assert features.points[0, 2] == 7
    np.testing.assert_array_equal(features.lines[0][:, 2], 8)
    assert "'Elev'" in features.notes[0]
    asked = read_features(path, field="ID")
    assert asked.points[0, 2] == 1
    assert asked.notes == ()


def test_attribute_asked_wins_over_z(tmp_path):
    path = make_layer(
        tmp_path / "a.gpkg", [("POINT Z (1 2 3)", {"elev": 7})], fields=[("elev", ogr.OFTReal)]
    )
    assert read_features(path).points[0, 2] == 3
    assert read_features(path, field="elev").points[0, 2] == 7


def test_all_zero_z_gives_way_to_the_attribute(tmp_path):
    path = make_layer(
        tmp_path / "a.gpkg",
        [("POINT Z (1 2 0)", {"elev": 7}), ("POINT Z (2 2 0)", {"elev": 9})],
        fields=[("elev", ogr.OFTReal)],
    )
    features = read_features(path)
    np.testing.assert_array_equal(features.points[:, 2], [7, 9])
    assert "every z of its geometries is 0" in features.notes[0]


def test_rival_attributes_are_named(tmp_path):
    path = make_layer(
        tmp_path / "a.gpkg",
        [("POINT (1 2)", {"height": 30, "ele": 500})],
        fields=[("height", ogr.OFTReal), ("ele", ogr.OFTReal)],
    )
    features = read_features(path)
    assert features.points[0, 2] == 500
    assert "'ele'" in features.notes[0]
    assert "'height'" in features.notes[0]


def test_text_attribute(tmp_path):
    path = make_layer(
        tmp_path / "a.gpkg",
        [("POINT (1 2)", {"h": text}) for text in ("12.5", " 13,5 ", "unknown")],
        fields=[("h", ogr.OFTString), ("when", ogr.OFTDate)],
    )
    features = read_features(path, field="h")
    np.testing.assert_array_equal(features.points[:, 2], [12.5, 13.5])
    assert "1 of 3" in features.notes[0]


def test_wrong_attributes(tmp_path):
    path = make_layer(
        tmp_path / "a.gpkg",
        [("POINT (1 2)", {"name": "peak"})],
        fields=[("name", ogr.OFTString), ("when", ogr.OFTDate)],
    )
    with pytest.raises(InputError, match=r"no attribute 'z'; it has: 'name', 'when'"):
        read_features(path, field="z")
    with pytest.raises(InputError, match="'name' of .* holds no numbers"):
        read_features(path, field="name")
    with pytest.raises(InputError, match="'when' of .* holds no numbers"):
        read_features(path, field="when")
    with pytest.raises(InputError, match="1 of 1 points and lines have no elevation"):
        read_features(path)


def test_unusable_features_are_left_out_and_counted(tmp_path):
    path = make_layer(
        tmp_path / "a.gpkg",
        [
            ("POINT Z (1 2 3)", {}),
            (None, {}),
            ("POINT EMPTY", {}),
            ("MULTILINESTRING Z EMPTY", {}),
            ("POINT (5 5)", {}),
            (shape(ogr.wkbPoint25D, (1, 2, np.nan)), {}),
            (shape(ogr.wkbLineString25D, (0, 0, 1), (1, 1, np.nan), (2, 2, 3)), {}),
        ],
    )
    features = read_features(path)
    np.testing.assert_array_equal(features.points, [[1, 2, 3]])
    assert features.lines == ()
    assert "3 of 4 points and lines have no elevation" in features.notes[0]


def test_null_attributes(tmp_path):
    path = make_layer(
        tmp_path / "a.gpkg",
        [("POINT (1 2)", {"z": 4.0}), ("POINT (1 3)", {})],
        fields=[("z", ogr.OFTReal)],
    )
    np.testing.assert_array_equal(read_features(path, field="z").points, [[1, 2, 4]])


@pytest.mark.parametrize(("driver", "name"), [("GPKG", "a.gpkg"), ("GeoJSON", "a.geojson")])
def test_reprojection_keeps_easting_first(tmp_path, driver, name):
    # UTM 31's central meridian is 3° E; the equator is at northing 0.
    shapes = [("POINT Z (3 0 50)", {}), ("LINESTRING Z (3 0 1, 3 1 2)", {})]
    path = make_layer(tmp_path / name, shapes, driver=driver, crs="EPSG:4326")
    features = read_features(path, crs=UTM31)
    np.testing.assert_allclose(features.points, [[500_000, 0, 50]], atol=1e-6)
    np.testing.assert_allclose(features.lines[0], [[500_000, 0, 1], [500_000, 110_530, 2]], atol=60)
    back = read_features(path)
    np.testing.assert_array_equal(back.points, [[3, 0, 50]])


def test_what_the_crs_does_not_reach_is_left_out(tmp_path):
    shapes = [("POINT Z (3 45 1)", {}), ("POINT Z (3 91 2)", {})]
    path = make_layer(tmp_path / "a.gpkg", shapes, crs="EPSG:4326")
    features = read_features(path, crs=UTM31)
    assert len(features.points) == 1
    assert "1 of 2 points and lines lie where" in features.notes[0]
    path = make_layer(tmp_path / "b.gpkg", shapes[1:], crs="EPSG:4326")
    with pytest.raises(InputError, match="does not reach"):
        read_features(path, crs=UTM31)


def test_no_crs(tmp_path):
    path = make_layer(tmp_path / "a.gpkg", [("POINT Z (3 0 1)", {})], crs=None)
    assert read_features(path).crs == ""
    taken = read_features(path, crs=UTM31)
    np.testing.assert_array_equal(taken.points, [[3, 0, 1]])
    assert "no CRS" in taken.notes[0]
    told = read_features(path, crs=UTM31, source_crs="EPSG:4326")
    np.testing.assert_allclose(told.points, [[500_000, 0, 1]], atol=1e-6)
    with pytest.raises(InputError, match="CRS cannot be understood"):
        read_features(path, crs="nonsense", source_crs=UTM31)


def test_heights_in_other_units_are_told(tmp_path):
    path = make_layer(tmp_path / "a.gpkg", [("POINT Z (3 0 1)", {})], crs="EPSG:4326+6360")
    features = read_features(path, crs="EPSG:32631+5773")
    assert features.points[0, 2] == 1
    assert "0.3048" in features.notes[0]


def test_several_layers(tmp_path):
    path = tmp_path / "a.gpkg"
    make_layer(path, [(None, {})], layer="table", kind=ogr.wkbNone)
    make_layer(path, [("POINT Z (1 1 1)", {})], layer="first")
    make_layer(path, [("POINT Z (2 2 2)", {})], layer="second")
    features = read_features(path)
    assert features.points[0, 2] == 1
    assert "'second'" in features.notes[0] and "'first' was read" in features.notes[0]
    chosen = read_features(path, layer="second")
    assert chosen.points[0, 2] == 2
    assert chosen.notes == ()
    with pytest.raises(InputError, match="no layer 'third', but .*'first', 'second'"):
        read_features(path, layer="third")


def test_only_attributes(tmp_path):
    path = make_layer(tmp_path / "a.gpkg", [(None, {})], kind=ogr.wkbNone)
    with pytest.raises(InputError, match="no geometries"):
        read_features(path)


def test_shapefile_and_its_zip(tmp_path):
    import zipfile

    folder = tmp_path / "shp"
    folder.mkdir()
    path = make_layer(
        folder / "samples.shp", [("POINT Z (1 2 3)", {})], driver="ESRI Shapefile",
        kind=ogr.wkbPoint25D,
    )  # fmt: skip
    np.testing.assert_array_equal(read_features(path).points, [[1, 2, 3]])
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        for part in folder.iterdir():
            archive.write(part, part.name)
    np.testing.assert_array_equal(read_features(tmp_path / "a.zip").points, [[1, 2, 3]])


def test_bad_files(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        read_features(tmp_path / "none.gpkg")
    (tmp_path / "empty.gpkg").touch()
    with pytest.raises(InputError, match="is empty"):
        read_features(tmp_path / "empty.gpkg")
    (tmp_path / "text.gpkg").write_text("no geopackage at all\n")
    with pytest.raises(InputError, match=r"text\.gpkg"):
        read_features(tmp_path / "text.gpkg")
    raster = make_raster(tmp_path / "dem.tif", hills())
    with pytest.raises(InputError, match="is a raster"):
        read_features(raster)
    with pytest.raises(InputError, match=r"folder"):
        read_features(tmp_path)


@pytest.mark.parametrize(("driver", "name"), [("GPKG", "a.gpkg"), ("GeoJSON", "a.geojson")])
@pytest.mark.parametrize("fraction", [0.02, 0.5, 0.95])
def test_truncated_files(tmp_path, driver, name, fraction):
    shapes = [(f"POINT Z ({n} {n} {n})", {"name": "x" * 50}) for n in range(3000)]
    path = make_layer(tmp_path / name, shapes, driver=driver, fields=[("name", ogr.OFTString)])
    truncate(path, fraction)
    with pytest.raises(InputError, match=r"a\.g"):
        read_features(path)


def test_cancelling_and_progress(tmp_path):
    n = 12_000
    path = write_points(tmp_path / "a.gpkg", *np.random.default_rng(1).random((3, n)), crs=UTM31)
    heard = CancelAt(2)
    read_features(path, crs="EPSG:4326", progress=heard)
    assert len(heard.seen) >= 3
    assert heard.seen == sorted(heard.seen) and heard.seen[-1] <= 1
    with pytest.raises(Cancelled):
        read_features(path, progress=CancelAt(0.1))


def test_exceptions_of_gdal_make_no_difference(tmp_path):
    shapes = [("POINT Z (1 2 3)", {}), ("POINT Z (1 91 3)", {})]
    path = make_layer(tmp_path / "a.gpkg", shapes, crs="EPSG:4326")
    (tmp_path / "text.gpkg").write_text("no geopackage\n")
    modules = (gdal, ogr, osr)
    before = [module.GetUseExceptions() for module in modules]
    for module in modules:
        module.UseExceptions()
    try:
        assert len(read_features(path, crs=UTM31).points) == 1
        with pytest.raises(InputError):
            read_features(tmp_path / "text.gpkg")
        written = write_points(tmp_path / "b.gpkg", [1], [2], [3], crs=UTM31)
        assert read_features(written, crs="EPSG:4326").points[0, 2] == 3
        assert ogr.GetUseExceptions()
    finally:
        for module, used in reversed([*zip(modules, before, strict=True)]):
            if not used:
                module.DontUseExceptions()
