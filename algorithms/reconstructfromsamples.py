"""The tool *Reconstruct from samples*."""

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessing,
    QgsProcessingException,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterCrs,
    QgsProcessingParameterEnum,
    QgsProcessingParameterExtent,
    QgsProcessingParameterFile,
    QgsProcessingParameterMultipleLayers,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterString,
)

from demsmith.algorithms import styling
from demsmith.algorithms.base import help_picture
from demsmith.algorithms.parameters import (
    add,
    add_maps,
    add_options,
    number,
    read_maps,
    read_number,
    read_options,
    tr,
)
from demsmith.algorithms.samplelayers import SampleLayers
from demsmith.algorithms.source import VoidTool

_HELP = """
{picture}
<p>Makes an elevation model from scattered points, ridge and valley lines, contour lines, a raster
of which only some cells are known, a painted sketch, any of them together, or from nothing at
all.</p>
<p><b>Samples.</b> A cell takes its elevation from the first of these that has one for it: points
(their mean), rasters, lines, contours, sketch. All other cells are made.</p>
<p><b>Elevations</b> are those of the <i>elevation attribute</i> if you name one, else the z of the
geometries, else the attribute that is obviously meant, such as <i>z</i>, <i>elev</i> or
<i>height</i>. Lines may rise and fall from vertex to vertex; contour lines are of one elevation
each and the ground rises on one side of them and falls on the other.</p>
<p><b>Which ground.</b> Take over another raster's grid, or give the resolution, and the extent if
it is not that of the samples. Where nothing is given, a raster among the samples gives its own.</p>
<p><b>Sketch.</b> Any image, stretched over the extent: black is the lowest elevation, white the
highest; ridges and valleys painted on an empty background suffice.</p>
<p><b>Method.</b> Constrained midpoint displacement (F. Belhadj, <i>Terrain modeling: a
constrained fractal model</i>, 2007), by default as the surface of least bending through the
samples. Strength <i>r_s</i> above 0 adds roughness; the presets are the parameters of the paper's
figures. Without any sample the terrain is a fractal: give its extent and resolution, and its
relief and seed among the advanced parameters.</p>
"""

_COUNTS = (
    ("SAMPLES", "samples", "Samples in the grid"),
    ("SAMPLES_OUTSIDE", "samples_outside", "Samples beyond the grid"),
    ("ROWS", "rows", "Rows"),
    ("COLUMNS", "columns", "Columns"),
    ("CELLS_KNOWN", "cells_known", "Cells that hold a sample"),
    ("CELLS_FILLED", "cells_filled", "Cells made between samples"),
    ("SECONDS", "seconds", "Run time [s]"),
)

_WKT2 = QgsCoordinateReferenceSystem.WktVariant.WKT_PREFERRED
_READING = 0.2  # of the progress
_DECIMALS = 12  # of a resolution in degrees


