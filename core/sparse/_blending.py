"""Kernels that blend discs to a surface, cell by cell or between the cells.

A point's sum runs over the discs in their order, whatever the window asked for, in float32 or
float64 operations of a fixed order: the same point has the same bits in every window.
"""

import math

import numba
import numpy as np

from demsmith.core.trees._bicubic import cubic

_JIT = dict(nogil=True, cache=True, error_model="numpy")


_place = np.uint64
"""Unsigned indices spare the inner loops the question whether they count from the end, and so let
them handle several samples at a time: six times as fast."""


@numba.njit(**_JIT)
def _combine(means, indices, coefficients, atoms, i, j, first, last, values):
    """Set samples ``first`` to ``last`` of disc ``(i, j)``: its mean and the sum of its atoms."""
    begin, end = _place(first), _place(last)
    mean = means[i, j]
    for k in range(begin, end):
        values[k] = mean
    for m in range(indices.shape[2]):
        coefficient = coefficients[i, j, m]
        atom = _place(indices[i, j, m])
        if coefficient != 0:
            for k in range(begin, end):
                values[k] += coefficient * atoms[atom, k]


@numba.njit(**_JIT)
def blend_cells(
    means, indices, coefficients, atoms, weights, lattice, inverse, row_kinds, out, first, last
):
    """Blend discs at the centres of cells, in the rows ``first`` to ``last`` of a window.

    Parameters
    ----------
    means : (m, n) float32 array
        Of the discs that touch the window.
    indices : (m, n, s) int32 array
    coefficients : (m, n, s) float32 array
    atoms : (N, K) float32 array
    weights : (side_rows, side_columns) float32 array
    lattice : (int, int, int, int)
        Row and column in the window of the first disc's block, and the steps.
    inverse : (kinds of rows, columns) float32 array
        One by the sum of the weights.
    row_kinds : (rows,) int32 array
    out : (rows, columns) float32 array
    """
    top_0, left_0, step_rows, step_columns = lattice
    side_rows, side_columns = weights.shape
    width = out.shape[1]
    flat_weights = weights.ravel()
    values = np.empty(weights.size, np.float32)
    out[first:last] = 0
    for i in range(means.shape[0]):
        top = top_0 + i * step_rows
        begin, end = max(top, first), min(top + side_rows, last)
        if begin >= end:
            continue
        for j in range(means.shape[1]):
            left = left_0 + j * step_columns
            start, stop = max(left, 0), min(left + side_columns, width)
            if start >= stop:
                continue
            _combine(
                means, indices, coefficients, atoms, i, j,
                (begin - top) * side_columns, (end - top) * side_columns, values,
            )  # fmt: skip
            count, column = _place(stop - start), _place(start)
            for r in range(begin, end):
                row, k = _place(r), _place((r - top) * side_columns + start - left)
                for c in range(count):
                    out[row, column + c] += flat_weights[k + c] * values[k + c]
    for r in range(first, last):
        row, kind = _place(r), _place(row_kinds[r])
        for column in range(_place(width)):
            out[row, column] *= inverse[kind, column]


