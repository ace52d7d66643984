"""Kernel that sums the sun's light on cells over instants of one sector of azimuths.

All that depends on a cell and not on the instant is a vector in the earth-fixed frame, so that one
scalar product with the sun's direction tells the rest: the sine of its altitude (with up), the
cosine of its incidence (with the normal), on which side of a sector's edge it stands, and whether
it is above the terrain. Between both edges' horizons that last one takes the tangent linearly along
the chord, which is exact for the horizon of a plane.

Cells are worked on in patches, between four nodes of a lattice, by runs of a row. In a patch what
the air lets through is, at the lowest and the highest sun there, a cubic in the elevation, and
linear in between. So the innermost loop has neither tables nor branches, and the compiler can make
vectors of it.
"""

import math

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")

_F = np.float32
_ZERO, _HALF, _ONE = _F(0), _F(0.5), _F(1)
_HALF_PI, _PI = _F(math.pi / 2), _F(math.pi)
_LEAST = _F(1e-6)  # sine of the altitude below which there is no sun
# Muneer 1990, "Solar radiation model for Europe", as in Hofierka and Šúri 2002, equations 24 to 31.
_N0, _N1, _N2 = _F(0.00263), _F(0.712), _F(0.6883)
_N_SHADE = _F(0.252271)
_LOW_SUN = _F(math.sin(0.1))
_LOW0, _LOW1 = _F(0.1), _F(0.008)
_SIXTH = _F(1 / 6)
# Arc tangent within 1e-5 (Abramowitz and Stegun 4.4.47).
_A1, _A3, _A5, _A7, _A9 = (
    _F(0.9998660), _F(-0.3302995), _F(0.1801410), _F(-0.0851330), _F(0.0208351),
)  # fmt: skip

LONGEST = 64
"""Most cells of a patch along a row, but for the last cell of the raster."""

# A run's buffer: rows of so many cells, of which there are these.
_ROW = LONGEST + 16
_UP, _NORMAL, _CLEAR, _AFTER, _BEFORE = 0, 3 * _ROW, 6 * _ROW, 9 * _ROW, 12 * _ROW
_COSINE, _SKY, _BEND, _BACK, _HEIGHT = 15 * _ROW, 16 * _ROW, 17 * _ROW, 18 * _ROW, 19 * _ROW
_BUFFER = 20 * _ROW
_Y, _Z = _ROW, 2 * _ROW  # from the x of a vector to its others
# Another, of what is given of its cells: what is read and what is written are two arrays each, so
# that the compiler sees them apart.
_ELEVATION, _EAST, _NORTH, _TANGENT_A, _TANGENT_B, _VIEW = (n * _ROW for n in range(6))
_GIVEN = 6 * _ROW


