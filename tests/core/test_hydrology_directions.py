"""D8: the steepest descent in ground metres, and a way out of every filled raster."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from water import Stop, around, ends, grounds, large_basin, outlets, steepest

from demsmith.core import strips
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.hydrology import d8_directions, fill_depressions, resolve_flats


def codes_by_definition(z, flat, void, dx, dy):
    """Look at all neighbours of all cells."""
    codes = np.full(z.shape, 247, np.uint8)
    for cell in map(tuple, np.argwhere(~void)):
        known = [(bit, r, c) for bit, r, c in around(*cell, z.shape) if not void[r, c]]
        code, _ = steepest(z, *cell, dx, dy, known)
        if not code and flat[cell]:
            level = [(bit, r, c) for bit, r, c in known if z[r, c] == z[cell]]
            code, _ = steepest(flat, *cell, dx, dy, level)
        codes[cell] = code
    return codes


@settings(max_examples=120, deadline=None)
@given(grounds(), st.sampled_from([1, 40, 1 << 19]), st.booleans())
def test_is_the_steepest_descent(ground, cells, square):
    z, void, dx, dy = ground
    dx, dy = (np.full(len(z), 25.0),) * 2 if square else (dx, dy)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strips, "_STRIP_CELLS", cells)
        flat = resolve_flats(z, void)
        codes = d8_directions(z, flat, void, dx, dy)
    assert codes.dtype == np.uint8
    np.testing.assert_array_equal(codes, codes_by_definition(z, flat, void, dx, dy))


@settings(max_examples=100, deadline=None)
@given(grounds(side=30))
def test_filled_ground_drains_to_outlets(ground):
    """From every cell the codes lead, without a circle, to the edge or beside a void."""
    z, void, dx, dy = ground
    filled = fill_depressions(z, void)
    codes = d8_directions(filled, resolve_flats(filled, void), void, dx, dy)
    assert np.all(ends(codes) >= 0)
    assert outlets(void).ravel()[ends(codes)[~void.ravel()]].all()
    np.testing.assert_array_equal(codes == 247, void)


def test_a_wide_basin_drains_to_outlets(monkeypatch):
    monkeypatch.setattr(strips, "_STRIP_CELLS", 500)
    z = large_basin(100, 80, levels=40)
    void = np.zeros(z.shape, bool)
    filled = fill_depressions(z, void)
    flat = resolve_flats(filled, void)
    codes = d8_directions(filled, flat, void, *np.ones((2, 100)))
    assert outlets(void).ravel()[ends(codes)].all()
    np.testing.assert_array_equal(
        codes, codes_by_definition(filled, flat, void, *np.ones((2, 100)))
    )


def test_an_unfilled_pit_is_a_sink():
    z = np.full((5, 5), 9.0)
    z[2, 2] = 1
    codes = d8_directions(z, None, np.zeros(z.shape, bool), np.ones(5), np.ones(5))
    np.testing.assert_array_equal(codes[1:4, 1:4], [[2, 4, 8], [1, 0, 16], [128, 64, 32]])


def test_slope_is_measured_on_the_ground():
    """Where a degree of longitude is short, water goes east rather than south."""
    z = np.array([[9, 9, 9], [9, 5, 3], [9, 2, 9.0]])
    void = np.zeros(z.shape, bool)
    centre = [d8_directions(z, None, void, np.full(3, dx), np.ones(3))[1, 1] for dx in (1, 0.5)]
    assert centre == [4, 1]


def test_ties_go_to_the_first():
    z = np.full((3, 3), 5.0)
    z[1, 1] = 9
    void = np.zeros(z.shape, bool)
    assert d8_directions(z, None, void, np.ones(3), np.ones(3))[1, 1] == 1
    z[1, 2] = 9
    assert d8_directions(z, None, void, np.ones(3), np.ones(3))[1, 1] == 4
    z[1, 0] = z[2, 1] = z[0, 1] = 9
    assert d8_directions(z, None, void, np.ones(3), np.ones(3))[1, 1] == 2


def test_tiny_drops_count():
    """Elevations a last bit apart are no flat, nor do they tie."""
    z = np.full((3, 3), 1000, np.float32)
    z[1, 2] = np.nextafter(np.float32(1000), np.float32(0))
    z[2, 1] = np.nextafter(z[1, 2], np.float32(0))
    codes = d8_directions(z, None, np.zeros(z.shape, bool), np.ones(3), np.ones(3))
    assert codes[1, 1] == 4


@pytest.mark.parametrize("shape", [(1, 1), (1, 6), (6, 1)])
def test_thin_rasters(shape):
    z = np.arange(float(max(shape))).reshape(shape)
    codes = d8_directions(z, None, np.zeros(shape, bool), np.ones(shape[0]), np.ones(shape[0]))
    assert codes.ravel()[0] == 0
    assert set(codes.ravel()[1:].tolist()) <= {16 if shape[0] == 1 else 64}


def test_threads_do_not_matter(monkeypatch):
    monkeypatch.setattr(strips, "_STRIP_CELLS", 300)
    z = large_basin(120, 90)
    void = np.random.default_rng(1).random(z.shape) < 0.01
    flat = resolve_flats(z, void)
    one, two, three = (
        d8_directions(z, flat, void, *np.ones((2, 120)), threads=threads).tobytes()
        for threads in (1, 2, 3)
    )
    assert one == two == three


def test_progress_is_told_and_cancel_heard(monkeypatch):
    monkeypatch.setattr(strips, "_STRIP_CELLS", 300)
    z = large_basin()
    inputs = z, None, np.zeros(z.shape, bool), *np.ones((2, len(z)))
    watch = Stop(after=10**6)
    d8_directions(*inputs, threads=1, progress=watch)
    assert watch.seen[0] == 0 and watch.seen[-1] == 1
    with pytest.raises(Cancelled):
        d8_directions(*inputs, threads=1, progress=Stop(3))


def test_bad_arguments_are_named():
    z, void = np.ones((3, 4)), np.zeros((3, 4), bool)
    with pytest.raises(InputError, match="dx has shape"):
        d8_directions(z, None, void, np.ones(4), np.ones(3))
    with pytest.raises(InputError, match="dy must be positive"):
        d8_directions(z, None, void, np.ones(3), np.array([1, 0, 1]))
    with pytest.raises(InputError, match="flat has shape"):
        d8_directions(z, np.zeros((3, 3), np.uint16), void, np.ones(3), np.ones(3))
