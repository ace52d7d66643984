"""*Reconstruct from samples*: points and lines out of vector layers of all kinds."""

import os

import numpy as np
import pytest
from gdal_reading import read
from qgis.core import (
    NULL,
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsGeometry,
    QgsPoint,
    QgsPointXY,
    QgsProcessingException,
    QgsProject,
    QgsRasterLayer,
    QgsVectorLayer,
)
from qgis_layers import (
    GROUND,
    LONLAT,
    SOUTH,
    UTM,
    WEST,
    assert_slope,
    line,
    make_layer,
    places,
    plane,
    points_with_field,
    points_with_z,
    save,
    to_lonlat,
)


@pytest.mark.parametrize("field", ["height:double", "ELEV:integer", "z:string"])
def test_points_whose_attribute_tells_by_its_name(make, field):
    result = make(INPUT=[points_with_field(field)], **GROUND)
    assert_slope(result)
    assert f"taken from attribute '{field.split(':')[0]}'" in result["WARNINGS"]
    assert (result["ROWS"], result["COLUMNS"]) == (30, 40)
    assert result["SAMPLES"] == len(places())
    assert result["CELLS_KNOWN"] + result["CELLS_FILLED"] == 1200
    assert result["SECONDS"] > 0


def test_points_whose_attribute_is_named(make):
    layer = points_with_field("Q7:double")
    assert_slope(make(INPUT=[layer], FIELD="q7", **GROUND))


def test_points_with_z_and_nothing_to_warn_of(make):
    result = make(INPUT=[points_with_z()], **GROUND)
    assert_slope(result)
    assert result["WARNINGS"] == ""


def test_many_points_of_one_feature(make):
    many = "MultiPointZ(" + ",".join(f"({x} {y} {plane(x, y)})" for x, y in places()) + ")"
    layer = make_layer("MultiPointZ", [(QgsGeometry.fromWkt(many), [])])
    assert_slope(make(INPUT=[layer], **GROUND))


def test_extent_is_that_of_the_samples(make):
    result = make(INPUT=[points_with_z()], RESOLUTION=10)
    assert_slope(result)


def test_ridge_and_valley_lines_rise_along_their_vertices(make):
    lines = [
        (line((0, 150, 100), (400, 150, 500)), []),
        (line((0, 5, 0), (200, 5, 0), (400, 5, 0)), []),
        (line((0, 295, 0), (400, 295, 0)), []),
    ]
    result = make(INPUT=[make_layer("LineStringZ", lines)], **GROUND)
    values = read(result["OUTPUT"])[0]
    assert values[15] == pytest.approx(np.linspace(105, 495, 40), abs=6)
    assert (np.diff(values[15]) > 0).all()
    assert values[15].mean() > values[[10, 20]].mean() + 30 > values[[1, 28]].mean() + 60


def test_contours_rise_on_one_side_and_fall_on_the_other(make):
    at = {5: 0, 105: 50, 195: 100, 295: 150, 395: 200}
    lines = [(line((x, -10), (x, 310)), [elevation]) for x, elevation in at.items()]
    layer = make_layer("LineString", lines, fields=("elev:double",))
    values = read(make(CONTOURS=[layer], **GROUND)["OUTPUT"])[0]
    assert (np.diff(values, axis=1) > 0).all()
    assert values == pytest.approx(np.tile(np.linspace(0, 200, 40), (30, 1)), abs=16)


def test_a_line_that_climbs_is_no_contour(make, tmp_path):
    layer = make_layer("LineStringZ", [(line((0, 0, 1), (9, 9, 50)), [])], name="crests")
    with pytest.raises(QgsProcessingException, match=r"'crests': contour 0 runs from 1 to 50 m"):
        make(CONTOURS=[layer], **GROUND)
    assert not os.listdir(tmp_path)