@numba.njit(**_JIT)
def add_light(
    patch_rows, ranges, z, slope_east, slope_north, horizon_a, horizon_b, sky_view, nodes,
    row_nodes, column_nodes, edges, shaded, sun, light, hours, parallax, beam_table,
    diffuse_table, lowest, per_level, albedo, muneer, beam, diffuse, reflected, sunny,
):  # fmt: skip
    """Add the light of some instants to the cells of some rows of patches.

    Parameters
    ----------
    patch_rows : (int, int)
        First, and one past the last.
    ranges : (R - 1, C - 1, 2) float32 array
        Lowest and highest elevation of each patch; the lowest is the higher one if all are voids.
    z, slope_east, slope_north : (H, W) float32 arrays
        Elevation [m] and gradient; NaN slopes in voids.
    horizon_a, horizon_b : (H, W) float32 arrays
        Tangents of the horizon at both edges, the same twice if there is but one; read only if
        ``shaded``.
    sky_view : (H, W) float32 array
        Share of the sky of the bare slope that the terrain leaves; of shape (1, 1) if it is 1
        everywhere.
    nodes : (R, C, 3, 3) float64 array
        Frames of the lattice's nodes.
    row_nodes, column_nodes : (R,), (C,) int64 arrays
        Where the nodes are; at most `LONGEST` apart.
    edges : (2, 2) float64 array
        East and north of the sector's edges; the same twice: it has but one horizon, and takes
        all of the instants.
    shaded : bool
    sun : (M, 3) float64 array
    light, hours : (M,) float32 arrays
        What an instant's sun gives to a plane facing it above the atmosphere, and what it counts.
    parallax : float32
    beam_table, diffuse_table : (S, L) float32 arrays
        As of `SkyTable`.
    lowest, per_level : float
        Of the tables' elevations.
    albedo : float32
    muneer : bool
    beam, diffuse, reflected, sunny : (H, W) float32 arrays
        Added to.
    """
    height, width = z.shape
    given = np.zeros(_GIVEN, np.float32)
    given[_VIEW:] = _ONE
    buffer = np.empty(_BUFFER, np.float32)
    sums = np.empty(4 * _ROW, np.float32)
    frame, frame_step = np.empty((3, 3), np.float32), np.empty((3, 3), np.float32)
    part = edges[0, 0] != edges[1, 0] or edges[0, 1] != edges[1, 1]
    wanted = np.empty(sun.shape[0], np.int64)
    mixed = np.empty(sun.shape[0], np.bool_)
    low_high = np.empty((sun.shape[0], 2))
    air = np.empty((sun.shape[0], 18), np.float32)
    for i in range(patch_rows[0], patch_rows[1]):
        below = min(i + 1, row_nodes.size - 1)
        stop = height if below == row_nodes.size - 1 else row_nodes[below]
        down = max(row_nodes[below] - row_nodes[i], 1)
        for j in range(max(column_nodes.size - 1, 1)):
            right = min(j + 1, column_nodes.size - 1)
            start = column_nodes[j]
            end = width if right == column_nodes.size - 1 else column_nodes[right]
            across = max(column_nodes[right] - start, 1)
            run = end - start
            corners = (nodes[i, j], nodes[i, right], nodes[below, j], nodes[below, right])
            count = _choose(corners, edges, part, sun, parallax, wanted, mixed, low_high)
            if count == 0:
                continue
            bottom, top = ranges[i, j]
            if bottom > top:
                continue
            middle, per_half = (bottom + top) / 2, 2 / max(top - bottom, _ONE)
            for k in range(count):
                _fit_air(
                    low_high[k], (middle - lowest) * per_level, per_level / per_half, beam_table,
                    diffuse_table, air[k],
                )  # fmt: skip
            for r in range(row_nodes[i], stop):
                _frame_of_row(corners, (r - row_nodes[i]) / down, across, frame, frame_step)
                _copy(z[r, start:end], given, _ELEVATION)
                _copy(slope_east[r, start:end], given, _EAST)
                _copy(slope_north[r, start:end], given, _NORTH)
                if shaded:
                    _copy(horizon_a[r, start:end], given, _TANGENT_A)
                    _copy(horizon_b[r, start:end], given, _TANGENT_B)
                if sky_view.size > 1:
                    _copy(sky_view[r, start:end], given, _VIEW)
                _describe(run, given, middle, _F(per_half), albedo, buffer)
                for axis in range(3):
                    _orient(run, frame, frame_step, axis, given, buffer)
                    _set_apart(run, frame, frame_step, axis, edges, part, given, buffer)
                sums[:] = _ZERO
                for k in range(count):
                    m = wanted[k]
                    _light_run(
                        run, buffer, _F(sun[m, 0]), _F(sun[m, 1]), _F(sun[m, 2]), light[m],
                        hours[m], parallax, mixed[k], air[k], muneer, sums,
                    )  # fmt: skip
                for c in range(run):
                    beam[r, start + c] += sums[c]
                    diffuse[r, start + c] += sums[_ROW + c]
                    reflected[r, start + c] += sums[2 * _ROW + c]
                    sunny[r, start + c] += sums[3 * _ROW + c]


@numba.njit(**_JIT)
def _choose(corners, edges, part, sun, parallax, wanted, mixed, low_high):
    """List the instants of which the sun is up and in the sector somewhere in a patch.

    Between the corners all is linear: what holds at the four holds everywhere in between.
    """
    count = 0
    for m in range(sun.shape[0]):
        low, high, after, before = 1.0, 0.0, 0, 0
        for n in range(4):
            frame = corners[n]
            east = frame[0, 0] * sun[m, 0] + frame[0, 1] * sun[m, 1] + frame[0, 2] * sun[m, 2]
            north = frame[1, 0] * sun[m, 0] + frame[1, 1] * sun[m, 1] + frame[1, 2] * sun[m, 2]
            up = frame[2, 0] * sun[m, 0] + frame[2, 1] * sun[m, 1] + frame[2, 2] * sun[m, 2]
            low, high = min(low, up - parallax), max(high, up - parallax)
            # The margin is for what the cells' single precision makes of it.
            a = east * edges[0, 1] - north * edges[0, 0]
            b = east * edges[1, 1] - north * edges[1, 0]
            after += (a > 1e-6) - (a < -1e-6)
            before += (b < -1e-6) - (b > 1e-6)
        if high > 0 and (not part or (after > -4 and before > -4)):
            wanted[count] = m
            mixed[count] = part and not (after == 4 and before == 4)
            low_high[count, 0], low_high[count, 1] = max(low, 0.0), high
            count += 1
    return count


