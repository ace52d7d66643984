"""The tool *Compress*."""

from qgis.core import (
    QgsProcessingOutputNumber,
    QgsProcessingOutputRasterLayer,
    QgsProcessingOutputString,
    QgsProcessingParameterFile,
    QgsProcessingParameterFileDestination,
)

from demsmith.algorithms.parameters import add, add_options, read_options, tr
from demsmith.algorithms.source import BandTool

_HELP = """
<p>Compresses an elevation model into a Sparse Construction Tree (<i>.sct</i>): a smooth surface
made of few atoms, and what is left of it, coded so that <b>no cell is wrong by more than the
maximum error</b>. Data type, nodata value, coordinate system, place, unit and metadata are kept,
and every void cell holds what it held. Before the file is put in place it is decoded, and its error
measured.</p>
<p><b>Maximum error.</b> In the raster's unit; 1 if nothing else is asked for. 0 keeps every value
of whole numbers, and of decimals of up to six digits.</p>
<p><b>Ratio, PSNR.</b> Instead of a maximum error: how small the file has to be, or how large its
root-mean-square error may be beside the raster's range. Single cells may then be wrong by more.</p>
<p><b>Atoms, sparsity, radius, dictionary.</b> The tree of E. Guérin et al., <i>Sparse
representation of terrains for procedural modeling</i>, 2016: patches, each of some atoms of a
dictionary. Without a maximum error given too, nothing bounds its error.</p>
<p><b>Virtual raster.</b> Beside the file a <i>.sct.vrt</i> is written: added to QGIS as a raster
layer, it decodes what is shown, where Demsmith is installed. Or drop the <i>.sct</i> file on the
map: it is decoded to a temporary layer.</p>
"""

_COUNTS = (
    ("BYTES", "bytes", "Bytes of the file"),
    ("RATIO_REACHED", "ratio", "Raw bytes by bytes of the file"),
    ("BITS_PER_CELL", "bits_per_cell", "Bits per cell"),
    ("LARGEST_ERROR", "max_error_measured", "Largest error, measured"),
    ("RMSE", "rmse", "Root-mean-square error, measured"),
    ("SECONDS", "seconds", "Run time [s]"),
)


class Compress(BandTool):
    """Compress a raster: `demsmith.core.sct.compress_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "compress"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Compress")

    def group(self):
        """Name the tool's group in the toolbox."""
        return tr("Compression")

    def groupId(self):
        """Name the tool's group in ids."""
        return "compression"

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "compress,compression,sct,sparse,construction tree,lossy,lossless,lerc,jpeg,wavelet,"
            "archive,small,size,max error,psnr,dictionary,dem,dtm,dsm,srtm,elevation,terrain"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr("Makes an elevation model small, with a guaranteed maximum error.")

    def shortHelpString(self):
        """Give the help panel's text."""
        return tr(_HELP.replace("\n", " "))

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.sct.options import CompressOptions

        self.add_source("Raster that is compressed. It is never changed.")
        add_options(self, CompressOptions)
        add(self, QgsProcessingParameterFile(
                "DICTIONARY", tr("Dictionary"), extension="dsd", optional=True), advanced=True,
            help_text="Dictionary (.dsd) for a tree of patches, instead of one that is learned "
            "from the raster.")  # fmt: skip
        self.add_threads()
        add(self, QgsProcessingParameterFileDestination(
                "OUTPUT", tr("Compressed"), tr("Sparse Construction Tree (*.sct)")),
            help_text="Sparse Construction Tree, .sct.")  # fmt: skip
        self.addOutput(QgsProcessingOutputRasterLayer("VIRTUAL", tr("Virtual raster")))
        for name, _, title in _COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def compute(self, parameters, context, feedback, progress):
        """Compress the raster."""
        from demsmith.core.sct import compress_file
        from demsmith.core.sct.options import CompressOptions

        output = self.parameterAsFileOutput(parameters, "OUTPUT", context)
        result = compress_file(
            **self.read_source(parameters, context),
            output=output,
            options=read_options(self, CompressOptions, parameters, context),
            dictionary=self.parameterAsFile(parameters, "DICTIONARY", context) or None,
            **self.read_threads(parameters, context),
            progress=progress,
        )
        for warning in result.warnings:
            feedback.pushWarning(warning)
        feedback.pushInfo(
            tr("{} bytes to {} ({:.3g} to 1), maximum error {:.6g}").format(
                result.bytes_raw, result.bytes, result.ratio, result.max_error_measured
            )
        )
        outputs = {name: getattr(result, field) for name, field, _ in _COUNTS}
        outputs.update(OUTPUT=output, WARNINGS="\n".join(result.warnings))
        if result.vrt:
            outputs["VIRTUAL"] = result.vrt
        return outputs
