"""Kernels of the structure function around voids and within them, and of scaled roughness."""

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def squares_around(begin, end, values, labels, runs, first_run, lags, out, margin):
    """Write the mean squared difference of known cells around voids ``begin`` to ``end``.

    Pairs of cells stand some ``lags`` apart, in a row or a column, both within ``margin`` of the
    void's bounding box and known.

    Parameters
    ----------
    out : (V, lags) float64 array
        NaN where there is no pair.
    """
    height, width = labels.shape
    for void in range(begin, end):
        a, b = first_run[void], first_run[void + 1]
        left, right = runs[a, 1], runs[a, 2]
        for k in range(a, b):
            left, right = min(left, runs[k, 1]), max(right, runs[k, 2])
        top, bottom = max(runs[a, 0] - margin, 0), min(runs[b - 1, 0] + 1 + margin, height)
        left, right = max(left - margin, 0), min(right + margin, width)
        for n in range(lags.size):
            lag = lags[n]
            total, count = 0.0, 0
            for row in range(top, bottom):
                for column in range(left, right):
                    if labels[row, column]:
                        continue
                    here = np.float64(values[row, column])
                    if row + lag < bottom and not labels[row + lag, column]:
                        total += (values[row + lag, column] - here) ** 2
                        count += 1
                    if column + lag < right and not labels[row, column + lag]:
                        total += (values[row, column + lag] - here) ** 2
                        count += 1
            out[void, n] = total / count if count else np.nan


@numba.njit(**_JIT)
def squares_within(begin, end, values, labels, runs, first_run, lags, out):
    """Write the same of the cells of each void, whose label both must carry."""
    height, width = labels.shape
    for void in range(begin, end):
        for n in range(lags.size):
            lag = lags[n]
            total, count = 0.0, 0
            for k in range(first_run[void], first_run[void + 1]):
                row = runs[k, 0]
                for column in range(runs[k, 1], runs[k, 2]):
                    here = np.float64(values[row, column])
                    if row + lag < height and labels[row + lag, column] == void + 1:
                        total += (values[row + lag, column] - here) ** 2
                        count += 1
                    if column + lag < width and labels[row, column + lag] == void + 1:
                        total += (values[row, column + lag] - here) ** 2
                        count += 1
            out[void, n] = total / count if count else np.nan


@numba.njit(**_JIT)
def soften_rims(begin, end, noise, labels, runs, first_run, share):
    """Multiply the noise of cells beside known ground."""
    height, width = labels.shape
    for k in range(first_run[begin], first_run[end]):
        row = runs[k, 0]
        for column in range(runs[k, 1], runs[k, 2]):
            if (
                (row > 0 and not labels[row - 1, column])
                or (row + 1 < height and not labels[row + 1, column])
                or (column > 0 and not labels[row, column - 1])
                or (column + 1 < width and not labels[row, column + 1])
            ):
                noise[row, column] *= share


@numba.njit(**_JIT)
def add_scaled(begin, end, values, labels, runs, first_run, noise, amplitude):
    """Add the noise of each void times its amplitude."""
    for void in range(begin, end):
        if amplitude[void] == 0:
            continue
        for k in range(first_run[void], first_run[void + 1]):
            row = runs[k, 0]
            for column in range(runs[k, 1], runs[k, 2]):
                values[row, column] += amplitude[void] * noise[row, column]
