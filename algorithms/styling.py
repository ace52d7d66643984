"""How result layers look when QGIS loads them."""

import os
from typing import ClassVar

from qgis.core import QgsProcessingLayerPostProcessorInterface, QgsRasterBandStats, QgsRectangle

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


class _Terrain(_Style):
    def postProcessLayer(self, layer, context, feedback):
        super().postProcessLayer(layer, context, feedback)
        _stretch(layer)


def style_terrain(path, context):
    """Give the layer of ``path`` the colours of terrain, over its own range, when it is loaded."""
    _attach(path, context, _Terrain, "terrain.qml")


def style_source_map(path, context):
    """Give the layer of ``path`` the classes of a source map when it is loaded."""
    _attach(path, context, _Style, "source_map.qml")


def style_sample_map(path, context):
    """Give the layer of ``path`` the classes of a map of samples when it is loaded."""
    _attach(path, context, _Style, "sample_map.qml")


def _attach(path, context, style, name):
    if context.willLoadLayerOnCompletion(path):
        context.layerToLoadOnCompletionDetails(path).setPostProcessor(style(name))


def _stretch(layer):
    """Spread the layer's colour ramp over the values it has."""
    stats = QgsRasterBandStats
    found = layer.dataProvider().bandStatistics(
        1, stats.Min | stats.Max, QgsRectangle(), _SAMPLE_CELLS
    )
    low, high = found.minimumValue, found.maximumValue
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
