"""Kernels that look for level water beside voids, and hold the voids at its level."""

import numba
import numpy as np

from demsmith.core.mcmd._points import columns_of

_JIT = dict(nogil=True, cache=True, error_model="numpy")

MARGIN = 64
"""How far [cells] from a void's bounding box water is looked at."""

MANY_CELLS = 4096
"""So many level cells are water whatever their area."""

FEW = 2
"""So many cells of a rim that lie lower than water may be noise, however short the rim."""

# Water beside one void has seldom two levels, never many.
_LEVELS = 8


@numba.njit(**_JIT)
def survey_water(
    begin,
    end,
    values,
    void,
    runs,
    first_run,
    cell_area,
    area,
    tolerance,
    share,
    level,
    floor,
    whole,
):
    """Tell the level of the water beside some voids, NaN if there is none.

    Parameters
    ----------
    begin, end : int
        Voids.
    cell_area : (H,) float64 array
        Ground area of a cell of each row.
    area : float
        A level area of at least this size is water.
    tolerance, share : float
        A void is all water where this share of its rim is within ``tolerance`` of the level.
    level, floor : (V,) float64 arrays
    whole : (V,) bool array
        What is found; see `demsmith.core.faults.water.Water`.
    """
    height, width = values.shape
    levels, counts = np.empty(_LEVELS), np.empty(_LEVELS, np.int64)
    for number in range(begin, end):
        a, b = first_run[number], first_run[number + 1]
        left, right = columns_of(runs, a, b)
        top, bottom = max(runs[a, 0] - MARGIN, 0), min(runs[b - 1, 0] + 1 + MARGIN, height)
        left, right = max(left - MARGIN, 0), min(right + MARGIN, width)
        rim = _rim(void, runs, a, b)
        found = _water_levels(
            values, void, rim, top, bottom, left, right, cell_area, area, levels, counts
        )
        level[number], floor[number], whole[number] = np.nan, np.nan, False
        if found:
            water = levels[np.argmax(counts[:found])]
            level[number] = water
            lowest, at, lower = water, 0, 0
            for k in range(rim.shape[0]):
                value = np.float64(values[rim[k, 0], rim[k, 1]])
                at += abs(value - water) <= tolerance
                lower += value < water
                lowest = min(lowest, value)
            whole[number] = at >= share * rim.shape[0]
            floor[number] = water if lower <= max((1 - share) * rim.shape[0], FEW) else lowest


@numba.njit(**_JIT)
def _rim(void, runs, begin, end):
    """Give row and column of the known cell at each outer side of a void's cells."""
    height, width = void.shape
    room = 0
    for k in range(begin, end):
        room += 2 + 2 * (runs[k, 2] - runs[k, 1])
    rim = np.empty((room, 2), np.int64)
    count = 0
    for k in range(begin, end):
        row, start, stop = runs[k, 0], runs[k, 1], runs[k, 2]
        for other in range(max(row - 1, 0), min(row + 2, height)):
            first = start - 1 if other == row else start
            last = stop + 1 if other == row else stop
            for column in range(max(first, 0), min(last, width)):
                if not void[other, column]:
                    rim[count] = other, column
                    count += 1
    return rim[:count]


@numba.njit(**_JIT)
def _water_levels(values, void, rim, top, bottom, left, right, cell_area, area, levels, counts):
    """Collect the levels of the water that a rim touches, and how many sides touch each."""
    found = 0
    # 0 not seen, 1 seen and no water, 2 water.
    seen = np.zeros((0, 0), np.uint8)
    stack = np.empty((0, 2), np.int64)
    for k in range(rim.shape[0]):
        row, column = rim[k]
        if not _has_equal(values, void, row, column):
            continue
        if stack.shape[0] == 0:
            seen = np.zeros((bottom - top, right - left), np.uint8)
            stack = np.empty((MANY_CELLS, 2), np.int64)
        if seen[row - top, column - left] == 0:
            _flood(values, void, row, column, top, left, cell_area, area, seen, stack)
        if seen[row - top, column - left] == 2:
            value = np.float64(values[row, column])
            at = 0
            while at < found and levels[at] != value:
                at += 1
            if at == found and found < _LEVELS:
                levels[at], counts[at] = value, 0
                found += 1
            if at < found:
                counts[at] += 1
    return found


@numba.njit(**_JIT)
def _has_equal(values, void, row, column):
    height, width = values.shape
    for i, j in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
        inside = 0 <= i < height and 0 <= j < width
        if inside and not void[i, j] and values[i, j] == values[row, column]:
            return True
    return False


@numba.njit(**_JIT)
def _flood(values, void, row, column, top, left, cell_area, area, seen, queue):
    """Mark the level ground of a cell as water or not, as far as it takes to tell."""
    height, width = seen.shape
    value = values[row, column]
    queue[0] = row - top, column - left
    seen[row - top, column - left] = 1
    total, taken, count = 0.0, 0, 1
    water = False
    while taken < count and not water:
        i, j = queue[taken]
        taken += 1
        total += cell_area[i + top]
        water = total >= area or taken == MANY_CELLS
        for m, n in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
            if m < 0 or n < 0 or m >= height or n >= width:
                continue
            if void[m + top, n + left] or values[m + top, n + left] != value:
                continue
            # Ground that is level with this one and was found to be water before.
            water |= seen[m, n] == 2
            if seen[m, n] == 0 and count < MANY_CELLS:
                seen[m, n] = 1
                queue[count] = m, n
                count += 1
    if water:
        for k in range(count):
            seen[queue[k, 0], queue[k, 1]] = 2


@numba.njit(**_JIT)
def hold(begin, end, work, runs, first_run, level, floor, whole, mask):
    """Raise or lower some filled voids to the water beside them, and mark what is water."""
    for number in range(begin, end):
        if np.isnan(level[number]):
            continue
        water, least = level[number], floor[number]
        for k in range(first_run[number], first_run[number + 1]):
            row = runs[k, 0]
            for column in range(runs[k, 1], runs[k, 2]):
                if whole[number] or (least == water and work[row, column] <= water):
                    work[row, column] = water
                    mask[row, column] = True
                else:
                    work[row, column] = max(work[row, column], least)
