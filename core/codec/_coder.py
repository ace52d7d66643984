"""Adaptive binary arithmetic coding: the kernels that turn decisions into bytes and back.

Every decision (a bit) is coded with a probability that encoder and decoder know alike, and both
learn from it afterwards. One function does both directions, so that they cannot drift apart: pass
``decoding`` and any bit, and go on with the bit that comes back.

A kernel that codes makes ``m = memory(coder, data, states, weights, opinions)`` of its arguments
and hands it on; these arrays must be arguments of the kernel, so that they outlive it
(`_memory` says why there are addresses at all). `workspace` allocates them.

- ``coder``: int64[4], the interval's ``low`` and ``high``, the decoder's ``code`` and the position
  in ``data``; begun by `start`, ended by `finish` when encoding.
- ``data``: uint8. The encoder writes there; a decision takes at most two bytes, and `finish` four.
  The decoder reads zeros past the end, so that cut data decode to nonsense, never beyond the array.
- ``states``: int32, each the probability of a one (21 bits) and how often it was met (the lowest
  10 bits). A new one is `FRESH`.
- ``weights``: float32 (sets, INPUTS), the trust of a set in each of the states that it mixes.
- ``opinions``: float32, room for as many as are mixed.

`code_mixed` weighs the opinions of several states in the logistic domain, with weights that learn
as well (M. Mahoney, *Adaptive weighing of context models for lossless data compression*, 2005).
Arithmetic is of integers, or of float32 in a fixed order: the same bytes on every machine.
"""

import math

import numba
import numpy as np

from demsmith.core.codec._memory import (
    read_f32,
    read_i32,
    read_i64,
    read_u8,
    write_f32,
    write_i32,
    write_i64,
    write_u8,
)

FRESH = np.int32(1 << 30)
"""State of even odds that was never met."""

BYTES_PER_DECISION = 2
"""Room in ``data`` that the encoder may need, besides 8 bytes to finish."""

_WHOLE = 1 << 32
_LIMIT = 500

INPUTS = 8
"""States that are mixed for a decision of `code_size`."""

PLACES = 256
"""States of one input for one decision of `code_size`."""

DECISIONS = 8
"""Decisions of `code_size` that have states of their own; later ones share the last's."""

LEVELS = 24
"""Sets of weights for each of them."""

SIZE_STATES = INPUTS * PLACES * DECISIONS
SIZE_WEIGHT_SETS = DECISIONS * LEVELS
DECISIONS_PER_SIZE = 24 + 66
"""Of one call of `code_size` at the worst."""

_STEPS_UP = 24  # before the rest is told by its length
_RATE = np.float32(0.007)

kernel = numba.njit(nogil=True, cache=True, error_model="numpy")
_inlined = numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)


def _stretching():
    """Logit of a probability given in 4096ths, by its integer part."""
    odds = [(i + 0.5) / 4096 for i in range(4096)]
    return np.array([math.log(p / (1 - p)) for p in odds], np.float32)


def _squashing():
    """Probability in 65536ths of a logit, by its 256ths, from −12 to 12."""
    logits = [(i - 3072 + 0.5) / 256 for i in range(6144)]
    chances = [65536 / (1 + math.exp(-x)) for x in logits]
    return np.array([min(max(round(p), 24), 65536 - 24) for p in chances], np.uint16)


def _slowing():
    """Share, in 65536ths, by which a state met n times moves towards the next bit."""
    return np.array([round(65536 / (n + 1.6)) for n in range(1024)], np.uint16)


_STRETCH, _SQUASH, _SLOW = _stretching(), _squashing(), _slowing()


@_inlined
def memory(coder, data, states, weights, opinions):
    """Give the addresses that the functions below work on."""
    return (
        coder.ctypes.data, data.ctypes.data, data.size, states.ctypes.data, weights.ctypes.data,
        weights.shape[1], opinions.ctypes.data,
    )  # fmt: skip


@_inlined
def start(m, decoding):
    """Begin at ``coder[3]``, the position in ``data``."""
    write_i64(m[0], 0, 0)
    write_i64(m[0], 1, _WHOLE - 1)
    write_i64(m[0], 2, 0)
    if decoding:
        for _ in range(4):
            _take_byte(m)


@_inlined
def finish(m):
    """Write what tells the last interval from all others; trailing zeros may be cut off."""
    low, high, position = read_i64(m[0], 0), read_i64(m[0], 1), read_i64(m[0], 3)
    # The number in [low, high] with the most trailing zeros, which are not written.
    top, shift = low, 24
    while shift > 0:
        rounded = ((low + (1 << shift) - 1) >> shift) << shift
        if rounded <= high:
            top = rounded
            break
        shift -= 8
    for k in range(4):
        write_u8(m[1], position + k, np.uint8((top >> (24 - 8 * k)) & 255))
    position += 4
    while position > 0 and read_u8(m[1], position - 1) == 0:
        position -= 1
    write_i64(m[0], 3, position)


@_inlined
def _take_byte(m):
    position = read_i64(m[0], 3)
    byte = np.int64(read_u8(m[1], position)) if position < m[2] else np.int64(0)
    write_i64(m[0], 2, ((read_i64(m[0], 2) << 8) & (_WHOLE - 1)) | byte)
    write_i64(m[0], 3, position + 1)


