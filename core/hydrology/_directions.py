"""Kernels of D8: to which of its eight neighbours each cell of some rows drains."""

import math

import numba
import numpy as np

from demsmith.core.hydrology._rows import pad_row
from demsmith.core.hydrology.directions import VOID_CODE

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def steepest(z, flat, void, dx, dy, first, last, codes):
    """Write the codes of rows ``first`` to ``last``; see `d8_directions`."""
    width = z.shape[1]
    north, here, south = np.empty(width + 2), np.empty(width + 2), np.empty(width + 2)
    pad_row(z, void, first - 1, np.inf, north)
    pad_row(z, void, first, np.inf, here)
    for row in range(first, last):
        pad_row(z, void, row + 1, np.inf, south)
        _descend(north, here, south, dx[row], dy[row], codes[row])
        _leave_flats(z, flat, row, dx[row], dy[row], codes[row])
        for column in range(width):
            if void[row, column]:
                codes[row, column] = VOID_CODE
        north, here, south = here, south, north


@numba.njit(**_JIT)
def _descend(north, here, south, dx, dy, codes):
    """Write the code of the steepest descent of each cell of a row, 0 where there is none.

    Rows are in double precision, so that drops are exact. Neighbours at the same distance are
    compared by elevation, which leaves three slopes. All is selection without branches: the
    compiler makes vector instructions of it. Codes grow in the order that decides between ties.
    """
    diagonal = math.hypot(dx, dy)
    for k in range(codes.size):
        j = k + 1
        best, code = here[j + 1], 1
        code = 16 if here[j - 1] < best else code
        best = min(here[j - 1], best)
        slope = (here[j] - best) / dx

        low, side = south[j + 1], 2
        side = 8 if south[j - 1] < low else side
        low = min(south[j - 1], low)
        side = 32 if north[j - 1] < low else side
        low = min(north[j - 1], low)
        side = 128 if north[j + 1] < low else side
        low = min(north[j + 1], low)
        steep = (here[j] - low) / diagonal
        code = side if (steep > slope) | ((steep == slope) & (side < code)) else code
        slope = max(steep, slope)

        low, side = south[j], 4
        side = 64 if north[j] < low else side
        low = min(north[j], low)
        steep = (here[j] - low) / dy
        code = side if (steep > slope) | ((steep == slope) & (side < code)) else code
        slope = max(steep, slope)
        codes[k] = code if slope > 0 else 0


@numba.njit(**_JIT)
def _leave_flats(z, flat, row, dx, dy, codes):
    """Write the code of each flat cell of a row: the steepest descent of ``flat``."""
    height, width = z.shape
    if row == 0 or row == height - 1:
        return  # water leaves there
    distance = (dx, math.hypot(dx, dy), dy)
    for column in range(1, width - 1):
        level = np.int64(flat[row, column])
        if level == 0:
            continue
        steepest_slope, code = 0.0, 0
        for k in range(8):
            down = (0, 1, 1, 1, 0, -1, -1, -1)[k]
            right = (1, 1, 0, -1, -1, -1, 0, 1)[k]
            if z[row + down, column + right] == z[row, column]:
                drop = level - np.int64(flat[row + down, column + right])
                slope = drop / distance[0 if down == 0 else 2 if right == 0 else 1]
                if slope > steepest_slope:
                    steepest_slope, code = slope, 1 << k
        codes[column] = code
