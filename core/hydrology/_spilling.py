"""Kernels on the graph of all basins and the passes between them: where each overflows."""

import numba
import numpy as np

from demsmith.core.hydrology._basins import root_of

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def find_levels(order, ends, levels, group, level):
    """Write the lowest level over which water leaves each basin (Kruskal's algorithm).

    Parameters
    ----------
    order : (N,) int64 array
        The passes from the lowest to the highest; part of them, if it is called again.
    ends, levels : (P, 2) and (P,) arrays
        All passes.
    group : (B,) int64 array
        Which basins are connected so far: a parent of each; each basin itself at the beginning,
        and 0 for those that are sinks.
    level : (B,) array
        Written where a group of basins is connected with basin 0.
    """
    for k in order:
        a, b = _root_below(group, ends[k, 0]), _root_below(group, ends[k, 1])
        drains_a, drains_b = group[a] == 0, group[b] == 0
        if a == b or (drains_a and drains_b):
            continue
        if drains_b:
            group[a] = 0
            level[a] = levels[k]
        elif drains_a:
            group[b] = 0
            level[b] = levels[k]
        else:
            group[a] = b


@numba.njit(**_JIT)
def find_sinks(order, ends, levels, pits, max_depth, group, deep, twin):
    """Mark in ``deep`` the pits where water would rise by more than ``max_depth``.

    It rises until it finds a way to a lower pit, or out. Pits at one elevation that are connected
    before share their fate: ``twin`` leads to the one it is written for. Other parameters are as
    in `find_levels`, but ``group`` leads to the lowest pit.
    """
    for k in order:
        low, high = root_of(group, ends[k, 0]), root_of(group, ends[k, 1])
        if low == high:
            continue
        if pits[high] < pits[low]:
            low, high = high, low
        group[high] = low
        if np.float64(levels[k]) - np.float64(pits[high]) > max_depth:
            deep[high] = True
            deep[low] |= pits[low] == pits[high]
        elif pits[low] == pits[high]:
            twin[high] = low


@numba.njit(**_JIT)
def share_fate(deep, twin):
    """Mark the pits whose twin is marked."""
    for basin in range(deep.size):
        deep[basin] = deep[root_of(twin, basin)]


@numba.njit(**_JIT)
def spread_levels(group, level):
    """Write the level of each basin from that of the group it is in."""
    for basin in range(1, level.size):
        level[basin] = level[_root_below(group, basin)]


@numba.njit(**_JIT)
def _root_below(group, basin):
    """Give the root of a basin's group, or where that is 0, what stands just below it."""
    while group[basin] != 0 and group[basin] != basin:
        parent = group[basin]
        if group[parent] == 0:
            return parent
        group[basin] = group[parent]
        basin = group[basin]
    return basin