@numba.njit(**_JIT)
def _fit_air(low_high, middle, half, beam_table, diffuse_table, out):
    """Write the first sine, one by their distance, and four cubics: beam and its change, diffuse.

    middle, half : of the patch's elevations, in levels of the tables.
    """
    out[0] = low_high[0]
    out[1] = 1 / max(low_high[1] - low_high[0], 1e-9)
    values = np.empty(4)
    for end in range(2):
        for quantity in range(2):
            table = diffuse_table if quantity else beam_table
            for n in range(4):
                at = middle + half * (2 * n - 3) / 3
                values[n] = _interpolated(table, low_high[end], at)
            # The cubic through its values at -1, -1/3, 1/3 and 1.
            outer, inner = (values[0] + values[3]) / 2, (values[1] + values[2]) / 2
            outward, inward = (values[3] - values[0]) / 2, (values[2] - values[1]) / 2
            first = 2 + 8 * quantity + 4 * end
            out[first] = (9 * inner - outer) / 8
            out[first + 1] = (27 * inward - outward) / 8
            out[first + 2] = 9 * (outer - inner) / 8
            out[first + 3] = 9 * (outward - 3 * inward) / 8
    for quantity in range(2):
        first = 2 + 8 * quantity
        for n in range(4):
            out[first + 4 + n] -= out[first + n]


@numba.njit(**_JIT)
def _interpolated(table, sine, level):
    """Read a table at a sine of the altitude and a level."""
    at = min(max(sine, 0.0), 1.0) * (table.shape[0] - 1)
    row = min(int(at), table.shape[0] - 2)
    f = at - row
    at = min(max(level, 0.0), table.shape[1] - 1.0)
    column = min(int(at), table.shape[1] - 2)
    g = at - column
    return (table[row, column] * (1 - g) + table[row, column + 1] * g) * (1 - f) + (
        table[row + 1, column] * (1 - g) + table[row + 1, column + 1] * g
    ) * f


@numba.njit(**_JIT)
def _frame_of_row(corners, down, across, first, step):
    """Write the frame of the first cell of a run, and its change from cell to cell."""
    for n in range(3):
        for axis in range(3):
            left = corners[0][n, axis] * (1 - down) + corners[2][n, axis] * down
            right = corners[1][n, axis] * (1 - down) + corners[3][n, axis] * down
            first[n, axis] = left
            step[n, axis] = (right - left) / across


@numba.njit(**_JIT)
def _copy(cells, given, row):
    for c in range(cells.size):
        given[row + c] = cells[c]


@numba.njit(**_JIT)
def _describe(run, given, middle, per_half, albedo, out):
    """Write what the sky and the ground around give to each cell of a run, and its elevation."""
    for c in range(run):
        p, q = given[_EAST + c], given[_NORTH + c]
        squared = p * p + q * q
        steep = np.sqrt(squared)
        cosine = _ONE / np.sqrt(_ONE + squared)
        less = steep if steep <= _ONE else _ONE / steep
        x = less * less
        angle = less * (_A1 + x * (_A3 + x * (_A5 + x * (_A7 + x * _A9))))
        angle = angle if steep <= _ONE else _HALF_PI - angle
        view = given[_VIEW + c]
        sky = (_ONE + cosine) * _HALF * view
        bend = (steep * cosine - angle * cosine) - _HALF_PI * (_ONE - cosine)
        out[_COSINE + c] = cosine
        out[_SKY + c] = sky
        out[_BEND + c] = bend * view
        out[_BACK + c] = albedo * (_ONE - cosine) * _HALF
        out[_HEIGHT + c] = (given[_ELEVATION + c] - middle) * per_half


@numba.njit(**_JIT)
def _orient(run, first, step, axis, given, out):
    """Write one axis of the vectors of a run's cells: up and the normal."""
    e0, n0, u0 = first[0, axis], first[1, axis], first[2, axis]
    e1, n1, u1 = step[0, axis], step[1, axis], step[2, axis]
    up, normal = out[_UP + axis * _ROW :], out[_NORMAL + axis * _ROW :]
    cosine = out[_COSINE:]
    for c in range(run):
        along = _F(np.int32(c))
        e, n, u = e0 + e1 * along, n0 + n1 * along, u0 + u1 * along
        up[c] = u
        normal[c] = (u - given[_EAST + c] * e - given[_NORTH + c] * n) * cosine[c]


