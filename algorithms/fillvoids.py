"""The tool *Fill voids*."""

from qgis.core import (
    QgsProcessingException,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterBand,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterString,
)

from demsmith.algorithms import styling
from demsmith.algorithms.base import Tool, help_picture
from demsmith.algorithms.parameters import (
    add,
    add_options,
    creation_options,
    number,
    read_creation_options,
    read_number,
    read_options,
    tr,
)

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
<p><b>Method.</b> Constrained midpoint displacement (F. Belhadj, <i>Terrain modeling: a
constrained fractal model</i>, 2007) with every generation relaxed to the smoothest surface
through the known ground. Strength <i>r_s</i> above 0 adds natural roughness.</p>
<p><b>Besides.</b> The source map tells filled cells (1) from original ones (0) and
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


class FillVoids(Tool):
    """Fill the voids of a raster: `demsmith.core.voids.fill_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "fillvoids"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Fill voids")

    def group(self):
        """Name the tool's group in the toolbox."""
        return tr("Void filling")

    def groupId(self):
        """Name the tool's group in ids."""
        return "voids"

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

        add(self, QgsProcessingParameterRasterLayer("INPUT", tr("Elevation model")),
            help_text="Raster whose voids are filled. It is never changed.")  # fmt: skip
        add(self, QgsProcessingParameterBand("BAND", tr("Band"), 1, "INPUT", optional=True),
            help_text="The band that holds the elevations.")  # fmt: skip
        add(self, QgsProcessingParameterString(
                "NODATA", tr("More values that mean void"), optional=True),
            help_text="Numbers, separated by commas: cells with these values are voids, besides "
            "the band's nodata value.")  # fmt: skip
        add(self, QgsProcessingParameterRasterLayer(
                "MASK", tr("Mask of voids"), optional=True),
            help_text="Raster of the same size: cells that are neither 0 nor nodata are voids.",
            )  # fmt: skip
        add(self, number("BELOW", "Void at or below", optional=True), advanced=True,
            help_text="Cells with this value or a lower one are voids.")  # fmt: skip
        add(self, number("ABOVE", "Void at or above", optional=True), advanced=True,
            help_text="Cells with this value or a higher one are voids.")  # fmt: skip
        add_options(self, FillOptions)
        add(self, number("THREADS", "Threads", kind=int, optional=True, minValue=1), advanced=True,
            help_text="Voids filled side by side; not given: one for every core. "
            "The result is the same.")  # fmt: skip
        add(self, creation_options(), advanced=True,
            help_text="Left empty: tiled and compressed.")  # fmt: skip
        self._declare_outputs()

    def _declare_outputs(self):
        add(self, QgsProcessingParameterRasterDestination("OUTPUT", tr("Filled")),
            help_text="GeoTIFF with the voids filled.")  # fmt: skip
        add(self, QgsProcessingParameterRasterDestination(
                "SOURCE_MAP", tr("Source map"), optional=True, createByDefault=False),
            help_text="GeoTIFF of 0 original, 1 filled, 2 a void left as it was.")  # fmt: skip
        add(self, QgsProcessingParameterFileDestination(
                "REPORT", tr("Report"), tr("JSON files (*.json)"),
                optional=True, createByDefault=False),
            help_text="Counts, options and a table of all voids.")  # fmt: skip
        for name, _, title in _FILLED_COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def checkParameterValues(self, parameters, context):
        """Check what can be checked before the run."""
        fine, message = super().checkParameterValues(parameters, context)
        if not fine:
            return False, message
        try:
            self.raster_source(parameters, "INPUT", context)
            self.raster_source(parameters, "MASK", context)
            self._void_values(parameters, context)
        except QgsProcessingException as error:
            return False, str(error)
        return True, ""

    def prepareAlgorithm(self, parameters, context, feedback):
        """Look layers up here, in the main thread, where QGIS keeps them."""
        self._input = self.raster_source(parameters, "INPUT", context)
        self._mask = self.raster_source(parameters, "MASK", context)
        return True

    def compute(self, parameters, context, feedback, progress):
        """Fill the voids."""
        from demsmith.core.voids import fill_file
        from demsmith.core.voids.options import FillOptions

        output = self.parameterAsOutputLayer(parameters, "OUTPUT", context)
        source_map = self.parameterAsOutputLayer(parameters, "SOURCE_MAP", context)
        report = self.parameterAsFileOutput(parameters, "REPORT", context)
        result = fill_file(
            self._input,
            output,
            options=read_options(self, FillOptions, parameters, context),
            band=self.parameterAsInt(parameters, "BAND", context),
            nodata=self._void_values(parameters, context),
            below=read_number(self, "BELOW", parameters, context),
            above=read_number(self, "ABOVE", parameters, context),
            mask=self._mask,
            source_map=source_map or None,
            report=report or None,
            threads=read_number(self, "THREADS", parameters, context, kind=int),
            overwrite=True,  # QGIS has asked the user
            creation_options=read_creation_options(
                self.parameterAsString(parameters, "CREATION_OPTIONS", context)
            ),
            progress=progress,
        )
        for warning in result.warnings:
            feedback.pushWarning(warning)
        feedback.pushInfo(
            tr("{} voids found; {} cells filled, {} left").format(
                result.voids, result.cells_filled, result.cells_unfilled
            )
        )
        outputs = {name: getattr(result, field) for name, field, _ in _FILLED_COUNTS}
        outputs.update(OUTPUT=output, WARNINGS="\n".join(result.warnings))
        styling.style_terrain(output, context)
        if source_map:
            outputs["SOURCE_MAP"] = source_map
            styling.style_source_map(source_map, context)
        if report:
            outputs["REPORT"] = report
        return outputs

    def _void_values(self, parameters, context):
        text = self.parameterAsString(parameters, "NODATA", context)
        try:
            return tuple(float(each) for each in text.split(",") if each.strip())
        except ValueError:
            raise QgsProcessingException(
                tr("NODATA is '{}'; give numbers separated by commas, such as -9999, 0").format(
                    text
                )
            ) from None
