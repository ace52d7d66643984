"""Kernel that sweeps an elevation array for the horizon of its cells towards one azimuth.

Cells are dealt with in lanes, as many at once as make a strip, each operation for all of them
before the next one: that is what compilers turn into vector instructions. What is known of the
lanes stands in a single array at fixed places, for that they do not overlap must be plain to see.
"""

import numba
import numpy as np

from demsmith.core.solar.horizon import PAD

_JIT = dict(nogil=True, cache=True, error_model="numpy")

LANES = 64
"""Lines of a strip."""

# Of each lane: elevation and padded column of its cell, height of its line there; how rays run (as
# in `sweep`); steps to the line's last ground and to its tangent point; steps to the ground looked
# at and the part of a step beyond, its padded column, share of the right one of two cells there,
# and what both are high; and the best so far: slope and steps. The last is one step, for all.
(
    _HERE, _COLUMN, _HEIGHT, _ASIDE, _BEND, _METRES, _GROWTH, _LAST, _TANGENT, _STEPS, _PART,
    _PLACE, _SHARE, _LEFT, _RIGHT, _BEST, _FAR, _ONE_STEP, _FACTS,
) = (LANES * fact for fact in range(19))  # fmt: skip

_NAN = np.float32(np.nan)
_ZERO, _HALF, _ONE = np.float32(0), np.float32(0.5), np.float32(1)
_TENTH, _TINY = np.float32(0.1), np.float32(1e-4)


@numba.njit(**_JIT)
def sweep(begin, lean, z, backwards, along, across, slanting, sag, out, out_strides):
    """Write the horizon of the cells of one strip.

    Steps go away from the sun. On lines that lean as rays do, the tangent point of each step is
    the ground one step towards the sun, or its tangent point, or that one's, and so on (Dozier and
    Frew 1990). A cell lies between two lines. How high their tangent points stand is looked up on
    the cell's own ray, and so is the ground next to it.

    Parameters
    ----------
    begin : int
        The column of the strip's first line at the first step; it may lie beside the raster.
        Cells of the first and last line are left to the next strips.
    lean : (P,) float64 array
        By how many columns the lines have moved at each step.
    z : (P, Q + 2 PAD) float32 array
        Elevations, NaN in voids.
    backwards : bool
        Whether the last row is the one towards the sun.
    along, across : (4, P) and (4, Q) float32 arrays
        How a ray runs towards the sun from a cell, by step and by column: ``m`` steps on, it is
        ``m * aside * (1 + m * bend)`` columns to the right and ``m * metres * (1 + m * growth)``
        away on the ground. Factors for aside and metres, terms for bend and growth.
    slanting : bool
        Whether the ground between rows is looked at too.
    sag : float32
        Half the curvature of the earth [1/m].
    out : (P * Q,) float32 array
        At least 0; NaN in voids.
    out_strides : (int, int)
        Where the cell of a row and column stands in ``out``.
    """
    steps, padded = z.shape
    width = padded - 2 * PAD
    ground = z.reshape(-1)
    lanes = np.zeros(_FACTS, np.float32)
    lanes[_HEIGHT : _HEIGHT + LANES] = _NAN
    lanes[_ONE_STEP : _ONE_STEP + LANES] = _ONE
    spots = np.zeros(LANES, np.int32)
    heights = np.empty(steps * LANES, np.float32)
    tangents = np.zeros(steps * LANES, np.float32)
    toward = padded if backwards else -padded
    for p in range(steps):
        row = steps - 1 - p if backwards else p
        moved = int(np.rint(lean[p]))
        left = begin + moved
        first, last = max(0, -left), min(LANES, width - left)
        if first >= last:
            continue
        _enter(lanes, z[row], left, first, last, np.float32(lean[p] - moved))
        _set_course(lanes, along[:, p], across[:, left + first : left + last], first)
        if p:
            start = row * padded
            _find_tangents(lanes, spots, heights, tangents, sag, p)
            _look_next(lanes, z[row + (1 if backwards else -1)], first, last, sag)
            _look(lanes, _TANGENT, spots, ground, start, toward, padded, sag)
            _turn_to_next(lanes, -1 if lean[p] > moved else 1)
            _look(lanes, _STEPS, spots, ground, start, toward, padded, sag)
            _turn_between(lanes, np.float32(abs(lean[p] - moved)))
            _look(lanes, _STEPS, spots, ground, start, toward, padded, sag)
            if slanting:
                _look_between(lanes, -_ONE, spots, ground, start, toward, padded, sag, p)
                _look_between(lanes, _ZERO, spots, ground, start, toward, padded, sag, p)
        for n in range(LANES):
            heights[p * LANES + n] = lanes[_HEIGHT + n]
            tangents[p * LANES + n] = lanes[_TANGENT + n]
        corner = row * out_strides[0] + left * out_strides[1]
        _write(lanes, out, corner, out_strides[1], max(first, 1), min(last, LANES - 1))


