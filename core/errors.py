"""The errors Demsmith raises, each with the exit status the command line gives it.

Every one says what is wrong, where, and what to do. They have a second parent from the
standard library, so that callers who know nothing of Demsmith can still catch them.
"""


class DemsmithError(Exception):
    """Base of every error raised on purpose by Demsmith."""

    exit_status = 1


class InputError(DemsmithError, ValueError):
    """The input, or an option, cannot be used as it is."""

    exit_status = 2


class OutputError(DemsmithError, OSError):
    """An output cannot be written where it was asked for."""

    exit_status = 2


class DependencyError(DemsmithError, ImportError):
    """A library that this operation needs is missing or too old."""


class Cancelled(DemsmithError):
    """The user stopped the operation; nothing was written."""

    exit_status = 130

    def __init__(self, message="cancelled; nothing was written"):
        super().__init__(message)
