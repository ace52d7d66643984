"""Which parameters of MCMD are tuned, and between which values."""

from dataclasses import dataclass

from demsmith.core.mcmd.converged import STIFFNESS_CELLS
from demsmith.core.mcmd.relaxed import TENSION_CELLS
from demsmith.core.tuning.search import Axis


@dataclass(frozen=True)
class _Range:
    """Bounds of a parameter; a length's, and its default, are in cells and searched by ratio."""

    low: float
    high: float
    length_default: float | None = None


# Beyond these the error has always grown, or no longer changed.
_L = _Range(-2, 2)
_L_BU = _Range(-2, 20)  # the paper's presets go up to 20
_TUNED = {
    "relaxed": {"tension": _Range(1, 200, TENSION_CELLS)},
    "converged": {
        "tension": _Range(1, 1000, 1000),  # without tension, nearly
        "stiffness": _Range(0.05, 8, STIFFNESS_CELLS),
    },
    "weighted": {"l": _L, "l_bu": _L_BU},
    "paper": {"l": _L, "l_bu": _L_BU},
}


def axes_of(options, cell, *, fixed=()):
    """List what can be tuned for the variant chosen.

    Parameters
    ----------
    options : McmdOptions
        The search begins at its values.
    cell : float
        Height of a cell [m].
    fixed : collection of str
        Names to leave as they are.

    Returns
    -------
    list of Axis

    Examples
    --------
    >>> from demsmith.core.mcmd import McmdOptions
    >>> axes_of(McmdOptions(variant="relaxed"), 90.0)
    [Axis(name='tension', start=1080.0, low=90.0, high=18000.0, log=True)]
    """
    return [
        _axis(name, getattr(options, name), span, cell)
        for name, span in _TUNED[options.variant].items()
        if name not in fixed
    ]


def _axis(name, value, span, cell):
    is_length = span.length_default is not None
    unit = cell if is_length else 1
    low, high = span.low * unit, span.high * unit
    start = span.length_default * unit if value is None else value
    if is_length and start == 0:  # which has no ratio to others
        start = low
    return Axis(name, start, min(low, start), max(high, start), log=is_length)
