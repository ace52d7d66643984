"""Filling depressions: the Priority-Flood's surface, to the last bit."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import shared_data
from water import Stop, around, grounds, large_basin, outlets, priority_flood

from demsmith.core import raster, strips
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.hydrology import fill_depressions

known_ground = np.zeros((3, 3), bool)


@pytest.fixture(params=[1, 60, 1 << 19], ids=["rows", "strips", "whole"])
def strip_cells(request, monkeypatch):
    """Rasters are worked on in strips of one row, of a few, and in one piece."""
    monkeypatch.setattr(strips, "_STRIP_CELLS", request.param)


def test_hand_made(strip_cells):
    """Two pits in one, of which the inner pass is of no account; and one that drains on the way."""
    z = np.array(
        [
            [9, 9, 9, 9, 9, 9, 9],
            [9, 2, 5, 1, 9, 3, 9],
            [9, 9, 9, 7, 9, 9, 4],
            [9, 9, 9, 9, 8, 9, 9],
        ],
        np.float32,
    )
    filled = fill_depressions(z, np.zeros(z.shape, bool))
    expected = z.copy()
    expected[1, 1:4] = expected[2, 3] = 8
    expected[1, 5] = 4
    np.testing.assert_array_equal(filled, expected)


@settings(max_examples=150, deadline=None)
@given(grounds(), st.sampled_from([1, 40, 1 << 19]))
def test_is_the_priority_floods_surface(ground, cells):
    z, void, _, _ = ground
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strips, "_STRIP_CELLS", cells)
        filled = fill_depressions(z, void)
    assert filled.dtype == z.dtype
    np.testing.assert_array_equal(filled, priority_flood(z, void))


def test_a_wide_basin_with_a_sea(strip_cells):
    z = large_basin()
    void = np.zeros(z.shape, bool)
    filled = fill_depressions(z, void)
    np.testing.assert_array_equal(filled, priority_flood(z, void))
    assert (filled > z).any()


def test_real_ground():
    tile = raster.read(shared_data("sierra_nevada/N37W004.hgt"))
    z = tile.values[300:500, 700:900].astype(np.float32)
    void = np.zeros(z.shape, bool)
    np.testing.assert_array_equal(fill_depressions(z, void), priority_flood(z, void))


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 7)])
def test_where_all_is_edge_nothing_changes(shape):
    z = np.random.default_rng(0).normal(size=shape)
    np.testing.assert_array_equal(fill_depressions(z, np.zeros(shape, bool)), z)


def test_all_void():
    z = np.full((4, 5), np.nan)
    assert np.isnan(fill_depressions(z, np.ones(z.shape, bool))).all()


def test_a_void_drains_its_surroundings(strip_cells):
    z = np.full((7, 7), 5.0)
    z[2:5, 2:5] = 1
    void = np.zeros(z.shape, bool)
    assert (fill_depressions(z, void)[2:5, 2:5] == 5).all()
    void[3, 3] = True
    np.testing.assert_array_equal(fill_depressions(z, void), z)


@pytest.mark.parametrize(
    ("given", "made"),
    [("int16", "float32"), ("uint8", "float32"), ("int32", "float32"), (">i2", "float32"),
     (">f4", "float32"), ("float16", "float32"), (">f8", "float64")],
)  # fmt: skip
def test_other_types_are_converted(given, made):
    z = large_basin(20, 30)
    z -= z.min()
    filled = fill_depressions(z.astype(given), np.zeros(z.shape, bool))
    assert filled.dtype == made
    np.testing.assert_array_equal(filled, fill_depressions(z, np.zeros(z.shape, bool)))


def test_large_integers_stay_exact():
    z = np.full((3, 3), 2**24 + 3)
    z[1, 1] = 2**24 + 1
    filled = fill_depressions(z, known_ground)
    assert filled.dtype == np.float64
    assert (filled == 2**24 + 3).all()


# --- limited by depth ----------------------------------------------------------------------------


def test_depth_limit_by_hand(strip_cells):
    """The inner pit is 2 deep, the one it drains to 7, the third 1."""
    z = np.full((3, 9), 9.0)
    z[1, 1:8] = [3, 5, 2, 9, 6, 8, 7]
    z[0, 6] = 8
    filled = {
        depth: fill_depressions(z, np.zeros(z.shape, bool), max_depth=depth)[1, 1:8].tolist()
        for depth in (0, 1, 2, 6.9, 7)
    }
    assert filled[0] == [3, 5, 2, 9, 6, 8, 7]
    assert filled[1] == [3, 5, 2, 9, 6, 8, 8]
    assert filled[2] == filled[6.9] == [5, 5, 2, 9, 8, 8, 8]
    assert filled[7] == [9, 9, 9, 9, 8, 8, 8]


def rise(z, void, pit):
    """How high water rises over a pit until it finds a way to lower ground, or out; from levels."""
    leave = outlets(void)
    for level in np.unique(z[~void & (z >= z[pit])]):
        reached, queue = {pit}, [pit]
        while queue:
            cell = queue.pop()
            if leave[cell] or z[cell] < z[pit]:
                return level - z[pit]
            for _, *other in around(*cell, z.shape):
                other = tuple(other)
                if other not in reached and not void[other] and z[other] <= level:
                    reached.add(other)
                    queue.append(other)
    raise AssertionError("water never left")


@settings(max_examples=80, deadline=None)
@given(grounds(side=10), st.sampled_from([0.0, 0.5, 1.0, 2.0, 7.0]), st.sampled_from([1, 1 << 19]))
def test_deep_pits_are_kept_as_sinks(ground, depth, cells):
    z, void, _, _ = ground
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strips, "_STRIP_CELLS", cells)
        filled = fill_depressions(z, void, max_depth=depth)
    pits = [
        cell
        for cell in itertools.product(*map(range, z.shape))
        if not void[cell]
        and not outlets(void)[cell]
        and all(void[r, c] or z[r, c] >= z[cell] for _, r, c in around(*cell, z.shape))
    ]
    z64 = z.astype(np.float64)
    sinks = [cell for cell in pits if rise(z64, void, cell) > depth]
    np.testing.assert_array_equal(filled, priority_flood(z, void, sinks))
    assert not (filled.astype(np.float64) - z64 > depth)[~void].any()


# --- the ways of the house -----------------------------------------------------------------------


def test_threads_do_not_matter(monkeypatch):
    monkeypatch.setattr(strips, "_STRIP_CELLS", 300)
    z = large_basin(120, 90) + np.random.default_rng(0).normal(size=(120, 90)).astype(np.float32)
    void = np.random.default_rng(1).random(z.shape) < 0.01
    one, two, three = (
        fill_depressions(z, void, max_depth=3, threads=threads).tobytes() for threads in (1, 2, 3)
    )
    assert one == two == three


def test_the_input_is_left_alone():
    z = large_basin()
    before = z.copy()
    fill_depressions(z, np.zeros(z.shape, bool))
    np.testing.assert_array_equal(z, before)


def test_progress_is_told_and_cancel_heard(monkeypatch):
    monkeypatch.setattr(strips, "_STRIP_CELLS", 300)
    z = large_basin()
    void = np.zeros(z.shape, bool)
    watch = Stop(after=10**6)
    fill_depressions(z, void, threads=1, progress=watch)
    assert watch.seen == sorted(watch.seen)
    assert watch.seen[0] == 0 and watch.seen[-1] == 1
    asked = 10**6 - watch.left
    for after in (0, asked // 2, asked - 1):
        with pytest.raises(Cancelled):
            fill_depressions(z, void, threads=1, progress=Stop(after))


def test_bad_arguments_are_named():
    with pytest.raises(InputError, match="max_depth is -1"):
        fill_depressions(np.ones((3, 3)), known_ground, max_depth=-1)
    with pytest.raises(InputError, match="max_depth is nan"):
        fill_depressions(np.ones((3, 3)), known_ground, max_depth=np.nan)
    with pytest.raises(InputError, match=r"void has shape \(3, 3\)"):
        fill_depressions(np.ones((3, 4)), known_ground)
    with pytest.raises(InputError, match="2-D"):
        fill_depressions(np.ones(3), known_ground)
