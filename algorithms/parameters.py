"""Processing parameters made from the core's options, and options read back from them."""

from qgis.core import (
    NULL,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterNumber,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterString,
)
from qgis.PyQt.QtCore import QCoreApplication

# The widget with profiles and key-value rows that QGIS's own GDAL tools use.
_CREATION_OPTIONS_WIDGET = {
    "widget_wrapper": {
        "class": "processing.algs.gdal.ui.RasterOptionsWidget.RasterOptionsWidgetWrapper"
    }
}


def tr(text):
    """Translate a text of Demsmith."""
    return QCoreApplication.translate("Demsmith", text)


def add_options(algorithm, options_class):
    """Add a parameter for every option: the common ones first, the advanced ones folded."""
    for spec in sorted(_specifications(options_class), key=lambda spec: spec.advanced):
        add(algorithm, _parameter(spec), help_text=spec.help, advanced=spec.advanced)


def add(algorithm, parameter, *, help_text, advanced=False):
    """Add a parameter with its help, folded away if ``advanced``."""
    parameter.setHelp(tr(help_text))
    if advanced:
        parameter.setFlags(parameter.flags() | QgsProcessingParameterDefinition.Flag.FlagAdvanced)
    algorithm.addParameter(parameter)


def add_maps(tool):
    """Add a raster for each of MCMD's parameters that may change from cell to cell."""
    from demsmith.core.mcmd import MapFiles

    for spec in _specifications(MapFiles):
        layer = QgsProcessingParameterRasterLayer(
            _parameter_name(spec), tr(spec.title), optional=True
        )
        add(tool, layer, help_text=spec.help, advanced=True)


def number(name, title, *, kind=float, default=None, optional=False, **limits):
    """Make a parameter for one number of ``kind`` `int` or `float`.

    Keywords ``minValue`` and ``maxValue`` are its inclusive limits.
    """
    numbers = QgsProcessingParameterNumber.Type
    return QgsProcessingParameterNumber(
        name, tr(title), type=numbers.Integer if kind is int else numbers.Double,
        defaultValue=default, optional=optional, **limits,
    )  # fmt: skip


def creation_options():
    """Make the parameter for the creation options of the output's driver."""
    parameter = QgsProcessingParameterString(
        "CREATION_OPTIONS", tr("Creation options of the GeoTIFF"), defaultValue="", optional=True
    )
    parameter.setMetadata(_CREATION_OPTIONS_WIDGET)
    return parameter


def read_creation_options(text):
    """Split creation options as QGIS joins them.

    Returns
    -------
    tuple of str
        Such as ``("COMPRESS=ZSTD", "BIGTIFF=YES")`` for ``COMPRESS=ZSTD|BIGTIFF=YES``.
    """
    return tuple(each.strip() for each in text.split("|") if each.strip())


def read_options(algorithm, options_class, parameters, context):
    """Build the options of an operation from what the user gave.

    Raises
    ------
    demsmith.core.errors.InputError
        If a value is out of its range.
    """
    from demsmith.core.options import validate

    options = options_class(
        **{
            spec.name: _read(algorithm, spec, parameters, context)
            for spec in _specifications(options_class)
        }
    )
    validate(options)
    return options


def read_maps(tool, parameters, context):
    """Name the rasters of `add_maps` that were given; in the main thread, where layers are.

    Returns
    -------
    dict of str to str
        As the core's file functions take for ``maps``.

    Raises
    ------
    QgsProcessingException
        If a layer is no file that GDAL can open.
    """
    from demsmith.core.mcmd import MapFiles

    files = {
        spec.name: tool.raster_source(parameters, _parameter_name(spec), context)
        for spec in _specifications(MapFiles)
    }
    return MapFiles(**files).paths()


def read_number(algorithm, name, parameters, context, *, kind=float):
    """Read an optional number; `None` if it was left out."""
    if parameters.get(name) in (None, NULL, ""):
        return None
    if kind is int:
        return algorithm.parameterAsInt(parameters, name, context)
    return algorithm.parameterAsDouble(parameters, name, context)


def _specifications(options_class):
    # Not at the top: QGIS may load this file with a Python that is too old for the core.
    from demsmith.core.options import specifications

    return specifications(options_class)


def _parameter_name(spec):
    return (spec.flag or spec.name).upper()


def _parameter(spec):
    name, title = _parameter_name(spec), tr(spec.title)
    if spec.kind is bool:
        return QgsProcessingParameterBoolean(name, title, defaultValue=spec.default)
    if spec.kind is str:
        return QgsProcessingParameterEnum(
            name, title, options=list(spec.choices), defaultValue=spec.default,
            usesStaticStrings=True,
        )  # fmt: skip
    limits = {"minValue": spec.minimum, "maxValue": spec.maximum}
    return number(
        name, spec.title, kind=spec.kind, default=spec.default, optional=spec.default is None,
        **{key: value for key, value in limits.items() if value is not None},
    )  # fmt: skip


def _read(algorithm, spec, parameters, context):
    name = _parameter_name(spec)
    if spec.kind is bool:
        return algorithm.parameterAsBoolean(parameters, name, context)
    if spec.kind is str:
        return algorithm.parameterAsEnumString(parameters, name, context)
    if parameters.get(name) is None and spec.default is not None:
        return spec.default
    return read_number(algorithm, name, parameters, context, kind=spec.kind)
