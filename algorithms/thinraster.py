"""The tool *Thin raster*."""

from qgis.core import (
    QgsProcessing,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameterVectorDestination,
)

from demsmith.algorithms import styling
from demsmith.algorithms.parameters import add, add_options, read_options, tr
from demsmith.algorithms.source import BandTool

_HELP = """
<p>Keeps a share of the cells of an elevation model, those that carry its shape, and makes all
others nodata. Kept cells have their exact values. <i>Reconstruct from samples</i> rebuilds a
terrain from them.</p>
<p><b>Ridges and valleys</b> (<i>ridges</i>): kept cells crowd where the ground bends, along crests,
valleys and edges, and thin out evenly on slopes and plains. The terrain is rebuilt from them with
a quarter to a half less error than from random cells.</p>
<p><b>Sobel</b> (<i>sobel</i>): the steepest cells, as in F. Belhadj, <i>Terrain modeling: a
constrained fractal model</i>, 2007. It leaves flat ground without any cell, so that terrain is
rebuilt badly from it alone.</p>
<p><b>Random</b> (<i>random</i>): any cells, all with the same chance.</p>
<p><b>Share.</b> Of the known cells, as a fraction of 1: 0.1 keeps a tenth. Voids of the input stay
voids. Slopes and bends are measured in metres on the ground, also in geographic coordinates.</p>
<p><b>Points.</b> The kept cells' centres as a GeoPackage, GeoJSON or CSV table, with their
elevations as <i>z</i>.</p>
"""

_COUNTS = (
    ("CELLS_KNOWN", "cells_known", "Cells with an elevation"),
    ("CELLS_KEPT", "cells_kept", "Cells kept"),
    ("SHARE_KEPT", "share", "Share of cells kept"),
    ("SECONDS", "seconds", "Run time [s]"),
)


class ThinRaster(BandTool):
    """Thin a raster: `demsmith.core.thinning.thin_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "thinraster"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Thin raster")

    def group(self):
        """Name the tool's group in the toolbox."""
        return tr("Samples")

    def groupId(self):
        """Name the tool's group in ids."""
        return "samples"

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "thin,sample,samples,decimate,simplify,generalize,compress,points,ridge,valley,crest,"
            "thalweg,sobel,edge,random,dem,dtm,dsm,srtm,elevation,terrain"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr("Keeps only the cells of an elevation model that carry its shape.")

    def shortHelpString(self):
        """Give the help panel's text."""
        return tr(_HELP.replace("\n", " "))

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.thinning.options import ThinOptions

        self.add_source("Raster whose cells are thinned. It is never changed.")
        add_options(self, ThinOptions)
        self.add_running()
        add(self, QgsProcessingParameterRasterDestination("OUTPUT", tr("Thinned")),
            help_text="GeoTIFF of the kept cells; all others are nodata.")  # fmt: skip
        add(self, QgsProcessingParameterVectorDestination(
                "POINTS", tr("Kept cells as points"), QgsProcessing.SourceType.TypeVectorPoint,
                optional=True, createByDefault=False),
            help_text="GeoPackage, GeoJSON or CSV table of the kept cells, with their elevations "
            "as z.")  # fmt: skip
        for name, _, title in _COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def compute(self, parameters, context, feedback, progress):
        """Thin the raster."""
        from demsmith.core.thinning import thin_file
        from demsmith.core.thinning.options import ThinOptions

        output = self.parameterAsOutputLayer(parameters, "OUTPUT", context)
        points = self.parameterAsOutputLayer(parameters, "POINTS", context)
        result = thin_file(
            **self.read_source(parameters, context),
            output=output,
            points=points or None,
            options=read_options(self, ThinOptions, parameters, context),
            **self.read_running(parameters, context),
            progress=progress,
        )
        for warning in result.warnings:
            feedback.pushWarning(warning)
        feedback.pushInfo(
            tr("{} of {} known cells kept").format(result.cells_kept, result.cells_known)
        )
        outputs = {name: getattr(result, field) for name, field, _ in _COUNTS}
        outputs.update(OUTPUT=output, WARNINGS="\n".join(result.warnings))
        styling.style_terrain(output, context)
        if points:
            outputs["POINTS"] = points
        return outputs
