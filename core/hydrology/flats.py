"""Flats: the order in which water leaves ground that is level."""

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.hydrology.surfaces import surface
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.strips import strips

# Cells looked at between two looks at the progress.
_MANY = 1 << 20


def resolve_flats(filled, void, *, threads=None, progress=SILENT):
    """Give the cells of flats an order in which water leaves them.

    On a flat water goes away from higher ground and towards where it can leave (Barnes et al.
    2014; Garbrecht and Martz 1997): it **goes to a neighbour of the same elevation with a smaller
    number**, and there always is one. The number is twice the distance in cells to the nearest
    cell of this elevation that drains, plus what the distance from higher ground lacks of the
    flat's largest.

    Parameters
    ----------
    filled : (H, W) float32 or float64 array
        Elevations [m]; best without depressions, as `fill_depressions` gives them.
    void : (H, W) bool array
        True where there is none. Cells at the raster's edge and beside a void are outlets.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    (H, W) array of uint16, or uint32 for the largest flats
        0 for cells with a lower neighbour, outlets, voids, and flats without an outlet (pits).

    Raises
    ------
    InputError
        If the arrays do not fit, or have 2**32 cells or more.
    Cancelled
        If ``progress`` asks to stop.

    References
    ----------
    Barnes, R., Lehman, C. and Mulla, D. (2014), An efficient assignment of drainage direction over
    flat surfaces in raster digital elevation models, Computers & Geosciences 62, 128-135.
    Garbrecht, J. and Martz, L. W. (1997), The assignment of drainage direction over flat surfaces
    in raster digital elevation models, Journal of Hydrology 193, 204-213.

    Examples
    --------
    >>> z = np.full((5, 5), 9.0)
    >>> z[1:4, 1:4] = 5
    >>> z[2, 4] = 5
    >>> resolve_flats(z, np.zeros(z.shape, bool))
    array([[0, 0, 0, 0, 0],
           [0, 7, 5, 3, 0],
           [0, 7, 4, 3, 0],
           [0, 7, 5, 3, 0],
           [0, 0, 0, 0, 0]], dtype=uint16)
    """
    from demsmith.core.hydrology import _flats

    filled, void = surface(filled, void)
    if filled.size >= 1 << 32:
        raise InputError(f"{filled.size} cells are too many for flats; the limit is 2**32 - 1")
    width = filled.shape[1]
    order = np.empty(filled.shape, np.int32)
    z, flat = filled.ravel(), order.ravel()
    parts = strips(filled.shape)
    running = dict(threads=threads, weights=[part.stop - part.start for part in parts])
    left, most = [0] * len(parts), [0] * len(parts)

    def within(k):
        first, last = parts[k].start, parts[k].stop
        _flats.mark_flats(filled, void, first, last, order)
        left[k] = _flats.order_within(z, flat, width, first * width, last * width)

    def measure(k):
        most[k] = _flats.largest(flat, parts[k].start * width, parts[k].stop * width)

    each = range(len(parts))
    parallel.run([lambda k=k: within(k) for k in each], progress=Span(progress, 0, 0.6), **running)
    _order_across(z, flat, width, parts, sum(left), Span(progress, 0.6, 0.9))
    parallel.run([lambda k=k: measure(k) for k in each], **running)
    narrowed = np.empty(order.shape, np.uint16 if max(most) < 1 << 16 else np.uint32)
    parallel.run(
        [
            lambda part=part: _flats.narrow(
                flat, part.start * width, part.stop * width, narrowed.ravel()
            )
            for part in parts
        ],
        progress=Span(progress, 0.9, 1),
        **running,
    )
    return narrowed


def _order_across(z, flat, width, parts, cells, progress):
    """Order the flats that reach into several strips: ``cells`` of them at most."""
    from demsmith.core.hydrology import _flats

    queue = np.empty(cells, np.uint32)
    work = np.empty(_flats.WORK, np.int64)
    done = 0
    for part in parts:
        for row in (part.start, part.stop - 1):
            cell, end = row * width, (row + 1) * width
            while (cell := _flats.find_left(flat, cell, end)) < end:
                _flats.start(cell, flat, queue, work)
                while not _flats.go_on(z, flat, width, queue, work, _MANY):
                    checkpoint(progress, min(done / (3 * cells), 1.0))
                    done += _MANY
