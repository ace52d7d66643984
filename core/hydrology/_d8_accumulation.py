"""Kernels that add up along D8 codes."""

import numba
import numpy as np

from demsmith.core.hydrology._dispersal import take
from demsmith.core.hydrology._receivers import DONE, DOWN, RIGHT, VOID, count_in_row
from demsmith.core.hydrology.directions import VOID_CODE

_jit = numba.njit(nogil=True, cache=True, error_model="numpy")

# Cells looked for at once.
_BUNCH = 64


def _by_code(steps):
    table = np.zeros(256, np.int64)
    for k in range(8):
        table[1 << k] = steps[k]
    return table


_DOWN, _RIGHT = _by_code(DOWN), _by_code(RIGHT)


@_jit
def count_donors_d8(directions, first, last, donors):
    """Count how many neighbours drain to each cell of some rows.

    Parameters
    ----------
    directions : (H, W) uint8 array
    first, last : int
        Rows from, and to before.
    donors : (H, W) uint8 array
        These rows are set, `VOID` where there is a void.

    Returns
    -------
    int
        Flat index of the first code that is none, or -1.
    """
    height, width = directions.shape
    rows = np.zeros((3, width + 2), np.uint8)
    wrong = np.int64(-1)
    for row in range(first, last):
        for near in range(row - 1 if row == first else row + 1, row + 2):
            padded = rows[near % 3]
            padded[:] = 0
            if 0 <= near < height:
                for column in range(width):
                    code = directions[near, column]
                    # With one bit set at most.
                    padded[column + 1] = code if code & (code - 1) == 0 else np.uint8(0)
        count_in_row(rows, row, donors[row])
        for column in range(width):
            code = directions[row, column]
            if code != rows[row % 3, column + 1]:
                donors[row, column] = VOID
                if code != VOID_CODE and wrong < 0:
                    wrong = row * width + column
    return wrong


@_jit
def drain(directions, rows, free, place, patience, donors, area):
    """Pass on what cells have, down the codes as far as nothing else must be waited for.

    Parameters
    ----------
    directions : (H, W) uint8 array
    rows, free, place
        See `demsmith.core.hydrology.traversal.Reach`.
    patience : int
        How many cells may be passed on in this call.
    donors : (H, W) uint8 array
        How many donors each cell waits for; `VOID` and `DONE`.
    area : (H, W) float64 array
        What each cell has; added to.

    Returns
    -------
    bool
        Whether all is done.
    """
    height, width = directions.shape
    end = rows[1] * width
    waiting, stack, cells = donors.reshape(-1), np.empty(0, np.int64), np.empty(_BUNCH, np.int64)
    while patience > 0:
        count = take(waiting, end, place, stack, cells)
        if count == 0:
            break
        for one in range(count):
            row = cells[one] // width
            column = cells[one] - row * width
            code = directions[row, column]
            while code != 0:
                amount = area[row, column]
                row += _DOWN[code]
                column += _RIGHT[code]
                if row < 0 or row >= height or column < 0 or column >= width:
                    break
                left = donors[row, column]
                if left == VOID:
                    break
                area[row, column] += amount
                donors[row, column] = left - 1
                if left > 1 or row < free[0] or row >= free[1]:
                    break
                donors[row, column] = DONE
                patience -= 1
                code = directions[row, column]
        patience -= count
    return place[0] >= end