@numba.njit(**_JIT)
def blend_points(
    means, indices, coefficients, atoms, sides, lattice, shape, scale, origin, out, first, last
):
    """Blend discs at the nodes of a finer or coarser raster, atoms interpolated bicubically.

    Parameters
    ----------
    means, indices, coefficients, atoms
        As of `blend_cells`, but that the atoms go on beyond the disc.
    sides : (int, int)
        Rows and columns of a block.
    lattice : (int, int, int, int)
        Row and column in the raster of the first disc's block, and the steps.
    shape : (int, int)
        Rows and columns of the raster; nodes beyond its edge take what is at the edge.
    scale : float
        Nodes by cell, along rows and columns.
    origin : (int, int)
        Row and column of ``out``'s first node among all; node (0, 0) is half a node's width from
        the raster's corner.
    out : (rows, columns) float32 array
        Rows ``first`` to ``last`` are set.
    """
    top_0, left_0, step_rows, step_columns = lattice
    side_rows, side_columns = sides
    width = out.shape[1]
    values = np.empty(side_rows * side_columns, np.float32)
    line = np.empty(side_columns)
    sums = np.zeros((last - first, width))
    totals = np.zeros((last - first, width))
    for i in range(means.shape[0]):
        top = top_0 + i * step_rows
        begin = max(math.ceil(top * scale - 0.5) - origin[0], first)
        end = min(math.floor((top + side_rows) * scale - 0.5) + 1 - origin[0], last)
        if top + side_rows >= shape[0]:
            end = last
        if begin >= end:
            continue
        for j in range(means.shape[1]):
            left = left_0 + j * step_columns
            start = max(math.ceil(left * scale - 0.5) - origin[1], 0)
            stop = min(math.floor((left + side_columns) * scale - 0.5) + 1 - origin[1], width)
            if left + side_columns >= shape[1]:
                stop = width
            if start >= stop:
                continue
            _combine(means, indices, coefficients, atoms, i, j, 0, values.size, values)
            for row in range(begin, end):
                y = min((row + origin[0] + 0.5) / scale, shape[0]) - top
                v = 2 * y / side_rows - 1
                at = math.floor(y - 0.5)
                w0, w1, w2, w3 = cubic(y - 0.5 - at)
                r0 = min(max(at - 1, 0), side_rows - 1) * side_columns
                r1 = min(max(at, 0), side_rows - 1) * side_columns
                r2 = min(max(at + 1, 0), side_rows - 1) * side_columns
                r3 = min(max(at + 2, 0), side_rows - 1) * side_columns
                for k in range(side_columns):
                    line[k] = (
                        w0 * values[r0 + k] + w1 * values[r1 + k]
                        + w2 * values[r2 + k] + w3 * values[r3 + k]
                    )  # fmt: skip
                for column in range(start, stop):
                    x = min((column + origin[1] + 0.5) / scale, shape[1]) - left
                    u = 2 * x / side_columns - 1
                    near = 1 - (v * v + u * u)
                    if near <= 0:
                        continue
                    at = math.floor(x - 0.5)
                    w0, w1, w2, w3 = cubic(x - 0.5 - at)
                    value = (
                        w0 * line[min(max(at - 1, 0), side_columns - 1)]
                        + w1 * line[min(max(at, 0), side_columns - 1)]
                        + w2 * line[min(max(at + 1, 0), side_columns - 1)]
                        + w3 * line[min(max(at + 2, 0), side_columns - 1)]
                    )
                    weight = near * near * near
                    sums[row - first, column] += weight * value
                    totals[row - first, column] += weight
    for row in range(first, last):
        for column in range(width):
            out[row, column] = sums[row - first, column] / totals[row - first, column]


@numba.njit(**_JIT)
def average_nodes(values, bounds_rows, bounds_columns, out, first, last):
    """Average cells over the rectangles of coarser cells, in rows ``first`` to ``last``.

    Parameters
    ----------
    values : (h, w) float32 array
    bounds_rows, bounds_columns : (rows + 1,) and (columns + 1,) float64 arrays
        Where the coarser cells begin and end, in cells of ``values``.
    out : (rows, columns) float32 array
    """
    for row in range(first, last):
        begin, end = bounds_rows[row], bounds_rows[row + 1]
        for column in range(out.shape[1]):
            start, stop = bounds_columns[column], bounds_columns[column + 1]
            total, area = 0.0, 0.0
            for r in range(math.floor(begin), math.ceil(end)):
                high = min(r + 1, end) - max(r, begin)
                for c in range(math.floor(start), math.ceil(stop)):
                    part = high * (min(c + 1, stop) - max(c, start))
                    total += part * values[r, c]
                    area += part
            out[row, column] = total / area


@numba.njit(**_JIT)
def project(cells, indices, atoms, weights, lattice, columns, power, out, first, last):
    """Project cells on the discs ``first`` to ``last``: the transpose of the blend.

    Parameters
    ----------
    cells : (H, W) float32 array
    indices : (n, s) int32 array
    atoms : (N, K) float32 array
    weights : (side_rows, side_columns) float32 array
    lattice : (int, int, int, int)
        Row and column of the first disc's block, and the steps.
    columns : int
        Discs in a row.
    power : int
        1 to sum products with weights and atoms, 2 with their squares.
    out : (n, 1 + s) float32 array
        Sums of weighted cells, and of these times each atom.
    """
    height, width = cells.shape
    side_rows, side_columns = weights.shape
    top_0, left_0, step_rows, step_columns = lattice
    seen = np.zeros(weights.size)
    for disc in range(first, last):
        top = top_0 + disc // columns * step_rows
        left = left_0 + disc % columns * step_columns
        start, stop = max(0, -left), min(side_columns, width - left)
        seen[:] = 0
        total = 0.0
        for i in range(max(0, -top), min(side_rows, height - top)):
            for j in range(start, stop):
                weight = np.float64(weights[i, j])
                value = cells[top + i, left + j] * (weight if power == 1 else weight * weight)
                seen[i * side_columns + j] = value
                total += value
        out[disc, 0] = total
        for m in range(indices.shape[1]):
            atom = atoms[indices[disc, m]]
            even, odd = 0.0, 0.0
            for k in range(0, seen.size - 1, 2):
                even += seen[k] * (atom[k] if power == 1 else atom[k] * atom[k])
                odd += seen[k + 1] * (atom[k + 1] if power == 1 else atom[k + 1] * atom[k + 1])
            if seen.size % 2:
                k = seen.size - 1
                even += seen[k] * (atom[k] if power == 1 else atom[k] * atom[k])
            out[disc, m + 1] = even + odd
