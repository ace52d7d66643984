"""Breaching: pits are drained by the least costly cuts, within the limits asked for."""

import heapq

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import shared_data
from water import Stop, around, distance, ends, grounds, large_basin, outlets

from demsmith.core import raster, strips
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.hydrology import (
    breach_depressions,
    breaching,
    d8_directions,
    fill_depressions,
    resolve_flats,
)

THREE = np.ones(3)


def level(rows, columns, height=30.0):
    """High ground, and all there is around it."""
    z = np.full((rows, columns), height)
    return z, np.zeros(z.shape, bool), np.ones(rows), np.ones(rows)


def cheapest_cuts(z, void, dx, dy):
    """Cut from each pit along the cheapest way; for ground of which no two ways cost the same."""
    cut, leave = z.copy(), outlets(void)
    for pit in map(tuple, np.argwhere(~void & ~leave)):
        if any(z[r, c] < z[pit] for _, r, c in around(*pit, z.shape)):
            continue
        queue, done = [(0.0, pit, ())], set()
        while queue:
            cost, cell, way = heapq.heappop(queue)
            if cell in done:
                continue
            done.add(cell)
            way = (*way, cell)
            if leave[cell] or z[cell] < z[pit]:
                for place in way:
                    cut[place] = min(cut[place], z[pit])
                break
            for bit, *other in around(*cell, z.shape):
                other = tuple(other)
                depth = max(float(z[other]) - float(z[pit]), 0)
                step = distance(bit, cell[0], dx, dy)
                heapq.heappush(queue, (cost + depth * step, other, way))
    return cut


# --- which way -----------------------------------------------------------------------------------


@settings(max_examples=80, deadline=None)
@given(grounds(side=14), st.sampled_from([1, 1 << 19]))
def test_takes_the_cheapest_way(ground, cells):
    _, void, dx, dy = ground
    z = np.random.default_rng(void.size).normal(size=void.shape)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strips, "_STRIP_CELLS", cells)
        breached = breach_depressions(z, void, dx, dy)
    np.testing.assert_array_equal(breached, cheapest_cuts(z, void, dx, dy))


def test_a_dam_is_cut_where_it_is_thinnest():
    """A valley falls to the south; a road crosses it, three cells wide but two in one column."""
    row, column = np.mgrid[:40, :21]
    z = 100.0 - row + 2 * abs(column - 10)
    z[20:23] = 115
    z[22, 10] = 77
    breached = breach_depressions(z, np.zeros(z.shape, bool), np.ones(40), np.ones(40))
    changed = np.argwhere(breached < z)
    np.testing.assert_array_equal(changed, [[20, 10], [21, 10]])
    assert (breached[20:22, 10] == z[19, 10]).all()
    filled = fill_depressions(breached, np.zeros(z.shape, bool))
    np.testing.assert_array_equal(filled, breached)


def test_cost_is_measured_on_the_ground():
    """One high cell to the east, two to the south: which is less ground depends on their size."""
    z, void, _, _ = level(7, 7)
    z[2, 2] = 1
    z[2, 3], z[2, 4] = 10, 0
    z[3, 2], z[4, 2], z[5, 2] = 10, 10, 0
    cut_east = breach_depressions(z, void, np.full(7, 10.0), np.full(7, 9.0))
    assert cut_east[2, 3] == 1 and cut_east[3, 2] == cut_east[4, 2] == 10
    cut_south = breach_depressions(z, void, np.full(7, 10.0), np.full(7, 4.0))
    assert cut_south[3, 2] == cut_south[4, 2] == 1 and cut_south[2, 3] == 10


def test_ways_as_cheap_are_short():
    """Over level ground a way costs nothing, but it does not wander."""
    z = np.full((9, 30), 5.0)
    z[4, 1:29] = 1
    z[4, 2] = 2
    z[4, 29] = 0
    breached = breach_depressions(z, np.zeros(z.shape, bool), np.ones(9), np.ones(9))
    np.testing.assert_array_equal(np.argwhere(breached < z), [[4, 2]])


def test_pits_as_low_drain_one_into_the_other():
    z, void, dx, dy = level(3, 9)
    z[1, 1:8] = [4, 9, 4, 9, 4, 9, 0]
    z[1, 8] = 0
    breached = breach_depressions(z, void, dx, dy)
    np.testing.assert_array_equal(breached[1], [30, 4, 4, 4, 4, 4, 4, 0, 0])


def test_a_void_is_a_way_out():
    z, void, dx, dy = level(9, 9)
    z[4, 4] = 1
    z[4, 6] = np.nan
    void[4, 6] = True
    breached = breach_depressions(z, void, dx, dy)
    assert breached[4, 5] == 1
    assert np.count_nonzero(breached[~void] < z[~void]) == 1


# --- what stays ----------------------------------------------------------------------------------


@settings(max_examples=100, deadline=None)
@given(grounds(side=25), st.sampled_from([1, 60, 1 << 19]))
def test_nothing_is_left_to_fill(ground, cells):
    z, void, dx, dy = ground
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strips, "_STRIP_CELLS", cells)
        breached = breach_depressions(z, void, dx, dy)
    assert breached.dtype == z.dtype
    assert (breached <= z)[~void].all()
    np.testing.assert_array_equal(breached[void], z[void])
    np.testing.assert_array_equal(fill_depressions(breached, void), breached)
    assert set(breached[~void]) <= set(z[~void])


