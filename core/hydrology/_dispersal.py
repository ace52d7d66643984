"""Kernels of flow that parts: the shares of each cell's receivers, and sums down the slopes."""

import numba
import numpy as np

from demsmith.core.hydrology._powers import angle, raise_all
from demsmith.core.hydrology._receivers import (
    DONE,
    DOWN,
    KIND,
    RIGHT,
    VOID,
    facet,
    lower_neighbours,
    oblique,
    offsets,
    steepest_facets,
    straight,
)

_jit = numba.njit(nogil=True, cache=True, error_model="numpy")

BUNCH = 64
"""Cells that are passed on at once."""
# Slopes from the one to the other can be divided in single precision.
_LEAST, _STEEPEST = np.float32(1e-37), np.float32(1e37)
_PER_EIGHTH = np.float32(4 / np.pi)


@_jit
def mfd_shares(drops, ways, exponent, best, shares, totals):
    """Write what each lower neighbour of a bunch's cells gets: a power of the slope down to it.

    Parameters
    ----------
    drops, ways
        As of `demsmith.core.hydrology._receivers.steepest_facets`.
    exponent : float32
    best : (N,) float32 array
        Overwritten.
    shares : (8, N) float32 array
        Set; not yet in parts of their sum.
    totals : (N,) float64 array
        Set: their sums, 0 where nothing is lower.
    """
    best[:] = 0
    for k in range(8):
        share, drop, rate = shares[k], drops[k], ways[KIND[k]]
        for cell in range(best.size):
            slope = drop[cell] * rate[cell]
            share[cell] = min(slope, _STEEPEST) if slope > 0 else np.float32(0)
            best[cell] = max(best[cell], share[cell])
    for cell in range(best.size):
        best[cell] = np.float32(1) / max(best[cell], _LEAST)
    for k in range(8):
        share = shares[k]
        for cell in range(best.size):
            share[cell] *= best[cell]
    raise_all(shares.reshape(-1), exponent)
    totals[:] = 0
    for k in range(8):
        share, drop, breadth = shares[k], drops[k], ways[3 + KIND[k]]
        for cell in range(best.size):
            share[cell] = share[cell] * breadth[cell] if drop[cell] > 0 else np.float32(0)
            totals[cell] += share[cell]


@_jit
def dinf_shares(drops, ways, best, shares, totals):
    """Write what the receivers of a bunch's cells get, by the angles to the steepest slope.

    ``best`` are the squares of the steepest slopes, as `steepest_facets` gives them; the others are
    as of `mfd_shares`. Where several slopes are the steepest, each has as much.
    """
    shares[:] = 0
    for k in range(8):
        share, drop, rate = shares[k], drops[k], ways[KIND[k]]
        for cell in range(best.size):
            slope = straight(drop[cell], rate[cell])
            steep = (slope == best[cell]) & (slope > 0)
            share[cell] += np.float32(1) if steep else np.float32(0)
        side, corner, ahead, across = facet(k)
        to_side, to_corner = shares[side], shares[corner]
        side, corner, ahead, across = drops[side], drops[corner], ways[ahead], ways[across]
        for cell in range(best.size):
            slope = oblique(side[cell], corner[cell], ahead[cell], across[cell])
            steep = (slope == best[cell]) & (slope > 0)
            # As if the cell were square: each slope once more by its distance.
            along = side[cell] * ahead[cell] * ahead[cell]
            aside = (corner[cell] - side[cell]) * across[cell] * across[cell]
            aside = angle(aside, along) * _PER_EIGHTH
            to_corner[cell] += aside if steep else np.float32(0)
            to_side[cell] += np.float32(1) - aside if steep else np.float32(0)
    totals[:] = 0
    for k in range(8):
        share = shares[k]
        for cell in range(best.size):
            totals[cell] += share[cell]


@_jit
def gather(cells, count, z, flat, by_row, donors, drops, ways):
    """Make a bunch of the first ``count`` of some cells, given by their flat indices."""
    height, width = z.shape
    for place in range(count):
        row = cells[place] // width
        column = cells[place] - row * width
        here = np.float64(z[row, column])
        for k in range(6):
            ways[k, place] = by_row[row, k]
        if 0 < row < height - 1 and 0 < column < width - 1:
            for k in range(8):
                r, c = row + DOWN[k], column + RIGHT[k]
                drop = here - z[r, c]
                drops[k, place] = drop if donors[r, c] != VOID else np.nan
        else:
            for k in range(8):
                r, c = row + DOWN[k], column + RIGHT[k]
                inside = 0 <= r < height and 0 <= c < width
                drops[k, place] = here - z[r, c] if inside and donors[r, c] != VOID else np.nan
        level = np.float64(flat[row, column])
        if level > 0:
            for k in range(8):
                r, c = row + DOWN[k], column + RIGHT[k]
                equal = not np.isnan(drops[k, place]) and z[r, c] == here
                drops[k, place] = level - flat[r, c] if equal else np.nan


