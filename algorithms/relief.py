"""The tool *Slope, aspect, hillshade*."""

from qgis.core import (
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterRasterDestination,
)

from demsmith.algorithms import styling
from demsmith.algorithms.parameters import add, add_options, read_options, tr
from demsmith.algorithms.source import BandTool

_HELP = """
<p>Looks at the ground of an elevation model. Everything is measured in metres on the ground, row by
row in geographic coordinates, up to the raster's edge and the rims of voids.</p>
<p><b>Slope</b> (<i>slope</i>): how steep the ground is, in degrees or percent.</p>
<p><b>Aspect</b> (<i>aspect</i>): which way it falls, in degrees clockwise from the grid's north; 90
faces east. Level ground has none.</p>
<p><b>Hillshade</b> (<i>hillshade</i>): how much light falls on it, from 1 (dark) to 255. Light from
many directions shows ridges whichever way they run. The layer is laid over those below it.</p>
<p><b>Mean deviation</b> (<i>deviation</i>): how rugged it is, as root mean square deviation of the
elevations within the radius from their mean, in metres.</p>
<p><b>Topographic position</b> (<i>position</i>): how far a cell lies above that mean, in metres:
above 0 on ridges and hills, below in valleys.</p>
"""

_STYLES = {
    "slope": styling.style_slope,
    "aspect": styling.style_aspect,
    "hillshade": styling.style_hillshade,
    "deviation": styling.style_slope,
    "position": styling.style_errors,
}
_COUNTS = (
    ("CELLS_KNOWN", "cells_known", "Cells with a result"),
    ("MINIMUM", "minimum", "Smallest value"),
    ("MAXIMUM", "maximum", "Largest value"),
    ("SECONDS", "seconds", "Run time [s]"),
)


class Relief(BandTool):
    """Look at the ground: `demsmith.core.relief.relief_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "relief"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Slope, aspect, hillshade")

    def group(self):
        """Name the tool's group in the toolbox."""
        return tr("Relief")

    def groupId(self):
        """Name the tool's group in ids."""
        return "relief"

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "relief,slope,steepness,gradient,aspect,exposition,hillshade,shaded relief,shading,"
            "multidirectional,roughness,ruggedness,deviation,topographic position,tpi,horn,"
            "zevenbergen,dem,dtm,dsm,srtm,elevation,terrain"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr("Makes slope, aspect, hillshade, mean deviation or topographic position.")

    def shortHelpString(self):
        """Give the help panel's text."""
        return tr(_HELP.replace("\n", " "))

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.relief.options import ReliefOptions

        self.add_source("Raster whose ground is looked at. It is never changed.")
        add_options(self, ReliefOptions)
        self.add_running()
        add(self, QgsProcessingParameterRasterDestination("OUTPUT", tr("Relief")),
            help_text="GeoTIFF of what is made; what has no value is nodata.")  # fmt: skip
        for name, _, title in _COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def compute(self, parameters, context, feedback, progress):
        """Look at the ground."""
        from demsmith.core.relief import ReliefOptions, relief_file

        output = self.parameterAsOutputLayer(parameters, "OUTPUT", context)
        result = relief_file(
            **self.read_source(parameters, context),
            output=output,
            options=read_options(self, ReliefOptions, parameters, context),
            **self.read_running(parameters, context),
            progress=progress,
        )
        for warning in result.warnings:
            feedback.pushWarning(warning)
        _STYLES[result.kind](output, context)
        outputs = {name: getattr(result, field) for name, field, _ in _COUNTS}
        outputs.update(OUTPUT=output, WARNINGS="\n".join(result.warnings))
        return outputs
