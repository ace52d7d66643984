"""The tool *Inverse procedural model*."""

from qgis.core import (
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterRasterDestination,
)

from demsmith.algorithms import styling
from demsmith.algorithms.parameters import add, add_options, read_options, tr
from demsmith.algorithms.source import BandTool

_HELP = """
<p>Models terrain by functions: a lattice of overlapping discs, each the sum of its mean and a few
noises out of a dictionary. The model is a file of parameters, not of cells, and a continuous
surface that is evaluated at any resolution.</p>
<p><b>Ridged</b> (<i>ridged</i>): noise with sharp crests, which follows mountains best.
<b>Perlin</b> (<i>perlin</i>): smooth noise. <b>Multifractal</b> (<i>multifractal</i>): Musgrave's
ridged multifractal, rough on crests and smooth in valleys. <b>Mixed</b> (<i>mixed</i>): all of
them.</p>
<p><b>Atoms of a disc.</b> More follow the terrain more closely and make a larger file.
<b>Radius.</b> Discs of a smaller radius do the same. The radius is in metres on the ground, also in
geographic coordinates.</p>
<p><b>Model.</b> The file (.dsp) can be evaluated again by <i>demsmith proceduralize MODEL
OUTPUT</i> on the command line, and by <i>demsmith.read_terrain</i> in Python. Voids stay voids.</p>
<p>E. Guérin et al., <i>Sparse representation of terrains for procedural modeling</i>, 2016,
§5.2.</p>
"""

_COUNTS = (
    ("RMSE", "rmse", "Root-mean-square error of the model"),
    ("PSNR", "psnr", "Peak signal-to-noise ratio [dB]"),
    ("DISCS", "discs", "Discs of the model"),
    ("BYTES", "bytes", "Bytes of the model's file"),
    ("SECONDS", "seconds", "Run time [s]"),
)


class InverseProcedural(BandTool):
    """Model terrain: `demsmith.core.procedural.proceduralize_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "inverseprocedural"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Inverse procedural model")

    def group(self):
        """Name the tool's group in the toolbox."""
        return tr("Synthesis")

    def groupId(self):
        """Name the tool's group in ids."""
        return "synthesis"

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "procedural,inverse,proceduralize,noise,perlin,ridged,multifractal,fractal,function,"
            "sparse,model,dsp,resolution,amplify,dem,dtm,dsm,srtm,elevation,terrain"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr("Models terrain by noise functions, and evaluates it at any resolution.")

    def shortHelpString(self):
        """Give the help panel's text."""
        return tr(_HELP.replace("\n", " "))

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.procedural.options import OutputOptions, ProceduralizeOptions

        self.add_source("Raster to model. It is never changed.")
        add_options(self, ProceduralizeOptions)
        add_options(self, OutputOptions)
        self.add_running()
        add(self, QgsProcessingParameterRasterDestination("OUTPUT", tr("Modelled terrain")),
            help_text="GeoTIFF of the model's elevations, float32.")  # fmt: skip
        add(self, QgsProcessingParameterFileDestination(
                "MODEL", tr("Model"), tr("Procedural terrain (*.dsp)"), optional=True,
                createByDefault=False),
            help_text="The model itself, a file of parameters.")  # fmt: skip
        for name, _, title in _COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def compute(self, parameters, context, feedback, progress):
        """Model the raster."""
        from demsmith.core.procedural import proceduralize_file
        from demsmith.core.procedural.options import OutputOptions, ProceduralizeOptions

        output = self.parameterAsOutputLayer(parameters, "OUTPUT", context)
        model = self.parameterAsFileOutput(parameters, "MODEL", context)
        result = proceduralize_file(
            **self.read_source(parameters, context),
            output=model or None,
            raster_output=output,
            options=read_options(self, ProceduralizeOptions, parameters, context),
            outputs=read_options(self, OutputOptions, parameters, context),
            **self.read_running(parameters, context),
            progress=progress,
        )
        for warning in result.warnings:
            feedback.pushWarning(warning)
        feedback.pushInfo(
            tr("{} cells modelled by {} discs of {} functions: RMSE {}").format(
                result.cells_known, result.discs, result.atoms, format(result.rmse, ".3g")
            )
        )
        outputs = {name: getattr(result, field) for name, field, _ in _COUNTS}
        outputs.update(OUTPUT=output, WARNINGS="\n".join(result.warnings))
        styling.style_terrain(output, context)
        if model:
            outputs["MODEL"] = model
        return {name: value for name, value in outputs.items() if value is not None}
