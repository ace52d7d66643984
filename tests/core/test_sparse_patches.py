"""Discs on a lattice: where they lie, what they weigh, and the samples in them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal

from demsmith.core.errors import InputError
from demsmith.core.sparse import PatchGrid, gather
from demsmith.core.sparse.patches import disc_weights, gather_at

shapes = st.tuples(st.integers(1, 60), st.integers(1, 60))


@st.composite
def grids(draw, shapes=shapes):
    """Any lattice whose discs cover the raster."""
    while True:
        sides = draw(st.integers(3, 14)), draw(st.integers(3, 14))
        steps = [draw(st.integers(1, max(1, side // 2))) for side in sides]
        try:
            return PatchGrid(draw(shapes), *sides, *steps)
        except InputError:
            continue


def covering(grid):
    """Sums of weights and numbers of discs over every cell, by brute force."""
    sums, counts = np.zeros(grid.shape), np.zeros(grid.shape, int)
    for top, left in zip(*grid.corners(), strict=True):
        for i in range(grid.side_rows):
            for j in range(grid.side_columns):
                row, column = top + i, left + j
                if 0 <= row < grid.shape[0] and 0 <= column < grid.shape[1]:
                    v = (i + 0.5) * 2 / grid.side_rows - 1
                    u = (j + 0.5) * 2 / grid.side_columns - 1
                    inside = u * u + v * v < 1
                    sums[row, column] += (1 - u * u - v * v) ** 3 if inside else 0
                    counts[row, column] += inside
    return sums, counts


@settings(max_examples=30, deadline=None)
@given(grid=grids(shapes=st.tuples(st.integers(1, 25), st.integers(1, 25))))
def test_every_cell_lies_in_discs_and_the_sums_are_those_of_their_weights(grid):
    sums, counts = covering(grid)
    assert counts.min() >= 1
    inverse = grid.sums.over(0, grid.shape[1])[grid.sums.row_kinds]
    np.testing.assert_allclose(inverse, 1 / sums, rtol=1e-5)


def test_sums_need_few_kinds_of_lines():
    sums = PatchGrid((3601, 7)).sums
    assert sums.inverse.shape[0] <= 5 + 10
    assert sums.row_kinds.shape == (3601,)


@settings(max_examples=50, deadline=None)
@given(grid=grids(), data=st.data())
def test_discs_over_some_rows_are_those_that_touch_them(grid, data):
    first = data.draw(st.integers(0, grid.shape[0] - 1))
    last = data.draw(st.integers(first + 1, grid.shape[0]))
    tops = grid.top(np.arange(grid.rows))
    touching = np.flatnonzero((tops < last) & (tops + grid.side_rows > first))
    assert grid.rows_over(first, last) == (touching[0], touching[-1] + 1)


def test_the_default_lattice_has_the_papers_number_of_discs():
    """Side 2R, step R: n K / 4 is the number of cells (§5.1)."""
    grid = PatchGrid((500, 700))
    assert grid.count * grid.samples / 4 == 500 * 700
    rows, columns = grid.centres()
    assert (np.diff(rows) == 5).all() and rows[0] == 3 and columns[-1] == 698


def test_weights_are_the_papers():
    weights = disc_weights(10, 10)
    assert weights[4, 4] == pytest.approx((1 - 0.02) ** 3)
    assert weights[0, 4] == pytest.approx((1 - 0.82) ** 3)
    assert weights[0, 0] == 0 and (weights > 0).sum() == 80
    np.testing.assert_array_equal(weights, weights[::-1, ::-1].T)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (((0, 5),), "no cells"),
        (((9, 9), 0), "side_rows is 0"),
        (((9, 9), 10, 600), "side_columns is 600"),
        (((9, 9), 10, 10, 11), "step_rows is 11"),
        (((99, 99), 10, 10, 8, 8), "leave some ground out"),
    ],
)
def test_impossible_lattices_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        PatchGrid(*arguments)


@settings(max_examples=30, deadline=None)
@given(grid=grids(), share=st.sampled_from([0, 0.3, 1]), seed=st.integers(0, 99))
def test_samples_are_the_valid_cells_less_their_mean(grid, share, seed):
    rng = np.random.default_rng(seed)
    values = rng.normal(2000, 50, grid.shape).astype(np.float32)
    void = rng.random(grid.shape) < share
    values[void] = np.nan
    patch = int(rng.integers(grid.count))
    found = gather(values, void, grid, [patch])
    top, left = (int(corner[0]) for corner in grid.corners([patch]))
    wide = np.pad(np.where(void, np.nan, values), 20, constant_values=np.nan)
    block = wide[top + 20 :, left + 20 :][: grid.side_rows, : grid.side_columns].ravel()
    valid = grid.disc.ravel() & np.isfinite(block)
    np.testing.assert_array_equal(found.valid[0], valid)
    assert found.counts[0] == valid.sum()
    assert (found.samples[0, ~valid] == 0).all()
    if valid.any():
        assert found.means[0] == pytest.approx(block[valid].mean(), rel=1e-6)
        assert abs(found.samples[0, valid].mean()) < 1e-3
        np.testing.assert_array_equal(found.samples[0, valid], block[valid] - found.means[0])
    else:
        assert found.means[0] == 0


def test_all_discs_are_gathered_in_their_order():
    ground = fractal((23, 31)).astype(np.float32)
    void = disc(ground.shape, (9, 9), 4)
    grid = PatchGrid(ground.shape)
    every = gather(ground, void, grid)
    assert every.samples.shape == (grid.count, 100)
    one = gather(ground, void, grid, [11])
    np.testing.assert_array_equal(every.samples[11], one.samples[0])
    assert math.isclose(every.means[11], one.means[0])


def test_discs_anywhere_are_gathered_too():
    slope = np.arange(50.0) * np.ones((40, 1))
    grid = PatchGrid((40, 50))
    found = gather_at(slope, np.zeros(slope.shape, bool), [7], [20], grid.disc)
    assert found.means[0] == 24.5
    np.testing.assert_array_equal(
        found.samples[0].reshape(10, 10)[4], np.arange(10) - np.float32(4.5)
    )


def test_arrays_of_another_shape_are_refused():
    with pytest.raises(InputError, match=r"shape \(9, 8\); values have \(9, 9\)"):
        gather(np.zeros((9, 9), np.float32), np.zeros((9, 9), bool), PatchGrid((9, 8)))
