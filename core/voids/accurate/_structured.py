"""The structured surface of one void: bending that follows the ridges and valleys around it."""

import numba
import numpy as np

from demsmith.core.voids.accurate._banded import bandwidth, solve_band
from demsmith.core.voids.accurate._locality import BLANK, GHOST, KNOWN, box_around, number_cells

# Weight of the void's own cells, which are only estimates, beside known ones in a structure tensor.
_ESTIMATE = 0.3
# The larger eigenvalue of the metric over the smaller is at most the square of this.
_STRONGEST = 4.0

# A cell's equation has cells up to so many rows above it and so many columns to either side.
_REACH = 3
_ACROSS = 2 * _REACH + 1
_SLOTS = (_REACH + 1) * _ACROSS


@numba.njit(nogil=True, cache=True, error_model="numpy")
def solve_structured(z, state, spread, strength, tension, stiffness, dx, dy):
    """Replace the estimates of a void's cells by the surface of least structured energy.

    z : (h, w) float64, known elevations and first estimates; changed in place.
    state : (h, w) uint8, see `_locality`.
    spread : cells over which structure is averaged.
    strength : exponent of the metric; 0: the same in all directions.
    tension, stiffness : lengths in rows.
    """
    number, stencil, right = equations(z, state, spread, strength, tension, stiffness, dx, dy)
    band = _as_band(stencil, number, max(bandwidth(number, 3, 2), bandwidth(number, 2, 3)))
    if not solve_band(band, right):
        return False
    high, wide = z.shape
    for r in range(high):
        for c in range(wide):
            if number[r, c] >= 0:
                z[r, c] = right[number[r, c]]
    return True


@numba.njit(nogil=True, cache=True, error_model="numpy")
def equations(z, state, spread, strength, tension, stiffness, dx, dy):
    """Give the linear equations of the surface; arguments as of `solve_structured`.

    number : (h, w) int64, see `number_cells`.
    stencil : (n, 28), half of the symmetric matrix: element (i, j) in the slot of where cell j lies
        seen from cell i, see `_slot`; of two cells, the upper or left one is j.
    right : (n,), the right-hand side.
    """
    number = np.empty(z.shape, np.int64)
    count = number_cells(state, number)
    box = box_around(number, 2)
    metric = _metric(z, state, box, spread, strength, dx, dy)
    stencil = np.zeros((count, _SLOTS))
    right = np.zeros(count)
    _assemble(z, state, number, box, metric, tension, stiffness, dy / dx, stencil, right)
    return number, stencil, right


