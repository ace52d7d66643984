"""Voids in the sea and in lakes are held level."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal, holed

from demsmith.core.errors import InputError
from demsmith.core.faults import WATER_REACH, find_water, hold_water
from demsmith.core.voids import fill_voids, find_voids

CELL = 90.0


def coast(shape=(120, 140), *, level=0.0, lowest=20.0):
    """Land that rises from water in the west of column 60, whose shore is steep."""
    land = level + lowest + fractal(shape, seed=2, relief=300.0)
    return np.where(np.arange(shape[1]) < 60, level, land)


def held(values, void, **options):
    """Filled ground with its water held, the water's mask, and what was found."""
    voids = find_voids(void)
    water = find_water(values, void, voids, pixel_size=CELL, **options)
    filled = fill_voids(values, void, pixel_size=CELL).values
    return filled, hold_water(filled, voids, water), water


@pytest.mark.parametrize("level", [0.0, 1234.0, -410.0])
def test_void_in_a_lake_gets_its_level(level):
    values = coast(level=level)
    void = disc(values.shape, (50, 30), 8)
    values[void] = -32768
    values[50, 21] += 7  # a buoy on the rim
    filled, mask, water = held(values, void)
    assert water.level[0] == level and water.whole[0]
    assert np.array_equal(mask, void) and (filled[void] == level).all()


def test_void_on_land_is_left_alone():
    values = coast()
    void = disc(values.shape, (50, 100), 8)
    filled, mask, water = held(values, void)
    assert np.isnan(water.level[0]) and np.isnan(water.floor[0]) and not water.whole[0]
    assert not mask.any()
    assert np.array_equal(filled, fill_voids(values, void, pixel_size=CELL).values)


def test_land_beside_the_sea_never_sinks_below_it():
    values = coast()
    void = holed(values.shape, (30, 60, 50, 75))
    voids = find_voids(void)
    water = find_water(values, void, voids, pixel_size=CELL)
    work = np.where(void, -3.0, values)  # as a spline that overshoots
    work[40, 70] = 80.0
    mask = hold_water(work, voids, water)
    assert work[void].min() == 0 and work[40, 70] == 80.0
    assert mask.sum() == void.sum() - 1 and not mask[40, 70]
    assert not water.whole[0]


def test_valley_below_a_dam_may_lie_lower_than_the_lake():
    values = np.where(np.arange(100) < 50, 300.0, 180.0) + np.zeros((100, 1))
    values[:, 50:] += np.arange(50)[::-1] * 0.5 + np.arange(100)[:, None] * 0.25
    void = holed(values.shape, (40, 60, 45, 55))
    voids = find_voids(void)
    water = find_water(values, void, voids, pixel_size=CELL)
    lowest = values[39:61, 55].min()
    assert water.level[0] == 300 and water.floor[0] == pytest.approx(lowest, abs=1.0)
    work = np.where(void, 0.0, values)
    assert not hold_water(work, voids, water).any()
    assert (work[void] == water.floor[0]).all()


def test_small_level_ground_is_no_water():
    values = fractal((80, 80), seed=1, relief=900.0)
    values[30:33, 30:33] = 400.0  # 9 cells: 0.07 km²
    void = holed(values.shape, (33, 36, 30, 33))
    voids = find_voids(void)
    assert np.isnan(find_water(values, void, voids, pixel_size=CELL).level[0])
    assert find_water(values, void, voids, pixel_size=CELL, water_area=70_000.0).level[0] == 400
    assert find_water(values, void, voids, pixel_size=110.0).level[0] == 400


def test_many_cells_are_water_at_any_cell_size():
    values = np.full((90, 90), 8.0)
    void = disc(values.shape, (45, 45), 5)
    assert find_water(values, void, find_voids(void), pixel_size=1.0).level[0] == 8
    values[:, 60:] = fractal((90, 30))
    values[:, :40] = fractal((90, 40), seed=1)  # 1800 level cells less the void
    assert np.isnan(find_water(values, void, find_voids(void), pixel_size=1.0).level[0])


def test_longest_shore_counts_where_lakes_meet():
    values = np.full((80, 80), 10.0)
    values[:, 43:] = 25.0
    void = holed(values.shape, (30, 40, 30, 45))
    assert find_water(values, void, find_voids(void), pixel_size=CELL).level[0] == 10


def test_no_voids_all_void_and_integers():
    values = coast().astype(np.int16)
    none = np.zeros(values.shape, bool)
    assert find_water(values, none, find_voids(none)).level.size == 0
    everything = find_water(values, ~none, find_voids(~none))
    assert np.isnan(everything.level).all() and not everything.whole.any()
    void = disc(values.shape, (50, 30), 8)
    assert find_water(values, void, find_voids(void), pixel_size=CELL).whole[0]


def test_area_is_checked():
    void = np.ones((3, 3), bool)
    with pytest.raises(InputError, match="water_area"):
        find_water(np.zeros((3, 3)), void, find_voids(void), water_area=-1.0)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 999), share=st.floats(0.01, 0.4))
def test_known_cells_stay_and_no_bank_is_below_the_water(seed, share):
    values = np.maximum(np.rint(fractal((60, 70), seed=seed, relief=400.0)), 150.0)
    rough = fractal((60, 70), seed=seed + 1)
    void = rough > np.quantile(rough, 1 - share)
    filled, mask, water = held(values, void, water_area=50_000.0)
    assert np.array_equal(filled[~void], values[~void])
    assert not (mask & ~void).any()
    beside = np.isfinite(water.level)
    low = water.floor[beside]
    assert (low <= water.level[beside]).all()
    labels = find_voids(void).labels
    for number in np.flatnonzero(beside):
        assert filled[labels == number + 1].min() >= water.floor[number]


def test_window_around_a_void_tells_the_same_and_threads_do():
    values = np.maximum(np.rint(fractal((400, 420), seed=6, relief=400.0)), 140.0)
    rough = fractal(values.shape, seed=7, exponent=1.5)
    void = rough > np.quantile(rough, 0.93)
    voids = find_voids(void)
    found = [find_water(values, void, voids, pixel_size=CELL, threads=t) for t in (1, 2)]
    assert np.isfinite(found[0].level).sum() > 5
    for name in ("level", "floor", "whole"):
        assert np.array_equal(getattr(found[0], name), getattr(found[1], name), equal_nan=True)
    for number in np.flatnonzero(np.isfinite(found[0].level))[:12]:
        runs = voids.runs[voids.first_run[number] : voids.first_run[number + 1]]
        rows = slice(max(runs[0, 0] - WATER_REACH, 0), runs[-1, 0] + 1 + WATER_REACH)
        first = max(runs[:, 1].min() - WATER_REACH, 0)
        columns = slice(first, runs[:, 2].max() + WATER_REACH)
        window = find_voids(np.ascontiguousarray(void[rows, columns]))
        part = find_water(values[rows, columns], void[rows, columns], window, pixel_size=CELL)
        row, column = runs[0, 0] - rows.start, runs[0, 1] - first
        there = window.labels[row, column] - 1
        for name in ("level", "floor", "whole"):
            assert getattr(part, name)[there] == getattr(found[0], name)[number]
