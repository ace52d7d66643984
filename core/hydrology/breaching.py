"""Depressions drained by cutting through their rims."""

import math
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.hydrology.surfaces import by_row, surface
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.strips import strips

# A search takes about 1 µs a cell: one from a pit ends in less than half a second.
_MOST_CELLS = 1 << 18
# Pits between two looks at the progress.
_PITS = 200


def breach_depressions(
    z, void, dx, dy, *, max_depth=None, max_length=None, threads=None, progress=SILENT
):
    """Cut the least costly ways out of the pits of a surface (Lindsay and Dhun 2015).

    From each pit the way is sought to the raster's edge, a void, a lower cell or a pit as low
    before it, on which the least ground lies above the pit's elevation: the sum over its cells of
    the depth of the cut times the length of the step to the cell. Of ways as good it is the
    shortest. All its cells that are higher are cut down to the pit. Every way is sought on the
    surface as given, so their order does not matter, and together they leave no pit but those
    whose way would break a limit: `fill_depressions` does the rest. What is level then,
    `resolve_flats` drains.

    Parameters
    ----------
    z : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array
        True where there is none.
    dx, dy : (H,) arrays
        Ground metres per cell of each row, along the row and across.
    max_depth : float, optional
        No cell is cut by more [m].
    max_length : float, optional
        No way is longer on the ground [m].
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    (H, W) array of the type of ``z``, or for integers float32 where that is exact, else float64
        The cut surface; voids as they were. Pits from which a quarter of a million cells do not
        lead out are left as well.

    Raises
    ------
    InputError
        If the arrays do not fit, or a limit is negative.
    Cancelled
        If ``progress`` asks to stop.

    References
    ----------
    Lindsay, J. B. and Dhun, K. (2015), Modelling surface drainage patterns in altered landscapes
    using LiDAR, International Journal of Geographical Information Science 29, 397-411.

    Examples
    --------
    >>> z = np.array([[30, 30, 30, 30, 30], [30, 1, 5, 6, 0], [30, 30, 30, 30, 30.0]])
    >>> breach_depressions(z, np.zeros(z.shape, bool), np.ones(3), np.ones(3))[1]
    array([30.,  1.,  1.,  1.,  0.])
    """
    from demsmith.core.hydrology._breaching import apply_breaches, mark_pits

    limits = [_limit("max_depth", max_depth), _limit("max_length", max_length)]
    z, void = surface(z, void)
    dx, dy = by_row(dx, "dx", len(z)), by_row(dy, "dy", len(z))
    parts = strips(z.shape)
    kind = np.empty(z.size, np.uint8)
    pits = [None] * len(parts)

    def mark(k):
        pits[k] = mark_pits(z, void, parts[k].start, parts[k].stop, kind)

    parallel.run(
        [lambda k=k: mark(k) for k in range(len(parts))],
        threads=threads,
        progress=Span(progress, 0, 0.05),
    )
    breached = z.copy()
    for cells, levels in _breaches(
        np.concatenate(pits), z, kind, dx, dy, limits, threads, Span(progress, 0.05, 1)
    ):
        apply_breaches(breached.ravel(), cells, levels)
    checkpoint(progress, 1)
    return breached


def _breaches(pits, z, kind, dx, dy, limits, threads, progress):
    """Find the ways out of pits; give the cells to be cut and the levels they are cut to.

    Searches from a few pits may be long, so each task ends after some time whether it is through
    or not, and the pits that are left make up the next round.
    """
    from demsmith.core.hydrology._breaching import find_breaches

    found = []

    def search(some, left):
        done, cells, levels = find_breaches(
            z.ravel(), z.shape[1], kind, dx, dy, some, *limits, _MOST_CELLS
        )
        found.append((cells, levels))
        left.append(some[done:])

    begun, reached = 0.0, 0.9
    while len(pits):
        left = []
        parallel.run(
            [partial(search, pits[k : k + _PITS], left) for k in range(0, len(pits), _PITS)],
            threads=threads,
            progress=Span(progress, begun, reached),
        )
        pits = np.concatenate(left)
        begun, reached = reached, 0.1 * reached + 0.9
    return found


def _limit(name, limit):
    if limit is None:
        return math.inf
    if not limit >= 0:
        raise InputError(f"{name} is {limit}; it must be at least 0")
    return float(limit)
