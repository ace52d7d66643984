"""The cells around one void, copied out: what is known there and what is to be found."""

import numba
import numpy as np

KNOWN, VOID, GHOST, BLANK = 0, 1, 2, 3
"""A known cell; one of the void; one of another void so near that it is solved for as well, its
value thrown away; one that says nothing: of another void further off."""

LATENT = 4
"""A known cell whose noise is taken away, where a copy of the states marks it."""

GHOST_REACH = 2


@numba.njit(nogil=True, cache=True, error_model="numpy")
def bounds(runs, begin, end, margin, shape):
    """Give first row, end row, first column and end column of a void with a margin, in a raster."""
    top, bottom = runs[begin, 0], runs[end - 1, 0] + 1
    left, right = runs[begin, 1], runs[begin, 2]
    for r in range(begin, end):
        top = min(top, runs[r, 0])
        bottom = max(bottom, runs[r, 0] + 1)
        left = min(left, runs[r, 1])
        right = max(right, runs[r, 2])
    return (
        max(top - margin, 0),
        min(bottom + margin, shape[0]),
        max(left - margin, 0),
        min(right + margin, shape[1]),
    )


@numba.njit(nogil=True, cache=True, error_model="numpy")
def states(void, runs, begin, end, top, bottom, left, right):
    """Tell what each cell of a window is to a void: see `KNOWN`."""
    state = np.empty((bottom - top, right - left), np.uint8)
    for r in range(top, bottom):
        for c in range(left, right):
            state[r - top, c - left] = BLANK if void[r, c] else KNOWN
    for run in range(begin, end):
        r = runs[run, 0] - top
        for c in range(runs[run, 1] - left, runs[run, 2] - left):
            state[r, c] = VOID
    high, wide = state.shape
    for run in range(begin, end):
        r = runs[run, 0] - top
        first, last = runs[run, 1] - left, runs[run, 2] - left
        for y in range(max(r - GHOST_REACH, 0), min(r + GHOST_REACH + 1, high)):
            for x in range(max(first - GHOST_REACH, 0), min(last + GHOST_REACH, wide)):
                if state[y, x] == BLANK:
                    state[y, x] = GHOST
    return state


@numba.njit(nogil=True, cache=True, error_model="numpy")
def number_cells(state, number):
    """Number the unknown cells along the window's shorter side, for a narrow band; -1 elsewhere."""
    high, wide = state.shape
    count = 0
    for a in range(max(high, wide)):
        for b in range(min(high, wide)):
            r, c = (a, b) if wide <= high else (b, a)
            if state[r, c] == VOID or state[r, c] == GHOST or state[r, c] == LATENT:
                number[r, c] = count
                count += 1
            else:
                number[r, c] = -1
    return count


@numba.njit(nogil=True, cache=True, error_model="numpy")
def box_around(number, reach):
    """Give first and end row and column of the cells within so many cells of a numbered one."""
    high, wide = number.shape
    top, bottom, left, right = high, 0, wide, 0
    for r in range(high):
        for c in range(wide):
            if number[r, c] >= 0:
                top, bottom = min(top, r), max(bottom, r + 1)
                left, right = min(left, c), max(right, c + 1)
    return (
        max(top - reach, 0),
        min(bottom + reach, high),
        max(left - reach, 0),
        min(right + reach, wide),
    )
