"""Kernels that tell which neighbours each cell drains to, and how many drain to it.

The neighbours of a cell are numbered in the order of ESRI's codes: 0 east (the next column),
1 south-east, 2 south (the next row), ... 7 north-east. Neighbour k is bit k of a cell's
*receivers*, a byte, so that a D8 code is the receivers of its cell.

A *bunch* is any number of cells, given by their elevations and those of their neighbours: loops
over its cells become vector instructions.
"""

import numba
import numpy as np

from demsmith.core.hydrology._rows import pad_row

_jit = numba.njit(nogil=True, cache=True, error_model="numpy")

DOWN = (0, 1, 1, 1, 0, -1, -1, -1)
"""Rows from a cell to its neighbours."""
RIGHT = (1, 1, 0, -1, -1, -1, 0, 1)
"""Columns from a cell to its neighbours."""
KIND = (0, 2, 1, 2, 0, 2, 1, 2)
"""Whether a neighbour is to the east or west, to the north or south, or across a corner."""
VOID = np.uint8(255)
"""Stands in place of the number of donors where there is a void."""
DONE = np.uint8(254)
"""Stands there where a cell has passed on what it had."""


@_jit
def find_receivers(z, flat, void, by_row, facets, first, last, receivers):
    """Write the receivers of some rows.

    Parameters
    ----------
    z : (H, W) float32 or float64 array
    flat : (H, W) array of unsigned integers
        Where it is not 0, it is compared in place of the elevation, among cells of the same
        elevation.
    void : (H, W) bool array
    by_row : (H, 6) float32 array
        See `demsmith.core.hydrology.traversal.Surface.ways`.
    facets : bool
        Whether by D-infinity, else by MFD.
    first, last : int
        Rows from, and to before.
    receivers : (H, W) uint8 array
        These rows are set.
    """
    width = z.shape[1]
    rows, flats = np.empty((3, width + 2)), np.empty((3, width + 2))
    drops, ways = np.empty((8, width), np.float32), np.empty((6, width), np.float32)
    best = np.empty(width, np.float32)
    for row in range(first, last):
        row_drops(z, flat, void, row, row == first, rows, flats, drops)
        if facets:
            for k in range(6):
                ways[k] = by_row[row, k]
            steepest_facets(drops, ways, best, receivers[row])
        else:
            lower_neighbours(drops, receivers[row])


@_jit
def row_drops(z, flat, void, row, anew, rows, flats, drops):
    """Make a bunch of a row: how far each neighbour lies below its cell.

    Parameters
    ----------
    z, flat, void
        As of `find_receivers`.
    row : int
    anew : bool
        Whether the last call was not for the row above.
    rows, flats : (3, W + 2) float64 arrays
        Kept for the next call: of row i, what is at i modulo 3.
    drops : (8, W) float32 array
        Set; NaN where water cannot go.
    """
    for near in range(row - 1 if anew else row + 1, row + 2):
        pad_row(z, void, near, np.nan, rows[near % 3])
        pad_row(flat, void, near, 0, flats[near % 3])
    here, level = rows[row % 3], flats[row % 3]
    for k in range(8):
        there, other, drop = rows[(row + DOWN[k]) % 3], flats[(row + DOWN[k]) % 3], drops[k]
        right = 1 + RIGHT[k]
        for column in range(drop.size):
            fall = here[column + 1] - there[column + right]
            along = level[column + 1] - other[column + right] if fall == 0 else np.nan
            drop[column] = along if level[column + 1] > 0 else fall


@_jit
def lower_neighbours(drops, receivers):
    """Write the receivers of a bunch by MFD: all neighbours that are lower.

    Parameters
    ----------
    drops : (8, N) float32 array
        How far each neighbour lies below its cell; NaN where water cannot go.
    receivers : (N,) uint8 array
    """
    receivers[:] = 0
    for k in range(8):
        drop = drops[k]
        for cell in range(receivers.size):
            receivers[cell] |= np.uint8((drop[cell] > 0) << k)


