"""Kernels of MCMD with relaxed generations: one void at a time, in place."""

import numba
import numpy as np

from demsmith.core.mcmd._points import (
    ALL,
    BITS,
    COLUMNS,
    EAST,
    EAST2,
    FIRST,
    LENGTH,
    NORTH,
    NORTH2,
    NORTHEAST,
    NORTHWEST,
    PARITY,
    PINNED,
    PLAIN,
    ROW,
    SOUTH,
    SOUTH2,
    SOUTHEAST,
    SOUTHWEST,
    WEST,
    WEST2,
    coarsest_level,
    count_cells,
    flood,
    gather,
    pin,
)

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def fill_voids(
    values, labels, runs, first_run, voids, starts, stencils, omega, row_offset, column_offset, fine
):
    """Fill some voids of ``values`` in place.

    Parameters
    ----------
    values : (H, W) float array, C order
        Elevations; the voids' own cells are overwritten, all others only read.
    labels : (H, W) int32 array
        0 where known, else 1 + the void's number.
    runs, first_run : arrays
        The voids' runs, see `demsmith.core.voids.labelling.Voids`.
    voids : (N,) int64 array
        Numbers of the voids to fill.
    starts : (N,) float64 array
        Elevation from which each begins.
    stencils : (levels, H, 5) float64 array
        From `make_stencils`.
    omega : float
        Over-relaxation.
    row_offset, column_offset : int
        Added to a cell's row and column they count from the lattice's corner.
    fine : int
        Sweeps at the finest step; each coarser step has twice as many.
    """
    most_cells, most_runs = 0, 0
    for void in voids:
        a, b = first_run[void], first_run[void + 1]
        most_cells = max(most_cells, count_cells(runs, a, b))
        most_runs = max(most_runs, b - a)
    segments = np.empty((most_runs, COLUMNS), np.int64)
    bits = np.empty(most_cells, np.int16)
    for i in range(voids.size):
        void = voids[i]
        a, b = first_run[void], first_run[void + 1]
        flood(values, runs, a, b, starts[i])
        for level in range(coarsest_level(runs, a, b), -1, -1):
            count = gather(
                labels, runs, a, b, void + 1, level, row_offset, column_offset, segments, bits
            )
            if count == 0:
                continue
            if level:
                pin(values, labels, segments, count, bits, level)
            predict(values, segments, count, bits, level)
            relax(values, segments, 0, count, bits, level, stencils, omega, 0, fine << level)


@numba.njit(**_JIT)
def make_stencils(aspect, tension, omega, levels):
    """Tabulate the weights of a cell's neighbours, by lattice level and row.

    The surface's energy is bending ``z_xx^2 + 2 z_xy^2 + z_yy^2`` plus ``tension`` times
    stretching ``z_x^2 + z_y^2``, in units of the row spacing.

    Parameters
    ----------
    aspect, tension : (H,) float64 arrays
        ``(dy / dx)**2`` and ``(dy / tension length)**2`` of each row.

    Returns
    -------
    (levels, H, 5) float64 array
        Weights of the neighbours east and west, north and south, diagonal, two columns and two
        rows away, already times ``omega`` over their sum; the last three are to be subtracted.
    """
    out = np.empty((levels, aspect.size, 5))
    for level in range(levels):
        step = 2.0**level
        for row in range(aspect.size):
            b_x = aspect[row] * aspect[row]
            b_d = 2 * aspect[row]
            t_y = tension[row] * step * step
            t_x = t_y * aspect[row]
            scale = omega / (6 * b_x + 6 + 4 * b_d + 2 * t_x + 2 * t_y)
            out[level, row, 0] = (4 * b_x + 2 * b_d + t_x) * scale
            out[level, row, 1] = (4 + 2 * b_d + t_y) * scale
            out[level, row, 2] = b_d * scale
            out[level, row, 3] = b_x * scale
            out[level, row, 4] = scale
    return out


@numba.njit(**_JIT)
def predict(values, segments, count, bits, level):
    """Give each midpoint of this generation the mean of its usable ascendants."""
    flat = values.ravel()
    side = np.uint64(1 << level)
    up = np.uint64(values.shape[1]) * side
    # Centres of squares first, for the midpoints of edges descend from them.
    for s in range(count):
        parity = segments[s, PARITY]
        if parity & 1:
            _predict_segment(
                flat, segments, s, bits, 1 - (parity >> 1), 8, side,
                up + side, up - side,
            )  # fmt: skip
    for s in range(count):
        parity = segments[s, PARITY]
        start = parity >> 1 if parity & 1 else 1 - (parity >> 1)
        _predict_segment(flat, segments, s, bits, start, 0, side, side, up)


@numba.njit(inline="always", **_JIT)
def _predict_segment(flat, segments, s, bits, start, shift, side, reach, other_reach):
    """Predict every other point of a segment from the points at two distances either way."""
    p = np.uint64(segments[s, FIRST]) + np.uint64(start) * side
    plain = segments[s, PLAIN]
    for i in range(start, segments[s, LENGTH], 2):
        if plain:
            found = ALL
        else:
            found = bits[segments[s, BITS] + i]
        if not found & PINNED:
            flat[p] = _mean_of(
                flat, found >> shift, p, p - reach, p - other_reach, p + other_reach, p + reach
            )
        p += side + side


