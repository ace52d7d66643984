"""Kernels of the specific catchment area: how far water goes in each cell, and which way."""

import numba
import numpy as np

from demsmith.core.hydrology._dispersal import dinf_shares, mfd_shares
from demsmith.core.hydrology._receivers import DOWN, RIGHT, row_drops, steepest_facets

_jit = numba.njit(nogil=True, cache=True, error_model="numpy")


@_jit
def mean_steps(z, flat, void, by_row, exponent, dx, dy, first, last, steps):
    """Write how far the water of each cell of some rows gets on average in one step [m].

    Parameters
    ----------
    z, flat, void, by_row
        As of `demsmith.core.hydrology._receivers.find_receivers`.
    exponent : float32
        Of MFD; below 0 for D-infinity.
    dx, dy : (H,) float64 arrays
        Ground metres per cell of each row.
    first, last : int
        Rows from, and to before.
    steps : (H, W) float32 array
        These rows are set: the length of the mean of the ways to the receivers, by their shares; 0
        where there is none.
    """
    width = z.shape[1]
    rows, flats = np.empty((3, width + 2)), np.empty((3, width + 2))
    drops, ways = np.empty((8, width), np.float32), np.empty((6, width), np.float32)
    shares, best = np.empty((8, width), np.float32), np.empty(width, np.float32)
    totals, receivers = np.empty(width), np.empty(width, np.uint8)
    for row in range(first, last):
        row_drops(z, flat, void, row, row == first, rows, flats, drops)
        for k in range(6):
            ways[k] = by_row[row, k]
        if exponent >= 0:
            mfd_shares(drops, ways, exponent, best, shares, totals)
        else:
            steepest_facets(drops, ways, best, receivers)
            dinf_shares(drops, ways, best, shares, totals)
        for column in range(width):
            east, south = 0.0, 0.0
            for k in range(8):
                east += RIGHT[k] * shares[k, column]
                south += DOWN[k] * shares[k, column]
            total = totals[column] if totals[column] > 0 else 1.0
            east, south = east * dx[row] / total, south * dy[row] / total
            steps[row, column] = np.sqrt(east * east + south * south)
