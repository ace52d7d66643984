"""Running a tool as QGIS does it on a worker thread, and what a tool's parameters are."""

import time

from qgis.core import (
    QgsApplication,
    QgsProcessingAlgRunnerTask,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingParameterDefinition,
)
from qgis.PyQt.QtCore import QEventLoop, QTimer


def tool(name):
    """Make the tool of this name, such as ``fillvoids``."""
    return QgsApplication.processingRegistry().createAlgorithmById(f"demsmith:{name}")


def parameter_row(parameter):
    """Name, type, default and flags of a parameter, as words."""
    flags = QgsProcessingParameterDefinition.Flag
    default = parameter.defaultValue()
    row = [
        parameter.name(),
        parameter.type(),
        "-" if default in (None, "") else str(default),
        "optional" if parameter.flags() & flags.FlagOptional else "required",
    ]
    return row + ["advanced"] * bool(parameter.flags() & flags.FlagAdvanced)


def assert_parameters(made, promised):
    """Require of a tool these rows of `parameter_row`, one a line, and that each is explained."""
    rows = [parameter_row(parameter) for parameter in made.parameterDefinitions()]
    assert rows == [line.split() for line in promised.strip().splitlines()]
    for parameter in made.parameterDefinitions():
        assert parameter.help(), parameter.name()
        assert parameter.description() != parameter.name()


class TaskRun:
    """One run of a tool as a task, with the main thread's event loop ticking meanwhile."""

    def __init__(self, name, parameters, *, cancel_at=None):
        self.feedback = QgsProcessingFeedback()
        self.context = QgsProcessingContext()
        self.progress, self.gaps, self.cancelled_at = [], [], None
        task = QgsProcessingAlgRunnerTask(tool(name), parameters, self.context, self.feedback)
        self._loop = QEventLoop()
        self._cancel_at = cancel_at
        self.feedback.progressChanged.connect(self._on_progress)
        task.executed.connect(self._on_end)
        timer = QTimer()
        timer.timeout.connect(self._tick)
        self._last = time.perf_counter()
        timer.start(10)
        QgsApplication.taskManager().addTask(task)
        self._loop.exec()
        timer.stop()

    def _tick(self):
        now = time.perf_counter()
        self.gaps.append(now - self._last)
        self._last = now

    def _on_progress(self, percent):
        self.progress.append(percent)
        if self._cancel_at is not None and percent >= self._cancel_at and not self.cancelled_at:
            self.cancelled_at = time.perf_counter()
            self.feedback.cancel()

    def _on_end(self, fine, outputs):
        self.ended_at = time.perf_counter()
        self.fine, self.outputs = fine, outputs
        self._loop.quit()
