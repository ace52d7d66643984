"""The tool *Decompress*."""

from qgis.core import (
    QgsProcessingException,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterFile,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameterString,
)

from demsmith.algorithms import styling
from demsmith.algorithms.base import Tool
from demsmith.algorithms.parameters import add, add_options, read_options, tr

_HELP = """
<p>Decompresses a Sparse Construction Tree (<i>.sct</i>), as <i>Compress</i> makes it, or any window
of it, at any scale. Only what is asked for is decoded.</p>
<p><b>Window.</b> First column, first row, number of columns and of rows, separated by commas,
counted from 0; left empty, all is decoded.</p>
<p><b>Scale.</b> Output cells per cell of the file, along rows and columns. 1 gives the raster as it
was compressed, within the maximum error and in its data type. Below 1 an overview is decoded from
the coarse levels alone; above 1 the continuous surface is evaluated: both in floating point.</p>
"""

_COUNTS = (
    ("CELLS", "cells", "Cells"),
    ("CELLS_KNOWN", "cells_known", "Cells with an elevation"),
    ("SECONDS", "seconds", "Run time [s]"),
)


class Decompress(Tool):
    """Decompress a file: `demsmith.core.sct.decompress_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "decompress"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Decompress")

    def group(self):
        """Name the tool's group in the toolbox."""
        return tr("Compression")

    def groupId(self):
        """Name the tool's group in ids."""
        return "compression"

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "decompress,decode,expand,unpack,open,sct,sparse,construction tree,window,overview,"
            "scale,dem,dtm,dsm,srtm,elevation,terrain"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr("Decodes a compressed elevation model, or a window of it, at any scale.")

    def shortHelpString(self):
        """Give the help panel's text."""
        return tr(_HELP.replace("\n", " "))

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.sct.options import DecompressOptions

        add(self, QgsProcessingParameterFile(
                "INPUT", tr("Compressed elevation model"), extension="sct"),
            help_text="Sparse Construction Tree, .sct.")  # fmt: skip
        add(self, QgsProcessingParameterString(
                "WINDOW", tr("Window"), optional=True),
            help_text="First column, first row, number of columns, number of rows; left empty: "
            "all.")  # fmt: skip
        add_options(self, DecompressOptions)
        self.add_running()
        add(self, QgsProcessingParameterRasterDestination("OUTPUT", tr("Decompressed")),
            help_text="GeoTIFF.")  # fmt: skip
        for name, _, title in _COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def checkParameterValues(self, parameters, context):
        """Check what can be checked before the run."""
        fine, message = super().checkParameterValues(parameters, context)
        if not fine:
            return False, message
        try:
            self._window(parameters, context)
        except QgsProcessingException as error:
            return False, str(error)
        return True, ""

    def compute(self, parameters, context, feedback, progress):
        """Decompress the file."""
        from demsmith.core.sct import decompress_file
        from demsmith.core.sct.options import DecompressOptions

        output = self.parameterAsOutputLayer(parameters, "OUTPUT", context)
        result = decompress_file(
            self.parameterAsFile(parameters, "INPUT", context),
            output,
            options=read_options(self, DecompressOptions, parameters, context),
            window=self._window(parameters, context),
            **self.read_running(parameters, context),
            progress=progress,
        )
        for warning in result.warnings:
            feedback.pushWarning(warning)
        feedback.pushInfo(tr("{} × {} cells").format(result.rows, result.columns))
        outputs = {name: getattr(result, field) for name, field, _ in _COUNTS}
        outputs.update(OUTPUT=output, WARNINGS="\n".join(result.warnings))
        styling.style_terrain(output, context)
        return outputs

    def _window(self, parameters, context):
        text = self.parameterAsString(parameters, "WINDOW", context)
        if not text.strip():
            return None
        try:
            window = tuple(int(each) for each in text.split(","))
        except ValueError:
            window = ()
        if len(window) != 4:
            raise QgsProcessingException(
                tr("WINDOW is '{}'; give first column, first row, number of columns and number of "
                   "rows, such as 0, 0, 512, 512").format(text)
            )  # fmt: skip
        return window
