"""Progress on a terminal, and cancel by signals, for `demsmith.core.progress`."""

import sys
import time

from demsmith.core.cli import interruption

_PATIENCE = 1.0  # seconds without a bar: shorter work is done before one could be read


class CommandProgress:
    """A `Progress` that signals cancel, and that draws a bar on a terminal.

    Parameters
    ----------
    title : str
        What is being done.
    quiet : bool
        Never draw a bar.
    """

    def __init__(self, title, *, quiet=False):
        self._title = title
        self._begin = time.monotonic()
        self._shown = not quiet and sys.stderr is not None and sys.stderr.isatty()
        self._bar = None

    def __enter__(self):
        return self

    def __exit__(self, *failure):
        if self._bar is not None:
            self._bar.stop()

    def report(self, fraction):
        """Move the bar to ``fraction``."""
        if not self._shown:
            return
        if self._bar is None:
            if time.monotonic() - self._begin < _PATIENCE:
                return
            self._bar, self._task = _draw(self._title)
        self._bar.update(self._task, completed=fraction)

    def cancelled(self):
        """Tell whether a signal asked to stop."""
        return interruption.asked_to_stop()


def _draw(title):
    from rich.console import Console
    from rich.progress import Progress

    bar = Progress(console=Console(stderr=True), transient=True)
    bar.start()
    return bar, bar.add_task(title, total=1.0)
