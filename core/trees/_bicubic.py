"""Kernels of bicubic interpolation: Keys' cubic convolution, whose gradient is continuous."""

import math

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(inline="always", **_JIT)
def cubic(t):
    """Give the four weights of the samples at −1, 0, 1, 2 for a place between 0 and 1."""
    return (
        ((-0.5 * t + 1.0) * t - 0.5) * t,
        (1.5 * t - 2.5) * t * t + 1.0,
        ((-1.5 * t + 2.0) * t + 0.5) * t,
        (0.5 * t - 0.5) * t * t,
    )


@numba.njit(inline="always", **_JIT)
def cubic_slope(t):
    """Give the derivatives of these weights."""
    return (
        (-1.5 * t + 2.0) * t - 0.5,
        (4.5 * t - 5.0) * t,
        (-4.5 * t + 4.0) * t + 0.5,
        (1.5 * t - 1.0) * t,
    )


@numba.njit(**_JIT)
def bicubic_at(samples, layer, row, column):
    """Interpolate at a place counted in samples; give the value and its slopes per sample.

    Layers come first in ``samples``.

    Beyond the outermost samples, these go on.
    """
    _, height, width = samples.shape
    i, j = math.floor(row), math.floor(column)
    a, b = cubic(row - i), cubic(column - j)
    da, db = cubic_slope(row - i), cubic_slope(column - j)
    value, by_row, by_column = 0.0, 0.0, 0.0
    for k in range(4):
        r = min(max(i - 1 + k, 0), height - 1)
        along, slope = 0.0, 0.0
        for m in range(4):
            sample = np.float64(samples[layer, r, min(max(j - 1 + m, 0), width - 1)])
            along += b[m] * sample
            slope += db[m] * sample
        value += a[k] * along
        by_row += da[k] * along
        by_column += a[k] * slope
    return value, by_row, by_column


@numba.njit(**_JIT)
def fill_joint(samples, void, rows, columns, joint):
    """Fill columns of ``joint``: value, slopes by row and by column, and weight, of points.

    ``samples`` has one layer. The weight is 1 in cells that are no voids, and 0 in voids and
    outside the raster.
    """
    height, width = void.shape
    for k in range(rows.size):
        joint[:, k] = 0.0
        row, column = rows[k], columns[k]
        if not (-0.5 <= row <= height - 0.5 and -0.5 <= column <= width - 0.5):
            continue
        i = min(math.floor(row + 0.5), height - 1)
        j = min(math.floor(column + 0.5), width - 1)
        if not void[i, j]:
            joint[0, k], joint[1, k], joint[2, k] = bicubic_at(samples, 0, row, column)
            joint[3, k] = 1.0