@numba.njit(inline="always", **_JIT)
def _mean_of(flat, bits, p, p1, p2, p3, p4):
    if bits & 15 == 15:
        return 0.25 * ((flat[p1] + flat[p2]) + (flat[p3] + flat[p4]))
    total, count = 0.0, 0
    if bits & 1:
        total += flat[p1]
        count += 1
    if bits & 2:
        total += flat[p2]
        count += 1
    if bits & 4:
        total += flat[p3]
        count += 1
    if bits & 8:
        total += flat[p4]
        count += 1
    return total / count if count else flat[p]


@numba.njit(**_JIT)
def relax(values, segments, low, high, bits, level, stencils, omega, begin, end):
    """Do the sweeps ``begin`` to ``end`` of successive over-relaxation, every other one backward.

    Each free point of the segments ``low`` to ``high`` moves past the value that makes the
    surface's energy least while its neighbours are held.
    """
    flat = values.ravel()
    table = stencils[level]
    step = np.int64(1 << level)
    up = np.int64(values.shape[1]) * step
    for sweep in range(begin, end):
        forward = sweep % 2 == 0
        for i in range(high - low):
            # Unsigned, for a signed index might be negative and costs a look.
            s = np.uint64(low + i if forward else high - 1 - i)
            length, row = segments[s, LENGTH], np.uint64(segments[s, ROW])
            c_x, c_y, c_d = table[row, 0], table[row, 1], table[row, 2]
            c_xx, c_yy = table[row, 3], table[row, 4]
            # Backward is the same with the columns' order turned round.
            ahead = step if forward else -step
            p = segments[s, FIRST] + (0 if forward else (length - 1) * step)
            if segments[s, PLAIN]:
                _relax_plain(flat, p, length, ahead, up, omega, c_x, c_y, c_d, c_xx, c_yy)
                continue
            at = segments[s, BITS] + (0 if forward else length - 1)
            for _ in range(length):
                found = bits[at]
                if found == ALL:
                    _relax_plain(flat, p, 1, ahead, up, omega, c_x, c_y, c_d, c_xx, c_yy)
                elif not found & PINNED:
                    best = _least_energy(
                        flat, found, np.uint64(p), np.uint64(step), np.uint64(up),
                        c_x, c_y, c_d, c_xx, c_yy,
                    )  # fmt: skip
                    flat[p] = (1 - omega) * flat[p] + omega * best
                p += ahead
                at += 1 if forward else -1


@numba.njit(inline="always", **_JIT)
def _relax_plain(flat, p, length, ahead, up, omega, c_x, c_y, c_d, c_xx, c_yy):
    """Relax points whose neighbours may all be used, from ``p`` on, ``ahead`` apart."""
    ahead, up = np.uint64(ahead), np.uint64(up)  # two's complement: adding goes either way
    p = np.uint64(p)
    keep = 1 - omega
    latest = np.float64(flat[p - ahead])
    for _ in range(length):
        north, south = p - up, p + up
        around = (
            c_y * (flat[north] + flat[south])
            - c_xx * (flat[p - ahead - ahead] + flat[p + ahead + ahead])
            - c_yy * (flat[north - up] + flat[south + up])
            - c_d
            * (
                (flat[north - ahead] + flat[north + ahead])
                + (flat[south - ahead] + flat[south + ahead])
            )
            + keep * flat[p]
            + c_x * flat[p + ahead]
        )
        # The neighbour just relaxed is still at hand: waiting for memory to give it back would
        # double the time of a sweep.
        latest = around + c_x * latest
        flat[p] = latest
        p += ahead


@numba.njit(**_JIT)
def _least_energy(flat, bits, p, side, up, c_x, c_y, c_d, c_xx, c_yy):
    """Give the value of least energy where some neighbours may not be used."""
    b_x, b_y, b_d = c_xx, c_yy, c_d
    t_x, t_y = c_x - 4 * b_x - 2 * b_d, c_y - 4 * b_y - 2 * b_d
    west, east = bits & WEST, bits & EAST
    north, south = bits & NORTH, bits & SOUTH
    total, weight = 0.0, 0.0
    if west:
        z = flat[p - side]
        total += t_x * z
        weight += t_x
        if bits & WEST2:
            total += b_x * (2 * z - flat[p - side - side])
            weight += b_x
        if east:
            total += 2 * b_x * (z + flat[p + side])
            weight += 4 * b_x
        if north and bits & NORTHWEST:
            total += b_d * (z + flat[p - up] - flat[p - up - side])
            weight += b_d
        if south and bits & SOUTHWEST:
            total += b_d * (z + flat[p + up] - flat[p + up - side])
            weight += b_d
    if east:
        z = flat[p + side]
        total += t_x * z
        weight += t_x
        if bits & EAST2:
            total += b_x * (2 * z - flat[p + side + side])
            weight += b_x
        if north and bits & NORTHEAST:
            total += b_d * (z + flat[p - up] - flat[p - up + side])
            weight += b_d
        if south and bits & SOUTHEAST:
            total += b_d * (z + flat[p + up] - flat[p + up + side])
            weight += b_d
    if north:
        z = flat[p - up]
        total += t_y * z
        weight += t_y
        if bits & NORTH2:
            total += b_y * (2 * z - flat[p - up - up])
            weight += b_y
        if south:
            total += 2 * b_y * (z + flat[p + up])
            weight += 4 * b_y
    if south:
        z = flat[p + up]
        total += t_y * z
        weight += t_y
        if bits & SOUTH2:
            total += b_y * (2 * z - flat[p + up + up])
            weight += b_y
    return total / weight if weight > 0 else flat[p]
