"""Kernels that bring a raster onto the cells of another grid."""

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")

# A pixel that weighs less than this is not asked for: rounding of coordinates makes such weights
# where the two grids' centres coincide.
_NO_WEIGHT = 1e-6


@numba.njit(**_JIT)
def locate(nodes, first_row, first_column, step, rows, columns, places):
    """Give the places of cells between the nodes of a lattice, linearly.

    Parameters
    ----------
    nodes : (2, R, C) float64 array
        Row and column, in some other raster, of the lattice's nodes; NaN where there is none.
    first_row, first_column : int
        Number of the first node, counted from the one on cell (0, 0).
    step : int
        Cells from node to node.
    rows, columns : (h,) and (w,) float64 arrays
        Cells whose places are asked for; not necessarily whole numbers.
    places : (2, h, w) float64 array
        The result.
    """
    for i in range(rows.size):
        v = rows[i] / step
        a = int(np.floor(v))
        v -= a
        a -= first_row
        for j in range(columns.size):
            u = columns[j] / step
            b = int(np.floor(u))
            u -= b
            b -= first_column
            for axis in range(2):
                north = nodes[axis, a, b] * (1 - u) + nodes[axis, a, b + 1] * u
                south = nodes[axis, a + 1, b] * (1 - u) + nodes[axis, a + 1, b + 1] * u
                places[axis, i, j] = north * (1 - v) + south * v


@numba.njit(**_JIT)
def convolve_at(values, void, row, column, whole_rows, whole_columns, places, width, out, unknown):
    """Interpolate a raster at places by cubic convolution, averaged over some width.

    Parameters
    ----------
    values, void : (H, W) arrays
        A window of the raster, real type and bool.
    row, column : int
        The raster's row and column of the window's first cell.
    whole_rows, whole_columns : int
        Shape of the raster: beyond its edge, half a cell from the outermost centres, nothing is
        known; the taps there repeat the edge.
    places : (2, h, w) float64 array
        Row and column in the raster; whole numbers are the centres of its cells.
    width : (float, float)
        Cells over which is averaged, by row and column; 0 interpolates.
    out : (h, w) float64 array
        The result; 0 where unknown.
    unknown : (h, w) bool array
        Whether a void cell, or none, is within the convolution's reach.
    """
    high, wide = width
    row_weights = np.empty(int(high) + 5)
    column_weights = np.empty(int(wide) + 5)
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            y, x = places[0, i, j], places[1, i, j]
            out[i, j] = 0.0
            unknown[i, j] = True
            if not (-0.5 <= y <= whole_rows - 0.5 and -0.5 <= x <= whole_columns - 0.5):
                continue
            top = _weigh(y, high, row_weights)
            left = _weigh(x, wide, column_weights)
            total, weight, known = 0.0, 0.0, True
            for k in range(row_weights.size):
                a = min(max(top + k, 0), whole_rows - 1) - row
                for m in range(column_weights.size):
                    w = row_weights[k] * column_weights[m]
                    if abs(w) < _NO_WEIGHT:
                        continue
                    b = min(max(left + m, 0), whole_columns - 1) - column
                    if void[a, b]:
                        known = False
                        break
                    total += w * values[a, b]
                    weight += w
                if not known:
                    break
            if known:
                out[i, j] = total / weight
                unknown[i, j] = False


@numba.njit(**_JIT)
def _weigh(place, width, weights):
    """Weigh the cells around a place (Keys' cubic, a = -1/2); gives the first one's index.

    The mean of the weights at points spread evenly over ``width``, each of which reproduces a
    plane, and so do they all.
    """
    first = int(np.ceil(place - width / 2 - 2))
    points = 1 + int(np.ceil(width))
    weights[:] = 0.0
    for p in range(points):
        centre = place + ((p + 0.5) / points - 0.5) * width
        for k in range(weights.size):
            t = abs(first + k - centre)
            if t < 1:
                weights[k] += ((1.5 * t - 2.5) * t * t + 1) / points
            elif t < 2:
                weights[k] += (((-0.5 * t + 2.5) * t - 4) * t + 2) / points
    return first


@numba.njit(**_JIT)
def average_blocks(values, void, high, wide, out, unknown):
    """Average blocks of ``high`` by ``wide`` cells, of which at least half must be known.

    ``values`` and ``void`` have shape (H, W), ``out`` and ``unknown`` one cell for each block;
    the last blocks may be incomplete.
    """
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            total, count, cells = 0.0, 0, 0
            for a in range(i * high, min((i + 1) * high, values.shape[0])):
                for b in range(j * wide, min((j + 1) * wide, values.shape[1])):
                    cells += 1
                    if not void[a, b]:
                        total += values[a, b]
                        count += 1
            unknown[i, j] = 2 * count < cells
            out[i, j] = 0.0 if unknown[i, j] else total / count
