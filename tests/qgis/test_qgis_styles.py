"""The styles of reconstruction: what QGIS reads in them, and what it draws by them."""

from pathlib import Path

import numpy as np
import pytest
from qgis.core import QgsMapRendererCustomPainterJob, QgsMapSettings, QgsRasterLayer, QgsVectorLayer
from qgis.PyQt.QtCore import QSize
from qgis.PyQt.QtGui import QColor, QImage, QPainter
from support import make_raster

from demsmith.algorithms.styling import _keep_categories_found, _keep_classes_found, _stretch
from demsmith.core.raster import Grid, write_polygons
from demsmith.core.report.pictures import TINTS, UNCERTAINTY
from demsmith.core.voids import LEFT, ORIGINAL, find_voids
from demsmith.core.voids.sources import SOURCE_COLORS, SOURCES

STYLES = Path(__file__).resolve().parents[2] / "styles"
UTM31 = "EPSG:32631"
SQUARE = (500_000.0, 10.0, 0.0, 4_700_000.0, 0.0, -10.0)


def styled(layer, name):
    assert layer.isValid()
    message, done = layer.loadNamedStyle(str(STYLES / name))
    assert done, message
    return layer


def drawn(layer, rows, columns):
    """Draw a layer on white, ten pixels a cell; returns a function from cell to colour."""
    settings = QgsMapSettings()
    settings.setLayers([layer])
    settings.setDestinationCrs(layer.crs())
    settings.setExtent(layer.extent())
    settings.setOutputSize(QSize(10 * columns, 10 * rows))
    settings.setBackgroundColor(QColor("white"))
    image = QImage(settings.outputSize(), QImage.Format.Format_ARGB32_Premultiplied)
    image.fill(QColor("white"))
    painter = QPainter(image)
    job = QgsMapRendererCustomPainterJob(settings, painter)
    job.renderSynchronously()
    painter.end()
    return lambda row, column: image.pixelColor(10 * column + 5, 10 * row + 5).getRgb()[:3]


def test_source_map_has_every_class_in_its_colour(plugin, tmp_path):
    codes = np.array([[source.code for source in SOURCES]], np.uint8)
    path = make_raster(tmp_path / "codes.tif", codes, geotransform=SQUARE, crs=UTM31)
    layer = styled(QgsRasterLayer(path, "sources"), "source_map.qml")
    classes = layer.renderer().classes()
    told = [(each.value, each.label, each.color.getRgb()[:3]) for each in classes]
    assert told == [(source.code, source.name, source.color[:3]) for source in SOURCES]
    colour = drawn(layer, 1, len(SOURCES))
    for column, source in enumerate(SOURCES):
        if source.code != ORIGINAL:  # which lets white shine through
            assert colour(0, column) == source.color[:3]
    del layer


def test_uncertainty_is_stretched_and_original_cells_are_clear(plugin, tmp_path):
    sigma = np.array([[0, 0.5, 8, 16]], np.float32)
    path = make_raster(tmp_path / "sigma.tif", sigma, geotransform=SQUARE, crs=UTM31)
    layer = styled(QgsRasterLayer(path, "sigma"), "uncertainty.qml")
    _stretch(layer)
    ramp = layer.renderer().shader().rasterShaderFunction()
    stops = [(item.value / 16, item.color.getRgb()[:3]) for item in ramp.colorRampItemList()]
    assert stops == list(UNCERTAINTY)
    colour = drawn(layer, 1, 4)
    assert colour(0, 0) == (255, 255, 255)
    assert colour(0, 2) == pytest.approx(UNCERTAINTY[2][1], abs=2)
    assert colour(0, 3) == pytest.approx(UNCERTAINTY[-1][1], abs=2)
    del layer


def test_voids_have_the_colours_of_their_sources(plugin, tmp_path):
    void = np.zeros((3, 2 * len(SOURCES) + 1), bool)
    void[1, 1::2] = True
    voids = find_voids(void)
    methods = ["" if each.code == LEFT else each.name for each in SOURCES]
    path = write_polygons(
        tmp_path / "voids.gpkg", voids, Grid(void.shape, SQUARE, UTM31), {"method": methods}
    )
    layer = styled(QgsVectorLayer(path, "voids", "ogr"), "voids.qml")
    categories = {each.value(): each for each in layer.renderer().categories()}
    assert set(categories) == set(methods) - {"original"}
    for source, method in zip(SOURCES[1:], methods[1:], strict=True):
        assert categories[method].label() == source.name
        assert (
            categories[method].symbol().symbolLayer(0).strokeColor().getRgb()[:3]
            == (source.color[:3])
        )
    colour = drawn(layer, 1, 2 * len(SOURCES) - 1)
    tint = 70 / 255
    for number, source in enumerate(SOURCES[1:], start=1):
        mixed = [255 + tint * (channel - 255) for channel in source.color[:3]]
        assert colour(0, 2 * number) == pytest.approx(mixed, abs=3), source.name
    del layer


def test_legends_keep_what_is_there(plugin, tmp_path):
    codes = np.array([[0, 0, 5, 11]], np.uint8)
    path = make_raster(tmp_path / "codes.tif", codes, geotransform=SQUARE, crs=UTM31)
    layer = styled(QgsRasterLayer(path, "sources"), "source_map.qml")
    _keep_classes_found(layer)
    assert [each.value for each in layer.renderer().classes()] == [0, 5, 11]
    assert drawn(layer, 1, 4)(0, 2) == SOURCE_COLORS[5][:3]
    voids = find_voids(codes > 0)
    grid = Grid(codes.shape, SQUARE, UTM31)
    path = write_polygons(tmp_path / "voids.gpkg", voids, grid, {"method": ["auxiliary 1"]})
    layer = styled(QgsVectorLayer(path, "voids", "ogr"), "voids.qml")
    _keep_categories_found(layer)
    assert [each.value() for each in layer.renderer().categories()] == ["auxiliary 1"]
    assert drawn(layer, 1, 2)(0, 0) != (255, 255, 255)
    del layer


def test_terrain_is_tinted_as_in_reports(plugin, tmp_path):
    values = np.arange(20, dtype=np.float32).reshape(4, 5)
    path = make_raster(tmp_path / "z.tif", values, geotransform=SQUARE, crs=UTM31)
    layer = styled(QgsRasterLayer(path, "z"), "terrain.qml")
    ramp = layer.renderer().shader().rasterShaderFunction()
    stops = [(item.value / 1000, item.color.getRgb()[:3]) for item in ramp.colorRampItemList()]
    assert stops == list(TINTS)
    del layer
