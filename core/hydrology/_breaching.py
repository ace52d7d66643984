"""Kernels that look for the least costly way out of pits.

A pit is a cell without a neighbour that comes before it in the order of elevation, then of place;
it is no outlet. All that is visited from it is on the raster and known, for outlets end the way.
Elevations and kinds of cells have one dimension here.
"""

import heapq
import math

import numba
import numpy as np

from demsmith.core.hydrology._rows import pad_row

_JIT = dict(nogil=True, cache=True, error_model="numpy")

# A void counts as an outlet.
_PIT, _OUTLET = 1, 2


@numba.njit(**_JIT)
def mark_pits(z, void, first, last, kind):
    """Write which cells of rows ``first`` to ``last`` are pits, outlets or voids; list the pits."""
    width = z.shape[1]
    low = -z.dtype.type(np.inf)
    north, here, south = (
        np.empty(width + 2, z.dtype), np.empty(width + 2, z.dtype), np.empty(width + 2, z.dtype)
    )  # fmt: skip
    pad_row(z, void, first - 1, low, north)
    pad_row(z, void, first, low, here)
    pits = 0
    for row in range(first, last):
        pad_row(z, void, row + 1, low, south)
        for column in range(width):
            j = column + 1
            before = min(min(north[j - 1], north[j]), min(north[j + 1], here[j - 1]))
            after = min(min(here[j + 1], south[j - 1]), min(south[j], south[j + 1]))
            pit = (here[j] < before) & (here[j] <= after)
            outlet = min(min(before, here[j]), after) == -np.inf
            kind[row * width + column] = _OUTLET if outlet else _PIT if pit else 0
            pits += pit & (not outlet)
        north, here, south = here, south, north
    places = np.empty(pits, np.int64)
    found = 0
    for cell in range(first * width, last * width):
        if kind[cell] == _PIT:
            places[found] = cell
            found += 1
    return places


@numba.njit(**_JIT)
def find_breaches(z, width, kind, dx, dy, pits, max_depth, max_length, most):
    """Find the way out of each pit; see `breach_depressions`.

    A way is given up after ``most`` cells, and no other is begun after as many cells in all.

    Returns
    -------
    done : int
        Pits for which it was done.
    cells : (N,) int64 array
        Those of the ways that are higher than the pit; a cell may be there several times.
    levels : (N,) array
        Elevation of the pit of each.
    """
    cells, levels = [np.int64(0) for _ in range(0)], [z[0] for _ in range(0)]
    steps = _steps(width)
    done, visited = 0, 0
    while done < pits.size and visited < most:
        pit = pits[done]
        end, count, seen, back = _search(z, width, kind, dx, dy, pit, max_depth, max_length, most)
        done += 1
        visited += count
        if end < 0:
            continue
        while end != pit:
            if z[end] > z[pit]:
                cells.append(end)
                levels.append(z[pit])
            end -= steps[back[_slot(seen, end)]]
    return done, np.array(cells, dtype=np.int64), np.array(levels, dtype=z.dtype)


@numba.njit(**_JIT)
def apply_breaches(z, cells, levels):
    """Cut cells down to levels."""
    for k in range(cells.size):
        z[cells[k]] = min(z[cells[k]], levels[k])


@numba.njit(**_JIT)
def _search(z, width, kind, dx, dy, pit, max_depth, max_length, most):
    """Find the cell where the least costly way from a pit ends, by Dijkstra's algorithm.

    Returns
    -------
    end : int
        -1 if there is none within the limits.
    visited : int
        Cells it took to tell.
    seen, back : (S,) int64 and int8 arrays
        A hash table: the cells seen, and the number of the step that led to each.
    """
    steps = _steps(width)
    bottom = np.float64(z[pit])
    size = 256
    seen, back = np.full(size, -1, np.int64), np.empty(size, np.int8)
    cost, length = np.empty(size), np.empty(size)
    place = _slot(seen, pit)
    seen[place], back[place], cost[place], length[place] = pit, -1, 0.0, 0.0
    count, visited = 1, 0
    queue = [(0.0, 0.0, np.int64(pit))]
    while len(queue) > 0 and visited < most:
        spent, way, cell = heapq.heappop(queue)
        place = _slot(seen, cell)
        if spent > cost[place] or (spent == cost[place] and way > length[place]):
            continue
        visited += 1
        if _ends(z, kind, pit, cell):
            return cell, visited, seen, back
        if 2 * (count + 8) > size:
            seen, back, cost, length = _enlarged(seen, back, cost, length)
            size = seen.size
        row = cell // width
        diagonal = math.hypot(dx[row], dy[row])
        for k in range(8):
            other = cell + steps[k]
            step = diagonal if k % 2 else dx[row] if k % 4 == 0 else dy[row]
            deep = max(np.float64(z[other]) - bottom, 0.0)
            other_way = way + step
            if deep > max_depth or other_way > max_length:
                continue
            other_spent = spent + deep * step
            place = _slot(seen, other)
            if seen[place] < 0:
                seen[place] = other
                count += 1
            elif not (
                other_spent < cost[place]
                or (other_spent == cost[place] and other_way < length[place])
            ):
                continue
            back[place], cost[place], length[place] = k, other_spent, other_way
            heapq.heappush(queue, (other_spent, other_way, other))
    return np.int64(-1), visited, seen, back


@numba.njit(**_JIT)
def _ends(z, kind, pit, cell):
    """Tell whether a way from a pit may end in a cell: an outlet, lower ground, an earlier pit."""
    if kind[cell] == _OUTLET or z[cell] < z[pit]:
        return True
    return kind[cell] == _PIT and z[cell] == z[pit] and cell < pit


@numba.njit(**_JIT)
def _steps(width):
    """To the east, south-east, south, ... north-east."""
    return (1, width + 1, width, width - 1, -1, -width - 1, -width, -width + 1)


@numba.njit(**_JIT)
def _slot(seen, cell):
    """Give the place of a cell in a hash table of 2**n places, or that where it may be put."""
    mask = seen.size - 1
    place = (cell * 0x9E3779B1 >> 7) & mask
    while seen[place] != cell and seen[place] != -1:
        place = (place + 1) & mask
    return place


@numba.njit(**_JIT)
def _enlarged(seen, back, cost, length):
    """Copy a hash table to one of four times the size."""
    size = 4 * seen.size
    new_seen, new_back = np.full(size, -1, np.int64), np.empty(size, np.int8)
    new_cost, new_length = np.empty(size), np.empty(size)
    for k in range(seen.size):
        if seen[k] >= 0:
            place = _slot(new_seen, seen[k])
            new_seen[place], new_back[place] = seen[k], back[k]
            new_cost[place], new_length[place] = cost[k], length[k]
    return new_seen, new_back, new_cost, new_length