@_inlined
def _code(m, chance, bit, decoding):
    """Code a bit that is one with ``chance`` in 65536."""
    low, high = read_i64(m[0], 0), read_i64(m[0], 1)
    width = high - low
    middle = low + (width >> 16) * chance + (((width & 65535) * chance) >> 16)
    if decoding:
        bit = np.int64(1) if read_i64(m[0], 2) <= middle else np.int64(0)
    if bit:
        high = middle
    else:
        low = middle + 1
    while (low ^ high) & 0xFF000000 == 0:
        if decoding:
            _take_byte(m)
        else:
            position = read_i64(m[0], 3)
            write_u8(m[1], position, np.uint8(high >> 24))
            write_i64(m[0], 3, position + 1)
        low = (low << 8) & (_WHOLE - 1)
        high = ((high << 8) & (_WHOLE - 1)) | 255
    write_i64(m[0], 0, low)
    write_i64(m[0], 1, high)
    return bit


@_inlined
def _learn(m, at, bit):
    state = np.int64(read_i32(m[3], at))
    times = state & 1023
    chance = state >> 10
    chance += ((((1 << 21) - 1) * bit - chance) * np.int64(_SLOW[times])) >> 16
    write_i32(m[3], at, np.int32((chance << 10) | (times + (times < _LIMIT))))


@_inlined
def code_plain(m, value, count, decoding):
    """Code ``count`` bits of even odds of an integer, the highest first; give the integer."""
    out = np.int64(0)
    for k in range(count):
        out = 2 * out + _code(m, 32768, (value >> (count - 1 - k)) & 1, decoding)
    return out


@_inlined
def code_rest(m, rest, decoding):
    """Code a count that is rarely met: its length in bits, then its bits."""
    length = np.int64(0)
    while length < 31:
        longer = np.int64(1) if (rest + 1) >> (length + 1) else np.int64(0)
        if not code_plain(m, longer, 1, decoding):
            break
        length += 1
    return ((1 << length) | code_plain(m, (rest + 1) & ((1 << length) - 1), length, decoding)) - 1


@_inlined
def code_adaptive(m, at, bit, decoding):
    """Code a bit by the one state ``at``, which learns; give the bit."""
    chance = min(max(np.int64(read_i32(m[3], at)) >> 15, 32), 65536 - 32)
    bit = _code(m, chance, bit, decoding)
    _learn(m, at, bit)
    return bit


@_inlined
def code_mixed(m, at, count, row, rate, bit, decoding):
    """Code a bit by several states, weighed by the set ``row`` of weights; give the bit.

    ``at`` is the address of ``count`` int64, the states' indices; ``rate`` (float32) is how fast
    weights learn, about 0.02 at first and 0.002 later.
    """
    row = row * m[5]
    total = np.float32(0)
    for i in range(count):
        opinion = _STRETCH[read_i32(m[3], read_i64(at, i)) >> 19]
        write_f32(m[6], i, opinion)
        total += read_f32(m[4], row + i) * opinion
    place = min(max(int(total * np.float32(256)) + 3072, 0), 6143)
    chance = np.int64(_SQUASH[place])
    bit = _code(m, chance, bit, decoding)
    step = (np.float32(65536 * bit) - np.float32(chance)) * (rate * np.float32(1 / 65536))
    for i in range(count):
        write_f32(m[4], row + i, read_f32(m[4], row + i) + step * read_f32(m[6], i))
        _learn(m, read_i64(at, i), bit)
    return bit


@_inlined
def code_size(m, at, level, size, decoding):
    """Code a size from 0 on, by a decision for each step up; give the size.

    Parameters
    ----------
    m : tuple
        From `memory`; the first `SIZE_STATES` states are for sizes.
    at : int
        Address of `INPUTS` int64: what each input sees, below `PLACES`. Changed.
    level : int
        What chooses the weights, below `LEVELS`.
    size : int
    decoding : bool
    """
    for i in range(INPUTS):
        write_i64(at, i, read_i64(at, i) + i * PLACES)
    step = np.int64(0)
    while step < _STEPS_UP:
        if 0 < step < DECISIONS:
            for i in range(INPUTS):
                write_i64(at, i, read_i64(at, i) + INPUTS * PLACES)
        row = min(step, DECISIONS - 1) * LEVELS + level
        more = np.int64(1) if size > step else np.int64(0)
        if not code_mixed(m, at, INPUTS, row, _RATE, more, decoding):
            return step
        step += 1
    return step + code_rest(m, size - step, decoding)


@kernel
def open_stream(coder, data, states, weights, opinions, decoding):
    """Begin a stream that several kernels go on with."""
    start(memory(coder, data, states, weights, opinions), decoding)


@kernel
def close_stream(coder, data, states, weights, opinions):
    """End a stream that several kernels wrote."""
    finish(memory(coder, data, states, weights, opinions))


def coding_room(states, inputs, weight_sets):
    """Allocate what a stream's kernels need, as it begins."""
    return dict(
        coder=np.zeros(4, np.int64),
        states=np.full(states, FRESH, np.int32),
        weights=np.full((weight_sets, inputs), 0.3, np.float32),
        opinions=np.zeros(inputs, np.float32),
    )


def buffer_for(decisions):
    """Allocate the bytes that an encoder may need for so many decisions."""
    return np.zeros(BYTES_PER_DECISION * decisions + 8, np.uint8)
