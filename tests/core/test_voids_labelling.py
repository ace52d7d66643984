"""Voids as objects, against SciPy's labels and the definition of a rim."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage

from demsmith.core.errors import InputError
from demsmith.core.voids import find_voids, survey_rims

masks = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=40))


def check(void):
    """All that `Voids` promises."""
    voids = find_voids(void)
    expected, count = ndimage.label(void)
    assert len(voids) == count
    # SciPy numbers in the order of first cells too: the same labels, not only the same parts.
    np.testing.assert_array_equal(voids.labels, expected)
    np.testing.assert_array_equal(voids.cells, np.bincount(expected.ravel(), minlength=1)[1:])
    assert voids.labels.dtype == np.int32
    painted = np.zeros(void.shape, np.int32)
    for number in range(count):
        runs = voids.runs[voids.first_run[number] : voids.first_run[number + 1]]
        order = [tuple(run[:2]) for run in runs.tolist()]
        assert order == sorted(set(order))
        for row, start, stop in runs:
            assert stop > start
            assert (painted[row, start:stop] == 0).all()
            painted[row, start:stop] = number + 1
            # A run is as long as it can be.
            assert start == 0 or not void[row, start - 1]
            assert stop == void.shape[1] or not void[row, stop]
    np.testing.assert_array_equal(painted, expected)


@given(masks)
def test_labels_are_scipys(void):
    check(void)


@given(
    st.integers(1, 70), st.integers(1, 70), st.sampled_from([0.02, 0.3, 0.6, 0.97]),
    st.integers(0, 99),
)  # fmt: skip
def test_labels_at_every_density(rows, columns, share, seed):
    check(np.random.default_rng(seed).random((rows, columns)) < share)


@pytest.mark.parametrize(
    "void",
    [
        np.zeros((5, 7), bool),
        np.ones((5, 7), bool),
        np.ones((1, 1), bool),
        np.zeros((1, 1), bool),
        np.ones((1, 65), bool),
        np.ones((65, 1), bool),
        np.indices((100, 101)).sum(0) % 2 == 0,  # a run per cell: more than room for at first
        np.indices((64, 64))[0] % 2 == 0,
        np.indices((64, 64))[1] % 2 == 0,
    ],
    ids=["none", "all", "one", "one known", "row", "column", "checkerboard", "rows", "columns"],
)
def test_labels_of_plain_masks(void):
    check(void)


def test_labels_of_winding_voids():
    """Parts that only meet late: a comb, a U, and a spiral."""
    comb = np.zeros((20, 41), bool)
    comb[:, ::2] = True
    comb[-1] = True
    check(comb)
    check(comb[::-1].copy())
    check(comb.T.copy())
    spiral = np.zeros((33, 33), bool)
    row, column, heading = 0, 0, (0, 1)
    spiral[0, 0] = True
    for length in [32, *np.repeat(np.arange(32, 1, -2), 2)]:
        for _ in range(length):
            row, column = row + heading[0], column + heading[1]
            spiral[row, column] = True
        heading = (heading[1], -heading[0])
    check(spiral)
    assert len(find_voids(spiral)) == 1
    check(~spiral)


@given(masks, st.sampled_from(["fortran", "steps", "reversed", "transposed", "unaligned"]))
def test_masks_in_any_layout(void, layout):
    given_ = {
        "fortran": np.asfortranarray(void),
        "steps": np.repeat(np.repeat(void, 2, 0), 3, 1)[::2, ::3],
        "reversed": void[::-1, ::-1].copy()[::-1, ::-1],
        "transposed": void.T.copy().T,
        "unaligned": np.append(False, void.ravel())[1:].reshape(void.shape),
    }[layout]
    np.testing.assert_array_equal(find_voids(given_).labels, ndimage.label(void)[0])


@pytest.mark.parametrize("mask", [np.zeros((3, 3), np.uint8), np.zeros(3, bool)])
def test_what_is_no_mask_is_refused(mask):
    with pytest.raises(InputError, match="2-D bool"):
        find_voids(mask)


def test_many_voids_are_quick():
    """A million voids of a cell: linear, not quadratic."""
    import time

    void = np.indices((1500, 1500)).sum(0) % 2 == 0
    find_voids(void[:9, :9].copy())
    begin = time.perf_counter()
    assert len(find_voids(void)) == 1500 * 1500 // 2
    assert time.perf_counter() - begin < 1.0


# --- rims ----------------------------------------------------------------------------------------

CROSS = ndimage.generate_binary_structure(2, 1)


@given(masks, st.integers(0, 99), st.sampled_from(["int16", "float32", "float64", "uint8"]))
def test_rims_against_the_definition(void, seed, dtype):
    """Lowest and highest known cell that shares a side with the void; their mean counts a cell
    once for each void row beside it, so it lies between.
    """
    values = (np.random.default_rng(seed).random(void.shape) * 200).astype(dtype)
    voids = find_voids(void)
    rims = survey_rims(values, void, voids)
    for number in range(len(voids)):
        own = voids.labels == number + 1
        rim = ndimage.binary_dilation(own, CROSS) & ~void
        rows, columns = np.nonzero(own)
        edge = (
            rows.min() == 0 or columns.min() == 0
            or rows.max() == void.shape[0] - 1 or columns.max() == void.shape[1] - 1
        )  # fmt: skip
        assert rims.touches_edge[number] == edge
        if rim.any():
            assert rims.low[number] == values[rim].min()
            assert rims.high[number] == values[rim].max()
            assert rims.low[number] <= rims.mean[number] <= rims.high[number]
        else:
            assert np.isnan([rims.low[number], rims.mean[number], rims.high[number]]).all()


def test_rims_do_not_depend_on_threads():
    """Enough void cells for several parts."""
    rng = np.random.default_rng(1)
    void, values = rng.random((400, 500)) < 0.3, rng.random((400, 500))
    voids = find_voids(void)
    assert voids.cells.sum() > 50_000
    one, five = (survey_rims(values, void, voids, threads=threads) for threads in (1, 5))
    for name in ("low", "mean", "high", "touches_edge"):
        np.testing.assert_array_equal(getattr(one, name), getattr(five, name))


def test_rim_mean_of_one_cell():
    values = np.array([[0.0, 1, 0], [2, -99, 4], [0, 9, 0]])
    void = values == -99
    rims = survey_rims(values, void, find_voids(void))
    assert (rims.low[0], rims.mean[0], rims.high[0]) == (1, 4, 9)
