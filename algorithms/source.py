"""What tools share that read elevations: which raster, band and cells are read."""

from qgis.core import (
    QgsProcessingException,
    QgsProcessingParameterBand,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterString,
)

from demsmith.algorithms.base import Tool
from demsmith.algorithms.parameters import add, number, read_number, tr


class CellTool(Tool):
    """A tool that is told by `add_cells` which of the elevations it reads are none."""

    def add_cells(self):
        """Declare which values mean void."""
        self._add_nodata()
        self._add_limits()

    def _add_nodata(self, *, advanced=False):
        add(self, QgsProcessingParameterString(
                "NODATA", tr("More values that mean void"), optional=True), advanced=advanced,
            help_text="Numbers, separated by commas: what has these values is void, besides "
            "a band's nodata value.")  # fmt: skip

    def _add_limits(self):
        add(self, number("BELOW", "Void at or below", optional=True), advanced=True,
            help_text="What has this value or a lower one is void.")  # fmt: skip
        add(self, number("ABOVE", "Void at or above", optional=True), advanced=True,
            help_text="What has this value or a higher one is void.")  # fmt: skip

    def checkParameterValues(self, parameters, context):
        """Check what can be checked before the run."""
        fine, message = super().checkParameterValues(parameters, context)
        if not fine:
            return False, message
        from demsmith.core.errors import InputError

        try:
            self.look_up(parameters, context)
            self._void_values(parameters, context)
        except (QgsProcessingException, InputError) as error:
            return False, str(error)
        return True, ""

    def prepareAlgorithm(self, parameters, context, feedback):
        """Look layers up here, in the main thread, where QGIS keeps them."""
        self.look_up(parameters, context)
        return True

    def look_up(self, parameters, context):
        """Find the layers that were given, and keep for the run what names them."""
        raise NotImplementedError

    def read_cells(self, parameters, context):
        """Give the arguments of the core's file functions that say which values mean void."""
        return dict(
            nodata=self._void_values(parameters, context),
            below=read_number(self, "BELOW", parameters, context),
            above=read_number(self, "ABOVE", parameters, context),
        )

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


class VoidTool(CellTool):
    """A tool that takes a mask of voids, too: it is told by `add_voids`."""

    def add_voids(self, *, advanced=False):
        """Declare what means void, folded away if ``advanced``."""
        self._add_nodata(advanced=advanced)
        add(self, QgsProcessingParameterRasterLayer(
                "MASK", tr("Mask of voids"), optional=True), advanced=advanced,
            help_text="Raster of the same size: cells that are neither 0 nor nodata are voids.",
            )  # fmt: skip
        self._add_limits()

    def look_up(self, parameters, context):
        """Find the layers that were given, and keep for the run what names them."""
        self._mask = self.raster_source(parameters, "MASK", context)

    def read_voids(self, parameters, context):
        """Give the arguments of the core's file functions that say what means void."""
        return dict(mask=self._mask, **self.read_cells(parameters, context))


class BandTool(VoidTool):
    """A tool that reads one band of a raster; its `initAlgorithm` begins with `add_source`."""

    def add_source(self, help_text):
        """Declare the raster, whose ``help_text`` is given, its band and its voids."""
        add(self, QgsProcessingParameterRasterLayer("INPUT", tr("Elevation model")),
            help_text=help_text)  # fmt: skip
        add(self, QgsProcessingParameterBand("BAND", tr("Band"), 1, "INPUT", optional=True),
            help_text="The band that holds the elevations.")  # fmt: skip
        self.add_voids()

    def look_up(self, parameters, context):
        """Find the layers that were given, and keep for the run what names them."""
        super().look_up(parameters, context)
        self._input = self.raster_source(parameters, "INPUT", context)

    def read_source(self, parameters, context):
        """Give the arguments of the core's file functions that say what is read."""
        return dict(
            input=self._input,
            band=self.parameterAsInt(parameters, "BAND", context),
            **self.read_voids(parameters, context),
        )