@settings(max_examples=80, deadline=None)
@given(grounds(side=20), st.sampled_from([0.0, 1.0, 3.0]), st.sampled_from([None, 0.0, 30.0, 90.0]))
def test_limits_hold_and_filling_does_the_rest(ground, depth, length):
    z, void, dx, dy = ground
    breached = breach_depressions(z, void, dx, dy, max_depth=depth, max_length=length)
    cut = z.astype(np.float64) - breached
    assert not (cut[~void] > depth).any()
    if depth == 0 or length == 0:
        np.testing.assert_array_equal(breached, z)
    filled = fill_depressions(breached, void)
    codes = d8_directions(filled, resolve_flats(filled, void), void, dx, dy)
    assert outlets(void).ravel()[ends(codes)[~void.ravel()]].all()


def test_limits_by_hand():
    """A way out 6 deep and 3 long on cells 10 m wide."""
    z, void, _, _ = level(9, 9)
    z[4, 4:9] = [1, 7, 5, 0, 0]
    sizes = np.full(9, 10.0), np.full(9, 10.0)
    whole = breach_depressions(z, void, *sizes)
    np.testing.assert_array_equal(whole[4, 4:], [1, 1, 1, 0, 0])
    for kept in (dict(max_depth=5.9), dict(max_length=29.9)):
        np.testing.assert_array_equal(breach_depressions(z, void, *sizes, **kept), z)
    for cut in (dict(max_depth=6), dict(max_length=30), dict(max_depth=6, max_length=30)):
        np.testing.assert_array_equal(breach_depressions(z, void, *sizes, **cut), whole)


def test_a_deep_short_way_gives_place_to_one_within_the_depth():
    z, void, dx, dy = level(7, 9)
    z[3, 3] = 1
    z[3, 4:6] = [12, 0]  # 11 of ground
    z[4, 3], z[5, 4], z[4, 5] = 7, 7, 7  # more than 12
    assert breach_depressions(z, void, dx, dy)[3, 4] == 1
    around_it = breach_depressions(z, void, dx, dy, max_depth=8)
    assert around_it[3, 4] == 12
    assert (around_it[[4, 5, 4], [3, 4, 5]] == 1).all()


def test_an_endless_search_is_given_up(monkeypatch):
    monkeypatch.setattr(breaching, "_MOST_CELLS", 50)
    z, void, dx, dy = level(30, 30)
    z[2:28, 2:28] = 5
    np.testing.assert_array_equal(breach_depressions(z, void, dx, dy), z)


def test_real_ground_is_moved_less_than_by_filling():
    tile = raster.read(shared_data("sierra_nevada/N37W004.hgt"))
    z = tile.values[:400, :600].astype(np.float32)
    void = np.zeros(z.shape, bool)
    dx, dy = (size[:400] for size in tile.grid.pixel_size_m())
    breached = breach_depressions(z, void, dx, dy)
    np.testing.assert_array_equal(fill_depressions(breached, void), breached)
    moved, raised = z - breached, fill_depressions(z, void) - z
    assert 0 < moved.sum() < raised.sum()


# --- the ways of the house -----------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 7)])
def test_where_all_is_edge_nothing_changes(shape):
    z = np.random.default_rng(0).normal(size=shape)
    rows = np.ones(shape[0])
    np.testing.assert_array_equal(breach_depressions(z, np.zeros(shape, bool), rows, rows), z)


def test_all_void():
    z = np.full((3, 5), np.nan)
    assert np.isnan(breach_depressions(z, np.ones(z.shape, bool), THREE, THREE)).all()


def test_threads_and_portions_do_not_matter(monkeypatch):
    monkeypatch.setattr(strips, "_STRIP_CELLS", 300)
    monkeypatch.setattr(breaching, "_PITS", 7)
    z = large_basin(120, 90)
    before = z.copy()
    inputs = z, np.random.default_rng(1).random(z.shape) < 0.01, *np.ones((2, 120))
    one, two, three = (
        breach_depressions(*inputs, threads=threads).tobytes() for threads in (1, 2, 3)
    )
    monkeypatch.undo()
    assert one == two == three == breach_depressions(*inputs).tobytes()
    np.testing.assert_array_equal(z, before)


def test_progress_is_told_and_cancel_heard(monkeypatch):
    monkeypatch.setattr(breaching, "_PITS", 2)
    z = large_basin() + np.random.default_rng(0).normal(size=(70, 90)).astype(np.float32)
    inputs = z, np.zeros(z.shape, bool), *np.ones((2, len(z)))
    watch = Stop(after=10**6)
    breach_depressions(*inputs, threads=1, progress=watch)
    assert watch.seen == sorted(watch.seen)
    assert watch.seen[0] == 0 and watch.seen[-1] == 1
    asked = 10**6 - watch.left
    for after in (0, asked // 2, asked - 1):
        with pytest.raises(Cancelled):
            breach_depressions(*inputs, threads=1, progress=Stop(after))


def test_bad_arguments_are_named():
    z, void = np.ones((3, 4)), np.zeros((3, 4), bool)
    with pytest.raises(InputError, match="max_depth is -1"):
        breach_depressions(z, void, THREE, THREE, max_depth=-1)
    with pytest.raises(InputError, match="max_length is nan"):
        breach_depressions(z, void, THREE, THREE, max_length=np.nan)
    with pytest.raises(InputError, match="dx has shape"):
        breach_depressions(z, void, np.ones(4), THREE)