@numba.njit(**_JIT)
def _enter(lanes, here, left, first, last, offset):
    """Take in the elevations of a row, and how high the lines are, so far off the cells."""
    for n in range(LANES):
        back = lanes[_LAST + n]
        back = back + _ONE if back > _ZERO else back
        lanes[_LAST + n] = back if np.isnan(lanes[_HEIGHT + n]) else _ONE
        lanes[_BEST + n] = -np.inf
        lanes[_FAR + n] = _ZERO
        lanes[_TANGENT + n] = _ZERO
        lanes[_HERE + n] = _NAN
        lanes[_HEIGHT + n] = _NAN
        lanes[_COLUMN + n] = np.float32(left + PAD) + np.float32(n)
    cells = here[left + PAD + first : left + PAD + last]
    beside = left + PAD + first + (1 if offset > 0 else -1)
    neighbours = here[beside : beside + last - first]
    elevations = lanes[_HERE + first : _HERE + last]
    heights = lanes[_HEIGHT + first : _HEIGHT + last]
    share = abs(offset)
    for k in range(last - first):
        elevations[k] = cells[k]
    for k in range(last - first):
        high = cells[k] + share * (neighbours[k] - cells[k])
        heights[k] = cells[k] if np.isnan(high) else high


@numba.njit(**_JIT)
def _set_course(lanes, along, across, first):
    """Write how the lanes' rays run."""
    count = across.shape[1]
    for fact, place in enumerate((_ASIDE, _BEND, _METRES, _GROWTH)):
        step = along[fact]
        columns = across[fact]
        places = lanes[place + first : place + first + count]
        if fact % 2:
            for k in range(count):
                places[k] = step + columns[k]
        else:
            for k in range(count):
                places[k] = step * columns[k]


@numba.njit(**_JIT)
def _find_tangents(lanes, spots, heights, tangents, sag, p):
    """Find the tangent points of the lines' own ground."""
    for n in range(LANES):
        lanes[_STEPS + n] = lanes[_LAST + n]
        lanes[_BEST + n] = -np.inf
    _compare_heights(lanes, spots, heights, sag, p)
    for _ in range(2):
        for n in range(LANES):
            spots[n] = (np.int32(p) - np.int32(lanes[_TANGENT + n])) * np.int32(LANES) + np.int32(n)
        for n in range(LANES):
            lanes[_STEPS + n] = lanes[_TANGENT + n] + tangents[np.uint64(spots[n])]
        _compare_heights(lanes, spots, heights, sag, p)
    for n in range(LANES):  # most have found theirs
        m, high, best = lanes[_TANGENT + n], lanes[_HEIGHT + n], lanes[_BEST + n]
        while m > _ZERO and m == lanes[_STEPS + n]:
            m += tangents[np.uint64((p - np.int64(m)) * LANES + n)]
            away = m * lanes[_METRES + n] * (_ONE + m * lanes[_GROWTH + n])
            slope = (heights[np.uint64((p - np.int64(m)) * LANES + n)] - high) / away - away * sag
            if not slope > best:
                break
            best = slope
            lanes[_TANGENT + n] = lanes[_STEPS + n] = m
    for n in range(LANES):
        lanes[_BEST + n] = -np.inf


