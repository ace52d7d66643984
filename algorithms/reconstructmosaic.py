"""The tool *Reconstruct a mosaic*."""

from qgis.core import (
    QgsProcessing,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingOutputHtml,
    QgsProcessingOutputNumber,
    QgsProcessingOutputRasterLayer,
    QgsProcessingOutputString,
    QgsProcessingOutputVectorLayer,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterFile,
    QgsProcessingParameterFolderDestination,
    QgsProcessingParameterMultipleLayers,
)

from demsmith.algorithms import styling
from demsmith.algorithms.base import file_of, help_picture
from demsmith.algorithms.parameters import add, add_options, number, read_options, tr
from demsmith.algorithms.reconstruction import COUNTS, add_auxiliaries, read_auxiliaries, tell
from demsmith.algorithms.source import CellTool
from demsmith.algorithms.voidfilling import VoidFilling

_HELP = """
{picture}
<p>Fills the voids of many tiles as <i>Reconstruct SRTM voids</i> does those of one, and as if
they were one raster: a void over the corner of four tiles gets what it would get in the merged
raster, and there are no seams.</p>
<p><b>Tiles</b> share one grid: the same CRS, resolution and unit of height, and places that
differ by whole cells. They may overlap, as SRTM tiles share a row and a column; where two know a
cell, the first gives its elevation. Where there is no tile, the ground stays unknown. The layers'
<i>additional no data values</i> in QGIS are not looked at: give them here.</p>
<p><b>The output folder</b> gets a GeoTIFF for each tile under the tile's name, mosaic.vrt, which
opens all of them as one raster, and the report mosaic.html with its numbers as mosaic.json.</p>
<p><b>Memory.</b> The mosaic is never in memory as a whole.</p>
<p><b>If it is stopped</b>, what is finished is kept in the output folder. The same tiles, options
and folder go on there. For processes on several cores or machines use the command line,
<i>demsmith mosaic</i>.</p>
"""


