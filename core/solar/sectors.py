"""Sectors of azimuths: for which directions horizons are needed, and which instants use them."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

# The whole circle is cut into so many sectors, if instants would need more sweeps of their own,
# and more than those of a day.
_CIRCLE = 360
_DAY = 120
# Cells by which an obstacle's place may be wrong: one sweep in the middle will do within the
# first, and between two sweeps nobody is farther from one than about the second.
_SAME, _APART = 0.5, 4.0
_NARROWEST, _WIDEST = 0.5, 30.0  # degrees between two sweeps


@dataclass(frozen=True, eq=False)
class Sector:
    """Instants whose sun stands between two azimuths somewhere in the raster.

    Attributes
    ----------
    edges : tuple of float
        Its two azimuths [degrees]; or a single one, near enough to the sun's in all of the raster.
    instants : (M,) int array
        Their numbers.
    """

    edges: tuple
    instants: np.ndarray


def sectors_of(lowest, highest, reach):
    """Cut the sun's azimuths into sectors.

    Parameters
    ----------
    lowest, highest : (M,) float64 arrays
        Range of the sun's azimuth in the raster at each instant [degrees], ``highest`` not below
        ``lowest`` and at most 360 above.
    reach : (M,) float64 array
        Cells within which terrain may hide the sun.

    Returns
    -------
    list of Sector
        Each instant and azimuth is in exactly one; those with two edges take in the first and
        leave out the second. Neighbours follow each other.

    Examples
    --------
    >>> [sector.edges for sector in sectors_of(np.array([90.0]), np.array([91.0]), np.array([300]))]
    [(90.0, 90.5), (90.5, 91.0)]
    """
    width = highest - lowest
    alone = np.radians(width / 2) * reach <= _SAME
    apart = np.clip(np.degrees(_APART / np.maximum(reach, 1e-9)), _NARROWEST, _WIDEST)
    parts = np.maximum(np.ceil(width / apart - 1e-9), 1).astype(int)
    around = _circle(lowest, highest)
    if np.where(alone, 1, parts + 1).sum() > max(len(around), _DAY):
        return around
    sectors = []
    for number in range(len(width)):
        instants = np.array([number])
        if alone[number]:
            sectors.append(Sector(((lowest[number] + highest[number]) / 2,), instants))
            continue
        edges = np.linspace(lowest[number], highest[number], parts[number] + 1)
        sectors += [
            Sector((float(start), float(stop)), instants) for start, stop in pairwise(edges)
        ]
    return sectors


def _circle(lowest, highest):
    """Cut the whole circle evenly."""
    step = 360.0 / _CIRCLE
    sectors = []
    for number in range(_CIRCLE):
        start, stop = number * step, (number + 1) * step
        # Ranges may begin anywhere, so that the sector may be a turn further.
        inside = np.zeros(len(lowest), bool)
        for turn in (-720.0, -360.0, 0.0, 360.0, 720.0):
            inside |= (lowest < stop + turn) & (highest >= start + turn)
        if inside.any():
            sectors.append(Sector((start, stop), np.flatnonzero(inside)))
    return sectors
