"""The tool *Reconstruct SRTM voids*."""

from qgis.core import (
    QgsProcessing,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterFile,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameterVectorDestination,
)

from demsmith.algorithms import styling
from demsmith.algorithms.base import help_picture
from demsmith.algorithms.parameters import add, add_options, read_options, tr
from demsmith.algorithms.reconstruction import COUNTS, add_auxiliaries, read_auxiliaries, tell
from demsmith.algorithms.source import BandTool
from demsmith.algorithms.voidfilling import VoidFilling, add_cell_maps

_HELP = """
{picture}
<p>Fills the voids of an SRTM tile or another elevation model, after it has removed what SRTM is
known to get wrong, and tells of every cell where it comes from and how wrong it may be (in the
picture: the redder, the more). All other cells keep their exact values; of those that are removed
the report has a list.</p>
<p><b>What is a void.</b> Cells with the band's nodata value, NaN, and the SRTM values -32768
and -32767 even if the file does not name them as nodata. Add values, limits or a mask raster if
your data mark voids otherwise. The layer's <i>additional no data values</i> in QGIS are not
looked at: give them here.</p>
<p><b>Faults.</b> Spikes and wells become voids and are filled; noisy cells beside voids only if
you ask for it. Voids in the sea and in lakes are held at the water's level.</p>
<p><b>Method.</b> <i>auto</i> learns from the raster's own ground, tries its estimators in
artificial voids, and fills each void by the blend that does best at its size. <i>mcmd</i> is
constrained midpoint displacement (F. Belhadj, <i>Terrain modeling: a constrained fractal
model</i>, 2007): faster, without uncertainty.</p>
<p><b>Auxiliary elevation models</b> may have any CRS and resolution. Each is shifted, levelled,
tilted and blurred so that it fits the known ground; in a void, what still differs at its rim is
spread over it (delta surface fill). The first that promises less error than interpolation
is used. One that does not fit is refused, and the report says why.</p>
<p><b>Neighbours.</b> Rasters of that folder on the same grid give the ground beyond the edges.</p>
"""

_STYLES = {
    "OUTPUT": styling.style_terrain,
    "SOURCE_MAP": styling.style_source_map,
    "UNCERTAINTY": styling.style_uncertainty,
    "VOIDS_LAYER": styling.style_voids,
}


class ReconstructSrtm(VoidFilling, BandTool):
    """Reconstruct voids: `demsmith.core.reconstruction.reconstruct_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "reconstructsrtm"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Reconstruct SRTM voids")

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "reconstruct,srtm,fill,voids,holes,gaps,nodata,dem,dtm,dsm,elevation,auxiliary,"
            "delta surface fill,aster,copernicus,outliers,spikes,wells,water,uncertainty,repair"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr(
            "Fills voids from the ground around and from other elevation models, and tells how "
            "wrong each cell may be."
        )

    def shortHelpString(self):
        """Give the help panel's text."""
        return tr(_HELP.replace("\n", " ")).format(picture=help_picture("reconstructsrtm.png"))

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.reconstruction import ReconstructOptions

        self.add_source("Raster whose voids are filled. It is never changed.")
        add_auxiliaries(self)
        add(self, QgsProcessingParameterFile(
                "NEIGHBOURS", tr("Folder with neighbouring tiles"),
                QgsProcessingParameterFile.Behavior.Folder, optional=True),
            help_text="Rasters in it that lie beside the elevation model, on the same grid, give "
            "the ground beyond its edges.")  # fmt: skip
        add_options(self, ReconstructOptions)
        self.add_running()
        self._declare_outputs()

    def _declare_outputs(self):
        add(self, QgsProcessingParameterRasterDestination("OUTPUT", tr("Reconstructed")),
            help_text="GeoTIFF with the voids filled.")  # fmt: skip
        add_cell_maps(self)
        add(self, QgsProcessingParameterVectorDestination(
                "VOIDS_LAYER", tr("Voids as polygons"),
                QgsProcessing.SourceType.TypeVectorPolygon, optional=True, createByDefault=False),
            help_text="GeoPackage or GeoJSON: each void with its size, relief, method and "
            "expected error.")  # fmt: skip
        add(self, QgsProcessingParameterFileDestination(
                "REPORT", tr("Report"), tr("HTML files (*.html);;JSON files (*.json)"),
                optional=True),
            help_text="Page with pictures and tables, and their numbers beside it in a JSON "
            "file; or the numbers alone.")  # fmt: skip
        for name, _, title in COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def look_up(self, parameters, context):
        """Find the layers that were given, and keep for the run what names them."""
        super().look_up(parameters, context)
        self._auxiliaries = read_auxiliaries(self, parameters, context)

    def compute(self, parameters, context, feedback, progress):
        """Reconstruct the voids."""
        from demsmith.core.reconstruction import ReconstructOptions, reconstruct_file

        paths = {name: self.parameterAsOutputLayer(parameters, name, context) for name in _STYLES}
        paths["REPORT"] = self.parameterAsFileOutput(parameters, "REPORT", context)
        result = reconstruct_file(
            **self.read_source(parameters, context),
            **{name.lower(): path or None for name, path in paths.items()},
            options=read_options(self, ReconstructOptions, parameters, context),
            auxiliaries=self._auxiliaries,
            neighbours=self.parameterAsFile(parameters, "NEIGHBOURS", context) or None,
            **self.read_running(parameters, context),
            progress=progress,
        )
        tell(result, feedback)
        for name, style in _STYLES.items():
            if paths[name]:
                style(paths[name], context)
        outputs = {name: getattr(result, field) for name, field, _ in COUNTS}
        outputs.update((name, path) for name, path in paths.items() if path)
        outputs["WARNINGS"] = "\n".join(result.warnings)
        return outputs