@numba.njit(**_JIT)
def _compare_heights(lanes, spots, heights, sag, p):
    """Compare the line's ground so many steps on with the best that lanes know."""
    for n in range(LANES):
        spots[n] = (np.int32(p) - np.int32(lanes[_STEPS + n])) * np.int32(LANES) + np.int32(n)
    for n in range(LANES):
        lanes[_LEFT + n] = heights[np.uint64(spots[n])]
    for n in range(LANES):
        m = lanes[_STEPS + n]
        away = m * lanes[_METRES + n] * (_ONE + m * lanes[_GROWTH + n])
        slope = (lanes[_LEFT + n] - lanes[_HEIGHT + n]) / away - away * sag
        better = (slope > lanes[_BEST + n]) & (m > _ZERO)
        lanes[_TANGENT + n] = m if better else lanes[_TANGENT + n]
        lanes[_BEST + n] = slope if better else lanes[_BEST + n]


@numba.njit(**_JIT)
def _turn_to_next(lanes, side):
    """Turn to the tangent points of the lines on one side."""
    if side > 0:
        for n in range(LANES - 1):
            lanes[_STEPS + n] = lanes[_TANGENT + n + 1]
    else:
        for n in range(LANES - 1):
            lanes[_STEPS + n + 1] = lanes[_TANGENT + n]


@numba.njit(**_JIT)
def _turn_between(lanes, share):
    """Turn to between the tangent points of the two lines, as the cell lies between these.

    A crest nearly along the rays is met by each line at another step, and by the cell's own ray
    between them.
    """
    for n in range(LANES):
        own, next_one = lanes[_TANGENT + n], lanes[_STEPS + n]
        between = np.rint(own + share * (next_one - own))
        lanes[_STEPS + n] = between if (own > _ZERO) & (next_one > _ZERO) else own


@numba.njit(**_JIT)
def _look_next(lanes, row, first, last, sag):
    """Compare the ground one step on, in this row, with the best that lanes know."""
    _aim(lanes, _ONE_STEP, row.size)
    begin, stop = int(lanes[_PLACE + np.uint64(first)]), int(lanes[_PLACE + np.uint64(last - 1)])
    if stop - begin == last - first - 1:  # all lanes look equally far aside, as they mostly do
        near, right = row[begin : stop + 1], row[begin + 1 : stop + 2]
        x, y = lanes[_LEFT + first : _LEFT + last], lanes[_RIGHT + first : _RIGHT + last]
        for k in range(last - first):
            x[k] = near[k]
        for k in range(last - first):
            y[k] = right[k]
    else:
        for n in range(first, last):
            place = np.uint64(lanes[_PLACE + np.uint64(n)])
            lanes[_LEFT + np.uint64(n)] = row[place]
            lanes[_RIGHT + np.uint64(n)] = row[place + np.uint64(1)]
    _judge(lanes, _ONE_STEP, sag)


@numba.njit(**_JIT)
def _look(lanes, steps, spots, ground, start, toward, padded, sag):
    """Compare the ground so many steps on with the best that lanes know."""
    _aim(lanes, steps, padded)
    for n in range(LANES):
        spots[n] = np.int32(lanes[steps + n]) * np.int32(toward) + np.int32(lanes[_PLACE + n])
    for n in range(LANES):
        spot = np.uint64(start + spots[n])
        lanes[_LEFT + n] = ground[spot]
        lanes[_RIGHT + n] = ground[spot + np.uint64(1)]
    _judge(lanes, steps, sag)


