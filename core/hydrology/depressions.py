"""Depressions filled to the level at which water leaves them."""

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.hydrology.surfaces import surface
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.strips import strips

# Passes looked at between two looks at the progress.
_MANY = 1 << 20


def fill_depressions(z, void, *, max_depth=None, threads=None, progress=SILENT):
    """Fill the depressions of a surface to the level at which water leaves them.

    Every cell is raised to the lowest level from which water gets to the raster's edge or to a
    void over its eight neighbours: the surface of the Priority-Flood (Barnes et al. 2014), made
    in another way. The raster is cut into the basins of its pits; the lowest passes between
    basins form a graph, on which Kruskal's algorithm finds the level at which each basin
    overflows; and what lies lower in it is raised to that.

    Parameters
    ----------
    z : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array
        True where there is none. Cells at the raster's edge and beside a void are outlets.
    max_depth : float, optional
        Pits where water would have to rise higher than this [m] to get to a lower pit or out are
        kept, as sinks into which the others may drain. So no cell is raised by more.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    (H, W) array of the type of ``z``, or for integers float32 where that is exact, else float64
        The filled surface; voids as they were.

    Raises
    ------
    InputError
        If the arrays do not fit, or ``max_depth`` is negative.
    Cancelled
        If ``progress`` asks to stop.

    References
    ----------
    Barnes, R., Lehman, C. and Mulla, D. (2014), Priority-Flood: an optimal depression-filling and
    watershed-labeling algorithm for digital elevation models, Computers & Geosciences 62, 117-127.
    Barnes, R. (2016), Parallel Priority-Flood depression filling for trillion cell digital
    elevation models on desktops or clusters, Computers & Geosciences 96, 56-68 (the graph).

    Examples
    --------
    >>> z = np.array([[9, 9, 9, 9], [9, 1, 5, 7], [9, 9, 9, 9.0]])
    >>> fill_depressions(z, np.zeros(z.shape, bool))
    array([[9., 9., 9., 9.],
           [9., 7., 7., 7.],
           [9., 9., 9., 9.]])
    """
    from demsmith.core.hydrology._basins import fill_basins

    if max_depth is not None and not max_depth >= 0:
        raise InputError(f"max_depth is {max_depth}; it must be at least 0")
    z, void = surface(z, void)
    label = np.empty(z.shape, np.uint32)
    parts = strips(z.shape)
    running = dict(threads=threads, weights=[part.stop - part.start for part in parts])
    before, *graph = _basin_graph(z, void, label, parts, running, Span(progress, 0, 0.7))
    level = _spill_levels(*graph, max_depth, Span(progress, 0.7, 0.9))
    filled = np.empty_like(z)
    parallel.run(
        [
            lambda part=part, k=k: fill_basins(
                z, part.start, part.stop, label,
                np.concatenate([level[:1], level[1 + before[k] : 1 + before[k + 1]]]), filled,
            )
            for k, part in enumerate(parts)
        ],
        progress=Span(progress, 0.9, 1),
        **running,
    )  # fmt: skip
    return filled


def _basin_graph(z, void, label, parts, running, progress):
    """Label the basins of each strip, and list the passes between basins.

    Labels are those within the strip. In what is returned the basins of all strips have one
    numbering: 0 is what flows out, then come those of the first strip.

    Returns
    -------
    before : (strips + 1,) int64 array
        Basins of the strips before each, without 0.
    pits : (B,) array
        Elevation of the basins' pits; -inf for 0.
    ends : (N, 2) int64 array
        The basins that a pass connects.
    levels : (N,) array
        Its elevation.
    """
    from demsmith.core.hydrology._basins import find_passes, find_seam_passes, label_basins

    pits, passes = [None] * len(parts), [None] * len(parts)

    def survey(k):
        first, last = parts[k].start, parts[k].stop
        pits[k] = label_basins(z, void, first, last, label)
        passes[k] = find_passes(z, first, last, label, len(pits[k]))

    parallel.run(
        [lambda k=k: survey(k) for k in range(len(parts))],
        progress=progress,
        **running,
    )
    before = np.cumsum([0, *(len(found) - 1 for found in pits)])
    ends = [
        np.where(pair > 0, pair.astype(np.int64) + before[k], 0)
        for k, (pair, _) in enumerate(passes)
    ]
    levels = [found for _, found in passes]
    for k, part in enumerate(parts[:-1]):
        pair, found = find_seam_passes(z, part.stop - 1, label, before[k], before[k + 1])
        ends.append(pair)
        levels.append(found)
        checkpoint(progress, 1)
    pits = np.concatenate([pits[0][:1], *(found[1:] for found in pits)])
    return before, pits, np.concatenate(ends), np.concatenate(levels)


def _spill_levels(pits, ends, levels, max_depth, progress):
    """Give the level over which water leaves each basin; -inf for sinks."""
    from demsmith.core.hydrology import _spilling

    order = np.argsort(levels, kind="stable")
    checkpoint(progress, 0.4)
    group = np.arange(len(pits))
    level = np.full_like(pits, -np.inf)
    if max_depth is not None:
        deep, twin = np.zeros(len(pits), bool), np.arange(len(pits))
        for some in _portions(order, Span(progress, 0.4, 0.6)):
            _spilling.find_sinks(some, ends, levels, pits, max_depth, group, deep, twin)
        _spilling.share_fate(deep, twin)
        group = np.arange(len(pits))
        group[deep] = 0
    for some in _portions(order, Span(progress, 0.6, 1)):
        _spilling.find_levels(some, ends, levels, group, level)
    _spilling.spread_levels(group, level)
    return level


def _portions(order, progress):
    """Go through an array in portions, between which the caller is asked."""
    for begin in range(0, len(order), _MANY):
        checkpoint(progress, begin / len(order))
        yield order[begin : begin + _MANY]
