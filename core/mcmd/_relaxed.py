"""Kernels of MCMD with relaxed generations: one void at a time, in place.

A void is a list of runs (row, first column, one past the last column) sorted by row. A void's own
cells are those that carry its label; label 0 is known ground; any other cell, another void's or
one beyond the raster, is left out of every stencil. So a void's surface depends on its known
surroundings alone, whatever the order of work, the number of threads or the tiling.
"""

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")

# Which neighbours of a lattice point may be used, as bits: the four axial ones, the four two
# steps away, the four diagonal ones.
_WEST, _EAST, _NORTH, _SOUTH = 1, 2, 4, 8
_WEST2, _EAST2, _NORTH2, _SOUTH2 = 16, 32, 64, 128
_NORTHWEST, _NORTHEAST, _SOUTHWEST, _SOUTHEAST = 256, 512, 1024, 2048
_ALL = 4095
# Where the point stands among its generation's midpoints: both odd is the centre of a square.
_ROW_ODD, _COLUMN_ODD, _CENTRE = 4096, 8192, 12288


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
    largest = 0
    for void in voids:
        largest = max(largest, count_cells(runs, first_run[void], first_run[void + 1]))
    points = np.empty(largest, np.uint64)
    rows = np.empty(largest, np.int32)
    usable = np.empty(largest, np.int16)
    for i in range(voids.size):
        void = voids[i]
        a, b = first_run[void], first_run[void + 1]
        flood(values, runs, a, b, starts[i])
        for level in range(coarsest_level(runs, a, b), -1, -1):
            count = gather(
                labels, runs, a, b, void + 1, level, row_offset, column_offset, points, rows, usable
            )
            if level:
                count = pin(values, labels, points, rows, usable, count, level)
            if count:
                predict(values, points, usable, count, level)
                sweeps = fine << level
                relax(values, points, rows, usable, 0, count, level, stencils, omega, 0, sweeps)


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
def count_cells(runs, a, b):
    """Count the cells of the runs ``a`` to ``b``."""
    cells = 0
    for k in range(a, b):
        cells += runs[k, 2] - runs[k, 1]
    return cells


@numba.njit(**_JIT)
def columns(runs, a, b):
    """Give the first and one past the last column of the runs ``a`` to ``b``."""
    low, high = runs[a, 1], runs[a, 2]
    for k in range(a, b):
        low = min(low, runs[k, 1])
        high = max(high, runs[k, 2])
    return low, high


@numba.njit(**_JIT)
def coarsest_level(runs, a, b):
    """Give the coarsest level worth relaxing: its step does not exceed the void's extent."""
    low, high = columns(runs, a, b)
    extent = max(high - low, runs[b - 1, 0] - runs[a, 0] + 1)
    level = 0
    while (2 << level) <= extent:
        level += 1
    return level


@numba.njit(**_JIT)
def flood(values, runs, a, b, start):
    """Set the void's own cells to ``start``."""
    for k in range(a, b):
        values[runs[k, 0], runs[k, 1] : runs[k, 2]] = start


@numba.njit(**_JIT)
def gather(labels, runs, a, b, own, level, row_offset, column_offset, points, rows, usable):
    """List the void's own lattice points of a level, each with what is known of its stencil."""
    step = 1 << level
    height, width = labels.shape
    count = 0
    for k in range(a, b):
        row, start, stop = runs[k]
        # A step is a power of two, and masking is many times as fast as dividing.
        if (row + row_offset) & (step - 1):
            continue
        start += -(start + column_offset) & (step - 1)
        if start >= stop:
            continue
        row_class = _ROW_ODD if (row + row_offset) & step else 0
        near_edge = row < 2 * step or row + 2 * step >= height
        near_edge |= start < 2 * step or stop + 2 * step > width
        alone = not near_edge and _alone(labels, row, start, stop, own, step)
        for column in range(start, stop, step):
            rows[count] = row
            p = np.uint64(row) * np.uint64(width) + np.uint64(column)
            points[count] = p
            if alone:
                bits = _ALL
            elif near_edge:
                bits = _usable_near_edge(labels, row, column, own, step)
            else:
                bits = _usable(labels.ravel(), p, own, np.uint64(step), np.uint64(width))
            if (column + column_offset) & step:
                bits |= _COLUMN_ODD
            usable[count] = bits | row_class
            count += 1
    return count


