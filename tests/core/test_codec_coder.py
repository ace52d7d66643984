"""Arithmetic coding: what goes in comes out, in about as many bits as it holds."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from demsmith.core.codec._coder import (
    BYTES_PER_DECISION,
    buffer_for,
    code_adaptive,
    code_mixed,
    code_plain,
    code_rest,
    coding_room,
    finish,
    kernel,
    memory,
    start,
)


@kernel
def _code_bits(bits, coder, data, states, weights, opinions, at, mixed, decoding):
    m = memory(coder, data, states, weights, opinions)
    start(m, decoding)
    history = np.int64(0)
    for n in range(bits.size):
        if mixed:
            at[0], at[1] = history & 7, 8 + (history & 63)
            bits[n] = code_mixed(m, at.ctypes.data, 2, 0, np.float32(0.01), bits[n], decoding)
        else:
            bits[n] = code_adaptive(m, history & 7, bits[n], decoding)
        history = 2 * history + bits[n]
    if not decoding:
        finish(m)


@kernel
def _code_numbers(numbers, coder, data, states, weights, opinions, decoding):
    m = memory(coder, data, states, weights, opinions)
    start(m, decoding)
    for n in range(numbers.size):
        numbers[n] = code_rest(m, numbers[n], decoding)
        numbers[n] += code_plain(m, n & 7, 3, decoding) - (n & 7)
    if not decoding:
        finish(m)


def _there_and_back(kernel, values, *more):
    room = coding_room(128, 2, 1)
    data = buffer_for(70 * values.size)
    kernel(values.copy(), data=data, decoding=False, **room, **dict(more))
    written = data[: room["coder"][3]].copy()
    back = np.zeros_like(values)
    kernel(back, data=written, decoding=True, **coding_room(128, 2, 1), **dict(more))
    return written, back


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("share", [0.5, 0.1, 0.001])
def test_bits_come_back_in_nearly_their_entropy(share, mixed):
    bits = (np.random.default_rng(0).random(40_000) < share).astype(np.int64)
    more = (("at", np.zeros(2, np.int64)), ("mixed", mixed))
    written, back = _there_and_back(_code_bits, bits, *more)
    assert np.array_equal(back, bits)
    entropy = -share * np.log2(share) - (1 - share) * np.log2(1 - share)
    assert written.size * 8 < 1.08 * entropy * bits.size + 400
    assert written.size * 8 > 0.98 * entropy * bits.size - 100


@given(st.lists(st.integers(0, 2**30), max_size=40))
@settings(max_examples=30, deadline=None)
def test_any_numbers_come_back(numbers):
    numbers = np.array(numbers, np.int64)
    assert np.array_equal(_there_and_back(_code_numbers, numbers)[1], numbers)


@given(st.lists(st.integers(0, 1), max_size=300))
@settings(max_examples=30, deadline=None)
def test_any_bits_come_back_within_the_room_promised(bits):
    bits = np.array(bits, np.int64)
    more = (("at", np.zeros(2, np.int64)), ("mixed", True))
    written, back = _there_and_back(_code_bits, bits, *more)
    assert np.array_equal(back, bits)
    assert written.size <= BYTES_PER_DECISION * bits.size + 8


def test_cut_data_decode_to_something():
    bits = (np.random.default_rng(1).random(5000) < 0.3).astype(np.int64)
    more = dict(at=np.zeros(2, np.int64), mixed=True)
    for size in (0, 1, 7):
        back = np.zeros_like(bits)
        _code_bits(back, data=np.zeros(size, np.uint8), decoding=True, **coding_room(128, 2, 1),
                   **more)  # fmt: skip
        assert set(np.unique(back)) <= {0, 1}
