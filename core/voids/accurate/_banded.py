"""Linear systems whose matrix is a band: sums of squares of differences, factored and solved.

A band holds the lower half of a symmetric matrix row by row: element (i, j), j <= i, lies at
``[i, width - i + j]``, where ``width`` is the largest i - j that occurs.
"""

import numba
import numpy as np


@numba.njit(nogil=True, cache=True, error_model="numpy")
def add_square(band, right, numbers, elevations, coefficients, count, weight):
    """Add ``weight`` times the square of a sum of cells to the energy that is to be least.

    A cell with a number of at least 0 is unknown; the others bring their elevation.
    """
    width = band.shape[1] - 1
    known = 0.0
    for a in range(count):
        if numbers[a] < 0:
            known += coefficients[a] * elevations[a]
    for a in range(count):
        i = numbers[a]
        if i < 0:
            continue
        scaled = weight * coefficients[a]
        right[i] -= scaled * known
        for b in range(count):
            j = numbers[b]
            if 0 <= j <= i:
                band[i, width - i + j] += scaled * coefficients[b]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def bandwidth(number, rows, columns):
    """Give the largest difference of two numbers within so many rows and columns of each other."""
    high, wide = number.shape
    most = 0
    for r in range(high):
        for c in range(wide):
            here = number[r, c]
            if here < 0:
                continue
            for y in range(r, min(r + rows + 1, high)):
                for x in range(max(c - columns, 0), min(c + columns + 1, wide)):
                    if number[y, x] >= 0:
                        most = max(most, abs(number[y, x] - here))
    return most


@numba.njit(nogil=True, cache=True, error_model="numpy")
def solve_band(band, right):
    """Solve in place by Cholesky's factor; False if the matrix is not positive definite."""
    if not _factor(band):
        return False
    n, columns = band.shape
    width = columns - 1
    for i in range(n):
        total = right[i]
        for j in range(max(0, i - width), i):
            total -= band[i, width - i + j] * right[j]
        right[i] = total / band[i, width]
    for i in range(n - 1, -1, -1):
        right[i] /= band[i, width]
        for j in range(max(0, i - width), i):
            right[j] -= band[i, width - i + j] * right[i]
    return True


_PANEL = 4


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _factor(band):
    """Factor in place, four columns at a time, so that each later element is fetched once for four.

    Rows that the columns do not reach are passed over: voids have ragged outlines.
    """
    n, columns = band.shape
    width = columns - 1
    panel = np.zeros((_PANEL, width + _PANEL))
    for first in range(0, n, _PANEL):
        end = min(first + _PANEL, n)
        if not _factor_panel(band, first, end, panel):
            return False
        for i in range(end, min(end + width, n)):
            p0, p1 = panel[0, i - first], panel[1, i - first]
            p2, p3 = panel[2, i - first], panel[3, i - first]
            if p0 == 0 and p1 == 0 and p2 == 0 and p3 == 0:
                continue
            low = max(end, i - width)
            row = band[i, width - i + low :]
            c0, c1 = panel[0, low - first :], panel[1, low - first :]
            c2, c3 = panel[2, low - first :], panel[3, low - first :]
            for k in range(i + 1 - low):
                row[k] -= p0 * c0[k] + p1 * c1[k] + p2 * c2[k] + p3 * c3[k]
    return True


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _factor_panel(band, first, end, panel):
    """Factor some columns, and copy them from row ``first`` down into the rows of ``panel``."""
    n, columns = band.shape
    width = columns - 1
    for c in range(first, end):
        if not band[c, width] > 0:
            return False
        pivot = np.sqrt(band[c, width])
        band[c, width] = pivot
        last = min(c + width, n - 1)
        column = panel[c - first]
        for i in range(c + 1, last + 1):
            band[i, width - i + c] /= pivot
            column[i - first] = band[i, width - i + c]
        column[last + 1 - first :] = 0
        for j in range(c + 1, end):
            share = column[j - first]
            if share != 0:
                for i in range(j, last + 1):
                    band[i, width - i + j] -= share * column[i - first]
    return True
