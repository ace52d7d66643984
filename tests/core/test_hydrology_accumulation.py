"""Upstream area by D8: against a plain walk, whatever the strips, threads, voids and bad codes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import fractal

from demsmith.core import strips as strips_module
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.hydrology.accumulation import accumulate_d8
from demsmith.core.hydrology.directions import VOID_CODE, d8_directions

STEPS = {
    1: (0, 1), 2: (1, 1), 4: (1, 0), 8: (1, -1), 16: (0, -1), 32: (-1, -1), 64: (-1, 0),
    128: (-1, 1),
}  # fmt: skip


def walked(directions, weights):
    """Let what each cell holds walk down by itself."""
    height, width = directions.shape
    area = np.zeros(directions.shape)
    for row, column in np.argwhere(directions != VOID_CODE):
        r, c = row, column
        while 0 <= r < height and 0 <= c < width and directions[r, c] != VOID_CODE:
            area[r, c] += weights[row, column]
            if directions[r, c] == 0:
                break
            down, right = STEPS[directions[r, c]]
            r, c = r + down, c + right
    return area


def codes(shape, seed, voids=0.0):
    rng = np.random.default_rng(seed)
    void = rng.random(shape) < voids
    ones = np.ones(shape[0])
    return d8_directions(rng.random(shape), None, void, ones, ones)


@pytest.fixture
def narrow_strips(monkeypatch):
    monkeypatch.setattr(strips_module, "_STRIP_CELLS", 100)


@pytest.mark.usefixtures("narrow_strips")
@settings(max_examples=60, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 40), st.integers(1, 30)),
    voids=st.sampled_from([0.0, 0.1, 0.7]),
    seed=st.integers(0, 10**6),
    by_row=st.booleans(),
)
def test_area_is_what_walks_through(shape, voids, seed, by_row):
    directions = codes(shape, seed, voids)
    weights = np.random.default_rng(seed).random(shape[:1] if by_row else shape)
    expected = walked(directions, np.broadcast_to(weights.T, shape[::-1]).T)
    area = accumulate_d8(directions, weights, threads=2)
    np.testing.assert_allclose(area, expected, rtol=1e-12)


@pytest.mark.usefixtures("narrow_strips")
def test_a_river_that_winds_through_all_strips():
    # Down one column, up the next, so that it crosses every strip again and again.
    directions = np.empty((41, 12), np.uint8)
    directions[:, 0::2], directions[:, 1::2] = 4, 64
    directions[-1, 0::2], directions[0, 1::2] = 1, 1
    area = accumulate_d8(directions, np.ones(41))
    river = np.where(np.arange(12) % 2, np.arange(41)[::-1, None], np.arange(41)[:, None])
    np.testing.assert_array_equal(area, river + 1 + 41 * np.arange(12))


def test_numbers_of_cells_are_exact_and_balance_over_many_strips():
    ground = fractal((900, 1500))
    ones = np.ones(900)
    directions = d8_directions(ground, None, np.zeros(ground.shape, bool), ones, ones)
    area = accumulate_d8(directions, ones, threads=2)
    assert area[directions == 0].sum() == ground.size
    below = np.zeros((902, 1502))
    for code, (down, right) in STEPS.items():
        below[1 + down : 901 + down, 1 + right : 1501 + right] += np.where(
            directions == code, area, 0
        )
    np.testing.assert_array_equal(area, below[1:-1, 1:-1] + 1)


def test_same_bytes_for_any_number_of_threads():
    directions = codes((1100, 1000), 3)
    weights = np.random.default_rng(0).random(directions.shape)
    results = {accumulate_d8(directions, weights, threads=n).tobytes() for n in (1, 2, 5)}
    assert len(results) == 1


def test_codes_may_lead_off_the_raster_and_into_voids():
    directions = np.array([[1, 1, VOID_CODE, 16, 16, 64]], np.uint8)
    np.testing.assert_array_equal(accumulate_d8(directions, np.ones(1)), [[1, 2, 0, 2, 1, 1]])


@pytest.mark.parametrize(
    ("codes", "message"),
    [
        ([[1, 16, 0]], "circle: the cell at row 0, column 0"),
        ([[0, 0, 0], [0, 1, 4], [0, 64, 16]], "circle: the cell at row 1, column 1"),
        ([[1, 3, 0]], "3 at row 0, column 1"),
        ([[1, 255, 0]], "255 at row 0, column 1"),
    ],
)
def test_circles_and_other_codes_are_refused(codes, message):
    with pytest.raises(InputError, match=message):
        accumulate_d8(np.array(codes, np.uint8), np.ones(len(codes)))


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (np.ones(3), r"weights have shape \(3,\)"),
        (np.ones((3, 2)), r"weights have shape \(3, 2\)"),
        (np.array([1, np.nan]), "finite"),
        (np.array([[1, 1, 1], [1, np.inf, 1]]), "finite"),
    ],
)
def test_weights_must_fit(weights, message):
    with pytest.raises(InputError, match=message):
        accumulate_d8(np.zeros((2, 3), np.uint8), weights)


def test_weights_at_voids_do_not_count():
    directions = np.array([[1, VOID_CODE, 1, 0]], np.uint8)
    area = accumulate_d8(directions, np.array([[1, np.nan, 2, 3]]))
    np.testing.assert_array_equal(area, [[1, 0, 2, 5]])


@pytest.mark.parametrize("directions", [np.zeros((2, 2)), np.zeros(4, np.uint8)])
def test_directions_must_be_two_dimensions_of_bytes(directions):
    with pytest.raises(InputError, match="uint8"):
        accumulate_d8(directions, np.ones(2))


def test_cancel():
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    with pytest.raises(Cancelled):
        accumulate_d8(np.zeros((5, 5), np.uint8), np.ones(5), progress=Stop())


@pytest.mark.usefixtures("narrow_strips")
def test_progress_never_falls_and_ends_at_one():
    told = []

    class Keep:
        def report(self, fraction):
            told.append(fraction)

        def cancelled(self):
            return False

    accumulate_d8(codes((60, 40), 1), np.ones(60), progress=Keep())
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1)
