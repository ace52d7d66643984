"""Kernels of stream networks: which stream cells flow together, and walks down the codes.

A code is ESRI's: 1 east, 2 south-east, 4 south, ... 128 north-east, where the next row is south;
anything else leads nowhere.
"""

import numba
import numpy as np

_jit = numba.njit(nogil=True, cache=True, error_model="numpy")


@_jit
def _step(code):
    """Rows and columns that a code leads on; (0, 0) for none."""
    row = 0
    if code == 2 or code == 4 or code == 8:
        row = 1
    elif code == 32 or code == 64 or code == 128:
        row = -1
    column = 0
    if code == 1 or code == 2 or code == 128:
        column = 1
    elif code == 8 or code == 16 or code == 32:
        column = -1
    return row, column


@_jit
def _below(row, column, directions, stream):
    """Give the stream cell that a cell drains to; itself if there is none."""
    down, right = _step(directions[row, column])
    r, c = row + down, column + right
    if 0 <= r < stream.shape[0] and 0 <= c < stream.shape[1] and stream[r, c]:
        return r, c
    return row, column


@_jit
def count_donors(directions, stream, first, last, donors):
    """Count for the stream cells of some rows how many stream cells drain to them.

    Parameters
    ----------
    directions : (H, W) uint8 array
    stream : (H, W) bool array
    first, last : int
        Rows from, and to before.
    donors : (H, W) uint8 array
        These rows are set, 0 off streams.
    """
    height, width = directions.shape
    for row in range(first, last):
        for column in range(width):
            count = 0
            if stream[row, column]:
                for r in range(max(0, row - 1), min(height, row + 2)):
                    for c in range(max(0, column - 1), min(width, column + 2)):
                        if stream[r, c] and (r != row or c != column):
                            down, right = _step(directions[r, c])
                            count += r + down == row and c + right == column
            donors[row, column] = count


@_jit
def link_sizes(starts, directions, stream, donors, sizes):
    """Count the cells of each link, from its start to the next confluence or its end.

    Parameters
    ----------
    starts : (L,) int64 array
        Flat places of the cells where links begin: heads and confluences.
    directions, stream, donors
        As of `count_donors`.
    sizes : (L,) int64 array
        Set; the cell of the confluence that a link ends in is counted.
    """
    width = directions.shape[1]
    for link in range(starts.size):
        row, column = starts[link] // width, starts[link] % width
        size = 1
        while True:
            r, c = _below(row, column, directions, stream)
            if r == row and c == column:
                break
            size += 1
            row, column = r, c
            if donors[row, column] > 1:
                break
        sizes[link] = size


@_jit
def trace_links(
    starts, first_cell, directions, stream, donors, dx, dy, area, cells, lengths, areas
):
    """Walk along links.

    Parameters
    ----------
    starts, directions, stream, donors
        As of `link_sizes`.
    first_cell : (L + 1,) int64 array
        Where each link's cells begin in ``cells``.
    dx, dy : (H,) float64 arrays
        Ground metres per cell of each row.
    area : (H, W) float64 array
        Upstream area.
    cells : (N, 2) int32 array
        Set: rows and columns.
    lengths, areas : (L,) float64 arrays
        Set: metres on the ground, and the area where the link ends, above a confluence there.
    """
    width = directions.shape[1]
    for link in range(starts.size):
        row, column = starts[link] // width, starts[link] % width
        length, at_end = 0.0, area[row, column]
        cells[first_cell[link], 0], cells[first_cell[link], 1] = row, column
        for place in range(first_cell[link] + 1, first_cell[link + 1]):
            r, c = _below(row, column, directions, stream)
            east = 0.5 * (dx[row] + dx[r]) * (c - column)
            south = 0.5 * (dy[row] + dy[r]) * (r - row)
            length += np.sqrt(east * east + south * south)
            row, column = r, c
            cells[place, 0], cells[place, 1] = row, column
            if donors[row, column] <= 1:
                at_end = area[row, column]
        lengths[link], areas[link] = length, at_end


@_jit
def strahler(downstream, sequence, order):
    """Give each link its order by Strahler.

    Parameters
    ----------
    downstream : (L,) int64 array
        Place of the link that each flows into; -1 for none.
    sequence : (L,) int64 array
        Links so that each comes before the one it flows into.
    order : (L,) int64 array
        Set.
    """
    highest = np.zeros(order.size, np.int64)
    ties = np.zeros(order.size, np.int64)
    for link in sequence:
        order[link] = max(1, highest[link] + (ties[link] > 1))
        into = downstream[link]
        if into >= 0:
            if order[link] > highest[into]:
                highest[into], ties[into] = order[link], 1
            elif order[link] == highest[into]:
                ties[into] += 1
