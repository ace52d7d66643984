"""Kernels that carry flags downstream."""

import numba

from demsmith.core.hydrology._receivers import DOWN, RIGHT

_jit = numba.njit(nogil=True, cache=True, error_model="numpy")


@_jit
def mark_edges(void, flag, first, last, flags):
    """Set a flag at the cells of some rows that lie at the raster's edge or beside a void."""
    height, width = void.shape
    for row in range(first, last):
        for column in range(width):
            if void[row, column]:
                continue
            if row == 0 or row == height - 1 or column == 0 or column == width - 1:
                flags[row, column] |= flag
                continue
            for k in range(8):
                if void[row + DOWN[k], column + RIGHT[k]]:
                    flags[row, column] |= flag


@_jit
def spread(receivers, void, end, patience, place, stack, flags):
    """Give the flags of each cell to all that it drains to, over and over.

    Parameters
    ----------
    receivers : (H, W) uint8 array
        Sums of the codes of each cell's receivers; read where there is no void.
    void : (H, W) bool array
    end : int
        Where to stop; cells are visited in row order.
    patience : int
        How many cells may be visited in this call.
    place : (2,) int64 array
        The cell to visit next, as flat index, and how many are on the stack.
    stack : (N,) int64 array
        Cells that got a flag after they had been visited.
    flags : (H, W) uint8 array

    Returns
    -------
    bool
        Whether all is done; if not, call again, with more room on the stack if it is short of that.
    """
    height, width = flags.shape
    current, top = place[0], place[1]
    while patience > 0 and top + 8 < stack.size and (top > 0 or current < end):
        patience -= 1
        if top > 0:
            top -= 1
            cell = stack[top]
        else:
            cell = current
            current += 1
        row = cell // width
        column = cell - row * width
        flag, bits = flags[row, column], receivers[row, column]
        if flag == 0 or bits == 0 or void[row, column]:
            continue
        for k in range(8):
            if not bits >> k & 1:
                continue
            r, c = row + DOWN[k], column + RIGHT[k]
            if r < 0 or r >= height or c < 0 or c >= width or void[r, c]:
                continue
            both = flags[r, c] | flag
            if both != flags[r, c]:
                flags[r, c] = both
                there = r * width + c
                if there < current:
                    stack[top] = there
                    top += 1
    place[0], place[1] = current, top
    return top == 0 and current >= end
