"""Voids as objects: where each lies, how large it is, what ground surrounds it."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError


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


def find_voids(void):
    """Find the 4-connected voids of a mask.

    Parameters
    ----------
    void : (H, W) bool array
        True where there is no elevation.

    Returns
    -------
    Voids

    Raises
    ------
    InputError
        If ``void`` is no two-dimensional bool array.

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
    from demsmith.core.voids import _labelling

    if void.ndim != 2 or void.dtype != bool:
        raise InputError(f"the void mask is a {void.ndim}-D {void.dtype} array; give a 2-D bool one")
    runs = _scan(np.ascontiguousarray(void))
    void_of_run = np.empty(len(runs), np.int64)
    count = _labelling.join_runs(runs, void_of_run)
    first_run = np.zeros(count + 1, np.int64)
    cells = np.zeros(count, np.int64)
    grouped = np.empty_like(runs)
    _labelling.group_runs(runs, void_of_run, first_run, grouped, cells)
    labels = np.zeros(void.shape, np.int32)
    _labelling.paint(grouped, first_run, labels)
    return Voids(labels, grouped, first_run, cells)


def _scan(void):
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


def survey_rims(values, voids, begin=0, end=None):
    """Measure the known cells that share a side with each void.

    Parameters
    ----------
    values : (H, W) array
        Elevations; only known cells are read.
    voids : Voids
        As found by `find_voids`.
    begin, end : int
        The span of voids to measure; default: all.

    Returns
    -------
    Rims
    """
    from demsmith.core.voids import _labelling

    end = len(voids) if end is None else end
    low, mean, high = (np.empty(end - begin) for _ in range(3))
    edge = np.empty(end - begin, bool)
    _labelling.survey(
        values, voids.labels, voids.runs, voids.first_run[begin : end + 1], low, mean, high, edge
    )
    return Rims(low, mean, high, edge)
