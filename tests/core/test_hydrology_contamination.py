"""Flags of catchments: against the plain spreading of each flag."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.hydrology import contamination as module
from demsmith.core.hydrology.contamination import contamination
from demsmith.core.hydrology.directions import d8_directions
from demsmith.core.hydrology.traversal import Surface

STEPS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))


def spread(seeds, receivers, void):
    """All cells that get anything from the seeds."""
    reached = seeds & ~void
    waiting = list(map(tuple, np.argwhere(reached)))
    while waiting:
        row, column = waiting.pop()
        for k, (down, right) in enumerate(STEPS):
            r, c = row + down, column + right
            inside = 0 <= r < void.shape[0] and 0 <= c < void.shape[1]
            if receivers[row, column] >> k & 1 and inside and not void[r, c] and not reached[r, c]:
                reached[r, c] = True
                waiting.append((r, c))
    return reached


def rims(void):
    """Cells at the edge or beside a void."""
    padded = np.pad(void, 1, constant_values=True)
    rows, columns = void.shape
    beside = np.zeros(void.shape, bool)
    for down, right in STEPS:
        beside |= padded[1 + down : 1 + down + rows, 1 + right : 1 + right + columns]
    return beside & ~void


@settings(max_examples=50, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 25), st.integers(1, 25)),
    method=st.sampled_from(["d8", None, 1.1]),
    voids=st.sampled_from([0.0, 0.02, 0.6]),
    seed=st.integers(0, 10**6),
)
def test_flags_reach_all_that_lies_below(shape, method, voids, seed):
    rng = np.random.default_rng(seed)
    z, void, ones = rng.random(shape), rng.random(shape) < voids, np.ones(shape[0])
    filled, changed = rng.random((2, *shape)) < 0.03
    if method == "d8":
        receivers = d8_directions(z, None, void, ones, ones)
    else:
        receivers = Surface(z, None, void, ones, ones).receivers(method)
    flags = contamination(receivers, void, filled=filled, changed=changed, threads=2)
    for flag, seeds in ((1, rims(void)), (2, filled), (4, changed)):
        np.testing.assert_array_equal(flags & flag > 0, spread(seeds, receivers, void))
    assert (flags[void] == 0).all()


def test_a_whole_catchment_has_no_flag():
    # A hill in a plain that falls to its edges.
    y, x = np.mgrid[:31, :31] - 15
    z, ones, void = -np.hypot(x, y), np.ones(31), np.zeros((31, 31), bool)
    flags = contamination(d8_directions(z, None, void, ones, ones), void)
    assert (flags[1:-1, 1:-1] == 0).all()
    assert (flags[0] == 1).all()


def test_only_what_was_given_is_flagged():
    receivers = np.full((3, 5), 1, np.uint8)
    filled = np.zeros((3, 5), bool)
    filled[1, 2] = True
    flags = contamination(receivers, np.zeros((3, 5), bool), filled=filled)
    np.testing.assert_array_equal(flags[1], [1, 1, 3, 3, 3])
    np.testing.assert_array_equal(flags[0], 1)


def test_little_room_and_patience_change_nothing(monkeypatch):
    rng = np.random.default_rng(0)
    z, void, ones = (
        rng.random((60, 60)) + np.arange(60)[:, None],
        np.zeros((60, 60), bool),
        np.ones(60),
    )
    receivers = Surface(z, None, void, ones, ones).receivers(1.1)
    filled = rng.random(z.shape) < 0.02
    expected = contamination(receivers, void, filled=filled)
    monkeypatch.setattr(module, "_ROOM", 20)
    monkeypatch.setattr(module, "_PATIENCE", 7)
    np.testing.assert_array_equal(contamination(receivers, void, filled=filled), expected)


@pytest.mark.parametrize(
    ("receivers", "options", "message"),
    [
        (np.zeros((2, 3), np.uint8), {}, "shape"),
        (np.zeros((3, 3)), {}, "uint8"),
        (np.zeros((3, 3), np.uint8), dict(filled=np.zeros((1, 3), bool)), "filled"),
        (np.zeros((3, 3), np.uint8), dict(changed=np.zeros((1, 3), bool)), "changed"),
    ],
)
def test_arrays_must_fit(receivers, options, message):
    with pytest.raises(InputError, match=message):
        contamination(receivers, np.zeros((3, 3), bool), **options)


def test_cancel():
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    with pytest.raises(Cancelled):
        contamination(np.zeros((3, 3), np.uint8), np.zeros((3, 3), bool), progress=Stop())