class ReconstructFromSamples(VoidTool):
    """Make terrain from samples: `demsmith.core.samples.samples_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "reconstructfromsamples"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Reconstruct from samples")

    def group(self):
        """Name the tool's group in the toolbox."""
        return tr("Samples")

    def groupId(self):
        """Name the tool's group in ids."""
        return "samples"

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "samples,points,contours,contour lines,ridge,valley,breaklines,sketch,image,heightmap,"
            "noise,fractal,random,interpolate,interpolation,grid,rasterize,spline,tin,thinned,dem,"
            "dtm,elevation,terrain,mcmd,midpoint displacement"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr(
            "Makes an elevation model from points, lines, contours, a thinned raster or a sketch."
        )

    def shortHelpString(self):
        """Give the help panel's text."""
        picture = help_picture("reconstructfromsamples.png")
        return tr(_HELP.replace("\n", " ")).format(picture=picture)

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.samples import SampleOptions

        self._declare_samples()
        self._declare_grid()
        self._declare_sketch()
        add_options(self, SampleOptions)
        add_maps(self)
        self.add_running()
        self._declare_outputs()

    def _declare_samples(self):
        kinds = QgsProcessing.SourceType
        add(self, QgsProcessingParameterMultipleLayers(
                "INPUT", tr("Points, lines and thinned rasters"), kinds.TypeMapLayer,
                optional=True),
            help_text="Layers of points, of ridge and valley lines, and rasters of which only "
            "some cells are known. None: terrain from noise alone, or from contours or a sketch.",
            )  # fmt: skip
        add(self, QgsProcessingParameterMultipleLayers(
                "CONTOURS", tr("Contour lines"), kinds.TypeVectorLine, optional=True),
            help_text="Lines of one elevation each.")  # fmt: skip
        add(self, QgsProcessingParameterString("FIELD", tr("Elevation attribute"), optional=True),
            help_text="Attribute that holds the elevations of vector layers. Not given: the z of "
            "the geometries, or else the attribute whose name tells, such as z, elev or height.",
            )  # fmt: skip
        add(self, QgsProcessingParameterBoolean(
                "SELECTED_ONLY", tr("Only selected features"), defaultValue=False),
            help_text="Of vector layers that have a selection, read only that.",
            advanced=True)  # fmt: skip
        add(self, number("BAND", "Band of rasters", kind=int, default=1, minValue=1),
            help_text="The band that holds the elevations.", advanced=True)  # fmt: skip
        self.add_voids(advanced=True)

    def _declare_grid(self):
        add(self, QgsProcessingParameterRasterLayer(
                "LIKE", tr("Raster whose grid to take"), optional=True),
            help_text="Its extent, resolution and CRS are taken; leave these empty then.",
            )  # fmt: skip
        add(self, QgsProcessingParameterExtent("EXTENT", tr("Extent"), optional=True),
            help_text="Not given: that of all samples.")  # fmt: skip
        resolution = number("RESOLUTION", "Resolution [units of the CRS]", optional=True)
        resolution.setMetadata({"widget_wrapper": {"decimals": _DECIMALS}})
        add(self, resolution,
            help_text="Width and height of a cell, in degrees where the CRS is geographic. Not "
            "given: that of a raster among the samples, or a cell for each pixel of a sketch.",
            )  # fmt: skip
        add(self, QgsProcessingParameterCrs("CRS", tr("CRS of the result"), optional=True),
            help_text="Not given: that of the first raster, or else of the first layer.",
            )  # fmt: skip

    def _declare_sketch(self):
        from demsmith.core.samples.sketch import BACKGROUNDS

        add(self, QgsProcessingParameterFile(
                "SKETCH", tr("Sketch"), optional=True,
                fileFilter=tr("Images") + " (*.png *.tif *.tiff *.exr *.jpg *.jpeg *.hdr *.bmp);;"
                + tr("All files") + " (*.*)"),
            help_text="Image whose brightness is elevation, stretched over the extent.",
            )  # fmt: skip
        add(self, number("SKETCH_LOW", "Elevation of black [m]", default=0.0),
            help_text="Elevation of the sketch where it is black.")  # fmt: skip
        add(self, number("SKETCH_HIGH", "Elevation of white [m]", default=1000.0),
            help_text="Elevation of the sketch where it is white.")  # fmt: skip
        add(self, QgsProcessingParameterEnum(
                "SKETCH_BACKGROUND", tr("Unpainted colour of the sketch"),
                options=list(BACKGROUNDS), defaultValue=next(iter(BACKGROUNDS)),
                usesStaticStrings=True),
            help_text="What is unpainted in an image without transparency; in one with, it is "
            "what is transparent.", advanced=True)  # fmt: skip

    def _declare_outputs(self):
        add(self, QgsProcessingParameterRasterDestination("OUTPUT", tr("Terrain")),
            help_text="GeoTIFF of the terrain.")  # fmt: skip
        add(self, QgsProcessingParameterRasterDestination(
                "SOURCE_MAP", tr("Source map"), optional=True, createByDefault=False),
            help_text="GeoTIFF of 0 sample, 1 made between samples.")  # fmt: skip
        for name, _, title in _COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def compute(self, parameters, context, feedback, progress):
        """Make the terrain."""
        from demsmith.core.progress import Span
        from demsmith.core.samples import SampleOptions, samples_file

        output = self.parameterAsOutputLayer(parameters, "OUTPUT", context)
        source_map = self.parameterAsOutputLayer(parameters, "SOURCE_MAP", context)
        options = read_options(self, SampleOptions, parameters, context)
        samples, notes = self._layers.read(
            self._crs, context.transformContext(), Span(progress, 0, _READING)
        )
        result = samples_file(
            [*samples, *self._layers.tables, *self._layers.rasters],
            output,
            options=options,
            maps=self._maps,
            source_map=source_map or None,
            **self._grid,
            **self._sketch(parameters, context),
            field=self._field(parameters, context),
            band=self.parameterAsInt(parameters, "BAND", context),
            **self.read_voids(parameters, context),
            **self.read_running(parameters, context),
            progress=Span(progress, _READING, 1),
        )
        warnings = (*notes, *result.warnings)
        for warning in warnings:
            feedback.pushWarning(warning)
        feedback.pushInfo(
            tr("{} × {} cells, {} of them from {} samples").format(
                result.rows, result.columns, result.cells_known, result.samples
            )
        )
        if result.tuning and result.tuning["accepted"]:
            feedback.pushInfo(result.tuning["summary"])
        outputs = {name: getattr(result, field) for name, field, _ in _COUNTS}
        outputs.update(OUTPUT=output, WARNINGS="\n".join(warnings))
        styling.style_terrain(output, context)
        if source_map:
            outputs["SOURCE_MAP"] = source_map
            styling.style_sample_map(source_map, context)
        return outputs

    def look_up(self, parameters, context):
        """Find the layers, and the grid as far as they tell it; all is kept for the run."""
        super().look_up(parameters, context)
        self._like = self.raster_source(parameters, "LIKE", context)
        self._maps = read_maps(self, parameters, context)
        self._layers = SampleLayers(
            self.parameterAsLayerList(parameters, "INPUT", context),
            self.parameterAsLayerList(parameters, "CONTOURS", context),
            field=self._field(parameters, context),
            selected_only=self.parameterAsBoolean(parameters, "SELECTED_ONLY", context),
        )
        self._crs = self._output_crs(parameters, context)
        self._grid = self._grid_asked(parameters, context)
        painted = parameters.get("SKETCH")
        placed = self._like or (parameters.get("EXTENT") and parameters.get("RESOLUTION"))
        if not (self._layers or painted or placed):
            raise QgsProcessingException(
                tr("there are no samples: give INPUT, CONTOURS or SKETCH, or for terrain from "
                   "noise alone EXTENT and RESOLUTION, or LIKE")
            )  # fmt: skip

    def _output_crs(self, parameters, context):
        if self._like:
            return self.parameterAsRasterLayer(parameters, "LIKE", context).crs()
        candidates = (
            self.parameterAsCrs(parameters, "CRS", context),
            self._layers.crs,
            self.parameterAsExtentCrs(parameters, "EXTENT", context),
        )
        return next((crs for crs in candidates if crs.isValid()), QgsCoordinateReferenceSystem())

    def _field(self, parameters, context):
        return self.parameterAsString(parameters, "FIELD", context).strip() or None

    def _grid_asked(self, parameters, context):
        """Give the arguments of `samples_file` that say which grid is made."""
        extent = self.parameterAsExtent(parameters, "EXTENT", context, self._crs)
        corners = (extent.xMinimum(), extent.yMinimum(), extent.xMaximum(), extent.yMaximum())
        asked = self.parameterAsCrs(parameters, "CRS", context).isValid()
        # Rasters tell their CRS themselves; asked for, it would mean that theirs is not wanted.
        told = self._like or self._layers.rasters
        return dict(
            like=self._like,
            extent=corners if parameters.get("EXTENT") else None,
            resolution=read_number(self, "RESOLUTION", parameters, context),
            crs=self._crs.toWkt(_WKT2) if asked or not told else "",
        )

    def _sketch(self, parameters, context):
        """Give the arguments of `samples_file` that say what is painted."""
        return dict(
            sketch=self.parameterAsFile(parameters, "SKETCH", context) or None,
            sketch_low=self.parameterAsDouble(parameters, "SKETCH_LOW", context),
            sketch_high=self.parameterAsDouble(parameters, "SKETCH_HIGH", context),
            sketch_background=self.parameterAsEnumString(parameters, "SKETCH_BACKGROUND", context),
        )
