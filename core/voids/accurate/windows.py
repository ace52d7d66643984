"""The windows of a raster from which its ground is learned."""

from dataclasses import dataclass

import numpy as np

BLOCK = 512
"""Side [cells] of the blocks by which windows are chosen, counted from the raster's first cell."""

_MOST = 12
_LEAST_KNOWN = 0.3


@dataclass(frozen=True)
class Window:
    """A window of a raster or mosaic.

    Attributes
    ----------
    row, column : int
        Its first cell.
    values : (h, w) float array
        Elevations [m].
    void : (h, w) bool array
    dx, dy : (h,) arrays
        Ground metres per cell of each row, east-west and north-south.
    """

    row: int
    column: int
    values: np.ndarray
    void: np.ndarray
    dx: np.ndarray
    dy: np.ndarray


def as_float(values):
    """Give elevations as float32, where they are, or else float64: kernels compile once for each.

    Examples
    --------
    >>> as_float(np.ones((1, 1), np.int16)).dtype
    dtype('float64')
    """
    return np.asarray(values, np.float32 if values.dtype == np.float32 else np.float64)


def cells_by_block(shape):
    """Give the cells of each block of a raster, an (R, C) array.

    Examples
    --------
    >>> cells_by_block((600, 2))
    array([[1024],
           [ 176]])
    """
    return np.outer(*(np.diff(np.minimum(np.arange(0, n + BLOCK, BLOCK), n)) for n in shape))


def training_spans(shape, voids):
    """Choose the blocks from which to learn: those with most voids of those that know enough.

    Parameters
    ----------
    shape : (int, int)
        Of the raster.
    voids : (R, C) int array
        Void cells of each block of `BLOCK` cells along a side.

    Returns
    -------
    list of (slice, slice)
        At most a dozen, in the order of the raster.

    Examples
    --------
    >>> training_spans((600, 512), np.array([[9], [0]]))
    [(slice(0, 512, None), slice(0, 512, None)), (slice(512, 600, None), slice(0, 512, None))]
    """
    by_block = cells_by_block(shape)
    cells = by_block.ravel()
    voids = np.asarray(voids).ravel()
    enough = cells - voids >= _LEAST_KNOWN * BLOCK**2
    # Among equals a random order, always the same, takes blocks from here and there.
    tie = np.random.default_rng(0).permutation(cells.size)
    order = np.lexsort((tie, -np.where(enough, voids, cells - voids), ~enough))
    chosen = np.sort(order[:_MOST])
    rows, columns = np.divmod(chosen, by_block.shape[1])
    return [
        (_span(row, shape[0]), _span(column, shape[1]))
        for row, column in zip(rows.tolist(), columns.tolist(), strict=True)
    ]


def _span(block, length):
    return slice(block * BLOCK, min((block + 1) * BLOCK, length))


def training_windows(values, void, pixel_size):
    """Cut the windows from which to learn out of an array.

    Parameters
    ----------
    values : (H, W) array
        Elevations [m].
    void : (H, W) bool array
    pixel_size : (array, array)
        Ground metres per cell of each row, as `demsmith.core.mcmd.lattice.metres` gives them.

    Returns
    -------
    list of Window
        Views of the arrays; windows without known ground are left out.
    """
    dx, dy = pixel_size
    edges = [np.arange(0, n, BLOCK) for n in void.shape]
    counts = np.add.reduceat(
        np.add.reduceat(void, edges[0], axis=0, dtype=np.int64), edges[1], axis=1
    )
    return [
        Window(rows.start, columns.start, values[rows, columns], void[rows, columns],
               dx[rows], dy[rows])
        for rows, columns in training_spans(void.shape, counts)
        if not void[rows, columns].all()
    ]  # fmt: skip