@_jit
def facet(k):
    """Describe the facet between neighbours k and k + 1.

    Returns the one of them that shares a side with the cell, the other, and the kinds of
    the ways to the first and from there to the other.
    """
    after = (k + 1) & 7
    side, corner = (after, k) if k & 1 else (k, after)
    return side, corner, KIND[side], 1 - KIND[side]


@_jit
def straight(drop, way):
    """Give the square of the slope down to a neighbour; 0 if it is not lower or not there."""
    slope = drop * way
    return slope * slope if slope > 0 else np.float32(0)


@_jit
def oblique(side, corner, ahead, across):
    """Give the square of the slope of a facet; 0 unless water leaves between its neighbours."""
    along, aside = side * ahead, (corner - side) * across
    between = (along > 0) & (aside > 0) & (aside * across < along * ahead)
    return along * along + aside * aside if between else np.float32(0)


@_jit
def steepest_facets(drops, ways, best, receivers):
    """Write the receivers of a bunch by D-infinity: those about its steepest slope.

    Where several slopes are the steepest, all of theirs, so that a mirrored surface drains
    mirrored.

    Parameters
    ----------
    drops
        As of `lower_neighbours`.
    ways : (6, N) float32 array
        Of each cell its row of `demsmith.core.hydrology.traversal.Surface.ways`.
    best : (N,) float32 array
        Set: the squares of the slopes, 0 where nothing is lower.
    receivers : (N,) uint8 array
    """
    best[:] = 0
    for k in range(8):
        drop, way = drops[k], ways[KIND[k]]
        for cell in range(best.size):
            best[cell] = max(best[cell], straight(drop[cell], way[cell]))
        side, corner, ahead, across = facet(k)
        side, corner, ahead, across = drops[side], drops[corner], ways[ahead], ways[across]
        for cell in range(best.size):
            slope = oblique(side[cell], corner[cell], ahead[cell], across[cell])
            best[cell] = max(best[cell], slope)
    receivers[:] = 0
    for k in range(8):
        drop, way = drops[k], ways[KIND[k]]
        for cell in range(best.size):
            slope = straight(drop[cell], way[cell])
            steep = (slope == best[cell]) & (slope > 0)
            receivers[cell] |= np.uint8(steep << k)
        side, corner, ahead, across = facet(k)
        side, corner, ahead, across = drops[side], drops[corner], ways[ahead], ways[across]
        for cell in range(best.size):
            slope = oblique(side[cell], corner[cell], ahead[cell], across[cell])
            steep = (slope == best[cell]) & (slope > 0)
            receivers[cell] |= np.uint8((steep << k) | (steep << ((k + 1) & 7)))


@_jit
def count_donors(receivers, void, first, last, donors):
    """Count how many neighbours drain to each cell of some rows.

    Parameters
    ----------
    receivers : (H, W) uint8 array
    void : (H, W) bool array
    first, last : int
        Rows from, and to before.
    donors : (H, W) uint8 array
        These rows are set, `VOID` where there is a void.
    """
    width = receivers.shape[1]
    rows = np.empty((3, width + 2), np.uint8)
    for row in range(first, last):
        for near in range(row - 1 if row == first else row + 1, row + 2):
            pad_row(receivers, void, near, 0, rows[near % 3])
        count_in_row(rows, row, donors[row])
        for column in range(width):
            if void[row, column]:
                donors[row, column] = VOID


@_jit
def count_in_row(rows, row, donors):
    """Count how many neighbours drain to each cell of a row.

    ``rows`` are the receivers, padded with 0, of this row and its neighbours, of row i at i
    modulo 3.
    """
    donors[:] = 0
    for k in range(8):
        there, right = rows[(row + DOWN[k]) % 3], 1 + RIGHT[k]
        back = np.uint8((k + 4) & 7)
        for column in range(donors.size):
            donors[column] += (there[column + right] >> back) & 1


@_jit
def offsets(width):
    """Give the distances in memory from a cell to its neighbours."""
    return 1, width + 1, width, width - 1, -1, -width - 1, -width, 1 - width
