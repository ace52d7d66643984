"""Stream networks: where enough water gathers, its links from confluence to confluence, orders."""

from dataclasses import dataclass

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.strips import strips

_LINKS_AT_ONCE = 1 << 12


@dataclass(frozen=True, eq=False)
class Streams:
    """A network of streams, as links that run from a head or a confluence to the next or the end.

    Attributes
    ----------
    mask : (H, W) bool array
        Stream cells.
    cells : (N, 2) int32 array
        Row and column of the cells of all links, link by link and downstream; a confluence ends
        the links above it and begins the one below.
    first_cell : (L + 1,) int64 array
        Where in ``cells`` each link begins.
    downstream : (L,) int64 array
        Number of the link, from 1, that each flows into; 0 for none.
    order : (L,) int64 array
        Strahler's.
    length : (L,) float64 array
        Metres on the ground.
    area : (L,) float64 array
        Upstream area where the link ends, above the confluence if it ends in one.
    """

    mask: np.ndarray
    cells: np.ndarray
    first_cell: np.ndarray
    downstream: np.ndarray
    order: np.ndarray
    length: np.ndarray
    area: np.ndarray

    def __len__(self):
        return self.order.size

    @property
    def columns(self):
        """The links' attributes by the names that they have in a file."""
        return {
            "link": np.arange(1, len(self) + 1),
            "downstream": self.downstream,
            "strahler": self.order,
            "length_m": self.length,
            "area_m2": self.area,
        }


def find_streams(
    directions, area, *, threshold=1e6, pixel_size=None, threads=None, progress=SILENT
):
    """Find the streams of a raster.

    Parameters
    ----------
    directions : (H, W) uint8 array
        ESRI codes, as `demsmith.core.hydrology.d8_directions` gives them.
    area : (H, W) float64 array
        Upstream area along these directions, so that it never shrinks downstream; else a stream
        could break off. 0 at voids.
    threshold : float
        Stream cells have this area or more, in the same unit.
    pixel_size : optional
        Ground metres per cell, see `demsmith.drainage_area`.
    threads : int, optional
    progress : Progress

    Returns
    -------
    Streams
        Links are numbered in the order of their first cells, row by row. A link of one cell, such
        as a stream that begins at the raster's edge, has no length and is left out.

    Raises
    ------
    InputError
        If the arrays differ in shape.
    Cancelled
        If ``progress`` asks to stop.

    Notes
    -----
    A head has order 1; a link has the highest order of those that flow into it, and one more where
    two or more of them have it.

    References
    ----------
    Strahler, A. N. (1957), Quantitative analysis of watershed geomorphology, Trans. AGU 38(6),
    913-920.

    Examples
    --------
    Two rills flow together and leave at the bottom:

    >>> directions = np.array([[4, 0, 4], [2, 0, 8], [0, 4, 0], [0, 0, 0]], np.uint8)
    >>> area = np.array([[1, 0, 1], [2, 0, 2], [0, 5, 0], [0, 6, 0.0]])
    >>> streams = find_streams(directions, area, threshold=1)
    >>> streams.order, streams.downstream, streams.area
    (array([1, 1, 2]), array([3, 3, 0]), array([2., 2., 6.]))
    """
    if directions.shape != area.shape:
        raise InputError(f"directions {directions.shape} and area {area.shape} differ in shape")
    dx, dy = metres(directions.shape, pixel_size)
    mask = area >= threshold
    checkpoint(progress, 0)
    donors = _donors(directions, mask, threads, Span(progress, 0, 0.5))
    starts = np.flatnonzero(mask & (donors != 1))
    sizes = np.empty(starts.size, np.int64)
    _by_links(
        lambda kernels, part: kernels.link_sizes(
            starts[part], directions, mask, donors, sizes[part]
        ),
        starts.size, threads, Span(progress, 0.5, 0.6),
    )  # fmt: skip
    first_cell = np.append(0, np.cumsum(sizes))
    cells = np.empty((first_cell[-1], 2), np.int32)
    length, end_area = np.empty(starts.size), np.empty(starts.size)
    _by_links(
        lambda kernels, part: kernels.trace_links(
            starts[part], first_cell[part.start : part.stop + 1], directions, mask, donors,
            dx, dy, area, cells, length[part], end_area[part],
        ),
        starts.size, threads, Span(progress, 0.6, 0.9),
    )  # fmt: skip
    downstream = _links_below(starts, cells[first_cell[1:] - 1], sizes, donors)
    order = _orders(downstream, area.ravel()[starts])
    checkpoint(progress, 1)
    return _with_length(
        Streams(mask, cells, first_cell, downstream, order, length, end_area), sizes > 1
    )


def _donors(directions, mask, threads, progress):
    """Count the stream cells that drain to each stream cell."""
    from demsmith.core.hydrology._streams import count_donors

    donors = np.empty(mask.shape, np.uint8)
    tasks = [
        lambda strip=strip: count_donors(directions, mask, strip.start, strip.stop, donors)
        for strip in strips(mask.shape)
    ]
    parallel.run(tasks, threads=threads, progress=progress)
    return donors


def _by_links(work, count, threads, progress):
    """Call a kernel for some links at a time."""
    from demsmith.core.hydrology import _streams

    tasks = [
        lambda first=first: work(_streams, slice(first, min(first + _LINKS_AT_ONCE, count)))
        for first in range(0, count, _LINKS_AT_ONCE)
    ]
    parallel.run(tasks, threads=threads, progress=progress)


def _links_below(starts, ends, sizes, donors):
    """Give the number, from 1, of the link that begins where each ends; 0 if there is none."""
    row, column = ends[:, 0].astype(np.int64), ends[:, 1]
    joins = (donors[row, column] > 1) & (sizes > 1)
    number = 1 + np.searchsorted(starts, row * donors.shape[1] + column)
    return np.where(joins, number, 0)


def _orders(downstream, start_area):
    from demsmith.core.hydrology._streams import strahler

    order = np.empty(downstream.size, np.int64)
    # Where a link begins, its area is that of all above it and more.
    strahler(downstream - 1, np.argsort(start_area, kind="stable"), order)
    return order


def _with_length(streams, kept):
    """Leave out links of one cell, and number the others anew."""
    if kept.all():
        return streams
    number = np.append(0, np.where(kept, np.cumsum(kept), 0))
    sizes = np.diff(streams.first_cell)
    return Streams(
        streams.mask,
        streams.cells[np.repeat(kept, sizes)],
        np.append(0, np.cumsum(sizes[kept])),
        number[streams.downstream[kept]],
        streams.order[kept],
        streams.length[kept],
        streams.area[kept],
    )
