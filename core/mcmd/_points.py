"""Kernels that list a void's own points of a lattice level, and what their stencils may use.

A void is a list of runs (row, first column, one past the last column) sorted by row. Its own cells
are those that carry its label; label 0 is known ground; any other cell, another void's or one
beyond the raster, is left out of every stencil. So a void's surface depends on its known
surroundings alone, whatever the order of work, the number of threads or the tiling.

The points of a level stand in *segments*, one for each run that has any: rows of an int64 array
with the columns named below.
"""

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")

# A segment's first point as a flat index, its number of points, their row, its parity (1: odd row,
# 2: odd first column of the lattice), where its points' bits begin, and whether it is plain: every
# point of it is free and may use all its neighbours.
FIRST, LENGTH, ROW, PARITY, BITS, PLAIN = 0, 1, 2, 3, 4, 5
COLUMNS = 6

# Which neighbours a point may use, as bits: the four axial ones, the four two steps away, the four
# diagonal ones; and whether the point is pinned. Opposite ones of four stand opposite.
WEST, NORTH, SOUTH, EAST = 1, 2, 4, 8
WEST2, EAST2, NORTH2, SOUTH2 = 16, 32, 64, 128
NORTHWEST, NORTHEAST, SOUTHWEST, SOUTHEAST = 256, 512, 1024, 2048
ALL = 4095
PINNED = 4096


@numba.njit(**_JIT)
def count_cells(runs, a, b):
    """Count the cells of the runs ``a`` to ``b``."""
    cells = 0
    for k in range(a, b):
        cells += runs[k, 2] - runs[k, 1]
    return cells


@numba.njit(**_JIT)
def columns_of(runs, a, b):
    """Give the first column of the runs ``a`` to ``b`` and one past their last."""
    low, high = runs[a, 1], runs[a, 2]
    for k in range(a, b):
        low = min(low, runs[k, 1])
        high = max(high, runs[k, 2])
    return low, high


@numba.njit(**_JIT)
def coarsest_level(runs, a, b):
    """Give the coarsest level worth relaxing: its step does not exceed the void's extent."""
    low, high = columns_of(runs, a, b)
    extent = max(high - low, runs[b - 1, 0] - runs[a, 0] + 1)
    level = 0
    while (2 << level) <= extent:
        level += 1
    return level


@numba.njit(**_JIT)
def flood(values, runs, a, b, start):
    """Set the void's own cells to ``start``."""
    for k in range(a, b):
        values[runs[k, 0], runs[k, 1] : runs[k, 2]] = start


@numba.njit(**_JIT)
def gather(labels, runs, a, b, own, level, row_offset, column_offset, segments, bits):
    """List the void's own lattice points of a level; returns the number of segments.

    ``bits`` has room for one number a point; those of a plain segment are not written.
    """
    step = 1 << level
    height, width = labels.shape
    flat = labels.ravel()
    side = np.uint64(step)
    up = np.uint64(width) * side
    count, points = 0, 0
    for k in range(a, b):
        row, start, stop = runs[k, 0], runs[k, 1], runs[k, 2]
        # A step is a power of two, and masking is many times as fast as dividing.
        if (row + row_offset) & (step - 1):
            continue
        start += -(start + column_offset) & (step - 1)
        if start >= stop:
            continue
        near_edge = row < 2 * step or row + 2 * step >= height
        near_edge |= start < 2 * step or stop + 2 * step > width
        length = (stop - start + step - 1) >> level
        first = np.uint64(row) * np.uint64(width) + np.uint64(start)
        plain = not near_edge and _alone(flat, first, np.uint64(length - 1) * side, own, side, up)
        parity = ((row + row_offset) >> level & 1) + 2 * ((start + column_offset) >> level & 1)
        segments[count, FIRST] = first
        segments[count, LENGTH] = length
        segments[count, ROW] = row
        segments[count, PARITY] = parity
        segments[count, BITS] = points
        segments[count, PLAIN] = plain
        if not plain:
            for i in range(length):
                if near_edge:
                    found = _usable_near_edge(labels, row, start + i * step, own, step)
                else:
                    found = _usable(flat, first + np.uint64(i) * side, own, side, up)
                bits[points + i] = found
        points += length
        count += 1
    return count


@numba.njit(inline="always", **_JIT)
def _alone(flat, first, span, own, side, up):
    """Tell whether no stencil of a run's points meets another void.

    ``first`` is the run's first point and ``span`` how far beyond it the last one is.
    """
    found = False
    begin = first - up - up - side - side
    for _ in range(5):
        p = begin
        end = begin + span + np.uint64(4) * side
        while p <= end:
            label = flat[p]
            found |= (label != 0) & (label != own)
            p += side
        begin += up
    return not found


