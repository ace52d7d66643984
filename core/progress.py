"""How long work tells its caller how far it is, and hears that it should stop."""

from typing import Protocol, runtime_checkable

from demsmith.core.errors import Cancelled


@runtime_checkable
class Progress(Protocol):
    """What a caller hands to a long operation.

    Both methods are called from the thread that called the operation, at least twice a second.
    """

    def report(self, fraction: float) -> None:
        """Take note that ``fraction`` (0 to 1) of the work is done."""

    def cancelled(self) -> bool:
        """Tell whether the operation should stop."""


class _Silent:
    def report(self, fraction):
        pass

    def cancelled(self):
        return False


SILENT = _Silent()
"""A progress that shows nothing and never cancels."""


class Span:
    """A part of another progress: 0 to 1 here is ``start`` to ``stop`` there.

    Examples
    --------
    >>> class Show:
    ...     def report(self, fraction): print(f"{fraction:.2f}")
    ...     def cancelled(self): return False
    >>> Span(Show(), 0.5, 0.9).report(0.5)
    0.70
    """

    def __init__(self, progress, start, stop):
        self._progress, self._start, self._stop = progress, start, stop

    def report(self, fraction):
        """Report ``fraction`` of this span to the whole."""
        self._progress.report(self._start + (self._stop - self._start) * fraction)

    def cancelled(self):
        """Tell whether the whole should stop."""
        return self._progress.cancelled()


def checkpoint(progress, fraction):
    """Report ``fraction`` and raise `Cancelled` if the caller wants to stop."""
    if progress.cancelled():
        raise Cancelled()
    progress.report(fraction)


class Muted:
    """The wish to cancel of another progress, without its reports.

    For work side by side, of which only the whole is reported.
    """

    def __init__(self, progress):
        self._progress = progress

    def report(self, fraction):
        """Report nothing."""

    def cancelled(self):
        """Tell whether the other progress asks to stop."""
        return self._progress.cancelled()
