"""Voids as objects: where each lies, how large it is, what ground surrounds it."""

from dataclasses import dataclass

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span, checkpoint

# A raster of fewer cells is scanned sooner than a thread begins.
_LARGE = 4_000_000


@dataclass(frozen=True)
class Voids:
    """The voids of a raster, 4-connected, numbered in the order of their first cells.

    Attributes
    ----------
    labels : (H, W) int32 array
        0 on known ground, 1 + the void's number in a void.
    runs : (N, 3) int32 array
        Row, first column and one past the last column of each run of void cells, by void.
    first_run : (V + 1,) int64 array
        Where in ``runs`` each void begins.
    cells : (V,) int64 array
        Cells of each void.
    """

    labels: np.ndarray
    runs: np.ndarray
    first_run: np.ndarray
    cells: np.ndarray

    def __len__(self):
        return self.cells.size


@dataclass(frozen=True)
class Rims:
    """The known cells beside each void: arrays of length V, elevations as float64.

    ``low``, ``mean`` and ``high`` are NaN for a void without a known neighbour;
    ``touches_edge`` tells whether the void reaches the raster's edge.
    """

    low: np.ndarray
    mean: np.ndarray
    high: np.ndarray
    touches_edge: np.ndarray


def find_voids(void, *, threads=None, progress=SILENT):
    """Find the 4-connected voids of a mask.

    Parameters
    ----------
    void : (H, W) bool array
        True where there is no elevation.
    threads : int, optional
        Default: one for each core.
    progress : Progress

    Returns
    -------
    Voids

    Raises
    ------
    InputError
        If ``void`` is no two-dimensional bool array.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> void = np.array([[1, 0, 1], [1, 0, 0], [0, 1, 1]], bool)
    >>> voids = find_voids(void)
    >>> voids.labels
    array([[1, 0, 2],
           [1, 0, 0],
           [0, 3, 3]], dtype=int32)
    >>> voids.cells
    array([2, 1, 2])
    """
    from demsmith.core.voids._labelling import paint

    if void.ndim != 2 or void.dtype != bool:
        raise InputError(f"the void mask is {void.ndim}-D {void.dtype}; give a 2-D bool array")
    void = np.ascontiguousarray(void)
    # Not zeros(): NumPy asks for huge pages for this one, and the kernels jump from row to row.
    labels = np.empty(void.shape, np.int32)
    found = []
    parallel.run(
        [lambda: found.append(find_runs(void)), lambda: labels.fill(0)],
        threads=threads if void.size > _LARGE else 1,
        progress=Span(progress, 0, 0.3),
    )
    grouped, first_run, cells = join_runs(found[0], progress=Span(progress, 0.3, 0.8))
    paint(grouped, first_run, labels)
    checkpoint(progress, 1.0)
    return Voids(labels, grouped, first_run, cells)


def join_runs(runs, *, progress=SILENT):
    """Join runs of void cells into 4-connected voids, numbered in the order of their first cells.

    Parameters
    ----------
    runs : (N, 3) int32 array
        Row, first column and one past the last column of each, sorted; none touches the next one
        of its row.
    progress : Progress

    Returns
    -------
    runs, first_run, cells : arrays
        As in `Voids`.
    """
    from demsmith.core.voids import _labelling

    void_of_run = np.empty(len(runs), np.int64)
    count = _labelling.join_runs(runs, void_of_run)
    checkpoint(progress, 0.6)
    first_run = np.zeros(count + 1, np.int64)
    cells = np.zeros(count, np.int64)
    grouped = np.empty_like(runs)
    _labelling.group_runs(runs, void_of_run, first_run, grouped, cells)
    checkpoint(progress, 1.0)
    return grouped, first_run, cells


def find_runs(void):
    """List the runs of void cells of a C-ordered bool mask: (N, 3) int32, as `join_runs` has."""
    from demsmith.core.voids._labelling import scan_runs

    flat = void.view(np.uint8).ravel()
    words = flat[: flat.size // 8 * 8].view(np.uint64)
    room = flat.size // 64 + 64
    while True:
        runs = np.empty((room, 3), np.int32)
        count = scan_runs(flat, words, void.shape[1], runs)
        if count <= room:
            return runs[:count]
        room = count


def survey_rims(values, void, voids, *, threads=None, progress=SILENT):
    """Measure the known cells that share a side with each void.

    Parameters
    ----------
    values : (H, W) array
        Elevations; only known cells are read.
    void : (H, W) bool array
    voids : Voids
        As `find_voids` found them in ``void``.
    threads : int, optional
        Default: one for each core.
    progress : Progress

    Returns
    -------
    Rims

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop.
    """
    from demsmith.core.voids._labelling import survey

    low, mean, high = (np.empty(len(voids)) for _ in range(3))
    edge = np.empty(len(voids), bool)
    cells = int(voids.cells.sum())
    parts = cells // 500_000 + 1  # a thread is not worth less
    parallel.run(
        [
            lambda begin=begin, end=end: survey(
                values, void, voids.runs, voids.first_run, begin, end, low, mean, high, edge
            )
            for begin, end in parallel.even_spans(voids.cells, parts)
        ],
        threads=threads,
        progress=progress,
    )
    return Rims(low, mean, high, edge)
