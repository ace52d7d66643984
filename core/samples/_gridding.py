"""Kernels that add up what falls into each cell: points, and lines along their way."""

import math

import numba


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _add(row, column, elevation, sums, counts):
    """Add an elevation to a cell; tells whether the cell is one of the grid's."""
    if not (0 <= row < sums.shape[0] and 0 <= column < sums.shape[1]):
        return False
    sums[row, column] += elevation
    counts[row, column] += 1
    return True


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _centres(begin, end, count):
    """Give the first cell whose centre lies between two coordinates, and one past the last."""
    low, high = min(begin, end), max(begin, end)
    first = max(math.ceil(low - 0.5), 0.0)
    last = min(math.floor(high - 0.5), count - 1.0)
    return int(min(first, count)), int(max(last, -1.0)) + 1


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _add_segment(u, v, z, a, b, sums, counts):
    """Add the segment from vertex a to b; tells whether it passes a cell's centre."""
    du, dv, dz = u[b] - u[a], v[b] - v[a], z[b] - z[a]
    added = False
    if abs(du) >= abs(dv):
        first, end = _centres(u[a], u[b], sums.shape[1])
        for column in range(first, end):
            t = (column + 0.5 - u[a]) / du if du != 0.0 else 0.0
            row = math.floor(v[a] + t * dv)
            added |= _add(row, column, z[a] + t * dz, sums, counts)
    else:
        first, end = _centres(v[a], v[b], sums.shape[0])
        for row in range(first, end):
            t = (row + 0.5 - v[a]) / dv
            column = math.floor(u[a] + t * du)
            added |= _add(row, column, z[a] + t * dz, sums, counts)
    return added


@numba.njit(nogil=True, cache=True, error_model="numpy")
def add_lines(u, v, z, first, sums, counts, entering):
    """Add lines: each to one cell a column, or a row, whichever its segments run along.

    Parameters
    ----------
    u, v : (N,) float64 arrays
        Vertices in columns and rows from the grid's outer corner; finite.
    z : (N,) float64 array
    first : (L + 1,) int64 array
        The first vertex of each line, and one past the last one's last.
    sums : (H, W) float64 array
        Elevations where the lines pass the cells' centres are added here. A line so short that it
        passes none adds its first vertex.
    counts : (H, W) int32 array
    entering : (L,) bool array
        Is told which lines have a cell of the grid.
    """
    for line in range(first.size - 1):
        begin, end = first[line], first[line + 1]
        added = False
        for a in range(begin, end - 1):
            added |= _add_segment(u, v, z, a, a + 1, sums, counts)
        if not added and begin < end:
            added = _add(math.floor(v[begin]), math.floor(u[begin]), z[begin], sums, counts)
        entering[line] = added


@numba.njit(nogil=True, cache=True, error_model="numpy")
def add_points(u, v, z, begin, end, sums, counts):
    """Add points ``begin`` to ``end``; the grid's outer edges belong to its outermost cells."""
    rows, columns = sums.shape
    for i in range(begin, end):
        if 0 <= u[i] <= columns and 0 <= v[i] <= rows:
            row, column = min(int(v[i]), rows - 1), min(int(u[i]), columns - 1)
            _add(row, column, z[i], sums, counts)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def largest_deviation(u, v, z, begin, end, means):
    """Tell how far points ``begin`` to ``end`` are from the mean of their cells at most."""
    rows, columns = means.shape
    largest = 0.0
    for i in range(begin, end):
        if 0 <= u[i] <= columns and 0 <= v[i] <= rows:
            row, column = min(int(v[i]), rows - 1), min(int(u[i]), columns - 1)
            largest = max(largest, abs(z[i] - means[row, column]))
    return largest
