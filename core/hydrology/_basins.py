"""Kernels that cut a strip of rows into the basins of its pits, and find the passes between them.

A pit is a cell without a neighbour that comes before it in the order of elevation, then of place.
Every other cell leads to the first of its neighbours in that order, so all lead to a pit, and
never upwards: a basin is what leads to one pit. Cells at the raster's edge and beside voids are
outlets; with all that leads to them they make up basin 0. Neighbours in other strips are ignored,
which makes pits of some cells at a strip's border, but over the seam water finds its way on.
"""

import numba
import numpy as np

from demsmith.core.hydrology._rows import pad_row

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def label_basins(z, void, first, last, label):
    """Write the basin, from 1 on, of each cell of rows ``first`` to ``last``; 0 flows out.

    Returns the elevation of the basins' pits; the first, of basin 0, is -inf.
    """
    _point_down(z, void, first, last, label)
    lead = label[first:last].ravel()
    _lead_to_ends(lead)
    ground = z[first:last].ravel()
    # Outlets have led to cell 0, so that is basin 0.
    basin = np.empty(lead.size, np.uint32)
    basins = 0
    for cell in range(lead.size):
        if lead[cell] == cell:
            basin[cell] = basins
            basins += 1
    pits = np.empty(basins, z.dtype)
    for cell in range(lead.size):
        if lead[cell] == cell:
            pits[basin[cell]] = ground[cell]
    pits[0] = -np.inf
    for cell in range(lead.size):
        lead[cell] = basin[lead[cell]]
    return pits


@numba.njit(**_JIT)
def _lead_to_ends(lead):
    """Let each cell lead to where its way ends.

    Again and again each is led to where the cell it leads to is led; ways to one side, along
    which the cells are visited, are followed to their end at once.
    """
    changed = True
    while changed:
        change = np.uint32(0)
        for cell in range(lead.size):
            old = lead[cell]
            lead[cell] = lead[old]
            change |= old ^ lead[old]
        for cell in range(lead.size - 1, -1, -1):
            old = lead[cell]
            lead[cell] = lead[old]
            change |= old ^ lead[old]
        changed = change != 0


@numba.njit(**_JIT)
def _point_down(z, void, first, last, lead):
    """Write the place in the strip to which each cell leads, 0 for outlets and voids.

    Cell 0 is at the raster's edge, so it is one of these itself.
    """
    width = z.shape[1]
    low = -z.dtype.type(np.inf)
    north, here, south = (
        np.empty(width + 2, z.dtype), np.empty(width + 2, z.dtype), np.empty(width + 2, z.dtype)
    )  # fmt: skip
    pad_row(z, void, first - 1, low, north)
    _raise_beyond(north)
    pad_row(z, void, first, low, here)
    for row in range(first, last):
        pad_row(z, void, row + 1, low, south)
        if row + 1 == last:
            _raise_beyond(south)
        _point_down_row(north, here, south, np.int32((row - first) * width), lead[row])
        north, here, south = here, south, north


@numba.njit(**_JIT)
def _raise_beyond(padded):
    """Put the known cells of a neighbouring strip out of reach; its voids stay outlets."""
    for j in range(padded.size):
        padded[j] = padded[j] if padded[j] == -np.inf else np.inf


@numba.njit(**_JIT)
def _point_down_row(north, here, south, begin, lead):
    width = np.int32(lead.size)
    for k in range(lead.size):
        j = k + 1
        place = begin + np.int32(k)
        best, to = north[j - 1], place - width - np.int32(1)
        to = place - width if north[j] < best else to
        best = min(north[j], best)
        to = place - width + np.int32(1) if north[j + 1] < best else to
        best = min(north[j + 1], best)
        to = place - np.int32(1) if here[j - 1] < best else to
        best = min(here[j - 1], best)
        to = place if here[j] < best else to
        best = min(here[j], best)
        to = place + np.int32(1) if here[j + 1] < best else to
        best = min(here[j + 1], best)
        to = place + width - np.int32(1) if south[j - 1] < best else to
        best = min(south[j - 1], best)
        to = place + width if south[j] < best else to
        best = min(south[j], best)
        to = place + width + np.int32(1) if south[j + 1] < best else to
        best = min(south[j + 1], best)
        lead[k] = np.uint32(0 if best == -np.inf else to)


