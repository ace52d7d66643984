"""Vector layers of a slope, made in QGIS's memory, for the tools that take samples."""

import numpy as np
import pytest
from gdal_reading import read
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsCoordinateTransformContext,
    QgsFeature,
    QgsGeometry,
    QgsPoint,
    QgsPointXY,
    QgsRasterLayer,
    QgsVectorFileWriter,
    QgsVectorLayer,
)

UTM, LONLAT = "EPSG:32631", "EPSG:4326"
WEST, SOUTH = 500_000.0, 4_700_000.0
EXTENT = f"{WEST},{WEST + 400},{SOUTH},{SOUTH + 300} [{UTM}]"
GRID = (WEST, 10.0, 0.0, SOUTH + 300, 0.0, -10.0)
"""Geotransform of the extent in cells of 10 m."""
GROUND = {"EXTENT": EXTENT, "RESOLUTION": 10}


def plane(x, y):
    """Elevation of a slope that every interpolation has to find."""
    return 200 + 0.5 * (x - WEST) + 0.25 * (y - SOUTH)


def plane_of_cells():
    """Elevation of the slope at the cells' centres of `EXTENT` at 10 m."""
    row, column = np.mgrid[:30, :40]
    return plane(WEST + 10 * column + 5, SOUTH + 300 - 10 * row - 5)


def places(count=150, seed=3):
    """Scatter places over the extent, centres of cells, among them the four corner cells."""
    inner = np.random.default_rng(seed).choice(1200, count, replace=False)
    cells = sorted({0, 39, 1160, 1199, *inner})
    return [(WEST + 5 + 10 * (cell % 40), SOUTH + 5 + 10 * (cell // 40)) for cell in cells]


def make_layer(kind, shapes, *, crs=UTM, fields=(), name="samples"):
    """Make a memory layer; ``shapes`` are pairs of a geometry and a list of attributes."""
    declared = "".join(f"&field={field}" for field in fields)
    layer = QgsVectorLayer(f"{kind}?crs={crs}{declared}", name, "memory")
    features = []
    for geometry, attributes in shapes:
        feature = QgsFeature(layer.fields())
        feature.setGeometry(geometry)
        feature.setAttributes(list(attributes))
        features.append(feature)
    assert layer.dataProvider().addFeatures(features)[0]
    layer.updateExtents()
    return layer


def points_with_field(field="height:double", **options):
    """Make points of the slope, its elevation as an attribute."""
    shapes = [
        (QgsGeometry.fromPointXY(QgsPointXY(x, y)), [float(plane(x, y))]) for x, y in places()
    ]
    return make_layer("Point", shapes, fields=(field,), **options)


def points_with_z(**options):
    """Make points of the slope, its elevation as their z."""
    shapes = [(QgsGeometry(QgsPoint(x, y, plane(x, y))), []) for x, y in places()]
    return make_layer("PointZ", shapes, **options)


def table_in_memory():
    """Make a layer without geometries."""
    return QgsVectorLayer("NoGeometry?field=z:double", "table", "memory")


def line(*vertices):
    """Make a line over x, y or x, y, z from the south-western corner on."""
    return QgsGeometry.fromPolyline([QgsPoint(WEST + x, SOUTH + y, *z) for x, y, *z in vertices])


def save(layer, path):
    """Save a layer to a file; returns its path as text."""
    options = QgsVectorFileWriter.SaveVectorOptions()
    options.driverName = {".gpkg": "GPKG", ".shp": "ESRI Shapefile"}[path.suffix]
    done = QgsVectorFileWriter.writeAsVectorFormatV3(
        layer, str(path), QgsCoordinateTransformContext(), options
    )
    assert done[0] == QgsVectorFileWriter.WriterError.NoError, done
    return str(path)


def assert_slope(result):
    """Check that the terrain is the slope, on the grid of `EXTENT`; a cell beside is 5 m off."""
    values, _, geotransform, kind = read(result["OUTPUT"])
    assert geotransform == pytest.approx(GRID)
    assert kind is np.float32
    assert abs(values - plane_of_cells()).mean() < 2
    assert QgsRasterLayer(result["OUTPUT"]).crs() == QgsCoordinateReferenceSystem(UTM)


def to_lonlat(x, y):
    """Give longitude and latitude of a place."""
    transform = QgsCoordinateTransform(
        QgsCoordinateReferenceSystem(UTM), QgsCoordinateReferenceSystem(LONLAT),
        QgsCoordinateTransformContext(),
    )  # fmt: skip
    return transform.transform(x, y)