@_jit
def disperse(
    z, flat, by_row, exponent, rows, free, place, stack, patience, donors, area
):  # fmt: skip
    """Pass on what cells have, in bunches, once all above them have done so.

    Parameters
    ----------
    z, flat, by_row
        As of `demsmith.core.hydrology._receivers.find_receivers`.
    exponent : float32
        Of MFD; below 0 for D-infinity.
    rows, free, place, stack
        See `demsmith.core.hydrology.traversal.Reach`.
    patience : int
        How many cells may be passed on in this call.
    donors : (H, W) uint8 array
        How many donors each cell waits for; `VOID` and `DONE`.
    area : (H, W) float64 array
        What each cell has; added to.

    Returns
    -------
    bool
        Whether all is done; if not, call again, with more room on the stack if it is short of that.
    """
    drops, ways = np.ones((8, BUNCH), np.float32), np.ones((6, BUNCH), np.float32)
    shares, best = np.empty((8, BUNCH), np.float32), np.empty(BUNCH, np.float32)
    receivers, totals = np.empty(BUNCH, np.uint8), np.empty(BUNCH)
    cells, targets = np.empty(BUNCH, np.int64), np.empty(8 * BUNCH + 1, np.int64)
    amounts = np.empty(8 * BUNCH + 1)
    waiting, has = donors.reshape(-1), area.reshape(-1)
    bounds = free[0] * z.shape[1], free[1] * z.shape[1], rows[1] * z.shape[1]
    while patience > 0 and place[1] + 8 * BUNCH < stack.size:
        count = take(waiting, bounds[2], place, stack, cells)
        if count == 0:
            break
        patience -= count
        gather(cells, count, z, flat, by_row, donors, drops, ways)
        if exponent >= 0:
            lower_neighbours(drops, receivers)
            mfd_shares(drops, ways, exponent, best, shares, totals)
        else:
            steepest_facets(drops, ways, best, receivers)
            dinf_shares(drops, ways, best, shares, totals)
        passed = _pass_on(
            cells, count, z.shape[1], receivers, shares, totals, has, targets, amounts
        )
        for one in range(passed):
            has[targets[one]] += amounts[one]
        release(targets, passed, bounds, place, stack, waiting)
    return place[1] == 0 and place[0] >= bounds[2]


@_jit
def take(waiting, end, place, stack, cells):
    """Take cells that wait for nothing: from the stack, then the next in row order.

    Returns how many; they are marked `DONE`.
    """
    count, top, current = 0, place[1], place[0]
    while count < cells.size and top > 0:
        top -= 1
        cells[count] = stack[top]
        count += 1
    while count < cells.size and current < end:
        cells[count] = current
        count += waiting[current] == 0
        current += 1
    place[0], place[1] = current, top
    for one in range(count):
        waiting[cells[one]] = DONE
    return count


@_jit
def _pass_on(cells, count, width, receivers, shares, totals, has, targets, amounts):
    """List what goes where; returns the length of the list. Without branches, for speed."""
    to = offsets(width)
    passed = 0
    for one in range(count):
        cell, bits = cells[one], np.int64(receivers[one])
        scale = has[cell] / totals[one]
        for k in range(8):
            targets[passed] = cell + to[k]
            amounts[passed] = scale * shares[k, one]
            passed += (bits >> k) & 1
    return passed


@_jit
def release(targets, passed, bounds, place, stack, waiting):
    """Tell receivers that a donor is done; put on the stack those that `take` has gone past.

    Parameters
    ----------
    targets : (N,) int64 array
        Flat indices of receivers, ``passed`` of them, one for each of their donors.
    bounds : (int, int, int)
        The first cell that may be passed on, one past the last, and where `take` ends.
    place, stack
        See `demsmith.core.hydrology.traversal.Reach`.
    waiting : (H * W,) uint8 array
        How many donors each cell waits for.
    """
    current, top = place[0], place[1]
    for one in range(passed):
        cell = targets[one]
        left = waiting[cell] - 1
        waiting[cell] = left
        stack[top] = cell
        ready = (left == 0) & (bounds[0] <= cell) & (cell < bounds[1])
        top += ready & ((cell < current) | (cell >= bounds[2]))
    place[1] = top
