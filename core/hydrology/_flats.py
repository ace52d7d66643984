"""Kernels that give the cells of flats an order in which water leaves them.

A flat is a set of neighbouring cells without a lower neighbour; they have one elevation, and none
of them is an outlet, so all eight neighbours are on the raster and known. Most arrays here have
one dimension, and a neighbour is a step in them.

While a flat is worked on, its cells hold negative numbers: `_FLAT` or `_LATER`, then `_SEEN`
less two bits, then `_AWAY` less a distance and a bit.
"""

import numba
import numpy as np

from demsmith.core.hydrology._rows import pad_row

_JIT = dict(nogil=True, cache=True, error_model="numpy")

# To be worked on; or by whoever works on more than a strip.
_FLAT, _LATER = -1, -2
# Less 1 beside a cell of this elevation that drains, less 2 beside a higher one.
_SEEN = -3
_LOW, _HIGH = 1, 2
# Less 2 * (distance from higher ground), less 1 beside a cell that drains.
_AWAY = -8

_ALL = 1 << 62


@numba.njit(**_JIT)
def mark_flats(z, void, first, last, flat):
    """Write `_FLAT` where no neighbour is lower and water cannot leave the raster, else 0."""
    width = z.shape[1]
    low = -z.dtype.type(np.inf)
    north, here, south = (
        np.empty(width + 2, z.dtype), np.empty(width + 2, z.dtype), np.empty(width + 2, z.dtype)
    )  # fmt: skip
    pad_row(z, void, first - 1, low, north)
    pad_row(z, void, first, low, here)
    for row in range(first, last):
        pad_row(z, void, row + 1, low, south)
        _mark_row(north, here, south, flat[row])
        north, here, south = here, south, north


@numba.njit(**_JIT)
def _mark_row(north, here, south, flat):
    for k in range(flat.size):
        j = k + 1
        lowest = min(min(north[j - 1], north[j]), min(north[j + 1], here[j - 1]))
        lowest = min(lowest, min(min(here[j + 1], south[j - 1]), min(south[j], south[j + 1])))
        is_flat = (here[j] <= lowest) & (here[j] != -np.inf)
        flat[k] = np.int32(_FLAT) if is_flat else np.int32(0)


@numba.njit(**_JIT)
def order_within(z, flat, width, begin, end):
    """Order the flats of a strip, the cells ``begin`` to ``end``; those that may leave it later.

    Returns the number of cells that are left.
    """
    queue = np.empty(end - begin, np.uint32)
    work = np.empty(WORK, np.int64)
    left = 0
    for cell in range(begin, end):
        if flat[cell] == _FLAT and (cell < begin + width or cell >= end - width):
            flat[cell] = _LATER
            left += 1
    for cell in range(begin + width, end - width):
        if flat[cell] != _FLAT:
            continue
        start(cell, flat, queue, work)
        _flood(z, flat, width, queue, work, _ALL)
        if work[_LEAVES]:
            for k in range(work[_TAIL]):
                flat[queue[k]] = _LATER
            left += work[_TAIL]
        else:
            go_on(z, flat, width, queue, work, _ALL)
    return left


# Where in the memory of work on one flat what is kept: the stage; the code of the cells that may
# belong to it; whether it touches others that are for later; the ends of the queue; the end of
# those in it that are as far as its beginning, and how far that is; and how far the farthest cell
# is from higher ground.
_STAGE, _UNSEEN, _LEAVES, _HEAD, _TAIL, _TURN, _DISTANCE, _FARTHEST = range(8)
WORK = 8
_FLOOD, _RISE, _FALL, _DONE = range(4)


@numba.njit(**_JIT)
def find_left(flat, begin, end):
    """Give the first cell between ``begin`` and ``end`` of a flat to be worked on; or ``end``."""
    for cell in range(begin, end):
        if flat[cell] < 0:
            return cell
    return end


@numba.njit(**_JIT)
def start(cell, flat, queue, work):
    """Begin to work on the flat of a cell."""
    work[:] = 0
    work[_UNSEEN] = flat[cell]
    work[_TAIL] = 1
    queue[0] = cell
    flat[cell] = _SEEN


@numba.njit(**_JIT)
def go_on(z, flat, width, queue, work, budget):
    """Work on a flat, on about so many cells; tell whether it is done.

    See `resolve_flats` for what is written.
    """
    if work[_STAGE] == _FLOOD:
        budget = _flood(z, flat, width, queue, work, budget)
        if budget > 0:
            _turn_from_high(flat, queue, work)
    if work[_STAGE] == _RISE:
        budget = _go_away(flat, width, queue, work, budget)
        if budget > 0:
            _turn_to_low(flat, queue, work)
    if work[_STAGE] == _FALL:
        budget = _go_towards(flat, width, queue, work, budget)
        if budget > 0:
            work[_STAGE] = _DONE
    return work[_STAGE] == _DONE


