"""Kernels that find the voids of a mask: runs of cells along rows, joined into voids."""

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def scan_runs(void, words, width, runs):
    """Write each run's row, first column and one past its last column, and count the runs.

    ``words`` are the bytes of ``void``, eight at a time. Runs for which ``runs`` has no room are
    counted all the same, so that the caller can make room and scan again.
    """
    room = runs.shape[0]
    count = 0
    i, row, row_end = 0, 0, width
    while i < void.size:
        if void[i] == 0:
            # Known ground is the rule: step over it a word at a time.
            if i % 8 == 0:
                word = i // 8
                while word < words.size and words[word] == 0:
                    word += 1
                if word * 8 > i:
                    i = word * 8
                    continue
            i += 1
            continue
        while i >= row_end:
            row += 1
            row_end += width
        begin = i
        while i < row_end and void[i] != 0:
            i += 1
        if count < room:
            runs[count, 0] = row
            runs[count, 1] = begin - (row_end - width)
            runs[count, 2] = i - (row_end - width)
        count += 1
    return count


@numba.njit(**_JIT)
def join_runs(runs, parent):
    """Give in ``parent`` each run's void, numbered from 0 in the order of their first cells.

    Runs belong together when they share a column in neighbouring rows (4-connected cells).
    Returns the number of voids.
    """
    for k in range(runs.shape[0]):
        parent[k] = k
    above = 0
    for k in range(runs.shape[0]):
        row, start, stop = runs[k, 0], runs[k, 1], runs[k, 2]
        while runs[above, 0] < row - 1 or (runs[above, 0] == row - 1 and runs[above, 2] <= start):
            above += 1
        other = above
        while other < k and runs[other, 0] == row - 1 and runs[other, 1] < stop:
            _union(parent, other, k)
            other += 1
    voids = 0
    for k in range(runs.shape[0]):
        # A root is the lowest run of its void, so it is met before the others.
        if parent[k] == k:
            parent[k] = -1 - voids
            voids += 1
        else:
            root = parent[k]
            while root >= 0:
                root = parent[root]
            parent[k] = root
    for k in range(runs.shape[0]):
        parent[k] = -1 - parent[k]
    return voids


@numba.njit(**_JIT)
def _union(parent, a, b):
    a, b = _root(parent, a), _root(parent, b)
    if a < b:
        parent[b] = a
    else:
        parent[a] = b


@numba.njit(**_JIT)
def _root(parent, k):
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@numba.njit(**_JIT)
def group_runs(runs, void_of_run, first_run, grouped, cells):
    """Sort the runs by void, keeping their order within each, and count each void's cells."""
    voids = cells.size
    for k in range(runs.shape[0]):
        first_run[void_of_run[k] + 1] += 1
        cells[void_of_run[k]] += runs[k, 2] - runs[k, 1]
    for void in range(voids):
        first_run[void + 1] += first_run[void]
    place = first_run.copy()
    for k in range(runs.shape[0]):
        void = void_of_run[k]
        grouped[place[void]] = runs[k]
        place[void] += 1


@numba.njit(**_JIT)
def paint(runs, first_run, labels):
    """Write 1 + its number into the cells of each void."""
    for void in range(first_run.size - 1):
        for k in range(first_run[void], first_run[void + 1]):
            row, start, stop = runs[k, 0], runs[k, 1], runs[k, 2]
            for column in range(start, stop):
                labels[row, column] = void + 1


@numba.njit(**_JIT)
def survey(values, void, runs, first_run, begin, end, low, mean, high, touches_edge):
    """Give the lowest, mean and highest known cell beside the voids ``begin`` to ``end``.

    NaN where there is none. A void cell beside a void's own is its own too.
    """
    height, width = values.shape
    for number in range(begin, end):
        lowest, highest = np.inf, -np.inf
        total, count = 0.0, 0
        edge = False
        for k in range(first_run[number], first_run[number + 1]):
            row, start, stop = runs[k, 0], runs[k, 1], runs[k, 2]
            edge |= row == 0 or row == height - 1 or start == 0 or stop == width
            for other in range(row - 1, row + 2):
                if other < 0 or other >= height:
                    continue
                # In its own row a run has one neighbour at either end, which known ground is.
                left = start - 1 if other == row else start
                right = stop + 1 if other == row else stop
                for column in range(max(left, 0), min(right, width)):
                    if not void[other, column]:
                        value = values[other, column]
                        lowest = min(lowest, value)
                        highest = max(highest, value)
                        total += value
                        count += 1
        touches_edge[number] = edge
        low[number] = lowest if count else np.nan
        high[number] = highest if count else np.nan
        mean[number] = total / count if count else np.nan
