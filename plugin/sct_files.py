"""`.sct` files in QGIS's window: dropped on it, they are decoded to a temporary layer."""

import os

from qgis.core import (
    Qgis,
    QgsApplication,
    QgsProcessingAlgRunnerTask,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingOutputLayerDefinition,
    QgsProject,
    QgsRasterLayer,
)
from qgis.gui import QgsCustomDropHandler
from qgis.PyQt.QtCore import QCoreApplication

_TOOL = "demsmith:decompress"


def _tr(text):
    return QCoreApplication.translate("Demsmith", text)


class SctDropHandler(QgsCustomDropHandler):
    """Opens dropped `.sct` files by the tool *Decompress*, in the background.

    Parameters
    ----------
    iface : qgis.gui.QgisInterface
        QGIS's window.
    """

    def __init__(self, iface):
        super().__init__()
        self._iface = iface
        self._runs = set()

    def handleFileDrop(self, file):
        """Take a dropped file, if it is one of ours."""
        if not file.lower().endswith(".sct"):
            return False
        tool = QgsApplication.processingRegistry().createAlgorithmById(_TOOL)
        if tool is None:
            return False
        run = _Run(tool, file, self._finish)
        self._runs.add(run)
        run.start()
        return True

    def cancel(self):
        """Stop all that still runs."""
        for run in tuple(self._runs):
            run.feedback.cancel()

    def _finish(self, run, problem):
        self._runs.discard(run)
        if problem:
            self._iface.messageBar().pushMessage("Demsmith", problem, Qgis.MessageLevel.Critical, 0)


class _Run:
    """The decoding of one file; what it needs lives until it has ended."""

    def __init__(self, tool, file, finish):
        self._file, self._finish = file, finish
        self.feedback = QgsProcessingFeedback()
        self._context = QgsProcessingContext()
        self._context.setProject(QgsProject.instance())
        output = QgsProcessingOutputLayerDefinition("TEMPORARY_OUTPUT", QgsProject.instance())
        self._parameters = {"INPUT": file, "OUTPUT": output}
        self._tool = tool

    def start(self):
        # Once more here: a task tells only that it failed.
        fine, problem = self._tool.canExecute()
        if fine:
            fine, problem = self._tool.checkParameterValues(self._parameters, self._context)
        if not fine:
            self._finish(self, problem)
            return
        self._task = QgsProcessingAlgRunnerTask(
            self._tool, self._parameters, self._context, self.feedback
        )
        self._task.executed.connect(self._end)
        QgsApplication.taskManager().addTask(self._task)

    def _end(self, fine, results):
        problem = ""
        if fine:
            self._show(results["OUTPUT"])
        elif not self.feedback.isCanceled():
            problem = _tr("'{}' cannot be opened: {}").format(
                self._file, self.feedback.textLog().strip()
            )
        self._finish(self, problem)

    def _show(self, path):
        name = os.path.splitext(os.path.basename(self._file))[0]
        layer = QgsRasterLayer(path, name)
        details = self._context.layersToLoadOnCompletion().get(path)
        if details is not None and details.postProcessor() is not None:
            details.postProcessor().postProcessLayer(layer, self._context, self.feedback)
        QgsProject.instance().addMapLayer(layer)
