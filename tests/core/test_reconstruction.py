"""Reconstruction of arrays and grounds: what a void's fill may depend on, and what not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal, holed, plane

import demsmith
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.raster import Grid
from demsmith.core.reconstruction import ReconstructOptions
from demsmith.core.reconstruction.extents import chunks, connect, scan
from demsmith.core.reconstruction.grounds import ArrayGround, steady_grid
from demsmith.core.reconstruction.parts import LARGEST_WINDOW, parts_of, too_large
from demsmith.core.reconstruction.pipeline import reconstruct_ground
from demsmith.core.reconstruction.training import BLOCK, count_voids, gathered_counts
from demsmith.core.voids import find_voids
from demsmith.core.voids.sources import FILLED, LEFT, ORIGINAL

PLAIN = dict(method="mcmd", outliers=False, flat_water=False)


def scattered(shape, *, seed=0, share=0.05):
    """A mask with voids of many sizes, some at the edges."""
    rng = np.random.default_rng(seed)
    void = rng.random(shape) < share / 3
    for _ in range(int(np.prod(shape) * share / 300) + 2):
        row, column = (rng.integers(0, length) for length in shape)
        high, wide = rng.integers(2, 20, 2)
        void[row : row + high, column : column + wide] = True
    return void


def filled_cells(done, shape, dtype=np.float32):
    """Lay the patches of a reconstructed ground on an empty raster."""
    out, sigma = np.full(shape, np.nan, dtype), np.empty(shape)
    for patch in done.patches:
        patch.paste(slice(0, shape[0]), slice(0, shape[1]), out, sigma, np.empty(shape))
    return out


def test_hole_in_a_plane_comes_back_as_the_plane():
    truth = plane((40, 50))
    void = holed((40, 50), (10, 20, 12, 30), (0, 3, 0, 4))
    done = demsmith.reconstruct(np.where(void, np.nan, truth), **PLAIN)
    np.testing.assert_allclose(done.values, truth, atol=2.0)
    np.testing.assert_array_equal(done.values[~void], truth[~void])
    np.testing.assert_array_equal(done.sources, np.where(void, FILLED, ORIGINAL))
    assert not done.left.any()
    assert done.table.cells.tolist() == [12, 180]
    assert done.table.method.tolist() == ["interpolated by MCMD"] * 2
    assert done.table.touches_edge.tolist() == [True, False]


@pytest.mark.parametrize("dtype", [np.int16, np.uint8, np.float32, np.float64, np.int32])
def test_types_stay_and_known_cells_keep_their_values(dtype):
    truth = fractal((60, 70), relief=200).astype(dtype)
    void = scattered((60, 70))
    done = demsmith.reconstruct(truth, void, **PLAIN)
    assert done.values.dtype == dtype
    np.testing.assert_array_equal(done.values[~void], truth[~void])
    kept = demsmith.reconstruct(truth, void, float_output=True, **PLAIN).values
    assert kept.dtype.kind == "f"
    if np.dtype(dtype).kind in "iu":
        np.testing.assert_array_equal(np.rint(kept), done.values)


def test_fast_engine_is_that_of_fill_voids():
    truth = fractal((120, 130)).astype(np.int16)
    void = scattered(truth.shape)
    done = demsmith.reconstruct(truth, void, **PLAIN)
    np.testing.assert_array_equal(
        done.values, demsmith.fill_voids(truth, void, method="mcmd").values
    )


@pytest.mark.parametrize("side", [(7, 200), (40, 33), (64, 64), (128, 1)])
def test_result_does_not_depend_on_the_chunks(side):
    truth = fractal((129, 140)).astype(np.float32)
    truth[70, 70] += 500  # an outlier on a chunk's border
    void = scattered(truth.shape, seed=3)
    ground = ArrayGround(np.where(void, 0, truth), void, Grid(truth.shape))
    options = ReconstructOptions(method="mcmd", noisy_rims=True)
    whole = reconstruct_ground(ground, options)
    cut = reconstruct_ground(ground, options, side=side)
    assert whole.extents.cells.sum() > void.sum()
    np.testing.assert_array_equal(cut.extents.runs, whole.extents.runs)
    np.testing.assert_array_equal(filled_cells(cut, truth.shape), filled_cells(whole, truth.shape))


def test_result_does_not_depend_on_threads():
    truth, void = fractal((129, 140)).astype(np.float32), scattered((129, 140))
    one, four = (demsmith.reconstruct(truth, void, threads=n, method="mcmd") for n in (1, 4))
    np.testing.assert_array_equal(one.values, four.values)


def test_a_spike_is_removed_and_told():
    truth = fractal((80, 80)).astype(np.float32)
    spiked = truth.copy()
    spiked[40, 40] += 800
    done = demsmith.reconstruct(spiked, method="mcmd")
    assert abs(done.values[40, 40] - truth[40, 40]) < 100
    assert done.sources[40, 40] == FILLED
    kept = demsmith.reconstruct(spiked, method="mcmd", outliers=False)
    assert kept.values[40, 40] == spiked[40, 40]


def test_widened_voids_forget_their_rims():
    truth = plane((40, 40)).astype(np.float32)
    void = holed((40, 40), (10, 14, 10, 14))
    truth[9, 10:14] = 9000
    done = demsmith.reconstruct(truth, void, method="mcmd", outliers=False, erode=1)
    assert done.table.cells.tolist() == [36]
    assert done.values.max() < 1000


def test_voids_that_are_not_wanted_are_left():
    truth = plane((40, 50)).astype(np.int16)
    void = holed((40, 50), (0, 3, 0, 4), (10, 20, 12, 30), (30, 31, 30, 31))
    truth[void] = -99
    inner = demsmith.reconstruct(truth, void, interior_only=True, **PLAIN)
    np.testing.assert_array_equal(inner.left, holed((40, 50), (0, 3, 0, 4)))
    assert (inner.values[inner.left] == -99).all()
    assert (inner.sources[inner.left] == LEFT).all()
    small = demsmith.reconstruct(truth, void, max_size=12, **PLAIN)
    assert small.table.filled.tolist() == [True, False, True]
    assert small.table.method.tolist() == ["interpolated by MCMD", "", "interpolated by MCMD"]


def test_ground_of_no_tile_is_neither_read_nor_filled():
    truth = plane((60, 60)).astype(np.float32)
    void = holed((60, 60), (10, 20, 25, 30), (40, 45, 40, 45))
    covered = np.ones((60, 60), bool)
    covered[:, 30:35] = False
    dirty = np.where(void | ~covered, 1e6, truth).astype(np.float32)
    ground = ArrayGround(dirty, void | ~covered, Grid((60, 60)), covered)
    done = reconstruct_ground(ground, ReconstructOptions(**PLAIN))
    assert done.extents.cells.tolist() == [50, 25]
    filled = filled_cells(done, (60, 60))
    np.testing.assert_array_equal(np.isfinite(filled), void)
    np.testing.assert_allclose(filled[void], truth[void], atol=4.0)
    inner = reconstruct_ground(ground, ReconstructOptions(interior_only=True, **PLAIN))
    assert inner.patches[0].filled.tolist() == [False, True]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31), st.tuples(st.integers(1, 20), st.integers(1, 20)),
       st.tuples(st.integers(1, 22), st.integers(1, 22)))  # fmt: skip
def test_voids_found_in_chunks_are_those_of_the_whole(seed, shape, side):
    void = np.random.default_rng(seed).random(shape) < 0.55
    whole = find_voids(void)
    found = connect([scan(void[chunk], *chunk) for chunk in chunks(shape, side)])
    np.testing.assert_array_equal(found.runs, whole.runs)
    np.testing.assert_array_equal(found.first_run, whole.first_run)
    np.testing.assert_array_equal(found.cells, whole.cells)
    some = np.arange(0, len(found), 2)
    part = found.subset(some)
    np.testing.assert_array_equal(part.cells, whole.cells[some])
    np.testing.assert_array_equal(part.left, found.left[some])


def test_parts_hold_each_void_once_with_its_margin():
    void = scattered((300, 400), seed=5)
    void[20:280, 200:203] = True
    extents = connect([scan(void, slice(0, 300), slice(0, 400))])
    parts = parts_of(extents, np.arange(len(extents)), (300, 400), (50, 60), lambda h, w: 4)
    numbers = np.concatenate([part.voids for part in parts])
    np.testing.assert_array_equal(np.sort(numbers), np.arange(len(extents)))
    for part in parts:
        assert (extents.top[part.voids] - 4 >= part.rows.start).all() or part.rows.start == 0
        assert (extents.right[part.voids] + 4 <= part.columns.stop).all() or (
            part.columns.stop == 400
        )
        inside = void[part.rows, part.columns]
        assert (part.runs[:, 2] - part.runs[:, 1]).sum() == inside.sum()


def test_voids_beyond_memory_are_left():
    runs = np.array([[0, 0, 1], [1000, 0, 90_000], [2000, 5, 6]], np.int32)
    extents = connect([runs])
    large = too_large(extents, np.arange(3), (10**6, 10**6), lambda h, w: 200)
    assert LARGEST_WINDOW < 90_000 * 401
    assert large.tolist() == [False, True, False]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**31), st.tuples(st.integers(1, 1300), st.integers(1, 1300)),
       st.tuples(st.integers(200, 1400), st.integers(200, 1400)))  # fmt: skip
def test_blocks_count_their_voids_whatever_the_chunks(seed, shape, side):
    void = np.random.default_rng(seed).random(shape) < 0.3
    ground = ArrayGround(np.zeros(shape, np.float32), void, Grid(shape))
    cut = chunks(shape, side)
    counts = gathered_counts(shape, [count_voids(ground, *chunk) for chunk in cut], cut)
    expected = [
        [void[r : r + BLOCK, c : c + BLOCK].sum() for c in range(0, shape[1], BLOCK)]
        for r in range(0, shape[0], BLOCK)
    ]
    np.testing.assert_array_equal(counts, expected)


def test_the_same_place_spelt_otherwise_is_the_same_grid():
    geotransform = (1 - 1 / 2400, 1 / 1200, 0, 43 + 1 / 2400, 0, -1 / 1200)
    other = (0.99958333333, 8.3333333333333e-04, 0, 43.000416666666666, 0, -8.33333333333301e-04)
    assert steady_grid(Grid((9, 9), geotransform)) == steady_grid(Grid((9, 9), other))
    assert steady_grid(Grid((9, 9))) == Grid((9, 9))


def test_refusals():
    with pytest.raises(InputError, match="every cell is a void"):
        demsmith.reconstruct(np.full((5, 5), np.nan))
    with pytest.raises(InputError, match="the grid has"):
        demsmith.reconstruct(np.zeros((5, 5)), grid=Grid((5, 6)))
    with pytest.raises(InputError, match="colour"):
        demsmith.reconstruct(np.zeros((5, 5)), colour="red")
    assert demsmith.reconstruct(np.zeros((1, 1)), method="mcmd").values == 0


def test_cancel():
    class Stop:
        def __init__(self):
            self.asked = 0

        def report(self, fraction):
            pass

        def cancelled(self):
            self.asked += 1
            return self.asked > 12

    with pytest.raises(Cancelled):
        demsmith.reconstruct(
            fractal((200, 200)), disc((200, 200), (100, 100), 40), progress=Stop(), **PLAIN
        )
