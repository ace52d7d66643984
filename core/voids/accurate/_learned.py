"""The expected surface of one void under the covariance learned from the raster."""

import numba
import numpy as np

from demsmith.core.voids.accurate._banded import add_square, bandwidth, solve_band
from demsmith.core.voids.accurate._locality import (
    BLANK,
    KNOWN,
    LATENT,
    VOID,
    box_around,
    number_cells,
)

HIGHEST = 4
"""Highest order of the differences whose squares make the energy."""

RING = 3
"""Known cells around a void whose noise is taken away."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def solve_learned(z, state, weights, noise):
    """Replace the estimates of a void's cells by their expectation.

    z : (h, w) float64, known elevations and first estimates; changed in place in the void.
    state : (h, w) uint8, see `_locality`.
    weights : (5, 5), of the square of the difference of order i down and j across.
    noise : variance of a known cell's noise; 0: known cells are true.
    """
    number = np.empty(z.shape, np.int64)
    count = number_cells(_with_ring(state) if noise > 0 else state, number)
    box = box_around(number, HIGHEST)
    width = 0
    for i in range(HIGHEST + 1):
        width = max(width, bandwidth(number, i, HIGHEST - i))
    band = np.zeros((count, width + 1))
    right = np.zeros(count)
    if noise > 0:
        _observe(z, state, number, noise, band, right)
    for i in range(HIGHEST + 1):
        for j in range(HIGHEST + 1 - i):
            if weights[i, j] > 0:
                _add_differences(z, state, number, box, i, j, weights[i, j], band, right)
    if not solve_band(band, right):
        return False
    high, wide = z.shape
    for r in range(high):
        for c in range(wide):
            if number[r, c] >= 0 and state[r, c] != KNOWN:
                z[r, c] = right[number[r, c]]
    return True


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _with_ring(state):
    """Copy the states, known cells near the void marked as `LATENT`."""
    marked = state.copy()
    high, wide = state.shape
    for r in range(high):
        for c in range(wide):
            if state[r, c] == VOID:
                for y in range(max(r - RING, 0), min(r + RING + 1, high)):
                    for x in range(max(c - RING, 0), min(c + RING + 1, wide)):
                        if state[y, x] == KNOWN:
                            marked[y, x] = LATENT
    return marked


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _observe(z, state, number, noise, band, right):
    width = band.shape[1] - 1
    high, wide = z.shape
    for r in range(high):
        for c in range(wide):
            i = number[r, c]
            if i >= 0 and state[r, c] == KNOWN:
                band[i, width] += 1 / noise
                right[i] += z[r, c] / noise


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _add_differences(z, state, number, box, down, across, weight, band, right):
    """Add the squares of one order of difference wherever it meets an unknown cell."""
    top, bottom, left, right_end = box
    rows, columns = _binomial(down), _binomial(across)
    count = (down + 1) * (across + 1)
    numbers, elevations = np.empty(count, np.int64), np.empty(count)
    coefficients = np.empty(count)
    for a in range(down + 1):
        for b in range(across + 1):
            coefficients[a * (across + 1) + b] = rows[a] * columns[b]
    for r in range(top, bottom - down):
        for c in range(left, right_end - across):
            unknown, complete = False, True
            k = 0
            for y in range(r, r + down + 1):
                for x in range(c, c + across + 1):
                    numbers[k] = number[y, x]
                    elevations[k] = z[y, x]
                    unknown |= number[y, x] >= 0
                    complete &= state[y, x] != BLANK
                    k += 1
            if unknown and complete:
                add_square(band, right, numbers, elevations, coefficients, count, weight)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _binomial(order):
    """Give the weights of a difference: 1; -1, 1; 1, -2, 1; and so on."""
    weights = np.zeros(order + 1)
    weights[0] = 1
    for _ in range(order):
        for k in range(order, 0, -1):
            weights[k] = weights[k - 1] - weights[k]
        weights[0] = -weights[0]
    return weights