@numba.njit(**_JIT)
def find_passes(z, first, last, label, basins):
    """List the lowest passes that connect the basins of a strip, a minimum spanning forest.

    Boruvka's algorithm: each basin is joined with another over the lowest pass that leads out of
    it; then the same is done with what has been joined, until nothing is left to join.

    Returns
    -------
    ends : (N, 2) uint32 array
        Basins on both sides of each pass.
    levels : (N,) array
        Its elevation.
    """
    group = np.arange(basins).astype(np.uint32)
    ends, levels = np.empty((basins, 2), np.uint32), np.empty(basins, z.dtype)
    chosen = np.empty(basins, np.int64)
    # Room for all; what is not written to takes up no memory.
    room = 4 * (last - first) * z.shape[1]
    left, left_levels = np.empty((room, 2), np.uint32), np.empty(room, z.dtype)
    count, found = _list_passes(z, first, last, label, left, left_levels), 0
    while count:
        count = _choose(group, left[:count], left_levels, chosen)
        for basin in range(basins):
            k = chosen[basin]
            if k >= 0 and _join(group, left[k, 0], left[k, 1]):
                ends[found, 0], ends[found, 1] = left[k, 0], left[k, 1]
                levels[found] = left_levels[k]
                found += 1
    return ends[:found].copy(), levels[:found].copy()


@numba.njit(**_JIT)
def _list_passes(z, first, last, label, ends, levels):
    """List the pairs of neighbouring cells of two basins; give their number."""
    width = z.shape[1]
    count = 0
    for row in range(first, last):
        for column in range(width):
            if _is_inside(label, row, column, last):
                continue
            for k in range(4):
                r, c = row + (k > 0), column + (1, -1, 0, 1)[k]
                if r < last and 0 <= c < width and label[row, column] != label[r, c]:
                    count = _add_pass(
                        ends, levels, count, label[row, column], label[r, c],
                        max(z[row, column], z[r, c]),
                    )  # fmt: skip
    return count


@numba.njit(**_JIT)
def _is_inside(label, row, column, last):
    """Tell, where that is quick, whether a cell and its next four are of one basin."""
    if row + 1 == last or column == 0 or column + 1 == label.shape[1]:
        return False
    here = label[row, column]
    beside = (here ^ label[row, column + 1]) | (here ^ label[row + 1, column])
    return (beside | (here ^ label[row + 1, column - 1]) | (here ^ label[row + 1, column + 1])) == 0


@numba.njit(**_JIT)
def _add_pass(ends, levels, count, here, there, level):
    """Add a pass to a list of ``count``; or lower the last, if it connects the same basins."""
    last = count - 1
    if count and ends[last, 0] == here and ends[last, 1] == there:
        levels[last] = min(level, levels[last])
        return count
    ends[count, 0], ends[count, 1], levels[count] = here, there, level
    return count + 1


@numba.njit(**_JIT)
def _choose(group, ends, levels, chosen):
    """Choose the lowest pass out of each group; drop the passes within one; count the others."""
    chosen[:] = -1
    count = 0
    for k in range(ends.shape[0]):
        a, b = root_of(group, ends[k, 0]), root_of(group, ends[k, 1])
        if a == b:
            continue
        ends[count, 0], ends[count, 1] = ends[k, 0], ends[k, 1]
        levels[count] = levels[k]
        if chosen[a] < 0 or levels[count] < levels[chosen[a]]:
            chosen[a] = count
        if chosen[b] < 0 or levels[count] < levels[chosen[b]]:
            chosen[b] = count
        count += 1
    return count


@numba.njit(**_JIT)
def find_seam_passes(z, row, label, above, below):
    """List passes between the basins of ``row`` and those of the next one, in another strip.

    ``above`` and ``below`` are added to the labels but 0, so that they are one numbering.
    """
    width = z.shape[1]
    ends = np.empty((3 * width, 2), np.int64)
    levels = np.empty(3 * width, z.dtype)
    count = 0
    for column in range(width):
        here = label[row, column] + (above if label[row, column] else 0)
        for c in range(max(column - 1, 0), min(column + 2, width)):
            there = label[row + 1, c] + (below if label[row + 1, c] else 0)
            if here == there:
                continue
            level = max(z[row, column], z[row + 1, c])
            count = _add_pass(ends, levels, count, here, there, level)
    return ends[:count].copy(), levels[:count].copy()


@numba.njit(**_JIT)
def fill_basins(z, first, last, label, level, filled):
    """Raise each cell of rows ``first`` to ``last`` to the level of its basin."""
    for row in range(first, last):
        for column in range(z.shape[1]):
            water = level[label[row, column]]
            ground = z[row, column]
            filled[row, column] = water if water > ground else ground


@numba.njit(**_JIT)
def _join(group, a, b):
    """Join the groups of two basins; tell whether they were apart."""
    a, b = root_of(group, a), root_of(group, b)
    if a < b:
        group[b] = a
    else:
        group[a] = b
    return a != b


@numba.njit(**_JIT)
def root_of(group, basin):
    """Give the root of a basin's group in a forest of parents, and shorten the way there."""
    while group[basin] != basin:
        group[basin] = group[group[basin]]
        basin = group[basin]
    return basin