@numba.njit(**_JIT)
def _aim(lanes, steps, padded):
    """Find where the rays are so many steps on."""
    end = np.float32(padded - 2)
    for n in range(LANES):
        m = lanes[steps + n]
        aside = m * lanes[_ASIDE + n] * (_ONE + m * lanes[_BEND + n])
        whole = np.floor(aside)
        lanes[_SHARE + n] = aside - whole
        place = lanes[_COLUMN + n] + whole
        place = place if place > _ZERO else _ZERO
        lanes[_PLACE + n] = place if place < end else end


@numba.njit(**_JIT)
def _judge(lanes, steps, sag):
    """Compare what the rays met with the best; 0 steps, where nothing is known, give NaN."""
    for n in range(LANES):
        m, x, share = lanes[steps + n], lanes[_LEFT + n], lanes[_SHARE + n]
        high = x if share == _ZERO else x + share * (lanes[_RIGHT + n] - x)  # that may be a void
        away = m * lanes[_METRES + n] * (_ONE + m * lanes[_GROWTH + n])
        slope = (high - lanes[_HERE + n]) / away - away * sag
        better = slope > lanes[_BEST + n]
        lanes[_FAR + n] = m if better else lanes[_FAR + n]
        lanes[_BEST + n] = slope if better else lanes[_BEST + n]


@numba.njit(**_JIT)
def _look_between(lanes, offset, spots, ground, start, toward, padded, sag, p):
    """Compare the ground between two rows, behind (offset 0) or before (-1) the best, with it.

    A ray bends upward most where it leaves one column for the next; and crossing cells from corner
    to corner it may touch ground that is higher than in both rows, if a ridge runs across it.
    """
    end, last = np.float32(padded - 2), np.float32(p)
    for n in range(LANES):
        near = lanes[_FAR + n] + offset
        aside = near * lanes[_ASIDE + n] * (_ONE + near * lanes[_BEND + n])
        then = (near + _ONE) * lanes[_ASIDE + n] * (_ONE + (near + _ONE) * lanes[_BEND + n])
        edge = np.floor(max(aside, then))
        part = (edge - aside) / (then - aside)
        part = part if _TENTH < part < _ONE - _TENTH else _HALF
        known = (near >= _ONE) & (near < last)
        near = near if known else _ONE
        lanes[_PART + n] = part if known else _NAN
        lanes[_STEPS + n] = near
        aside += part * (then - aside)
        # Seen from right of the edge or left of it, it is the same; rounding must not decide.
        whole = np.floor(aside + _TINY)
        share = aside - whole
        lanes[_SHARE + n] = share if share > _TINY else _ZERO
        place = lanes[_COLUMN + n] + whole
        place = place if place > _ZERO else _ZERO
        lanes[_PLACE + n] = place if place < end else end
    for n in range(LANES):
        spots[n] = np.int32(lanes[_STEPS + n]) * np.int32(toward) + np.int32(lanes[_PLACE + n])
    further = toward if p > 1 else 0
    for n in range(LANES):
        near, far = np.uint64(start + spots[n]), np.uint64(start + spots[n] + further)
        part = lanes[_PART + n]
        lanes[_LEFT + n] = ground[near] + part * (ground[far] - ground[near])
        x, y = ground[near + np.uint64(1)], ground[far + np.uint64(1)]
        lanes[_RIGHT + n] = x + part * (y - x)
    for n in range(LANES):
        lanes[_STEPS + n] += lanes[_PART + n]
        lanes[_PART + n] = lanes[_FAR + n]
    _judge(lanes, _STEPS, sag)
    for n in range(LANES):
        lanes[_FAR + n] = lanes[_PART + n]  # in whole steps


@numba.njit(**_JIT)
def _write(lanes, out, corner, stride, first, last):
    """Write the horizon that the lanes have found."""
    for n in range(first, last):
        slope = max(lanes[np.uint64(_BEST + n)], _ZERO)
        void = np.isnan(lanes[np.uint64(_HERE + n)])
        out[np.uint64(corner + n * stride)] = _NAN if void else slope