@numba.njit(**_JIT)
def _set_apart(run, first, step, axis, edges, part, given, out):
    """Write one axis of the vectors that tell what is clear of terrain and in the sector."""
    e0, n0, u0 = first[0, axis], first[1, axis], first[2, axis]
    e1, n1, u1 = step[0, axis], step[1, axis], step[2, axis]
    a_east, a_north = _F(edges[0, 0]), _F(edges[0, 1])
    b_east, b_north = _F(edges[1, 0]), _F(edges[1, 1])
    clear = out[_CLEAR + axis * _ROW :]
    after, before = out[_AFTER + axis * _ROW :], out[_BEFORE + axis * _ROW :]
    if not part:
        for c in range(run):
            along = _F(np.int32(c))
            toward = (e0 + e1 * along) * a_east + (n0 + n1 * along) * a_north
            clear[c] = u0 + u1 * along - given[_TANGENT_A + c] * toward
        return
    per_cross = _F(1 / (edges[0, 1] * edges[1, 0] - edges[0, 0] * edges[1, 1]))
    for c in range(run):
        along = _F(np.int32(c))
        e, n = e0 + e1 * along, n0 + n1 * along
        # The gradient of the plane through both edges' horizons.
        a, b = given[_TANGENT_A + c] * per_cross, given[_TANGENT_B + c] * per_cross
        p, q = b * a_north - a * b_north, a * b_east - b * a_east
        clear[c] = u0 + u1 * along - p * e - q * n
        after[c] = e * a_north - n * a_east
        before[c] = e * b_north - n * b_east


@numba.njit(**_JIT)
def _light_run(run, cell, x, y, z, light, hour, parallax, mixed, air, muneer, sums):
    """Add the light of one instant to the cells of a run."""
    first, per = air[0], air[1]
    b0, b1, b2, b3, b4, b5, b6, b7 = air[2], air[3], air[4], air[5], air[6], air[7], air[8], air[9]
    d0, d1, d2, d3, d4, d5, d6, d7 = (
        air[10], air[11], air[12], air[13], air[14], air[15], air[16], air[17],
    )  # fmt: skip
    for c in range(run):
        sine = cell[_UP + c] * x + cell[_UP + _Y + c] * y + cell[_UP + _Z + c] * z - parallax
        facing = cell[_NORMAL + c] * x + cell[_NORMAL + _Y + c] * y + cell[_NORMAL + _Z + c] * z
        clear = (
            cell[_CLEAR + c] * x + cell[_CLEAR + _Y + c] * y + cell[_CLEAR + _Z + c] * z - parallax
        )
        counts = sine > _LEAST
        if mixed:
            after = cell[_AFTER + c] * x + cell[_AFTER + _Y + c] * y + cell[_AFTER + _Z + c] * z
            before = cell[_BEFORE + c] * x + cell[_BEFORE + _Y + c] * y + cell[_BEFORE + _Z + c] * z
            counts = counts & (after >= _ZERO) & (before < _ZERO)
        lit = counts & (facing > _ZERO) & (clear >= _ZERO)
        sine = sine if counts else _LEAST
        share = (sine - first) * per
        h = cell[_HEIGHT + c]
        through = (b0 + h * (b1 + h * (b2 + h * b3))) + share * (b4 + h * (b5 + h * (b6 + h * b7)))
        scattered = (d0 + h * (d1 + h * (d2 + h * d3))) + share * (
            d4 + h * (d5 + h * (d6 + h * d7))
        )
        direct = through if lit else _ZERO
        sky = cell[_SKY + c]
        if muneer:
            bend = cell[_BEND + c]
            angle = sine + sine * sine * sine * _SIXTH
            toward = (facing - cell[_COSINE + c] * sine) / np.sqrt(_ONE - sine * sine)
            around = facing / sine if sine >= _LOW_SUN else toward / (_LOW0 - _LOW1 * angle)
            even = (_N0 - through * (_N1 + _N2 * through)) * bend + sky
            bright = even * (_ONE - through) + through * around
            bright = bright if bright > _ZERO else _ZERO
            sky = bright if lit else sky + _N_SHADE * bend
        weight = light if counts else _ZERO
        sums[c] += weight * direct * facing
        sums[_ROW + c] += weight * scattered * sky
        sums[2 * _ROW + c] += weight * (scattered + direct * sine) * cell[_BACK + c]
        sums[3 * _ROW + c] += hour if lit else _ZERO