@numba.njit(inline="always", **_JIT)
def _usable(flat, p, own, side, up):
    """Give the bits of the neighbours that are known or the void's own."""
    bits = _open(flat[p - side], own) * WEST
    bits |= _open(flat[p + side], own) * EAST
    bits |= _open(flat[p - up], own) * NORTH
    bits |= _open(flat[p + up], own) * SOUTH
    bits |= _open(flat[p - side - side], own) * WEST2
    bits |= _open(flat[p + side + side], own) * EAST2
    bits |= _open(flat[p - up - up], own) * NORTH2
    bits |= _open(flat[p + up + up], own) * SOUTH2
    bits |= _open(flat[p - up - side], own) * NORTHWEST
    bits |= _open(flat[p - up + side], own) * NORTHEAST
    bits |= _open(flat[p + up - side], own) * SOUTHWEST
    bits |= _open(flat[p + up + side], own) * SOUTHEAST
    return bits


@numba.njit(inline="always", **_JIT)
def _open(label, own):
    return np.int64((label == 0) | (label == own))


@numba.njit(**_JIT)
def _usable_near_edge(labels, row, column, own, step):
    """Do the same where some neighbours lie beyond the raster."""
    height, width = labels.shape
    far = 2 * step
    bits, bit = 0, 1
    for dr, dc in (
        (0, -step), (-step, 0), (step, 0), (0, step),
        (0, -far), (0, far), (-far, 0), (far, 0),
        (-step, -step), (-step, step), (step, -step), (step, step),
    ):  # fmt: skip
        r, c = row + dr, column + dc
        if 0 <= r < height and 0 <= c < width:
            bits |= _open(labels[r, c], own) * bit
        bit *= 2
    return bits


@numba.njit(**_JIT)
def pin(values, labels, segments, count, bits, level):
    """Set and pin points near known ground that no stencil of this level meets.

    Ground narrower than the step, such as an island in the void or a strip at the raster's edge,
    would else be met at the finest level only, whose few sweeps would leave a spike there. As in
    the bottom-up pass the points take its elevation: the mean of the known cells up to half a step
    away, or as far as the edge, by inverse squared distance.
    """
    width = labels.shape[1]
    step = 1 << level
    for s in range(count):
        row = segments[s, ROW]
        column = segments[s, FIRST] - row * width
        for i in range(segments[s, LENGTH]):
            mean = _mean_of_hidden_ground(values, labels, row, column + i * step, step)
            if np.isnan(mean):
                continue
            values[row, column + i * step] = mean
            if segments[s, PLAIN]:
                segments[s, PLAIN] = False
                for j in range(segments[s, LENGTH]):
                    bits[segments[s, BITS] + j] = ALL
            bits[segments[s, BITS] + i] |= PINNED


@numba.njit(inline="always", **_JIT)
def _mean_of_hidden_ground(values, labels, row, column, step):
    """Give the mean that pins a point, NaN if the point is free."""
    if _known_beside(labels, row, column, step):
        return np.nan
    height, width = labels.shape
    half = step // 2
    own = labels[row, column]
    # The last points before the raster's edge or another void stand for all that is between.
    top, left, bottom, right = row - half, column - half, row + half + 1, column + half + 1
    if row < step or labels[row - step, column] != own:
        top = max(row - step + 1, 0)
    if column < step or labels[row, column - step] != own:
        left = max(column - step + 1, 0)
    if row + step >= height or labels[row + step, column] != own:
        bottom = min(row + step, height)
    if column + step >= width or labels[row, column + step] != own:
        right = min(column + step, width)
    total, weight = 0.0, 0.0
    for r in range(top, bottom):
        for c in range(left, right):
            if labels[r, c] == 0:
                near = 1.0 / ((r - row) ** 2 + (c - column) ** 2)
                total += near * values[r, c]
                weight += near
    return total / weight if weight > 0 else np.nan


@numba.njit(inline="always", **_JIT)
def _known_beside(labels, row, column, step):
    """Tell whether one of a lattice point's eight neighbours is known."""
    height, width = labels.shape
    for r in range(row - step, row + step + 1, step):
        for c in range(column - step, column + step + 1, step):
            if 0 <= r < height and 0 <= c < width and labels[r, c] == 0:
                return True
    return False
