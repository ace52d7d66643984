"""Mean deviation and topographic position: against sums over every cell of every disc."""

from importlib import import_module

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.raster import Grid
from demsmith.core.relief import mean_deviation, topographic_position


def by_hand(values, void, radius, dx, dy):
    """Deviation and position by looking at all cells from each."""
    deviation, position = (np.full(values.shape, np.nan) for _ in range(2))
    north = np.cumsum(dy) - np.asarray(dy) / 2
    for i, j in np.argwhere(~void):
        width = (dx + dx[i]) / 2
        down = north - north[i]
        along = (np.arange(values.shape[1]) - j)[None, :] * width[:, None]
        seen = values[(np.hypot(along, down[:, None]) <= radius * (1 + 1e-9)) & ~void]
        deviation[i, j] = seen.std()
        position[i, j] = values[i, j] - seen.mean()
    return deviation, position


@settings(max_examples=25, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 14), st.integers(1, 14)),
    dtype=st.sampled_from(["int16", "uint8", ">f4", "float64"]),
    radius=st.floats(12, 300),
    voids=st.sampled_from([0.0, 0.3, 0.9, 1.0]),
    seed=st.integers(0, 2**31 - 1),
)
def test_is_the_deviation_within_the_disc(shape, dtype, radius, voids, seed):
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 200, shape).astype(dtype)
    void = rng.random(shape) < voids
    dx, dy = np.linspace(8, 11, shape[0]), np.full(shape[0], 12.0)
    how = dict(radius=radius, pixel_size=(dx, dy), threads=1)
    deviation, position = by_hand(values.astype(float), void, radius, dx, dy)
    np.testing.assert_allclose(mean_deviation(values, void, **how), deviation, atol=1e-4)
    np.testing.assert_allclose(topographic_position(values, void, **how), position, atol=1e-4)


def test_a_plane_deviates_by_half_its_slope_times_the_radius():
    """The root mean square of x over a disc of radius r is r / 2."""
    ground = 0.4 * 5.0 * np.indices((141, 141))[1]
    made = mean_deviation(ground, radius=200, pixel_size=5)
    inner = np.s_[40:-40, 40:-40]
    np.testing.assert_allclose(made[inner], 0.4 * 200 / 2, rtol=5e-3)
    position = topographic_position(ground, radius=200, pixel_size=5)
    np.testing.assert_allclose(position[inner], 0, atol=1e-4)


def test_small_relief_is_found_far_above_the_sea():
    ground = 8000 + 0.01 * (np.indices((60, 60)).sum(axis=0) % 2)
    np.testing.assert_allclose(mean_deviation(ground, radius=8), 0.005, rtol=1e-2)


def test_the_disc_is_round_on_the_ground_at_60_degrees():
    """A lone summit is seen from 1 km in every direction, not from one farther away."""
    grid = Grid((81, 161), (20.0, 1 / 3600, 0, 60.01, 0, -1 / 3600), "EPSG:4326")
    ground = np.zeros(grid.shape)
    ground[40, 80] = 100
    seen = mean_deviation(ground, radius=1000, pixel_size=grid.pixel_size_m()) > 0.1
    rows, columns = np.flatnonzero(seen[:, 80]), np.flatnonzero(seen[40])
    assert 40 - rows[0] == rows[-1] - 40 == int(1000 / 30.94)  # metres of 1″ at 60° N
    assert 80 - columns[0] == columns[-1] - 80 == int(1000 / 15.50)


def test_ridges_are_above_and_valleys_below():
    row = np.indices((80, 80))[0]
    ground = 100 * np.cos(row * np.pi / 20)  # crests at 0, 40, valleys at 20, 60
    position = topographic_position(ground, radius=20)
    assert (position[40] > 50).all()
    assert (position[20] < -50).all()


def test_what_voids_hold_does_not_matter():
    ground = fractal((50, 60))
    void = disc(ground.shape, (20, 20), 9)
    made = {mean_deviation(np.where(void, at, ground), void, radius=7).tobytes()
            for at in (-32768, np.nan, np.inf)}  # fmt: skip
    assert len(made) == 1


def test_result_does_not_depend_on_threads(monkeypatch):
    ground = fractal((97, 60))
    void = disc(ground.shape, (40, 20), 9)
    whole = mean_deviation(ground, void, radius=9)
    monkeypatch.setattr(import_module("demsmith.core.relief.deviation"), "_TILE", 16)
    tiled = [mean_deviation(ground, void, radius=9, threads=threads) for threads in (1, 3)]
    assert tiled[0].tobytes() == tiled[1].tobytes()
    np.testing.assert_allclose(tiled[0], whole, rtol=1e-5)


def test_mirrored_ground_gives_the_mirrored_result():
    ground = fractal((40, 70)).astype(np.float32)
    made = mean_deviation(ground, radius=6)
    np.testing.assert_allclose(mean_deviation(ground[::-1, ::-1], radius=6)[::-1, ::-1], made)


@pytest.mark.parametrize("function", [mean_deviation, topographic_position])
@pytest.mark.parametrize(
    ("radius", "said"), [(0, "radius is 0"), (29, "less than a cell"), (1e7, "at most")]
)
def test_refused(function, radius, said):
    with pytest.raises(InputError, match=said):
        function(np.zeros((4, 4)), radius=radius, pixel_size=30)


class _Stop:
    def report(self, fraction):
        pass

    def cancelled(self):
        return True


def test_cancel():
    with pytest.raises(Cancelled):
        mean_deviation(np.zeros((9, 9)), radius=2, progress=_Stop())
