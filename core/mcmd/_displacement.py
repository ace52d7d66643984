"""Kernels of the random displacements: a counter-based generator, and their sum over levels."""

import numba
import numpy as np

from demsmith.core.mcmd._maps import value_at
from demsmith.core.mcmd._points import coarsest_level

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(inline="always", **_JIT)
def _mix(x):
    """Scramble 64 bits: the finalizer of SplitMix64 (Steele, Lea and Flood 2014)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


@numba.njit(**_JIT)
def uniform(seed, row, column):
    """Give the number in [-1, 1) that belongs to a seed and a cell, whoever asks and when."""
    key = _mix(np.uint64(seed) + np.uint64(0x9E3779B97F4A7C15))
    key = _mix(key ^ (np.uint64(row) * np.uint64(0xD1B54A32D192ED03)))
    key = _mix(key ^ (np.uint64(column) * np.uint64(0xABC98388FB8FAC03)))
    return np.float64(key >> np.uint64(11)) * 2.0**-52 - 1.0


@numba.njit(**_JIT)
def displacement(noise, r, row, column, i, j):
    """Give the displacement of a midpoint of subdivision level ``r`` (equation 1).

    Its parameters are those of the raster's cell ``(row, column)``, its random number that of the
    lattice's point ``(i, j)``.
    """
    strength = value_at(noise.strength, row, column)
    if strength == 0:
        return 0.0
    amplitude = strength * 2.0 ** (-2 * value_at(noise.h, row, column) * r)
    return (uniform(noise.seed, i, j) + value_at(noise.r_t, row, column)) * amplitude


@numba.njit(**_JIT)
def displace_voids(values, labels, runs, first_run, voids, sums, noise, row_offset, column_offset):
    """Add the summed displacements of all levels to some filled voids, in place.

    Displacements descend as elevations do: a midpoint has the mean of its ascendants' and its
    own. They are nought on all ground but the void's, and at points that the bottom-up pass would
    fix because a known cell descends from them, so the roughness dies away at the rim.

    Parameters
    ----------
    sums : (H, W) float64 array of zeros
        Where the displacements of each void's cells are summed.
    noise : Noise
    """
    for void in voids:
        a, b = first_run[void], first_run[void + 1]
        for level in range(min(coarsest_level(runs, a, b), noise.levels - 1), -1, -1):
            # Centres of squares before midpoints of edges, which descend from them.
            for centres in (True, False):
                _displace_level(
                    labels, runs, a, b, void + 1, level, centres, sums, noise,
                    row_offset, column_offset,
                )  # fmt: skip
        for k in range(a, b):
            row = runs[k, 0]
            for column in range(runs[k, 1], runs[k, 2]):
                values[row, column] += sums[row, column]


@numba.njit(**_JIT)
def _displace_level(
    labels, runs, a, b, own, level, centres, sums, noise, row_offset, column_offset
):
    step = 1 << level
    r = noise.levels - level
    for k in range(a, b):
        row, start, stop = runs[k, 0], runs[k, 1], runs[k, 2]
        if (row + row_offset) % step:
            continue
        row_odd = (row + row_offset) & step != 0
        start += -(start + column_offset) % step
        for column in range(start, stop, step):
            column_odd = (column + column_offset) & step != 0
            if not (row_odd or column_odd) or (row_odd and column_odd) != centres:
                continue
            if not _is_free(labels, row, column, own, step):
                continue
            here = displacement(noise, r, row, column, row + row_offset, column + column_offset)
            sums[row, column] = here + _inherited(labels, row, column, own, step, centres, sums)


@numba.njit(**_JIT)
def _is_free(labels, row, column, own, step):
    """Tell whether no known cell descends from this lattice point."""
    height, width = labels.shape
    reach = step // 2
    while reach >= 1:
        for r in range(row - reach, row + reach + 1, reach):
            for c in range(column - reach, column + reach + 1, reach):
                if 0 <= r < height and 0 <= c < width and labels[r, c] != own:
                    return False
        reach //= 2
    return True


@numba.njit(**_JIT)
def _inherited(labels, row, column, own, step, centres, sums):
    height, width = labels.shape
    total, count = 0.0, 0
    for i in range(4):
        first, second = i // 2 * 2 - 1, i % 2 * 2 - 1
        if centres:
            r, c = row + first * step, column + second * step
        elif i < 2:
            r, c = row + second * step, column
        else:
            r, c = row, column + second * step
        if 0 <= r < height and 0 <= c < width:
            count += 1
            if labels[r, c] == own:
                total += sums[r, c]
    return total / count if count else 0.0