def test_samples_in_another_crs_than_the_result(make):
    shapes = [(QgsGeometry.fromPointXY(to_lonlat(x, y)), [float(plane(x, y))]) for x, y in places()]
    layer = make_layer("Point", shapes, crs=LONLAT, fields=("height:double",))
    assert_slope(make(INPUT=[layer], CRS=UTM, **GROUND))
    degrees = make(INPUT=[layer], RESOLUTION=0.0002)
    assert QgsRasterLayer(degrees["OUTPUT"]).crs() == QgsCoordinateReferenceSystem(LONLAT)
    assert read(degrees["OUTPUT"])[2][1] == pytest.approx(0.0002)


def test_filters_edits_and_selections_count(make):
    layer = points_with_z()
    low = QgsFeature(layer.fields())
    low.setGeometry(QgsGeometry(QgsPoint(WEST + 200, SOUTH + 150, -5000)))
    layer.startEditing()
    layer.addFeature(low)
    assert read(make(INPUT=[layer], **GROUND)["OUTPUT"])[0].min() < -4000
    layer.select([feature.id() for feature in layer.getFeatures() if feature.id() > 0])
    assert read(make(INPUT=[layer], **GROUND)["OUTPUT"])[0].min() < -4000
    assert_slope(make(INPUT=[layer], SELECTED_ONLY=True, **GROUND))
    layer.rollBack()


def test_a_filtered_file(make, tmp_path):
    path = save(points_with_field(), tmp_path / "points.gpkg")
    layer = QgsVectorLayer(path, "points")
    assert layer.setSubsetString("height < 300")
    result = make(INPUT=[layer], **GROUND)
    assert result["SAMPLES"] == layer.featureCount() < len(places())


def test_a_layer_of_the_project_by_its_id(make):
    layer = points_with_z()
    QgsProject.instance().addMapLayer(layer)
    assert_slope(make(INPUT=layer.id(), **GROUND))
    QgsProject.instance().removeMapLayer(layer.id())


def test_a_table_of_points(make, tmp_path):
    table = tmp_path / "points.csv"
    rows = [f"{x},{y},{plane(x, y)}" for x, y in places()]
    table.write_text("\n".join(["x,y,z", *rows]))
    assert_slope(make(INPUT=[str(table)], CRS=UTM, **GROUND))


def test_polygons_give_their_rings_and_curves_their_course(make):
    ring = f"CurvePolygonZ(CircularStringZ({WEST + 50} {SOUTH + 150} 70,{WEST + 350} "
    ring += f"{SOUTH + 150} 70,{WEST + 50} {SOUTH + 150} 70))"
    layer = make_layer("CurvePolygonZ", [(QgsGeometry.fromWkt(ring), [])])
    values = read(make(CONTOURS=[], INPUT=[layer], **GROUND)["OUTPUT"])[0]
    assert values == pytest.approx(70, abs=0.01)
    assert make(INPUT=[layer], **GROUND)["CELLS_KNOWN"] > 60


def test_what_has_no_elevation_is_left_out_and_told(make):
    shapes = [(QgsGeometry.fromPointXY(QgsPointXY(*xy)), [float(plane(*xy))]) for xy in places()]
    shapes[40] = (shapes[40][0], [NULL])
    shapes[41] = (QgsGeometry(), [5.0])
    layer = make_layer("Point", shapes, fields=("z:double",), name="heights")
    result = make(INPUT=[layer], **GROUND)
    assert_slope(result)
    assert (
        f"'heights': 1 of {len(places()) - 1} points and lines have no elevation"
        in result["WARNINGS"]
    )


def test_a_layer_without_crs_is_taken_to_be_the_outputs(make):
    result = make(INPUT=[points_with_z(crs="")], CRS=UTM, **GROUND)
    assert_slope(result)
    assert "it has no CRS; its coordinates are taken to be the output's" in result["WARNINGS"]


def test_features_beyond_the_reach_of_the_crs_are_left_out_and_told(make):
    shapes = [(QgsGeometry(QgsPoint(*place, 7)), []) for place in ((3, 42), (3.01, 42.01), (3, 95))]
    layer = make_layer("PointZ", shapes, crs=LONLAT)
    result = make(INPUT=[layer], CRS=UTM, RESOLUTION=100)
    assert "1 of 3 features lie where the CRS asked for does not reach" in result["WARNINGS"]
    assert result["SAMPLES"] == 2
