"""How result layers look when QGIS loads them."""

import math
import os
from typing import ClassVar

from qgis.core import (
    QgsColorRampLegendNodeSettings,
    QgsColorRampShader,
    QgsPalettedRasterRenderer,
    QgsProcessingLayerPostProcessorInterface,
    QgsRasterBandStats,
    QgsRectangle,
)

from demsmith.algorithms.provider import ROOT

# Statistics are exact up to this many cells and sampled beyond, so that loading stays quick.
_SAMPLE_CELLS = 4_000_000
# A logarithmic ramp covers no more than this ratio of values: 0 has no logarithm.
_WIDEST = 1e8


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


class _Logarithmic(_Style):
    def postProcessLayer(self, layer, context, feedback):
        super().postProcessLayer(layer, context, feedback)
        _stretch_by_logarithm(layer)


class _Streams(_Style):
    def postProcessLayer(self, layer, context, feedback):
        super().postProcessLayer(layer, context, feedback)
        _keep_orders_found(layer)


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


def style_flow(path, context):
    """Give the layer of ``path`` blues by the logarithm of its areas when it is loaded."""
    _attach(path, context, _Logarithmic, "flow.qml")


def style_log_flow(path, context):
    """Give the layer of ``path`` these blues over its range, of logarithms, when it is loaded."""
    _attach(path, context, _Stretched, "flow.qml")


def style_standard_error(path, context):
    """Give the layer of ``path`` the colours of uncertainty by its logarithm when it is loaded."""
    _attach(path, context, _Logarithmic, "uncertainty.qml")


def style_directions(path, context):
    """Give the layer of ``path`` the classes of flow directions when it is loaded."""
    _attach(path, context, _Style, "directions.qml")


def style_catchment_flags(path, context):
    """Give the layer of ``path`` those classes of catchments that it has, when it is loaded."""
    _attach(path, context, _SourceMap, "catchment_flags.qml")


def style_stream_mask(path, context):
    """Show only the streams of the layer of ``path`` when it is loaded."""
    _attach(path, context, _Style, "stream_mask.qml")


def style_streams(path, context):
    """Give the lines of the layer of ``path`` widths by their order when it is loaded."""
    _attach(path, context, _Streams, "streams.qml")


def style_irradiance(path, context):
    """Give the layer of ``path`` the colours of sunlight, over its own range, when it is loaded."""
    _attach(path, context, _Stretched, "irradiance.qml")


def style_hours(path, context):
    """Give the layer of ``path`` the colours of hours of sun, over its range, when it is loaded."""
    _attach(path, context, _Stretched, "hours.qml")


def style_sky_view(path, context):
    """Give the layer of ``path`` grey tones for the sky it sees, over its range, when loaded."""
    _attach(path, context, _Stretched, "sky_view.qml")


def style_slope(path, context):
    """Give the layer of ``path`` colours from level to steep, over its range, when it is loaded."""
    _attach(path, context, _Stretched, "slope.qml")


def style_aspect(path, context):
    """Give the layer of ``path`` a colour for each point of the compass when it is loaded."""
    _attach(path, context, _Style, "aspect.qml")


def style_hillshade(path, context):
    """Show the layer of ``path`` in grey, made to be laid over others, when it is loaded."""
    _attach(path, context, _Style, "hillshade.qml")


def _attach(path, context, style, name):
    if context.willLoadLayerOnCompletion(path):
        context.layerToLoadOnCompletionDetails(path).setPostProcessor(style(name))


def _stretch(layer, *, symmetric=False):
    """Spread the layer's colour ramp over the values it has, or with 0 in the middle."""
    low, high = _range(layer)
    if symmetric:
        high = max(-low, high)
        low = -high
    if not low < high:  # flat: a ramp needs some room
        high = low + 1
    _set_range(layer, low, high).classifyColorRamp()
    layer.triggerRepaint()


def _stretch_by_logarithm(layer):
    """Spread the layer's colour ramp over the logarithms of its values, which are 0 or more."""
    low, high = _range(layer)
    if not high > 0:
        low, high = 1, 10
    low = max(low, high / _WIDEST)
    if not low < high:
        high = 10 * low
    ramp = _set_range(layer, low, high)
    colors, decades = ramp.sourceColorRamp(), math.log10(high / low)
    ramp.setColorRampItemList([
        QgsColorRampShader.ColorRampItem(
            value, colors.color(math.log10(value / low) / decades), _round_label(value)
        )
        for value in _round_values(low, high)
    ])  # fmt: skip
    legend = QgsColorRampLegendNodeSettings()
    legend.setUseContinuousLegend(False)  # which would be labelled as if it were linear
    ramp.setLegendSettings(legend)
    layer.triggerRepaint()


def _round_values(low, high):
    """List from low to high these and what is 1 or 3 times a power of ten between."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    between = [digit * 10.0**power for power in powers for digit in (1, 3)]
    # What lies close to an end would only crowd the legend.
    return [low, *(value for value in between if 1.5 * low < value < high / 1.5), high]


def _round_label(value):
    """Write three digits of a number, thousands apart."""
    digits = 2 - math.floor(math.log10(value))
    return f"{round(value, digits):,.{max(digits, 0)}f}".replace(",", " ")


def _range(layer):
    """Give the lowest and highest value of the layer's first band."""
    stats = QgsRasterBandStats
    found = layer.dataProvider().bandStatistics(
        1, stats.Min | stats.Max, QgsRectangle(), _SAMPLE_CELLS
    )
    return found.minimumValue, found.maximumValue


def _set_range(layer, low, high):
    """Tell the layer's renderer and its shader function the range; returns the latter."""
    renderer = layer.renderer()
    renderer.setClassificationMin(low)
    renderer.setClassificationMax(high)
    ramp = renderer.shader().rasterShaderFunction()
    ramp.setMinimumValue(low)
    ramp.setMaximumValue(high)
    return ramp


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


def _keep_orders_found(layer):
    """Take the orders out of a legend that no stream has."""
    renderer = layer.renderer()
    found = layer.uniqueValues(layer.fields().lookupField(renderer.classAttribute()))
    ranges = renderer.ranges()
    for place in reversed(range(len(ranges))):
        if not any(ranges[place].lowerValue() <= order < ranges[place].upperValue()
                   for order in found):  # fmt: skip
            renderer.deleteClass(place)
    layer.triggerRepaint()