@numba.njit(**_JIT)
def _steps(width):
    return (1, width + 1, width, width - 1, -1, -width - 1, -width, -width + 1)


@numba.njit(**_JIT)
def _flood(z, flat, width, queue, work, budget):
    """Collect the cells of a flat, and note what they lie beside; give what is left to spend."""
    head, tail, unseen = work[_HEAD], work[_TAIL], work[_UNSEEN]
    steps = _steps(width)
    while head < tail and budget > 0:
        cell = np.int64(queue[head])
        head += 1
        budget -= 1
        beside = 0
        for k in range(8):
            other = cell + steps[k]
            if flat[other] == unseen:
                flat[other] = _SEEN
                queue[tail] = other
                tail += 1
            elif flat[other] == 0:
                beside |= _LOW if z[other] == z[cell] else _HIGH
            elif flat[other] == _LATER:
                work[_LEAVES] = 1
        flat[cell] = _SEEN - beside
    work[_HEAD], work[_TAIL] = head, tail
    return budget


@numba.njit(**_JIT)
def _turn_from_high(flat, queue, work):
    """Put the cells beside higher ground first in the queue, at distance 1 from it."""
    count = 0
    for k in range(work[_TAIL]):
        cell = queue[k]
        if (_SEEN - flat[cell]) & _HIGH:
            queue[k], queue[count] = queue[count], cell
            count += 1
    if count == 0:  # an island of level ground: all is at one distance
        count = work[_TAIL]
    for k in range(count):
        cell = queue[k]
        flat[cell] = _AWAY - 2 - ((_SEEN - flat[cell]) & _LOW)
    work[_STAGE], work[_HEAD], work[_TAIL] = _RISE, 0, count
    work[_TURN], work[_DISTANCE] = count, 1


@numba.njit(**_JIT)
def _go_away(flat, width, queue, work, budget):
    """Write the distance from higher ground; give what is left to spend."""
    head, tail, turn, distance = work[_HEAD], work[_TAIL], work[_TURN], work[_DISTANCE]
    steps = _steps(width)
    while head < tail and budget > 0:
        if head == turn:
            distance += 1
            turn = tail
        cell = np.int64(queue[head])
        head += 1
        budget -= 1
        for k in range(8):
            other = cell + steps[k]
            if _AWAY < flat[other] <= _SEEN:
                flat[other] = _AWAY - 2 * (distance + 1) - ((_SEEN - flat[other]) & _LOW)
                queue[tail] = other
                tail += 1
    work[_HEAD], work[_TAIL], work[_TURN], work[_DISTANCE] = head, tail, turn, distance
    return budget


@numba.njit(**_JIT)
def _turn_to_low(flat, queue, work):
    """Put the cells beside those that drain first in the queue, at distance 1 from them."""
    farthest, count = work[_DISTANCE], 0
    for k in range(work[_TAIL]):
        cell = queue[k]
        if (_AWAY - flat[cell]) & _LOW:
            queue[k], queue[count] = queue[count], cell
            count += 1
    if count == 0:
        for k in range(work[_TAIL]):
            flat[queue[k]] = 0
    for k in range(count):
        flat[queue[k]] = 2 + farthest - (_AWAY - flat[queue[k]]) // 2
    work[_STAGE], work[_HEAD], work[_TAIL] = _FALL, 0, count
    work[_TURN], work[_DISTANCE], work[_FARTHEST] = count, 1, farthest


@numba.njit(**_JIT)
def _go_towards(flat, width, queue, work, budget):
    """Write the order in which water leaves; give what is left to spend."""
    head, tail, turn, distance = work[_HEAD], work[_TAIL], work[_TURN], work[_DISTANCE]
    farthest = work[_FARTHEST]
    steps = _steps(width)
    while head < tail and budget > 0:
        if head == turn:
            distance += 1
            turn = tail
        cell = np.int64(queue[head])
        head += 1
        budget -= 1
        for k in range(8):
            other = cell + steps[k]
            if flat[other] < 0:
                away = (_AWAY - flat[other]) // 2
                flat[other] = 2 * (distance + 1) + farthest - away
                queue[tail] = other
                tail += 1
    work[_HEAD], work[_TAIL], work[_TURN], work[_DISTANCE] = head, tail, turn, distance
    return budget


@numba.njit(**_JIT)
def narrow(flat, begin, end, narrowed):
    """Copy cells to an array of a smaller type."""
    for cell in range(begin, end):
        narrowed[cell] = flat[cell]


@numba.njit(**_JIT)
def largest(flat, begin, end):
    """Give the largest number of some cells."""
    most = 0
    for cell in range(begin, end):
        most = max(most, flat[cell])
    return most
