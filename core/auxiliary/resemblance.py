"""Whether an auxiliary raster knows anything of the ground that interpolation does not."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.auxiliary.coregistration import robust_spread
from demsmith.core.progress import SILENT, checkpoint

_LAGS = (2, 4, 8, 16, 32)
"""Cells: what is left between the two is compared with the ground at each of these scales."""

_STEP = 2
"""Cells between the second differences that are taken; neighbours tell much the same."""

_ROUGHEST = 0.9
_LEAST_CORRELATION = 0.3
_FEWEST = 100
_OUTLIER = 5.0


@dataclass(frozen=True)
class Resemblance:
    """How much smoother the delta is than the ground, at the scale where it is most so.

    Attributes
    ----------
    roughness : float
        Mean magnitude of the delta's second differences, as a share of the ground's. A second
        difference is what linear interpolation between two cells misses in their middle, so
        1 or more means that the auxiliary is of no help.
    correlation : float
        Of the second differences of target and auxiliary.
    lag : int
        The scale [cells]; 0 if there is too little ground.
    """

    roughness: float
    correlation: float
    lag: int

    @property
    def useful(self):
        """Whether the auxiliary is of use at one scale at least."""
        return self.roughness <= _ROUGHEST and self.correlation >= _LEAST_CORRELATION

    def sentence(self):
        """Tell the judgement."""
        if not self.lag:
            return "There is too little ground that both know to judge the auxiliary."
        found = (
            f"what is left between the two is {100 * self.roughness:.0f} % as rough as the ground, "
            f"whose relief they share with a correlation of {self.correlation:.2f}"
        )
        if self.useful:
            return f"The auxiliary fits: {found}."
        return f"The auxiliary shows other ground, or is worse than interpolation: {found}."


def compare(pairs, *, progress=SILENT):
    """Compare target and auxiliary by the second differences of their elevations.

    Parameters
    ----------
    pairs : list of (ground, known, auxiliary, known)
        Elevations of a window, the same of the auxiliary on it: (h, w) arrays with their masks.
    progress : Progress

    Returns
    -------
    Resemblance
    """
    found = []
    for number, lag in enumerate(_LAGS):
        checkpoint(progress, number / len(_LAGS))
        found.append(_at(pairs, lag))
    return min(found, key=lambda each: each.roughness)


def _at(pairs, lag):
    seconds = []
    for ground, known, other, other_known in pairs:
        both = known & other_known
        for axis in range(2):
            usable = _second(both, lag, axis)
            seconds.append(np.stack([_second(each, lag, axis)[usable] for each in (ground, other)]))
    ground, other = np.concatenate(seconds, axis=1)
    if ground.size < _FEWEST:
        return Resemblance(1.0, 0.0, 0)
    relief = float(np.abs(ground).mean())
    roughness = float(np.abs(ground - other).mean()) / relief if relief else 1.0
    return Resemblance(roughness, _correlation(ground, other), lag)


def _second(values, lag, axis):
    """Some second differences along an axis; of a mask, where all three cells are known."""
    values = np.moveaxis(values, axis, 0)[:, ::_STEP]
    if len(values) <= 2 * lag:
        return np.empty((0, values.shape[1]), values.dtype)
    before, middle, after = (
        values[start : len(values) - 2 * lag + start : _STEP] for start in (0, lag, 2 * lag)
    )
    if values.dtype == bool:
        return before & middle & after
    return before - 2.0 * middle + after


def _correlation(ground, other):
    """Correlation of two samples of zero mean, their outliers held back."""
    ground, other = (
        np.clip(each, *(np.array([-1, 1]) * _OUTLIER * (robust_spread(each) or np.inf)))
        for each in (ground, other)
    )
    norm = np.sqrt((ground @ ground) * (other @ other))
    return float(ground @ other / norm) if norm else 0.0
