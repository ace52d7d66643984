"""Kernels that add up elevations within a distance of each cell."""

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def moments_around(z, void, base, row, column, reach, mean, deviation):
    """Write the mean and the root mean square deviation from it within a disc around some cells.

    Parameters
    ----------
    z, void : (h, w) arrays of float32 or float64, and bool
        The cells, and all those around them that the discs reach.
    base : float
        An elevation among those, which keeps rounding errors small.
    row, column : int
        Where in them the first cell is.
    reach : (m, h) int64 array
        Cells to either side, in each row, that the disc of the cells of a row covers; -1 if none.
    mean, deviation : (m, n) float32 arrays
        The mean less ``base``. NaN in voids.
    """
    h, w = z.shape
    heights, squares = np.zeros((h, w + 1)), np.zeros((h, w + 1))
    counts = np.zeros((h, w + 1), np.int32)
    for r in range(h):
        for c in range(w):
            height = 0.0 if void[r, c] else z[r, c] - base
            heights[r, c + 1] = heights[r, c] + height
            squares[r, c + 1] = squares[r, c] + height * height
            counts[r, c + 1] = counts[r, c] + (not void[r, c])
    m, n = mean.shape
    height, square, count = np.empty(n), np.empty(n), np.empty(n, np.int32)
    for i in range(m):
        height[:], square[:], count[:] = 0, 0, 0
        for r in range(h):
            if reach[i, r] >= 0:
                _add_differences(heights[r], column, reach[i, r], height)
                _add_differences(squares[r], column, reach[i, r], square)
                _add_differences(counts[r], column, reach[i, r], count)
        for j in range(n):
            if void[row + i, column + j]:
                mean[i, j] = deviation[i, j] = np.nan
                continue
            middle = height[j] / count[j]
            mean[i, j] = middle
            deviation[i, j] = np.sqrt(max(square[j] / count[j] - middle * middle, 0.0))


@numba.njit(**_JIT)
def _add_differences(sums, column, reach, total):
    """Add to some cells what running sums grow by from ``reach`` before each to as many behind.

    Parameters
    ----------
    sums : (w + 1,) array
    column, reach : int
        The first cell; not beyond w.
    total : (n,) array
    """
    n, w = total.size, sums.size - 1
    begin = min(max(reach - column, 0), n)
    end = max(min(w - reach - column, n), begin)
    for j in range(begin):
        total[j] += sums[min(column + j + reach + 1, w)]
    # Slices from 0 on, so that the compiler sees that no index is negative and goes fast.
    inner = total[begin:end]
    behind, before = sums[column + begin + reach + 1 :], sums[max(column + begin - reach, 0) :]
    for j in range(inner.size):
        inner[j] += behind[j] - before[j]
    for j in range(end, n):
        total[j] += sums[w] - sums[max(column + j - reach, 0)]
