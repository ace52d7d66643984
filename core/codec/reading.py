"""Parameters from a file that nobody vouches for."""

import math

from demsmith.core.errors import InputError


def whole(params, name, lowest, highest):
    """Give an integer of ``params`` that lies within bounds.

    Raises
    ------
    InputError
        If it is missing, of another type or out of bounds.

    Examples
    --------
    >>> whole({"tile": 256}, "tile", 8, 4096)
    256
    """
    value = params.get(name)
    if type(value) is not int or not lowest <= value <= highest:
        raise _damaged(name, value, lowest, highest)
    return value


def number(params, name, lowest, highest):
    """Give a finite float of ``params`` that lies within bounds; raise `InputError` else."""
    value = params.get(name)
    if type(value) not in (int, float) or not math.isfinite(value):
        raise _damaged(name, value, lowest, highest)
    if not lowest <= value <= highest:
        raise _damaged(name, value, lowest, highest)
    return float(value)


def choice(params, name, choices):
    """Give a string of ``params`` that is one of ``choices``; raise `InputError` else."""
    value = params.get(name)
    if type(value) is not str or value not in choices:
        raise InputError(f"damaged file: '{name}' is {str(value)[:40]!r}, not one of {choices}")
    return value


def _damaged(name, value, lowest, highest):
    return InputError(
        f"damaged file: '{name}' is {str(value)[:40]!r}; it must be a number from {lowest} to "
        f"{highest}"
    )
