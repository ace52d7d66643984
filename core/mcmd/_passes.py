"""Kernels of MCMD's two passes over a whole lattice, as published and distance-weighted.

A lattice is an ``(S, S)`` array with ``S = 2**levels + 1``. A point's step is the largest power of
two that divides both its indices; its ascendants are the points it is the midpoint of.

``row`` and ``column`` are those of the lattice's first point in the raster, whose maps ``l`` and
``l_bu`` are. The cell that receives an elevation is the one whose curve bends it, up as down.
"""

import numba
import numpy as np

from demsmith.core.mcmd._displacement import displacement
from demsmith.core.mcmd._maps import value_at

_JIT = dict(nogil=True, cache=True, error_model="numpy")

# Offsets, in steps, of the ascendants of a square's centre: of triangle-edge the first two, the
# ends of the main diagonal; of diamond-square all four corners.
_DIAGONAL = ((-1, -1), (1, 1), (-1, 1), (1, -1))


@numba.njit(**_JIT)
def bend(d, d_max, l):
    """Give the paper's phi (equation 2) at a distance, as a share of the elevation."""
    if l == 0:
        return 1.0
    fall = 1.0 - (1.0 - min(d / d_max, 1.0)) ** abs(l)
    return 1.0 - fall if l > 0 else 1.0 + fall


@numba.njit(**_JIT)
def _ascendant(i, j, n, side, triangle):
    """Give the ``n``-th ascendant of a point and whether there is one."""
    step = (i | j) & -(i | j)
    if step == 0 or step >= side - 1:
        return 0, 0, False
    i_odd, j_odd = (i & step) != 0, (j & step) != 0
    if i_odd and j_odd:
        if triangle and n >= 2:
            return 0, 0, False
        return i + _DIAGONAL[n][0] * step, j + _DIAGONAL[n][1] * step, True
    if triangle:
        if n >= 2:
            return 0, 0, False
        sign = 2 * n - 1
        return (i + sign * step, j, True) if i_odd else (i, j + sign * step, True)
    sign = n % 2 * 2 - 1
    if n < 2:
        i += sign * step
    else:
        j += sign * step
    return i, j, 0 <= i < side and 0 <= j < side


@numba.njit(**_JIT)
def bottom_up_generation(
    z, known, active, sums, counts, triangle, l_bu, row, column, d_max, dx, dy
):
    """Do one generation of Algorithm 1: unknown ascendants of the active points become known.

    ``sums`` and ``counts`` are zeros on entry and on return. Returns the points that became known.
    """
    side = z.shape[0]
    reached = []
    for p in active:
        i, j = p // side, p % side
        for n in range(4):
            ai, aj, exists = _ascendant(i, j, n, side, triangle)
            if not exists or known[ai, aj]:
                continue
            if counts[ai, aj] == 0:
                reached.append(ai * side + aj)
            d = np.hypot((ai - i) * dy[i], (aj - j) * dx[i])
            l = value_at(l_bu, ai + row, aj + column)
            sums[ai, aj] += z[i, j] * bend(d, d_max, l)
            counts[ai, aj] += 1
    out = np.empty(len(reached), np.int64)
    for n in range(len(reached)):
        out[n] = reached[n]
        i, j = out[n] // side, out[n] % side
        z[i, j] = sums[i, j] / counts[i, j]
        known[i, j] = True
        sums[i, j] = 0
        counts[i, j] = 0
    return out


@numba.njit(**_JIT)
def points_of(known):
    """List the known points as flat indices."""
    out = np.empty(known.sum(), np.int64)
    n = 0
    for i in range(known.shape[0]):
        for j in range(known.shape[1]):
            if known[i, j]:
                out[n] = i * known.shape[1] + j
                n += 1
    return out


@numba.njit(**_JIT)
def lift_level(z, known, step, centres, begin, end, triangle, l_bu, row, column, d_max, dx, dy):
    """Give unknown ascendants the distance-weighted mean of their known children at ``step``.

    With ``centres``, the ascendants are the centres of squares of side ``2 * step`` and their
    children the midpoints of the squares' edges; else the ascendants are the squares' corners.
    Rows ``begin`` to ``end`` in units of ``step``.
    """
    side = z.shape[0]
    for i in range(begin * step, min(end * step, side), step):
        if ((i & step) != 0) != centres:
            continue
        for j in range(step if centres else 0, side, 2 * step):
            if known[i, j]:
                continue
            l = value_at(l_bu, i + row, j + column)
            total, weight = 0.0, 0.0
            for di in range(-1, 2):
                for dj in range(-1, 2):
                    diagonal = di != 0 and dj != 0
                    if (di == 0 and dj == 0) or (diagonal and (centres or (triangle and di != dj))):
                        continue
                    ci, cj = i + di * step, j + dj * step
                    if ci < 0 or cj < 0 or ci >= side or cj >= side or not known[ci, cj]:
                        continue
                    d2 = (di * step * dy[i]) ** 2 + (dj * step * dx[i]) ** 2
                    total += z[ci, cj] * bend(np.sqrt(d2), d_max, l) / d2
                    weight += 1 / d2
            if weight > 0:
                z[i, j] = total / weight
                known[i, j] = True


@numba.njit(**_JIT)
def descend_level(
    z, known, step, centres, begin, end, triangle, l, row, column, d_max, dx, dy, noise, r
):
    """Give unknown midpoints of a step the mean of their ascendants, displaced (equation 1).

    Rows ``begin`` to ``end`` in units of ``step``.
    """
    side = z.shape[0]
    for i in range(begin * step, min(end * step, side), step):
        i_odd = (i & step) != 0
        if centres and not i_odd:
            continue
        first = step if centres or not i_odd else 0
        # A power for every ascendant would take longer than all else: there are but three
        # distances in a row, and a curve seldom changes from cell to cell.
        along, across, down = 1.0, 1.0, 1.0
        bent_by = 0.0
        for j in range(first, side, 2 * step):
            if known[i, j]:
                continue
            own = value_at(l, i + row, j + column)
            if own != bent_by:
                bent_by = own
                along = bend(step * dx[i], d_max, own)
                across = bend(step * np.hypot(dx[i], dy[i]), d_max, own)
                down = bend(step * dy[i], d_max, own)
            total, count = 0.0, 0
            for n in range(4):
                ai, aj, exists = _ascendant(i, j, n, side, triangle)
                if exists:
                    total += z[ai, aj] * (across if centres else along if ai == i else down)
                    count += 1
            z[i, j] = total / count
            z[i, j] += displacement(noise, r, i + row, j + column, i, j)


@numba.njit(**_JIT)
def nearest_known(z, known, i, j, dx, dy):
    """Give the elevation of the known point nearest to a point, the first of equals."""
    side = z.shape[0]
    best, value = np.inf, np.nan
    for r in range(side):
        for c in range(side):
            if known[r, c]:
                d2 = ((r - i) * dy[i]) ** 2 + ((c - j) * dx[i]) ** 2
                if d2 < best:
                    best, value = d2, z[r, c]
    return value
