"""The least score over a few numbers, by nlopt without derivatives."""

import math
from dataclasses import dataclass

from demsmith.core.errors import DependencyError, InputError
from demsmith.core.progress import SILENT, Span, checkpoint

_FIRST_STEP = 0.2
_TOLERANCE = 0.01


@dataclass(frozen=True)
class Axis:
    """A number to find, and where to look.

    Attributes
    ----------
    name : str
    start, low, high : float
        Where the search begins, and its inclusive bounds.
    log : bool
        Whether its ratio matters, not its difference, as for a length.
    """

    name: str
    start: float
    low: float
    high: float
    log: bool = False

    def place(self, value):
        """Give the place from 0 (``low``) to 1 (``high``) of a value; beyond, that of the bound.

        Examples
        --------
        >>> Axis("tension", 10, 1, 100, log=True).place(10)
        0.5
        """
        low, high, value = (math.log(n) if self.log else n for n in (self.low, self.high, value))
        return min(max((value - low) / (high - low), 0.0), 1.0)

    def value(self, place):
        """Give the value at a place from 0 to 1."""
        if self.log:
            return self.low * (self.high / self.low) ** place
        return self.low + (self.high - self.low) * place


def search(score, axes, *, evaluations=40, progress=SILENT):
    """Find the numbers of the least score.

    The search is nlopt's Subplex (T. Rowan 1990, "Functional stability analysis of numerical
    algorithms"), a sequence of simplex searches that takes a score with small steps in it and, as
    it uses no random numbers, always goes the same way.

    Parameters
    ----------
    score : callable
        Called with a dict of values by name and a `Progress`; gives a float, not finite where it
        has no score.
    axes : sequence of Axis
    evaluations : int
        At most this many scores; fewer when the values settle to 1 % of their range.
    progress : Progress

    Returns
    -------
    dict
        Value by name: the best of all that were tried, of which the first is the start.

    Raises
    ------
    InputError
        If ``evaluations`` is less than 1.
    DependencyError
        If nlopt is missing.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> found = search(lambda at, progress: (at["x"] - 2) ** 2, [Axis("x", 0, -10, 10)])
    >>> abs(found["x"] - 2) < 0.2
    True
    """
    if evaluations < 1:
        raise InputError(f"evaluations is {evaluations}; it must be at least 1")
    nlopt = _nlopt()
    tried = []

    def objective(places, _):
        checkpoint(progress, len(tried) / evaluations)
        values = {axis.name: axis.value(place) for axis, place in zip(axes, places, strict=True)}
        part = Span(progress, len(tried) / evaluations, (len(tried) + 1) / evaluations)
        result = float(score(values, part))
        tried.append((result if math.isfinite(result) else math.inf, values))
        return tried[-1][0]

    optimizer = nlopt.opt(nlopt.LN_SBPLX, len(axes))
    optimizer.set_lower_bounds(0.0)
    optimizer.set_upper_bounds(1.0)
    optimizer.set_initial_step(_FIRST_STEP)
    optimizer.set_xtol_abs(_TOLERANCE)
    optimizer.set_maxeval(evaluations)
    optimizer.set_min_objective(objective)
    optimizer.optimize([axis.place(axis.start) for axis in axes])
    checkpoint(progress, 1.0)
    return min(tried, key=lambda each: each[0])[1]


def _nlopt():
    try:
        import nlopt
    except ImportError:
        raise DependencyError("tuning needs the library nlopt: pip install nlopt") from None
    return nlopt
