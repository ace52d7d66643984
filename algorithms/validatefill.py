"""The tool *Validate void filling*."""

from qgis.core import (
    QgsProcessing,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterEnum,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterVectorDestination,
)

from demsmith.algorithms import styling
from demsmith.algorithms.parameters import add, add_options, read_options, tr
from demsmith.algorithms.source import BandTool
from demsmith.algorithms.voidfilling import VoidFilling

_HELP = """
<p>Tells how wrong fills of this elevation model are. Known ground is hidden in artificial voids,
filled by each method, and compared with what it was. The input is never changed.</p>
<p><b>Artificial voids.</b> They have the shapes of the raster's own voids, or of those of another
raster, turned and mirrored, and lie where the ground is as steep as around the real ones. A raster
without voids is given a mixture of small and large ones as the SRTM has.</p>
<p><b>Methods.</b> Demsmith's own, GDAL's <i>Fill nodata</i> without and with smoothing
(<i>gdal</i>, <i>gdal-smooth</i>), and scikit-image's biharmonic surface (<i>biharmonic</i>), which
leaves out voids of more than 50000 cells. None chosen: all that are installed.</p>
<p><b>Errors.</b> A table with a row for each method and size class of voids, in cells: root mean
square error, bias, mean and largest magnitude; root mean square error of the slope (rise by run);
and, for a method that states how wrong it may be, the shares of cells within its intervals of 68
and 95 %. The report shows the same as charts.</p>
"""

_COUNTS = (
    ("HOLES", "holes", "Artificial voids"),
    ("CELLS_HIDDEN", "cells_hidden", "Cells hidden"),
    ("RMSE", "rmse", "Least RMSE of all methods"),
    ("SECONDS", "seconds", "Run time [s]"),
)


class ValidateFill(VoidFilling, BandTool):
    """Try fills on known ground: `demsmith.core.validation.validate_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "validatefill"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Validate void filling")

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "validate,validation,cross-validation,accuracy,error,rmse,bias,uncertainty,compare,"
            "fill,voids,holes,gaps,nodata,dem,dtm,dsm,srtm,elevation,gdal,biharmonic"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr("Tells how wrong fills of an elevation model are, by artificial voids.")

    def shortHelpString(self):
        """Give the help panel's text."""
        return tr(_HELP.replace("\n", " "))

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.validation import METHODS, ValidateOptions

        self.add_source("Raster on whose known ground fills are tried. It is never changed.")
        add(self, QgsProcessingParameterEnum(
                "METHODS", tr("Methods to compare"), options=list(METHODS), allowMultiple=True,
                usesStaticStrings=True, optional=True),
            help_text="None chosen: all that are installed.")  # fmt: skip
        add(self, QgsProcessingParameterRasterLayer(
                "VOIDS_FROM", tr("Raster to take the voids' shapes from"), optional=True),
            help_text="Not given: the raster's own voids or, if none lies inside it, a mixture "
            "as of the SRTM. Its first band is read.")  # fmt: skip
        add_options(self, ValidateOptions)
        self.add_running()
        self._declare_outputs()

    def _declare_outputs(self):
        add(self, QgsProcessingParameterVectorDestination(
                "OUTPUT", tr("Errors by method and void size"), QgsProcessing.SourceType.TypeVector,
                ),
            help_text="Table without geometry: GeoPackage, GeoJSON or CSV.")  # fmt: skip
        add(self, QgsProcessingParameterFileDestination(
                "REPORT", tr("Report"), tr("HTML files (*.html);;JSON files (*.json)"),
                optional=True),
            help_text="Page with charts and tables, or their numbers.")  # fmt: skip
        add(self, QgsProcessingParameterRasterDestination(
                "ERROR_MAP", tr("Map of errors"), optional=True, createByDefault=False),
            help_text="GeoTIFF of filled less true elevation by the first of the methods, where "
            "ground was hidden.")  # fmt: skip
        for name, _, title in _COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("BEST", tr("Method of the least RMSE")))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def look_up(self, parameters, context):
        """Find the layers that were given, and keep for the run what names them."""
        super().look_up(parameters, context)
        self._voids_from = self.raster_source(parameters, "VOIDS_FROM", context)

    def _methods(self, parameters, context):
        """Name the methods that were chosen; None for all."""
        names = self.parameterAsEnumStrings(parameters, "METHODS", context)
        return [name for name in names if name] or None  # QGIS reads none as one without a name

    def compute(self, parameters, context, feedback, progress):
        """Try the methods."""
        from demsmith.core.validation import ValidateOptions, validate_file

        output = self.parameterAsOutputLayer(parameters, "OUTPUT", context)
        report = self.parameterAsFileOutput(parameters, "REPORT", context)
        error_map = self.parameterAsOutputLayer(parameters, "ERROR_MAP", context)
        result = validate_file(
            **self.read_source(parameters, context),
            output=output,
            methods=self._methods(parameters, context),
            voids_from=self._voids_from,
            options=read_options(self, ValidateOptions, parameters, context),
            report=report or None,
            error_map=error_map or None,
            **self.read_running(parameters, context),
            progress=progress,
        )
        for warning in result.warnings:
            feedback.pushWarning(warning)
        for score in result.scores:
            feedback.pushInfo(tr("{}: RMSE {:.2f}").format(score.title, score.errors[-1].rmse))
        outputs = {name: getattr(result, field) for name, field, _ in _COUNTS}
        outputs.update(OUTPUT=output, BEST=result.best, WARNINGS="\n".join(result.warnings))
        if report:
            outputs["REPORT"] = report
        if error_map:
            outputs["ERROR_MAP"] = error_map
            styling.style_errors(error_map, context)
        return outputs
