"""What all tools share: their run with its errors, cancel and progress; inputs; help."""

import configparser
import os

from qgis.core import (
    QgsProcessing,
    QgsProcessingAlgorithm,
    QgsProcessingException,
    QgsProcessingUtils,
    QgsProviderRegistry,
)
from qgis.PyQt.QtCore import QUrl
from qgis.PyQt.QtGui import QIcon

from demsmith.algorithms import dependencies
from demsmith.algorithms.parameters import (
    add,
    creation_options,
    number,
    read_creation_options,
    read_number,
    tr,
)
from demsmith.algorithms.provider import ICON, ROOT


class Tool(QgsProcessingAlgorithm):
    """A Processing tool over one operation of the core.

    A tool defines QGIS's ``name``, ``displayName``, ``group`` and ``initAlgorithm``, and
    `compute`; where it takes rasters, `prepareAlgorithm` asks `raster_source` for each.
    """

    def createInstance(self):
        """Make another of the same kind."""
        return type(self)()

    def icon(self):
        """Show Demsmith's icon."""
        return QIcon(ICON)

    def helpUrl(self):
        """Give the address of the user guide."""
        manifest = configparser.ConfigParser(interpolation=None)
        manifest.read(os.path.join(ROOT, "metadata.txt"), encoding="utf-8")
        return manifest.get("general", "homepage")

    def canExecute(self):
        """Tell whether all libraries are there, and what to do where one is not."""
        problem = dependencies.problem()
        return not problem, problem

    def checkParameterValues(self, parameters, context):
        """Check what QGIS checks, then that outputs are of a kind that can be written."""
        fine, message = super().checkParameterValues(parameters, context)
        if not fine:
            return False, _why_unreadable(self, parameters, context) or message
        for output in self.destinationParameterDefinitions():
            value = parameters.get(output.name())
            if value:
                fine, message = self.provider().isSupportedOutputValue(value, output, context)
                if not fine:
                    return False, f"{output.name()}: {message}"
        return True, ""

    def processAlgorithm(self, parameters, context, feedback):
        """Run `compute`; what it raises on purpose reaches the user as its message alone."""
        # Once more: qgis_process never asks canExecute.
        problem = dependencies.problem()
        if problem:
            raise QgsProcessingException(problem)
        from demsmith.core.errors import DemsmithError

        try:
            return self.compute(parameters, context, feedback, _Progress(feedback))
        except ImportError as error:
            raise QgsProcessingException(
                tr(
                    "A library that this tool needs does not load: {}. To install what Demsmith "
                    "needs: {}"
                ).format(
                    error,
                    dependencies.install_command(
                        (*dependencies.REQUIREMENTS, *dependencies.EXTRAS)
                    ),
                )
            ) from error
        except DemsmithError as error:
            raise QgsProcessingException(str(error)) from error

    def compute(self, parameters, context, feedback, progress):
        """Do the work in a worker thread and return the outputs by name."""
        raise NotImplementedError

    def raster_source(self, parameters, name, context):
        """Name a raster input as GDAL opens it.

        Returns
        -------
        str or None
            None for an optional input that was not given.

        Raises
        ------
        QgsProcessingException
            If the layer is no file that GDAL can open, such as a WMS layer.
        """
        layer = self.parameterAsRasterLayer(parameters, name, context)
        if layer is None:
            if parameters.get(name):
                raise QgsProcessingException(self.invalidRasterError(parameters, name))
            return None
        return file_of(layer, name)

    def add_threads(self):
        """Declare how the tool runs."""
        add(self, number("THREADS", "Threads", kind=int, optional=True, minValue=1), advanced=True,
            help_text="Threads that compute; not given: one for every core. "
            "The result is the same.")  # fmt: skip

    def add_running(self):
        """Declare how the tool runs and how rasters are written."""
        self.add_threads()
        add(self, creation_options(), advanced=True,
            help_text="Left empty: tiled and compressed.")  # fmt: skip

    def read_threads(self, parameters, context):
        """Give the arguments of the core's file functions that say how the tool runs."""
        return dict(
            threads=read_number(self, "THREADS", parameters, context, kind=int),
            overwrite=True,  # QGIS has asked the user
        )

    def read_running(self, parameters, context):
        """Give the same with how rasters are written."""
        return dict(
            **self.read_threads(parameters, context),
            creation_options=read_creation_options(
                self.parameterAsString(parameters, "CREATION_OPTIONS", context)
            ),
        )


def file_of(layer, name):
    """Name the file of a raster layer, given for parameter ``name``, as GDAL opens it.

    Raises
    ------
    QgsProcessingException
        If the layer is no file that GDAL can open, such as a WMS layer.
    """
    if layer.providerType() != "gdal":
        raise QgsProcessingException(
            tr("{}: layer '{}' comes from '{}', not from a file; "
               "export it as GeoTIFF and use that").format(
                name, layer.name(), layer.providerType()
            )
        )  # fmt: skip
    return _without_additions(layer.source())


def _why_unreadable(tool, parameters, context):
    """Say which raster cannot be loaded and why; QGIS says that it is not found, or not even that.

    Gives an empty text if all can.
    """
    from demsmith.core.errors import InputError
    from demsmith.core.raster.opening import opened

    for parameter in tool.parameterDefinitions():
        for value in _rasters_given(parameter, parameters):
            if QgsProcessingUtils.mapLayerFromString(value, context):
                continue
            try:
                with opened(value):
                    continue
            except InputError as error:
                return f"{parameter.name()}: {error}"
    return ""


def _rasters_given(parameter, parameters):
    """List the values of a parameter for one raster or several that name a layer or a file."""
    several = parameter.type() == "multilayer"
    if not several and parameter.type() != "raster":
        return []
    if several and parameter.layerType() != QgsProcessing.SourceType.TypeRaster:
        return []
    value = parameters.get(parameter.name())
    values = value if isinstance(value, (list, tuple)) else [value]
    return [each for each in values if isinstance(each, str)]


def _without_additions(source):
    """Strip from a layer's source what QGIS adds to the name GDAL knows."""
    parts = QgsProviderRegistry.instance().decodeUri("gdal", source)
    if parts.get("openOptions"):
        raise QgsProcessingException(
            tr("'{}' is opened with options ({}) that Demsmith does not pass on; "
               "export it as GeoTIFF and use that").format(
                parts["path"], ", ".join(parts["openOptions"])
            )
        )  # fmt: skip
    return source


class _Progress:
    """The core's progress, shown in QGIS."""

    def __init__(self, feedback):
        self._feedback = feedback

    def report(self, fraction):
        self._feedback.setProgress(100 * fraction)

    def cancelled(self):
        return self._feedback.isCanceled()


def help_picture(name):
    """Give the HTML that shows a picture of ``algorithms/help`` in the help panel."""
    path = os.path.join(ROOT, "algorithms", "help", name)
    return f'<p><img src="{QUrl.fromLocalFile(path).toString()}"></p>'
