"""Draw the models of ``models/`` anew, where their tools' parameters or defaults have changed.

Run it from anywhere: ``.venv/bin/python tools/make_model.py``. A model keeps a value for every
parameter that its tools need, as QGIS's model designer does; those not told here are the tools'
defaults. QGIS 3.22 saves models so that all later ones can read them.
"""

import os
import sys
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ["QT_HASH_SEED"] = "0"  # the same order of attributes every time

from qgis.core import (
    QgsApplication,
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildAlgorithm,
    QgsProcessingModelChildParameterSource,
    QgsProcessingModelOutput,
    QgsProcessingModelParameter,
    QgsProcessingParameterDateTime,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterNumber,
    QgsProcessingParameterRasterLayer,
)
from qgis.PyQt.QtCore import QPointF, QSizeF

import demsmith

FOLDER = Path(__file__).resolve().parents[1] / "models"
_HELP = {
    "ALG_DESC": "Fills the voids of a raw SRTM tile, then tells how much ground drains through "
    "each cell, where streams run, and how much sunlight falls on a day.",
    "INPUT": "Elevation model with voids, such as a raw SRTM tile. It is never changed.",
    "DATE": "The day whose sunlight is computed.",
    "THRESHOLD": "Upstream area from which on water runs in a stream.",
    "reconstruct:Elevation": "GeoTIFF of the elevations without voids.",
    "drainage:Drainage": "GeoTIFF of the area that drains through each cell, in m².",
    "drainage:Streams": "Lines with Strahler's order, length and upstream area.",
    "sunlight:Sunlight": "GeoTIFF of the day's irradiation under a clear sky, in Wh/m².",
}
_INPUT = QgsProcessingModelChildParameterSource.fromModelParameter
_FROM = QgsProcessingModelChildParameterSource.fromChildOutput


def main():
    """Draw and save all."""
    application = QgsApplication([], False)
    application.initQgis()
    plugin = demsmith.classFactory(None)
    plugin.initProcessing()
    model = srtm_to_drainage_and_sun()
    fine, problems = model.validate()
    if not fine:
        sys.exit("\n".join(problems))
    model.toFile(str(FOLDER / "srtm_to_drainage_and_sun.model3"))
    plugin.unload()


def srtm_to_drainage_and_sun():
    """Chain a raw SRTM tile with drainage, streams and sunlight."""
    model = QgsProcessingModelAlgorithm("SRTM to drainage and sunlight", "Chains", "chains")
    model.setHelpContent(_HELP)
    dates, numbers = QgsProcessingParameterDateTime.Type, QgsProcessingParameterNumber.Type
    _ask(model, QgsProcessingParameterRasterLayer("INPUT", "Raw SRTM tile"), (160, 60))
    _ask(
        model,
        QgsProcessingParameterNumber(
            "THRESHOLD", "Streams begin at [m²]", numbers.Double, 1e6, minValue=0
        ),
        (480, 60),
    )
    _ask(
        model,
        QgsProcessingParameterDateTime("DATE", "Day of the sunlight", dates.Date, "2024-06-20"),
        (800, 60),
    )
    _step(
        model, "reconstruct", "reconstructsrtm", "Reconstruct SRTM", (160, 180),
        inputs={"INPUT": _INPUT("INPUT")},
        outputs={"Elevation": "OUTPUT"},
    )  # fmt: skip
    _step(
        model, "drainage", "drainagearea", "Drainage area", (480, 300),
        inputs={"INPUT": _FROM("reconstruct", "OUTPUT"), "THRESHOLD": _INPUT("THRESHOLD")},
        outputs={"Drainage": "OUTPUT", "Streams": "STREAMS"},
    )  # fmt: skip
    _step(
        model, "sunlight", "solarirradiance", "Solar irradiance", (800, 300),
        inputs={"INPUT": _FROM("reconstruct", "OUTPUT"), "DATE": _INPUT("DATE")},
        outputs={"Sunlight": "OUTPUT"},
    )  # fmt: skip
    return model


def _ask(model, parameter, place):
    """Add a parameter of the model."""
    parameter.setHelp(_HELP[parameter.name()])
    component = QgsProcessingModelParameter(parameter.name())
    _put(component, place)
    model.addModelParameter(parameter, component)


def _step(model, name, tool, title, place, *, inputs, outputs):
    """Add a tool of Demsmith.

    Parameters
    ----------
    inputs : dict
        Sources by the tool's parameters.
    outputs : dict
        The tool's outputs by names in the model, which the layers will have.
    """
    step = QgsProcessingModelChildAlgorithm(f"demsmith:{tool}")
    step.setChildId(name)
    step.setDescription(title)
    _put(step, place)
    optional = QgsProcessingParameterDefinition.Flag.FlagOptional
    for parameter in step.algorithm().parameterDefinitions():
        if parameter.name() in inputs:
            step.addParameterSources(parameter.name(), [inputs[parameter.name()]])
        elif not parameter.isDestination() and not parameter.flags() & optional:
            value = QgsProcessingModelChildParameterSource.fromStaticValue(parameter.defaultValue())
            step.addParameterSources(parameter.name(), [value])
    made = {}
    for number, (output, source) in enumerate(outputs.items()):
        made[output] = QgsProcessingModelOutput(output, output)
        made[output].setChildId(name)
        made[output].setChildOutputName(source)
        made[output].setMandatory(True)
        _put(made[output], (place[0] + 60, place[1] + 100 + 60 * number))
    step.setModelOutputs(made)
    model.addChildAlgorithm(step)


def _put(component, place):
    component.setPosition(QPointF(*place))
    component.setSize(QSizeF(240, 40))


if __name__ == "__main__":
    main()
