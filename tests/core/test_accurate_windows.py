"""The windows from which ground is learned: which, how many, and of what."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import holed

from demsmith.core.pixel_size import metres
from demsmith.core.voids.accurate import BLOCK, training_spans, training_windows

MOST = 12


def blocks(shape):
    return tuple(-(-length // BLOCK) for length in shape)


@given(st.integers(1, 5000), st.integers(1, 5000), st.integers(0, 10**6))
def test_spans_are_blocks_of_the_raster(rows, columns, seed):
    counts = np.random.default_rng(seed).integers(0, 200_000, blocks((rows, columns)))
    spans = training_spans((rows, columns), counts)
    assert len(spans) == min(MOST, counts.size)
    assert spans == sorted(spans, key=lambda span: (span[0].start, span[1].start))
    corners = {(down.start, along.start) for down, along in spans}
    assert len(corners) == len(spans)
    for down, along in spans:
        for span, length in ((down, rows), (along, columns)):
            assert span.start % BLOCK == 0
            assert span.stop == min(span.start + BLOCK, length)
    assert spans == training_spans((rows, columns), counts)


def test_blocks_with_voids_are_preferred_if_they_know_enough():
    """The ground to be learned is that around voids; nearly empty blocks teach nothing."""
    counts = np.zeros((5, 5), np.int64)
    counts[1, 1], counts[2, 3], counts[4, 4] = 50_000, 10, 260_000  # of 262 144
    spans = training_spans((5 * BLOCK, 5 * BLOCK), counts)
    chosen = {(down.start // BLOCK, along.start // BLOCK) for down, along in spans}
    assert {(1, 1), (2, 3)} <= chosen
    assert (4, 4) not in chosen


def test_blocks_that_know_little_are_better_than_none():
    counts = np.full((4, 5), 250_000)
    counts[3, 4] = 200_000
    spans = training_spans((4 * BLOCK, 5 * BLOCK), counts)
    assert len(spans) == MOST
    assert (slice(3 * BLOCK, 4 * BLOCK), slice(4 * BLOCK, 5 * BLOCK)) in spans


def test_windows_show_the_arrays():
    shape = (700, 1100)
    values = np.arange(shape[0] * shape[1], dtype=np.float32).reshape(shape)
    void = holed(shape, (0, 10, 0, 10), (512, 700, 512, 1024))
    dx, dy = metres(shape, (np.linspace(60, 70, shape[0]), 90.0))
    windows = training_windows(values, void, (dx, dy))
    # The block that is all void is left out.
    corners = [(window.row, window.column) for window in windows]
    assert corners == [(0, 0), (0, 512), (0, 1024), (512, 0), (512, 1024)]
    for window in windows:
        high, wide = window.values.shape
        here = (slice(window.row, window.row + high), slice(window.column, window.column + wide))
        np.testing.assert_array_equal(window.values, values[here])
        np.testing.assert_array_equal(window.void, void[here])
        np.testing.assert_array_equal(window.dx, dx[here[0]])
        np.testing.assert_array_equal(window.dy, dy[here[0]])
        assert np.shares_memory(window.values, values)


@pytest.mark.parametrize("shape", [(1, 1), (1, 2000), (2000, 1), (513, 512)])
def test_thin_rasters_have_windows(shape):
    windows = training_windows(np.zeros(shape), np.zeros(shape, bool), metres(shape, None))
    assert sum(window.values.size for window in windows) == shape[0] * shape[1]


def test_all_void_has_no_window():
    assert training_windows(np.zeros((9, 9)), np.ones((9, 9), bool), metres((9, 9), None)) == []
