"""How result layers look when QGIS loads them."""

import os
from typing import ClassVar

from qgis.core import (
    QgsPalettedRasterRenderer,
    QgsProcessingLayerPostProcessorInterface,
    QgsRasterBandStats,
    QgsRectangle,
)

from demsmith.algorithms.provider import ROOT

# Statistics are exact up to this many cells and sampled beyond, so that loading stays quick.
_SAMPLE_CELLS = 4_000_000


class _Style(QgsProcessingLayerPostProcessorInterface):
    """Styles one result layer, in the main thread, once it is in the project."""

    # QGIS keeps no reference to a post-processor: one that Python forgets is never called.
    alive: ClassVar = []

    def __init__(self, name):
        super().__init__()
        self._qml = os.path.join(ROOT, "styles", name)
        self.alive.append(self)

    def postProcessLayer(self, layer, context, feedback):
        layer.loadNamedStyle(self._qml)
        layer.triggerRepaint()
        self.alive.remove(self)


class _Stretched(_Style):
    def postProcessLayer(self, layer, context, feedback):
        super().postProcessLayer(layer, context, feedback)
        _stretch(layer)


class _Errors(_Style):
    def postProcessLayer(self, layer, context, feedback):
        super().postProcessLayer(layer, context, feedback)
        _stretch(layer, symmetric=True)


class _SourceMap(_Style):
    def postProcessLayer(self, layer, context, feedback):
        super().postProcessLayer(layer, context, feedback)
        _keep_classes_found(layer)


class _Voids(_Style):
    def postProcessLayer(self, layer, context, feedback):
        super().postProcessLayer(layer, context, feedback)
        _keep_categories_found(layer)


def style_terrain(path, context):
    """Give the layer of ``path`` the colours of terrain, over its own range, when it is loaded."""
    _attach(path, context, _Stretched, "terrain.qml")


def style_uncertainty(path, context):
    """Give the layer of ``path`` the colours of uncertainty, over its range, when it is loaded."""
    _attach(path, context, _Stretched, "uncertainty.qml")


def style_source_map(path, context):
    """Give the layer of ``path`` those classes of a source map that it has, when it is loaded."""
    _attach(path, context, _SourceMap, "source_map.qml")


def style_voids(path, context):
    """Give the layer of ``path`` the colours of what filled its voids when it is loaded."""
    _attach(path, context, _Voids, "voids.qml")


def style_sample_map(path, context):
    """Give the layer of ``path`` the classes of a map of samples when it is loaded."""
    _attach(path, context, _Style, "sample_map.qml")


def style_errors(path, context):
    """Give the layer of ``path`` colours for too low, right and too high when it is loaded."""
    _attach(path, context, _Errors, "errors.qml")


def _attach(path, context, style, name):
    if context.willLoadLayerOnCompletion(path):
        context.layerToLoadOnCompletionDetails(path).setPostProcessor(style(name))


def _stretch(layer, *, symmetric=False):
    """Spread the layer's colour ramp over the values it has, or with 0 in the middle."""
    stats = QgsRasterBandStats
    found = layer.dataProvider().bandStatistics(
        1, stats.Min | stats.Max, QgsRectangle(), _SAMPLE_CELLS
    )
    low, high = found.minimumValue, found.maximumValue
    if symmetric:
        high = max(-low, high)
        low = -high
    if not low < high:  # flat: a ramp needs some room
        high = low + 1
    renderer = layer.renderer()
    ramp = renderer.shader().rasterShaderFunction()
    ramp.setMinimumValue(low)
    ramp.setMaximumValue(high)
    ramp.classifyColorRamp()
    renderer.setClassificationMin(low)
    renderer.setClassificationMax(high)
    layer.triggerRepaint()


def _keep_classes_found(layer):
    """Take the classes out of a legend that no cell has."""
    renderer = layer.renderer()
    found = QgsPalettedRasterRenderer.classDataFromRaster(layer.dataProvider(), renderer.band())
    values = {each.value for each in found}
    kept = [each for each in renderer.classes() if each.value in values]
    layer.setRenderer(QgsPalettedRasterRenderer(layer.dataProvider(), renderer.band(), kept))
    layer.triggerRepaint()


def _keep_categories_found(layer):
    """Take the categories out of a legend that no feature has."""
    renderer = layer.renderer()
    found = layer.uniqueValues(layer.fields().lookupField(renderer.classAttribute()))
    categories = renderer.categories()
    for place in reversed(range(len(categories))):
        if categories[place].value() not in found:
            renderer.deleteCategory(place)
    layer.triggerRepaint()
