"""The tool *Learn dictionary*."""

from qgis.core import (
    QgsProcessing,
    QgsProcessingException,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterMultipleLayers,
)

from demsmith.algorithms.base import file_of
from demsmith.algorithms.parameters import add, add_options, number, read_options, tr
from demsmith.algorithms.source import CellTool

_HELP = """
<p>Learns a dictionary of terrain shapes, the <i>atoms</i>, from elevation models that serve as
exemplars. Every disc of the terrain is to be the sum of few atoms. <i>Compress</i> takes it for
its tree of patches.</p>
<p><b>K-SVD</b> (<i>ksvd</i>): atoms are free shapes and represent the exemplars best.
<b>Constrained</b> (<i>constrained</i>): every atom is one of the terrain's own discs, and the file
tells which. <b>Complete</b> (<i>complete</i>): all discs are atoms; the file holds the exemplars
and their places.</p>
<p><b>Atoms of a disc.</b> Learn with as many as the dictionary is used with: few, 1 or 2, make
atoms that are whole landforms; many make atoms that are parts of them.</p>
<p><b>Factor.</b> Above 1 every atom has two resolutions, the exemplar's and one so many times
coarser.</p>
<p>Discs with a void are skipped. Radii are metres on the ground in the middle row of the first
exemplar, also in geographic coordinates.</p>
<p>E. Guérin et al., <i>Sparse representation of terrains for procedural modeling</i>, 2016, §4.</p>
"""

_COUNTS = (
    ("ATOMS_LEARNED", "atoms", "Atoms in the dictionary"),
    ("SIDE_ROWS", "side_rows", "Rows across a disc"),
    ("SIDE_COLUMNS", "side_columns", "Columns across a disc"),
    ("DISCS", "discs", "Discs learned from"),
    ("DISCS_SKIPPED", "discs_skipped", "Discs skipped for a void"),
    ("RMSE", "rmse", "Root-mean-square error of the discs [m]"),
    ("BYTES", "bytes", "Bytes of the file"),
    ("SECONDS", "seconds", "Run time [s]"),
)


class LearnDictionary(CellTool):
    """Learn a dictionary: `demsmith.core.sparse.learn_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "learndictionary"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Learn dictionary")

    def group(self):
        """Name the tool's group in the toolbox."""
        return tr("Compression")

    def groupId(self):
        """Name the tool's group in ids."""
        return "compression"

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "learn,dictionary,dsd,atoms,ksvd,k-svd,sparse,exemplar,train,training,compress,"
            "amplify,super-resolution,matching pursuit,dem,dtm,dsm,srtm,elevation,terrain"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr("Learns terrain shapes from exemplars, of which terrain can be made up.")

    def shortHelpString(self):
        """Give the help panel's text."""
        return tr(_HELP.replace("\n", " "))

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.sparse.options import LearnOptions, StoreOptions

        add(self, QgsProcessingParameterMultipleLayers(
                "INPUT", tr("Exemplars"), QgsProcessing.SourceType.TypeRaster),
            help_text="Elevation rasters to learn from. They are never changed.")  # fmt: skip
        add(self, number("BAND", "Band", kind=int, default=1, minValue=1), advanced=True,
            help_text="The band that holds the elevations, of every exemplar.")  # fmt: skip
        self.add_cells()
        add_options(self, LearnOptions)
        add_options(self, StoreOptions)
        self.add_threads()
        add(self, QgsProcessingParameterFileDestination(
                "OUTPUT", tr("Dictionary"), tr("Dictionary (*.dsd)")),
            help_text="Dictionary, .dsd.")  # fmt: skip
        for name, _, title in _COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def look_up(self, parameters, context):
        """Find the layers that were given, and keep for the run what names them."""
        layers = self.parameterAsLayerList(parameters, "INPUT", context)
        self._exemplars = [file_of(layer, "INPUT") for layer in layers]
        if not self._exemplars:
            raise QgsProcessingException(tr("there are no exemplars: give INPUT"))

    def compute(self, parameters, context, feedback, progress):
        """Learn the dictionary."""
        from demsmith.core.sparse.job import learn_file
        from demsmith.core.sparse.options import LearnOptions, StoreOptions

        output = self.parameterAsFileOutput(parameters, "OUTPUT", context)
        result = learn_file(
            self._exemplars,
            output,
            options=read_options(self, LearnOptions, parameters, context),
            store=read_options(self, StoreOptions, parameters, context),
            band=self.parameterAsInt(parameters, "BAND", context),
            **self.read_cells(parameters, context),
            **self.read_threads(parameters, context),
            progress=progress,
        )
        for warning in result.warnings:
            feedback.pushWarning(warning)
        feedback.pushInfo(
            tr("{} atoms of {} x {} cells from {} discs").format(
                result.atoms, result.side_rows, result.side_columns, result.discs
            )
        )
        outputs = {name: getattr(result, field) for name, field, _ in _COUNTS}
        outputs.update(OUTPUT=output, WARNINGS="\n".join(result.warnings))
        return {name: value for name, value in outputs.items() if value is not None}
