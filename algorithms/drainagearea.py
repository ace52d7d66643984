"""The tool *Drainage area*."""

from qgis.core import (
    QgsProcessing,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterVectorDestination,
)

from demsmith.algorithms import styling
from demsmith.algorithms.parameters import add, add_options, read_options, tr
from demsmith.algorithms.source import BandTool

_HELP = """
<p>Tells how much ground drains through each cell of an elevation model: its upstream area, with its
own. Areas are those of the ground, row by row in geographic coordinates. Nothing is known beyond
voids and the raster's edge; water leaves there.</p>
<p><b>Method.</b> <i>d8</i>: all water goes to the steepest of the eight neighbours. <i>dinf</i>: to
the one or two neighbours about the steepest slope (Tarboton 1997). <i>mfd</i>: to all lower
neighbours, by a power of the slope (Freeman 1991, Holmgren 1994); it spreads on hillsides, as water
does. <i>particles</i>: many drops walk down by chance, in the shares of mfd; the area comes with a
standard error.</p>
<p><b>Depressions.</b> <i>fill</i> raises them to their lowest rim (the least surface without any).
<i>breach</i> cuts through the rim where that moves the least ground, and fills what stays.
<i>keep</i> lets water end in them. Water finds its way over flats.</p>
<p><b>Streams</b> begin where the upstream area by d8 reaches the threshold, whatever the method, so
that none breaks off. Lines run from head or confluence to the next, and tell Strahler's order,
length and upstream area.</p>
<p><b>Flags</b> tell which catchments touch the raster's edge or a void (more water may come from
there), hold filled cells (give the source map of <i>Fill voids</i>), or hold depressions that were
changed.</p>
"""

_COUNTS = (
    ("LARGEST_AREA", "largest_area", "Largest upstream area"),
    ("CELLS_CHANGED", "cells_changed", "Cells changed in depressions"),
    ("LINKS", "links", "Stream links"),
    ("STREAM_LENGTH", "stream_length_m", "Length of streams [m]"),
    ("SECONDS", "seconds", "Run time [s]"),
)
_RASTERS = (
    ("LOG", "Logarithm of upstream area", styling.style_log_flow,
     "GeoTIFF of its common logarithm."),
    ("SPECIFIC", "Specific catchment area", styling.style_flow,
     "GeoTIFF of upstream area by width of flow, in m² a metre."),
    ("STANDARD_ERROR", "Standard error", styling.style_standard_error,
     "GeoTIFF of the upstream area's standard error, by method particles only."),
    ("DIRECTIONS", "Flow directions", styling.style_directions,
     "GeoTIFF of ESRI's codes of D8: 1 east, 2 south-east, 4 south, ... 128 north-east."),
    ("FLAGS", "Catchment flags", styling.style_catchment_flags,
     "GeoTIFF of sums: 1 touches edge or void, 2 holds filled cells, 4 depressions changed."),
    ("CONDITIONED", "Conditioned elevations", styling.style_terrain,
     "GeoTIFF of the elevations after the treatment of depressions."),
    ("STREAM_MASK", "Stream mask", styling.style_stream_mask, "GeoTIFF: 1 in streams, else 0."),
    ("COARSE", "Largest area of coarse cells", styling.style_flow,
     "GeoTIFF of fewer cells, each the largest upstream area of its block."),
)  # fmt: skip


class DrainageArea(BandTool):
    """Drain a raster: `demsmith.core.hydrology.drainage_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "drainagearea"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Drainage area")

    def group(self):
        """Name the tool's group in the toolbox."""
        return tr("Hydrology")

    def groupId(self):
        """Name the tool's group in ids."""
        return "hydrology"

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "drainage,upstream area,catchment,watershed,flow accumulation,flow direction,d8,dinf,"
            "d-infinity,mfd,streams,rivers,channels,strahler,sinks,depressions,fill,breach,"
            "hydrology,twi,dem,dtm,srtm,elevation,terrain"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr("Tells how much ground drains through each cell, and finds streams.")

    def shortHelpString(self):
        """Give the help panel's text."""
        return tr(_HELP.replace("\n", " "))

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.hydrology.options import DrainageOptions

        self.add_source("Raster that is drained. It is never changed.")
        add_options(self, DrainageOptions)
        add(self, QgsProcessingParameterRasterLayer("WEIGHTS", tr("Weights"), optional=True),
            help_text="Raster on the same grid of what each cell adds instead of its area, such as "
            "runoff; 0 or more. Its first band is read.", advanced=True)  # fmt: skip
        add(self, QgsProcessingParameterRasterLayer(
                "FILLED_MASK", tr("Filled cells"), optional=True),
            help_text="Raster on the same grid that is not 0 where elevations were filled, such as "
            "the source map of Fill voids; for the flags.", advanced=True)  # fmt: skip
        self.add_running()
        self._declare_outputs()

    def _declare_outputs(self):
        add(self, QgsProcessingParameterRasterDestination("OUTPUT", tr("Upstream area")),
            help_text="GeoTIFF of the area that drains through each cell, with its own."
            )  # fmt: skip
        add(self, QgsProcessingParameterVectorDestination(
                "STREAMS", tr("Streams"), QgsProcessing.SourceType.TypeVectorLine,
                optional=True, createByDefault=False),
            help_text="GeoPackage or GeoJSON of lines with Strahler's order, length and upstream "
            "area.")  # fmt: skip
        for name, title, _, help_text in _RASTERS:
            add(self, QgsProcessingParameterRasterDestination(
                    name, tr(title), optional=True, createByDefault=False),
                help_text=help_text)  # fmt: skip
        for name, _, title in _COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def look_up(self, parameters, context):
        """Find the layers that were given, and keep for the run what names them."""
        super().look_up(parameters, context)
        self._weights = self.raster_source(parameters, "WEIGHTS", context)
        self._filled_mask = self.raster_source(parameters, "FILLED_MASK", context)

    def compute(self, parameters, context, feedback, progress):
        """Drain the raster."""
        from demsmith.core.hydrology import DrainageOptions, drainage_file

        names = ["OUTPUT", "STREAMS", *(name for name, *_ in _RASTERS)]
        paths = {
            name: self.parameterAsOutputLayer(parameters, name, context) or None for name in names
        }
        result = drainage_file(
            **self.read_source(parameters, context),
            **{name.lower(): path for name, path in paths.items()},
            options=read_options(self, DrainageOptions, parameters, context),
            weights=self._weights,
            filled_mask=self._filled_mask,
            **self.read_running(parameters, context),
            progress=progress,
        )
        for warning in result.warnings:
            feedback.pushWarning(warning)
        feedback.pushInfo(
            tr("{} cells changed in depressions; largest upstream area {:.6g}").format(
                result.cells_changed, result.largest_area
            )
        )
        self._style(paths, context)
        outputs = {name: path for name, path in paths.items() if path}
        counts = {name: getattr(result, field) for name, field, _ in _COUNTS}
        outputs.update({name: count for name, count in counts.items() if count is not None})
        outputs["WARNINGS"] = "\n".join(result.warnings)
        return outputs

    def _style(self, paths, context):
        styling.style_flow(paths["OUTPUT"], context)
        if paths["STREAMS"]:
            styling.style_streams(paths["STREAMS"], context)
        for name, _, style, _ in _RASTERS:
            if paths[name]:
                style(paths[name], context)