class ReconstructMosaic(VoidFilling, CellTool):
    """Reconstruct tiles: `demsmith.core.mosaic.reconstruct_mosaic` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "reconstructmosaic"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Reconstruct a mosaic")

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "mosaic,tiles,folder,many,batch,large,merge,seam,seamless,reconstruct,srtm,fill,voids,"
            "holes,gaps,nodata,dem,dtm,dsm,elevation,auxiliary,uncertainty,vrt"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr("Fills the voids of many tiles as if they were one raster.")

    def shortHelpString(self):
        """Give the help panel's text."""
        return tr(_HELP.replace("\n", " ")).format(picture=help_picture("reconstructmosaic.png"))

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.reconstruction import ReconstructOptions

        self._declare_tiles()
        add_auxiliaries(self)
        add_options(self, ReconstructOptions)
        self.add_running()
        self._declare_outputs()

    def _declare_tiles(self):
        add(self, QgsProcessingParameterMultipleLayers(
                "INPUT", tr("Tiles"), QgsProcessing.SourceType.TypeRaster, optional=True),
            help_text="Rasters of one grid; of a virtual raster, its files. They are never "
            "changed.")  # fmt: skip
        add(self, QgsProcessingParameterFile(
                "FOLDER", tr("Folder of tiles"), QgsProcessingParameterFile.Behavior.Folder,
                optional=True),
            help_text="Its elevation rasters (.hgt, .tif, .dt1, .zip and others) are tiles, "
            "besides the layers, if any.")  # fmt: skip
        add(self, number("BAND", "Band", kind=int, default=1, minValue=1), advanced=True,
            help_text="The band that holds the elevations, of every tile.")  # fmt: skip
        self.add_cells()

    def _declare_outputs(self):
        for name, title, help_text in (
            ("WITH_SOURCE_MAPS", "Write source maps",
             "NAME_source.tif for each tile: where each cell comes from."),
            ("WITH_UNCERTAINTIES", "Write uncertainties",
             "NAME_uncertainty.tif for each tile: the standard error to be expected in filled "
             "cells. Method auto only."),
            ("WITH_VOIDS_LAYER", "Write voids as polygons",
             "voids.gpkg: each void with its size, relief, method and expected error."),
            ("OVERWRITE", "Replace files of the folder",
             "Whether files that are in the output folder already may be replaced."),
        ):  # fmt: skip
            add(self, QgsProcessingParameterBoolean(name, tr(title), defaultValue=False),
                help_text=help_text)  # fmt: skip
        add(self, QgsProcessingParameterBoolean(
                "LOAD", tr("Open the mosaic when done"), defaultValue=True),
            help_text="Adds mosaic.vrt, and the layer of voids if there is one, to the project.",
            )  # fmt: skip
        add(self, QgsProcessingParameterFolderDestination("OUTPUT", tr("Output folder")),
            help_text="Where the results go, each as GeoTIFF under its tile's name; not the "
            "folder of the tiles.")  # fmt: skip
        self.addOutput(QgsProcessingOutputRasterLayer("VRT", tr("Mosaic")))
        self.addOutput(QgsProcessingOutputVectorLayer(
            "VOIDS_LAYER", tr("Voids as polygons"), QgsProcessing.SourceType.TypeVectorPolygon
        ))  # fmt: skip
        self.addOutput(QgsProcessingOutputHtml("REPORT", tr("Report")))
        self.addOutput(QgsProcessingOutputNumber("TILES", tr("Tiles")))
        for name, _, title in COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def look_up(self, parameters, context):
        """Find the layers that were given, and keep for the run what names them."""
        layers = self.parameterAsLayerList(parameters, "INPUT", context)
        self._tiles = [file_of(layer, "INPUT") for layer in layers]
        folder = self.parameterAsFile(parameters, "FOLDER", context)
        if folder:
            self._tiles.append(folder)
        if not self._tiles:
            raise QgsProcessingException(tr("there are no tiles: give INPUT or FOLDER"))
        self._auxiliaries = read_auxiliaries(self, parameters, context)

    def compute(self, parameters, context, feedback, progress):
        """Reconstruct the tiles."""
        from demsmith.core.mosaic import reconstruct_mosaic
        from demsmith.core.reconstruction import ReconstructOptions

        def is_set(name):
            return self.parameterAsBoolean(parameters, name, context)

        running = self.read_running(parameters, context)
        result = reconstruct_mosaic(
            self._tiles,
            self.parameterAsString(parameters, "OUTPUT", context),
            options=read_options(self, ReconstructOptions, parameters, context),
            auxiliaries=self._auxiliaries,
            band=self.parameterAsInt(parameters, "BAND", context),
            **self.read_cells(parameters, context),
            source_map=is_set("WITH_SOURCE_MAPS"),
            uncertainty=is_set("WITH_UNCERTAINTIES"),
            voids_layer=is_set("WITH_VOIDS_LAYER"),
            workers=0,  # QGIS is one process
            **{**running, "overwrite": is_set("OVERWRITE")},
            progress=progress,
        )
        tell(result, feedback)
        if is_set("LOAD"):
            _load(result.vrt, "VRT", tr("Mosaic"), styling.style_terrain, context)
            _load(result.voids_layer, "VOIDS_LAYER", tr("Voids"), styling.style_voids, context)
        outputs = {name: getattr(result, field) for name, field, _ in COUNTS}
        outputs.update(
            OUTPUT=result.output, REPORT=result.report, TILES=len(result.tiles),
            WARNINGS="\n".join(result.warnings),
        )  # fmt: skip
        written = {"VRT": result.vrt, "VOIDS_LAYER": result.voids_layer}
        outputs.update((name, path) for name, path in written.items() if path)
        return outputs


def _load(path, output, title, style, context):
    """Have QGIS add a file, if there is one, to the project when the tool is done."""
    if path:
        details = QgsProcessingContext.LayerDetails(title, context.project(), output)
        context.addLayerToLoadOnCompletion(path, details)
        style(path, context)
