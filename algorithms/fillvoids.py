"""The tool *Fill voids*."""

from qgis.core import (
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterRasterDestination,
)

from demsmith.algorithms import styling
from demsmith.algorithms.base import help_picture
from demsmith.algorithms.parameters import (
    add,
    add_maps,
    add_options,
    read_maps,
    read_options,
    tr,
)
from demsmith.algorithms.source import BandTool
from demsmith.algorithms.voidfilling import VoidFilling, add_cell_maps

_HELP = """
{picture}
<p>Fills the holes of an elevation model with terrain that continues the ground around them.
Known cells keep their exact values; distances are measured in metres on the ground, also in
geographic coordinates.</p>
<p><b>What is a void.</b> Cells with the band's nodata value, NaN, and the SRTM values -32768
and -32767 even if the file does not name them as nodata. Add values, limits or a mask raster if
your data mark voids otherwise. The layer's <i>additional no data values</i> in QGIS are not
looked at: give them here.</p>
<p><b>What is filled.</b> Every void, also those at the edge, unless you restrict it to interior
voids or to a size. The result has the type of the input, rounded, or 32-bit floating point.</p>
<p><b>Method.</b> <i>auto</i> learns from the raster's own ground how it bends and how rough it is,
tries its estimators in artificial voids, and fills each void by the blend that does best at its
size; it also tells how wrong each cell may be. <i>mcmd</i> is faster: constrained midpoint
displacement (F. Belhadj, <i>Terrain modeling: a constrained fractal model</i>, 2007) with every
generation relaxed to the smoothest surface through the known ground; auto hands over to it when one
of its own options is set. Strength <i>r_s</i> above 0 adds roughness, everywhere alike or, by
maps of the parameters, from cell to cell.</p>
<p><b>Besides.</b> The source map tells by what each cell was filled, original cells (0) and
voids left as they were (2). The report is
a JSON file with the place, size and rim of every void.</p>
"""

_FILLED_COUNTS = (
    ("VOIDS", "voids", "Voids found"),
    ("CELLS_FILLED", "cells_filled", "Cells filled"),
    ("CELLS_UNFILLED", "cells_unfilled", "Void cells left"),
    ("LARGEST_VOID", "largest_void", "Cells of the largest void"),
    ("SECONDS", "seconds", "Run time [s]"),
)


class FillVoids(VoidFilling, BandTool):
    """Fill the voids of a raster: `demsmith.core.voids.fill_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "fillvoids"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Fill voids")

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "fill,voids,holes,gaps,nodata,no data,dem,dtm,dsm,srtm,elevation,terrain,"
            "interpolate,inpaint,repair,mcmd,midpoint displacement,fractal"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr("Fills the nodata holes of an elevation model with terrain that fits its rim.")

    def shortHelpString(self):
        """Give the help panel's text."""
        return tr(_HELP.replace("\n", " ")).format(picture=help_picture("fillvoids.png"))

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.voids.options import FillOptions

        self.add_source("Raster whose voids are filled. It is never changed.")
        add_options(self, FillOptions)
        add_maps(self)
        self.add_running()
        self._declare_outputs()

    def _declare_outputs(self):
        add(self, QgsProcessingParameterRasterDestination("OUTPUT", tr("Filled")),
            help_text="GeoTIFF with the voids filled.")  # fmt: skip
        add_cell_maps(self)
        add(self, QgsProcessingParameterFileDestination(
                "REPORT", tr("Report"), tr("JSON files (*.json)"),
                optional=True, createByDefault=False),
            help_text="Counts, options and a table of all voids.")  # fmt: skip
        for name, _, title in _FILLED_COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def look_up(self, parameters, context):
        """Find the layers that were given, and keep for the run what names them."""
        super().look_up(parameters, context)
        self._maps = read_maps(self, parameters, context)

    def compute(self, parameters, context, feedback, progress):
        """Fill the voids."""
        from demsmith.core.voids import fill_file
        from demsmith.core.voids.options import FillOptions

        output = self.parameterAsOutputLayer(parameters, "OUTPUT", context)
        source_map = self.parameterAsOutputLayer(parameters, "SOURCE_MAP", context)
        uncertainty = self.parameterAsOutputLayer(parameters, "UNCERTAINTY", context)
        report = self.parameterAsFileOutput(parameters, "REPORT", context)
        result = fill_file(
            **self.read_source(parameters, context),
            output=output,
            options=read_options(self, FillOptions, parameters, context),
            maps=self._maps,
            source_map=source_map or None,
            uncertainty=uncertainty or None,
            report=report or None,
            **self.read_running(parameters, context),
            progress=progress,
        )
        for reason in result.reasons:
            feedback.pushInfo(reason)
        for warning in result.warnings:
            feedback.pushWarning(warning)
        feedback.pushInfo(
            tr("{} voids found; {} cells filled, {} left").format(
                result.voids, result.cells_filled, result.cells_unfilled
            )
        )
        if result.tuning and result.tuning["accepted"]:
            feedback.pushInfo(result.tuning["summary"])
        outputs = {name: getattr(result, field) for name, field, _ in _FILLED_COUNTS}
        outputs.update(OUTPUT=output, WARNINGS="\n".join(result.warnings))
        styling.style_terrain(output, context)
        if source_map:
            outputs["SOURCE_MAP"] = source_map
            styling.style_source_map(source_map, context)
        if uncertainty:
            outputs["UNCERTAINTY"] = uncertainty
            styling.style_uncertainty(uncertainty, context)
        if report:
            outputs["REPORT"] = report
        return outputs
