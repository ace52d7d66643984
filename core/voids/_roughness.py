"""Kernels of the roughness around voids and within them, and of what is added to them."""

import numba
import numpy as np

from demsmith.core.mcmd._points import columns_of

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def squares_around(begin, end, values, labels, runs, first_run, lags, out, margin):
    """Write the mean squared second difference of known cells around some voids.

    That is of three cells, in a row or a column, each ``lag`` cells from the next, all known and
    within ``margin`` of the void's bounding box.

    Parameters
    ----------
    begin, end : int
        Voids.
    out : (V, lags) float64 array
        NaN where there are no three such cells.
    """
    height, width = labels.shape
    for void in range(begin, end):
        a, b = first_run[void], first_run[void + 1]
        left, right = columns_of(runs, a, b)
        top, bottom = max(runs[a, 0] - margin, 0), min(runs[b - 1, 0] + 1 + margin, height)
        left, right = max(left - margin, 0), min(right + margin, width)
        for n in range(lags.size):
            lag = lags[n]
            total, count = 0.0, 0
            for row in range(top, bottom):
                for column in range(left, right):
                    if labels[row, column]:
                        continue
                    twice = 2 * np.float64(values[row, column])
                    up, down = row - lag, row + lag
                    if (
                        up >= top
                        and down < bottom
                        and not (labels[up, column] or labels[down, column])
                    ):
                        total += (values[up, column] - twice + values[down, column]) ** 2
                        count += 1
                    west, east = column - lag, column + lag
                    if (
                        west >= left
                        and east < right
                        and not (labels[row, west] or labels[row, east])
                    ):
                        total += (values[row, west] - twice + values[row, east]) ** 2
                        count += 1
            out[void, n] = total / count if count else np.nan


@numba.njit(**_JIT)
def squares_within(begin, end, values, labels, runs, first_run, lags, out):
    """Write the same of the cells of each void, whose label all three must carry."""
    height, width = labels.shape
    for void in range(begin, end):
        for n in range(lags.size):
            lag = lags[n]
            total, count = 0.0, 0
            for k in range(first_run[void], first_run[void + 1]):
                row = runs[k, 0]
                for column in range(runs[k, 1], runs[k, 2]):
                    twice = 2 * np.float64(values[row, column])
                    up, down = row - lag, row + lag
                    if (
                        up >= 0
                        and down < height
                        and (labels[up, column] == void + 1 and labels[down, column] == void + 1)
                    ):
                        total += (values[up, column] - twice + values[down, column]) ** 2
                        count += 1
                    west, east = column - lag, column + lag
                    if (
                        west >= 0
                        and east < width
                        and (labels[row, west] == void + 1 and labels[row, east] == void + 1)
                    ):
                        total += (values[row, west] - twice + values[row, east]) ** 2
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
def smooth(begin, end, noise, labels, runs, first_run):
    """Smooth the noise of each void by 1-6-1 along rows and columns, as if nought all around."""
    for void in range(begin, end):
        a, b = first_run[void], first_run[void + 1]
        left, right = columns_of(runs, a, b)
        top = runs[a, 0] - 1
        # The void and a cell around it, smoothed along rows.
        along = np.zeros((runs[b - 1, 0] - top + 2, right - left + 2))
        for k in range(a, b):
            row = runs[k, 0] - top
            for column in range(runs[k, 1], runs[k, 2]):
                value = noise[runs[k, 0], column] / 8
                at = column - left + 1
                along[row, at - 1] += value
                along[row, at] += 6 * value
                along[row, at + 1] += value
        for k in range(a, b):
            row = runs[k, 0] - top
            for column in range(runs[k, 1], runs[k, 2]):
                at = column - left + 1
                noise[runs[k, 0], column] = (
                    along[row - 1, at] + 6 * along[row, at] + along[row + 1, at]
                ) / 8


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