@numba.njit(**_JIT)
def _alone(labels, row, start, stop, own, step):
    """Tell whether no stencil of a run's points meets another void."""
    flat = labels.ravel()
    width, side = np.uint64(labels.shape[1]), np.uint64(step)
    found = False
    for r in range(row - 2 * step, row + 2 * step + 1, step):
        p = np.uint64(r) * width + np.uint64(start - 2 * step)
        end = p + np.uint64(stop - start + 4 * step)
        while p < end:
            label = flat[p]
            found |= (label != 0) & (label != own)
            p += side
    return not found


@numba.njit(**_JIT)
def _usable(flat, p, own, side, width):
    """Give the bits of the neighbours that are known or the void's own."""
    up = side * width
    bits = _open(flat[p - side], own) * _WEST
    bits |= _open(flat[p + side], own) * _EAST
    bits |= _open(flat[p - up], own) * _NORTH
    bits |= _open(flat[p + up], own) * _SOUTH
    bits |= _open(flat[p - side - side], own) * _WEST2
    bits |= _open(flat[p + side + side], own) * _EAST2
    bits |= _open(flat[p - up - up], own) * _NORTH2
    bits |= _open(flat[p + up + up], own) * _SOUTH2
    bits |= _open(flat[p - up - side], own) * _NORTHWEST
    bits |= _open(flat[p - up + side], own) * _NORTHEAST
    bits |= _open(flat[p + up - side], own) * _SOUTHWEST
    bits |= _open(flat[p + up + side], own) * _SOUTHEAST
    return bits


@numba.njit(inline="always", **_JIT)
def _open(label, own):
    return np.int64((label == 0) | (label == own))


@numba.njit(**_JIT)
def _usable_near_edge(labels, row, column, own, step):
    """Do the same where some neighbours lie beyond the raster."""
    height, width = labels.shape
    far = 2 * step
    bits, bit = 0, 1
    for dr, dc in (
        (0, -step), (0, step), (-step, 0), (step, 0),
        (0, -far), (0, far), (-far, 0), (far, 0),
        (-step, -step), (-step, step), (step, -step), (step, step),
    ):  # fmt: skip
        r, c = row + dr, column + dc
        if 0 <= r < height and 0 <= c < width:
            bits |= _open(labels[r, c], own) * bit
        bit *= 2
    return bits


@numba.njit(**_JIT)
def pin(values, labels, points, rows, usable, count, level):
    """Set points near known ground that no stencil of this level meets, and drop them.

    Ground narrower than the step, such as an island in the void or a strip at the raster's edge,
    would else be met at the finest level only, whose few sweeps would leave a spike there. As in
    the bottom-up pass the points take its elevation: the mean of the known cells up to half a step
    away, or as far as the edge, by inverse squared distance. Returns how many points are left.
    """
    height, width = labels.shape
    step = 1 << level
    half = step // 2
    kept = 0
    for i in range(count):
        row = np.int64(rows[i])
        column = np.int64(points[i]) - row * width
        total, weight = 0.0, 0.0
        if not _known_beside(labels, row, column, step):
            # The last points before the raster's edge stand for all that is beyond them.
            top = row - half if row >= step else 0
            left = column - half if column >= step else 0
            bottom = row + half + 1 if row + step < height else height
            right = column + half + 1 if column + step < width else width
            for r in range(top, bottom):
                for c in range(left, right):
                    if labels[r, c] == 0:
                        near = 1.0 / ((r - row) ** 2 + (c - column) ** 2)
                        total += near * values[r, c]
                        weight += near
        if weight > 0:
            values[row, column] = total / weight
        else:
            points[kept], rows[kept], usable[kept] = points[i], rows[i], usable[i]
            kept += 1
    return kept


@numba.njit(**_JIT)
def _known_beside(labels, row, column, step):
    """Tell whether one of a lattice point's eight neighbours is known."""
    height, width = labels.shape
    for r in range(row - step, row + step + 1, step):
        for c in range(column - step, column + step + 1, step):
            if 0 <= r < height and 0 <= c < width and labels[r, c] == 0:
                return True
    return False


