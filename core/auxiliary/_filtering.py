"""Kernels of the linear filter that makes an auxiliary raster resemble the target."""

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def differences(values, void, rows, columns, taps, out):
    """Gather what each tap sees beside some cells: its elevation less the cell's own.

    Parameters
    ----------
    values, void : (H, W) float64 and bool arrays
    rows, columns : (N,) int64 arrays
        Cells; all taps of them lie within the array.
    taps : (T, 2) int64 array
        Rows and columns from a cell to its taps.
    out : (N, T) float64 array
        NaN where a tap is void.
    """
    for n in range(rows.size):
        here = values[rows[n], columns[n]]
        for t in range(taps.shape[0]):
            a, b = rows[n] + taps[t, 0], columns[n] + taps[t, 1]
            out[n, t] = np.nan if void[a, b] else values[a, b] - here


@numba.njit(**_JIT)
def add_taps(values, void, margin, taps, weights, out):
    """Add to ``out`` the weighted differences between each cell and its taps.

    A void tap is thought to lie as far above its cell as the tap opposite lies below; where that
    is void too, it is left out.

    Parameters
    ----------
    values, void : (h + 2 margin, w + 2 margin) float64 and bool arrays
    margin : int
        At least as far as the taps reach.
    taps : (T, 2) int64 array
    weights : (T,) float64 array
    out : (h, w) float64 array
    """
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            a, b = i + margin, j + margin
            if void[a, b]:
                continue
            here, total = values[a, b], 0.0
            for t in range(weights.size):
                p, q = taps[t, 0], taps[t, 1]
                if not void[a + p, b + q]:
                    total += weights[t] * (values[a + p, b + q] - here)
                elif not void[a - p, b - q]:
                    total += weights[t] * (here - values[a - p, b - q])
            out[i, j] += total


@numba.njit(**_JIT)
def add_products(columns, weights, group, products):
    """Add up the weighted products of columns, by group of rows.

    Parameters
    ----------
    columns : (N, K) float64 array
    weights : (N,) float64 array
    group : (N,) int64 array
    products : (G, K, K) float64 array
        Changed in place; its upper triangles are made.
    """
    for n in range(weights.size):
        here = products[group[n]]
        for j in range(columns.shape[1]):
            w = weights[n] * columns[n, j]
            for k in range(j, columns.shape[1]):
                here[j, k] += w * columns[n, k]
