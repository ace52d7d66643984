"""Voids of ground that may be larger than memory: as runs of cells, found chunk by chunk."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.voids.labelling import find_runs, join_runs


@dataclass(frozen=True)
class VoidExtents:
    """All voids of a ground, 4-connected, numbered in the order of their first cells.

    Attributes
    ----------
    runs : (N, 3) int32 array
        Row, first column and one past the last column of each run of void cells, by void.
    first_run : (V + 1,) int64 array
        Where in ``runs`` each void begins.
    cells : (V,) int64 array
    top, bottom, left, right : (V,) int64 arrays
        The rows and columns they span; ``bottom`` and ``right`` are one past the last.
    in_order : (N, 3) int32 array
        The runs of all voids, sorted by row and column.
    """

    runs: np.ndarray
    first_run: np.ndarray
    cells: np.ndarray
    top: np.ndarray
    bottom: np.ndarray
    left: np.ndarray
    right: np.ndarray
    in_order: np.ndarray

    def __len__(self):
        return self.cells.size

    @property
    def first_cells(self):
        """Row and column of each void's first cell: (V, 2) int32 array."""
        return self.runs[self.first_run[:-1], :2]

    def subset(self, voids):
        """Give some of the voids, numbered anew."""
        counts = np.diff(self.first_run)[voids]
        runs = runs_of(self, voids)
        return VoidExtents(
            runs, np.append(0, np.cumsum(counts)), self.cells[voids], self.top[voids],
            self.bottom[voids], self.left[voids], self.right[voids],
            runs[np.lexsort((runs[:, 1], runs[:, 0]))],
        )  # fmt: skip

    def meeting(self, rows, columns):
        """Give the numbers of the voids that have a cell in a window, in order."""
        row, start, stop = self.runs.T
        inside = (row >= rows.start) & (row < rows.stop)
        inside &= (start < columns.stop) & (stop > columns.start)
        void_of_run = np.repeat(np.arange(len(self)), np.diff(self.first_run))
        return np.unique(void_of_run[inside])

    def runs_within(self, rows, columns):
        """Give what lies in a window of the runs of all voids, (K, 3) int32 in order."""
        begin, end = np.searchsorted(self.in_order[:, 0], (rows.start, rows.stop))
        found = self.in_order[begin:end]
        return clipped(found, rows, columns)


def chunks(shape, side):
    """Cut a grid into windows of at most ``side`` rows and columns: pairs of slices, in order."""
    height, width = shape
    step_down, step_right = side
    return [
        (slice(row, min(row + step_down, height)), slice(column, min(column + step_right, width)))
        for row in range(0, height, step_down)
        for column in range(0, width, step_right)
    ]


def scan(void, rows, columns):
    """Give the runs of a window's void cells in the rows and columns of the whole ground.

    Parameters
    ----------
    void : (h, w) bool array
    rows, columns : slice
        Where it lies.

    Returns
    -------
    (N, 3) int32 array
    """
    corner = np.array([rows.start, columns.start, columns.start], np.int32)
    return find_runs(np.ascontiguousarray(void)) + corner


def connect(found, *, progress=SILENT):
    """Join the runs that were found in chunks that do not overlap into voids.

    Parameters
    ----------
    found : iterable of (N, 3) int32 arrays
    progress : Progress

    Returns
    -------
    VoidExtents

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    A void across the border of two chunks is one:

    >>> left, right = np.array([[0, 3, 4]], np.int32), np.array([[0, 4, 6]], np.int32)
    >>> connect([left, right]).runs
    array([[0, 3, 6]], dtype=int32)
    """
    runs = _joined_along_rows(np.concatenate([np.empty((0, 3), np.int32), *found]))
    checkpoint(progress, 0.3)
    grouped, first_run, cells = join_runs(runs, progress=Span(progress, 0.3, 1))
    first, last = first_run[:-1], first_run[1:] - 1
    left = right = np.empty(0, np.int64)
    if cells.size:
        left = np.minimum.reduceat(grouped[:, 1], first).astype(np.int64)
        right = np.maximum.reduceat(grouped[:, 2], first).astype(np.int64)
    top, bottom = grouped[first, 0].astype(np.int64), grouped[last, 0].astype(np.int64) + 1
    return VoidExtents(grouped, first_run, cells, top, bottom, left, right, runs)


def _joined_along_rows(runs):
    """Sort runs and make one of those that touch end to end, as chunk borders cut them."""
    runs = runs[np.lexsort((runs[:, 1], runs[:, 0]))]
    begins = np.ones(len(runs), bool)
    begins[1:] = (runs[1:, 0] != runs[:-1, 0]) | (runs[1:, 1] != runs[:-1, 2])
    starts = np.flatnonzero(begins)
    joined = runs[starts]
    ends = np.append(starts[1:], len(runs))[: starts.size] - 1
    joined[:, 2] = runs[ends, 2]
    return joined


def runs_of(voids, numbers):
    """Give the runs of some voids, one void after the other.

    Parameters
    ----------
    voids : VoidExtents or demsmith.core.voids.Voids
    numbers : (M,) int array

    Returns
    -------
    (K, 3) int32 array
    """
    return voids.runs[spans(voids.first_run[numbers], voids.first_run[numbers + 1])]


def spans(begins, ends):
    """Give the indices of several ranges, one after the other.

    Examples
    --------
    >>> spans(np.array([3, 9]), np.array([5, 12]))
    array([ 3,  4,  9, 10, 11])
    """
    lengths = ends - begins
    before = np.cumsum(lengths) - lengths
    return np.repeat(begins - before, lengths) + np.arange(lengths.sum())


def cells_of(runs):
    """Give the row and the column of every cell of some runs, in order."""
    rows = np.repeat(runs[:, 0], runs[:, 2] - runs[:, 1])
    return rows, spans(runs[:, 1].astype(np.int64), runs[:, 2].astype(np.int64))


def clipped(runs, rows, columns):
    """Give the parts of runs that lie in a window."""
    out = runs[(runs[:, 0] >= rows.start) & (runs[:, 0] < rows.stop)]
    out = out[(out[:, 1] < columns.stop) & (out[:, 2] > columns.start)]  # a copy
    np.maximum(out[:, 1], columns.start, out=out[:, 1])
    np.minimum(out[:, 2], columns.stop, out=out[:, 2])
    return out