@numba.njit(nogil=True, cache=True, error_model="numpy")
def as_elements(stencil, number):
    """List row, column and value of the elements of both halves of the matrix."""
    size = 2 * np.count_nonzero(stencil) - stencil.shape[0]
    rows, columns = np.empty(size, np.int32), np.empty(size, np.int32)
    values = np.empty(size)
    k = 0
    high, wide = number.shape
    for r in range(high):
        for c in range(wide):
            i = number[r, c]
            if i < 0:
                continue
            for slot in range(_SLOTS):
                value = stencil[i, slot]
                if value != 0:
                    j = number[r - slot // _ACROSS, c + slot % _ACROSS - _REACH]
                    rows[k], columns[k], values[k] = i, j, value
                    k += 1
                    if j != i:
                        rows[k], columns[k], values[k] = j, i, value
                        k += 1
    return rows[:k], columns[:k], values[:k]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _as_band(stencil, number, width):
    """Lay the matrix into a band as `_banded` keeps it."""
    band = np.zeros((stencil.shape[0], width + 1))
    high, wide = number.shape
    for r in range(high):
        for c in range(wide):
            i = number[r, c]
            if i < 0:
                continue
            for slot in range(_SLOTS):
                if stencil[i, slot] != 0:
                    j = number[r - slot // _ACROSS, c + slot % _ACROSS - _REACH]
                    band[max(i, j), width - abs(i - j)] = stencil[i, slot]
    return band


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _metric(z, state, box, spread, strength, dx, dy):
    """Give the metric (xx, yy, xy) of each cell of a box from the structure tensor around it.

    The tensor is the covariance of the gradient over a Gaussian neighbourhood; where gradients
    vary much in one direction, across ridges, bending that way costs little.
    """
    sums = _blurred(_gradient_moments(z, state, dx, dy), box, spread)
    top, _, left, _ = box
    metric = np.zeros((3, z.shape[0], z.shape[1]))
    for r in range(sums.shape[1]):
        for c in range(sums.shape[2]):
            total = max(sums[0, r, c], 1e-30)
            mx, my = sums[1, r, c] / total, sums[2, r, c] / total
            xx = sums[3, r, c] / total - mx * mx
            yy = sums[4, r, c] / total - my * my
            xy = sums[5, r, c] / total - mx * my
            mean, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
            ratio, cos, sin = 1.0, 1.0, 0.0
            if half > 1e-12:
                most, least = mean + half, max(mean - half, 1e-3 * (mean + half))
                ratio = min((most / least) ** (strength / 2), _STRONGEST)
                cos, sin = (xx - yy) / 2 / half, xy / half
            middle, swing = (ratio + 1 / ratio) / 2, (1 / ratio - ratio) / 2
            metric[0, top + r, left + c] = middle + swing * cos
            metric[1, top + r, left + c] = middle - swing * cos
            metric[2, top + r, left + c] = swing * sin
    return metric


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _gradient_moments(z, state, dx, dy):
    """Give each cell's weight, and by it the gradient's components and their products."""
    high, wide = z.shape
    moments = np.zeros((6, high, wide))
    for r in range(1, high - 1):
        for c in range(1, wide - 1):
            beside = max(
                max(state[r - 1, c], state[r + 1, c]), max(state[r, c - 1], state[r, c + 1])
            )
            if max(beside, state[r, c]) >= GHOST:
                continue
            weight = 1.0 if state[r, c] == KNOWN and beside == KNOWN else _ESTIMATE
            gx = (z[r, c + 1] - z[r, c - 1]) / (2 * dx)
            gy = (z[r + 1, c] - z[r - 1, c]) / (2 * dy)
            moments[0, r, c] = weight
            moments[1, r, c] = weight * gx
            moments[2, r, c] = weight * gy
            moments[3, r, c] = weight * gx * gx
            moments[4, r, c] = weight * gy * gy
            moments[5, r, c] = weight * gx * gy
    return moments


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _blurred(fields, box, spread):
    """Give fields within a box, blurred by a Gaussian cut at three spreads."""
    reach = int(np.ceil(3 * spread))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / spread) ** 2)
    count, high, wide = fields.shape
    top, bottom, left, right = box
    first, last = max(top - reach, 0), min(bottom + reach, high)
    rows = np.zeros((last - first, right - left))
    out = np.zeros((count, bottom - top, right - left))
    for k in range(count):
        for r in range(first, last):
            row = rows[r - first]
            row[:] = 0
            for x in range(max(left - reach, 0), min(right + reach, wide)):
                value = fields[k, r, x]
                if value != 0:
                    for c in range(max(x - reach, left), min(x + reach + 1, right)):
                        row[c - left] += kernel[x - c + reach] * value
        for r in range(top, bottom):
            for y in range(max(r - reach, first), min(r + reach + 1, last)):
                share = kernel[y - r + reach]
                for c in range(right - left):
                    out[k, r - top, c] += share * rows[y - first, c]
    return out


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _assemble(z, state, number, box, metric, tension, stiffness, aspect, stencil, right):
    """Sum the energy's squares over the cells near the void."""
    high, wide = z.shape
    top, bottom, left, right_end = box
    near = _near(number, box, 2)
    whole = np.zeros((high, wide), np.bool_)  # cells whose eight neighbours say something
    for r in range(max(top, 1), min(bottom, high - 1)):
        for c in range(max(left, 1), min(right_end, wide - 1)):
            if near[r, c]:
                whole[r, c] = True
                for y in range(r - 1, r + 2):
                    for x in range(c - 1, c + 2):
                        if state[y, x] == BLANK:
                            whole[r, c] = False
    numbers, elevations = np.empty(12, np.int64), np.empty(12)
    coefficients, other = np.empty(12), np.empty(12)
    pull = 1 / tension**2
    stiff = stiffness**2
    for r in range(top, bottom):
        for c in range(left, right_end):
            if not near[r, c] or state[r, c] == BLANK:
                continue
            if whole[r, c]:
                _gather(z, number, r - 1, c - 1, 3, 3, numbers, elevations)
                _operator(metric, r, c, aspect, 3, 0, 0, coefficients, 9)
                _add_square(stencil, right, numbers, elevations, coefficients, 3, 3, 1.0)
                if stiff > 0 and whole[r, c + 1]:
                    _gather(z, number, r - 1, c - 1, 3, 4, numbers, elevations)
                    _operator(metric, r, c, aspect, 4, 0, 0, other, 12)
                    _operator(metric, r, c + 1, aspect, 4, 0, 1, coefficients, 12)
                    coefficients -= other
                    weight = stiff * aspect**2
                    _add_square(stencil, right, numbers, elevations, coefficients, 3, 4, weight)
                if stiff > 0 and whole[r + 1, c]:
                    _gather(z, number, r - 1, c - 1, 4, 3, numbers, elevations)
                    _operator(metric, r, c, aspect, 3, 0, 0, other, 12)
                    _operator(metric, r + 1, c, aspect, 3, 1, 0, coefficients, 12)
                    coefficients -= other
                    _add_square(stencil, right, numbers, elevations, coefficients, 4, 3, stiff)
            else:
                coefficients[0], coefficients[1], coefficients[2] = 1.0, -2.0, 1.0
                if 0 < c < wide - 1 and state[r, c - 1] != BLANK and state[r, c + 1] != BLANK:
                    _gather(z, number, r, c - 1, 1, 3, numbers, elevations)
                    weight = (metric[0, r, c] * aspect**2) ** 2
                    _add_square(stencil, right, numbers, elevations, coefficients, 1, 3, weight)
                if 0 < r < high - 1 and state[r - 1, c] != BLANK and state[r + 1, c] != BLANK:
                    _gather(z, number, r - 1, c, 3, 1, numbers, elevations)
                    weight = metric[1, r, c] ** 2
                    _add_square(stencil, right, numbers, elevations, coefficients, 3, 1, weight)
            coefficients[0], coefficients[1] = -1.0, 1.0
            if c + 1 < wide and state[r, c + 1] != BLANK:
                _gather(z, number, r, c, 1, 2, numbers, elevations)
                weight = pull * aspect**2 * metric[0, r, c]
                _add_square(stencil, right, numbers, elevations, coefficients, 1, 2, weight)
            if r + 1 < high and state[r + 1, c] != BLANK:
                _gather(z, number, r, c, 2, 1, numbers, elevations)
                weight = pull * metric[1, r, c]
                _add_square(stencil, right, numbers, elevations, coefficients, 2, 1, weight)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _add_square(stencil, right, numbers, elevations, coefficients, high, wide, weight):
    """Add ``weight`` times the square of a sum over a block of cells to what is to be least.

    A cell with a number of at least 0 is unknown; the others bring their elevation.
    """
    count = high * wide
    known = 0.0
    for a in range(count):
        if numbers[a] < 0:
            known += coefficients[a] * elevations[a]
    for a in range(count):
        i = numbers[a]
        if i < 0:
            continue
        scaled = weight * coefficients[a]
        right[i] -= scaled * known
        for b in range(a + 1):
            if numbers[b] >= 0:
                stencil[i, _slot(a // wide - b // wide, b % wide - a % wide)] += (
                    scaled * coefficients[b]
                )


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _slot(up, right):
    """Give the place in an equation of the cell so many rows up and columns to the right."""
    return up * _ACROSS + right + _REACH


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _near(number, box, reach):
    """Mark the cells within so many cells of an unknown one; they lie in the box."""
    top, bottom, left, right = box
    near = np.zeros(number.shape, np.bool_)
    for r in range(top, bottom):
        for c in range(left, right):
            if number[r, c] >= 0:
                for y in range(max(r - reach, top), min(r + reach + 1, bottom)):
                    for x in range(max(c - reach, left), min(c + reach + 1, right)):
                        near[y, x] = True
    return near


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _gather(z, number, top, left, high, wide, numbers, elevations):
    k = 0
    for r in range(top, top + high):
        for c in range(left, left + wide):
            numbers[k] = number[r, c]
            elevations[k] = z[r, c]
            k += 1


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _operator(metric, r, c, aspect, wide, down, across, coefficients, count):
    """Lay the cell's second derivative under its metric into a block ``wide`` cells wide.

    The mixed derivative takes the diagonal of its sign, which keeps the operator's weights small.
    """
    xx = metric[0, r, c] * aspect * aspect
    yy = metric[1, r, c]
    xy = metric[2, r, c] * aspect
    rising, falling = max(xy, 0.0), max(-xy, 0.0)
    sides = rising + falling
    coefficients[:count] = 0
    middle = (1 + down) * wide + 1 + across
    coefficients[middle] = -2 * (xx + yy) + 2 * sides
    coefficients[middle - 1] = coefficients[middle + 1] = xx - sides
    coefficients[middle - wide] = coefficients[middle + wide] = yy - sides
    coefficients[middle - wide - 1] = coefficients[middle + wide + 1] = rising
    coefficients[middle - wide + 1] = coefficients[middle + wide - 1] = falling