@numba.njit(**_JIT)
def predict(values, points, usable, count, level):
    """Give each midpoint of this generation the mean of its usable ascendants."""
    flat = values.ravel()
    side = np.uint64(1 << level)
    up = np.uint64(values.shape[1]) * side
    for j in range(count):
        bits = usable[j]
        if bits & _CENTRE == _CENTRE:
            p = points[j]
            flat[p] = _mean_of(
                flat, bits >> 8, p, p - up - side, p - up + side, p + up - side, p + up + side
            )
    for j in range(count):
        bits = usable[j]
        if bits & _CENTRE == _ROW_ODD or bits & _CENTRE == _COLUMN_ODD:
            p = points[j]
            flat[p] = _mean_of(flat, bits, p, p - side, p + side, p - up, p + up)


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
def relax(values, points, rows, usable, low, high, level, stencils, omega, begin, end):
    """Do the sweeps ``begin`` to ``end`` of successive over-relaxation, every other one backward.

    Each point from ``low`` to ``high`` moves past the value that makes the surface's energy least
    while its neighbours are held.
    """
    flat = values.ravel()
    side = np.uint64(1 << level)
    up = np.uint64(values.shape[1]) * side
    side2, up2 = side + side, up + up
    keep = 1 - omega
    c_x = c_y = c_d = c_xx = c_yy = 0.0
    latest, latest_p = 0.0, np.uint64(0)
    for sweep in range(begin, end):
        forward = sweep % 2 == 0
        row = np.int32(-1)
        for i in range(high - low):
            j = low + i if forward else high - 1 - i
            p = points[j]
            if rows[j] != row:
                row = rows[j]
                c_x = stencils[level, row, 0]
                c_y = stencils[level, row, 1]
                c_d = stencils[level, row, 2]
                c_xx = stencils[level, row, 3]
                c_yy = stencils[level, row, 4]
            bits = usable[j]
            if bits & _ALL == _ALL:
                north, south = p - up, p + up
                around = (
                    c_y * (flat[north] + flat[south])
                    - c_xx * (flat[p - side2] + flat[p + side2])
                    - c_yy * (flat[p - up2] + flat[p + up2])
                    - c_d
                    * (
                        (flat[north - side] + flat[north + side])
                        + (flat[south - side] + flat[south + side])
                    )
                    + keep * flat[p]
                )
                # The neighbour just relaxed is still at hand: waiting for memory to give it back
                # would double the time of a sweep.
                behind, ahead = (p - side, p + side) if forward else (p + side, p - side)
                around += c_x * flat[ahead]
                latest = around + c_x * (latest if behind == latest_p else flat[behind])
            else:
                best = _least_energy(flat, bits, p, side, up, c_x, c_y, c_d, c_xx, c_yy)
                latest = keep * flat[p] + omega * best
            flat[p] = latest
            latest_p = p


@numba.njit(**_JIT)
def _least_energy(flat, bits, p, side, up, c_x, c_y, c_d, c_xx, c_yy):
    """Give the value of least energy where some neighbours may not be used."""
    b_x, b_y, b_d = c_xx, c_yy, c_d
    t_x, t_y = c_x - 4 * b_x - 2 * b_d, c_y - 4 * b_y - 2 * b_d
    west, east = bits & _WEST, bits & _EAST
    north, south = bits & _NORTH, bits & _SOUTH
    total, weight = 0.0, 0.0
    if west:
        z = flat[p - side]
        total += t_x * z
        weight += t_x
        if bits & _WEST2:
            total += b_x * (2 * z - flat[p - side - side])
            weight += b_x
        if east:
            total += 2 * b_x * (z + flat[p + side])
            weight += 4 * b_x
        if north and bits & _NORTHWEST:
            total += b_d * (z + flat[p - up] - flat[p - up - side])
            weight += b_d
        if south and bits & _SOUTHWEST:
            total += b_d * (z + flat[p + up] - flat[p + up - side])
            weight += b_d
    if east:
        z = flat[p + side]
        total += t_x * z
        weight += t_x
        if bits & _EAST2:
            total += b_x * (2 * z - flat[p + side + side])
            weight += b_x
        if north and bits & _NORTHEAST:
            total += b_d * (z + flat[p - up] - flat[p - up + side])
            weight += b_d
        if south and bits & _SOUTHEAST:
            total += b_d * (z + flat[p + up] - flat[p + up + side])
            weight += b_d
    if north:
        z = flat[p - up]
        total += t_y * z
        weight += t_y
        if bits & _NORTH2:
            total += b_y * (2 * z - flat[p - up - up])
            weight += b_y
        if south:
            total += 2 * b_y * (z + flat[p + up])
            weight += 4 * b_y
    if south:
        z = flat[p + up]
        total += t_y * z
        weight += t_y
        if bits & _SOUTH2:
            total += b_y * (2 * z - flat[p + up + up])
            weight += b_y
    return total / weight if weight > 0 else flat[p]
