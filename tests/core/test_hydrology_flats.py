"""Flats: the order in which water leaves them is that of the paper, and always leads out."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from water import Stop, around, grounds, large_basin, outlets

from demsmith.core import strips
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.hydrology import fill_depressions, flats, resolve_flats


def distances(cells, first, shape):
    """Distance in steps within some cells from the first ones, which are at 1."""
    reached, front = {}, set(first)
    distance = 1
    while front:
        reached.update(dict.fromkeys(front, distance))
        front = {
            (r, c)
            for cell in front
            for _, r, c in around(*cell, shape)
            if (r, c) in cells and (r, c) not in reached
        }
        distance += 1
    return reached


def order_by_definition(z, void):
    """Barnes, Lehman and Mulla's numbers, flat by flat."""
    leave = outlets(void)

    def beside(cell):
        return [(r, c) for _, r, c in around(*cell, z.shape)]

    left = {
        cell
        for cell in map(tuple, np.argwhere(~void & ~leave))
        if all(z[other] >= z[cell] for other in beside(cell))
    }
    order = np.zeros(z.shape, int)
    while left:
        flat = set(distances(left, [next(iter(left))], z.shape))
        left -= flat
        high = [cell for cell in flat if any(z[other] > z[cell] for other in beside(cell))]
        low = [
            cell
            for cell in flat
            if any(z[other] == z[cell] and other not in flat for other in beside(cell))
        ]
        away = distances(flat, high, z.shape) or dict.fromkeys(flat, 1)
        for cell, distance in distances(flat, low, z.shape).items():
            order[cell] = 2 * distance + max(away.values()) - away[cell]
    return order


def test_the_papers_flat():
    """Figure 1 of Barnes et al. (2014) has a flat of 5 x 5 cells in a rim, with one way out."""
    z = np.full((7, 7), 9.0)
    z[1:6, 1:6] = 7
    z[6, 4] = 7
    order = resolve_flats(z, np.zeros(z.shape, bool))
    toward = np.array([[5, 5, 5, 5, 5], [4, 4, 4, 4, 4], [3, 3, 3, 3, 3], [3, 2, 2, 2, 2],
                       [3, 2, 1, 1, 1]])  # fmt: skip
    away = np.array([[1, 1, 1, 1, 1], [1, 2, 2, 2, 1], [1, 2, 3, 2, 1], [1, 2, 2, 2, 1],
                     [1, 1, 1, 1, 1]])  # fmt: skip
    np.testing.assert_array_equal(order[1:6, 1:6], 2 * toward + 3 - away)
    assert order.dtype == np.uint16
    assert not order[0].any() and not order[6].any()


@settings(max_examples=120, deadline=None)
@given(grounds(side=14), st.sampled_from([1, 40, 1 << 19]), st.booleans())
def test_follows_the_definition(ground, cells, fill):
    z, void, _, _ = ground
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strips, "_STRIP_CELLS", cells)
        z = fill_depressions(z, void) if fill else z
        order = resolve_flats(z, void)
    np.testing.assert_array_equal(order, order_by_definition(z, void))


def assert_leads_out(z, void, order):
    """On each cell of a flat a neighbour as high has a smaller number."""
    for cell in map(tuple, np.argwhere(order > 0)):
        assert any(
            z[r, c] == z[cell] and order[r, c] < order[cell] and not void[r, c]
            for _, r, c in around(*cell, z.shape)
        )


@pytest.mark.parametrize("cells", [1, 500, 1 << 19])
def test_a_filled_basin_leads_out(cells, monkeypatch):
    monkeypatch.setattr(strips, "_STRIP_CELLS", cells)
    z = large_basin()
    void = np.zeros(z.shape, bool)
    void[30, 40] = True
    filled = fill_depressions(z, void)
    order = resolve_flats(filled, void)
    assert_leads_out(filled, void, order)
    np.testing.assert_array_equal(order, order_by_definition(filled, void))


def test_level_everywhere():
    """All water leaves over the edge, by the shortest way."""
    order = resolve_flats(np.full((60, 40), 3, np.float32), np.zeros((60, 40), bool))
    row, column = np.mgrid[:60, :40]
    inward = np.minimum.reduce([row, column, 59 - row, 39 - column])
    np.testing.assert_array_equal(order, 2 * inward)


def test_a_long_winding_flat_needs_a_larger_type():
    """A ditch of 40,000 cells, far longer than 16 bits can count twice."""
    z = np.full((403, 201), 9, np.float32)
    z[1:-1:2, 1:-1] = 1
    z[2:-2:4, -2] = 1
    z[4:-2:4, 1] = 1
    z[-2, -1] = 1
    order = resolve_flats(z, np.zeros(z.shape, bool))
    assert order.dtype == np.uint32
    assert order[1, 1] > 1 << 16
    assert order[-2, -2] == 2
    assert_leads_out(z, np.zeros(z.shape, bool), order)


def test_pits_have_no_order():
    z = np.full((6, 9), 5.0)
    z[1:5, 1:4] = 2
    z[2:4, 6:8] = 4
    z[2, 8] = 4
    order = resolve_flats(z, np.zeros(z.shape, bool))
    assert not order[:, :5].any()
    assert (order[2:4, 6:8] > 0).all()


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 7)])
def test_where_all_is_edge_there_is_none(shape):
    assert not resolve_flats(np.ones(shape), np.zeros(shape, bool)).any()


def test_turning_the_ground_turns_the_order():
    z = fill_depressions(large_basin(), np.zeros((70, 90), bool))
    order = resolve_flats(z, np.zeros(z.shape, bool))
    for turn in (np.flipud, np.fliplr, np.rot90, np.transpose):
        turned = resolve_flats(turn(z), np.zeros(turn(z).shape, bool))
        np.testing.assert_array_equal(turned, turn(order))


def test_threads_do_not_matter(monkeypatch):
    monkeypatch.setattr(strips, "_STRIP_CELLS", 300)
    z = large_basin(120, 90)
    void = np.random.default_rng(1).random(z.shape) < 0.01
    one, two, three = (resolve_flats(z, void, threads=threads).tobytes() for threads in (1, 2, 3))
    assert one == two == three


def test_progress_is_told_and_cancel_heard(monkeypatch):
    """Also in the middle of one flat that is the whole raster."""
    monkeypatch.setattr(strips, "_STRIP_CELLS", 300)
    monkeypatch.setattr(flats, "_MANY", 500)
    z = np.zeros((70, 90), np.float32)
    void = np.zeros(z.shape, bool)
    whole = resolve_flats(z, void)
    watch = Stop(after=10**6)
    np.testing.assert_array_equal(resolve_flats(z, void, threads=1, progress=watch), whole)
    assert watch.seen == sorted(watch.seen)
    assert watch.seen[0] == 0 and watch.seen[-1] == 1
    within = [fraction for fraction in watch.seen if 0.6 < fraction < 0.9]
    assert len(within) > 20
    for after in range(0, 10**6 - watch.left, 5):
        with pytest.raises(Cancelled):
            resolve_flats(z, void, threads=1, progress=Stop(after))


def test_bad_arguments_are_named():
    with pytest.raises(InputError, match=r"void has shape \(3, 3\)"):
        resolve_flats(np.ones((3, 4)), np.zeros((3, 3), bool))
