"""Horizons of terrain: walls, pyramids, the earth's curvature, and rays marched step by step."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import fractal
from support import shared_data

from demsmith.core import geodesy
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.solar.horizon import HorizonSweep, horizon_tangent, horizons

DIRECTIONS = {0: (-1, 0), 45: (-1, 1), 90: (0, 1), 135: (1, 1), 180: (1, 0), 225: (1, -1),
              270: (0, -1), 315: (-1, -1)}  # fmt: skip
ON_A_PLANE = dict(curvature=False)


def metres(rows, size=10.0):
    """Square pixels: the same ground metres in every row."""
    return (np.full(rows, size),) * 2


def march(z, dx, dy, cells, azimuth, *, steps_per_cell=4, sag=0.0):
    """Steepest ground on the ray of each cell, in small steps over the bilinear surface."""
    rows, columns = (index.astype(float) for index in cells)
    high, north, east = z[cells], math.cos(math.radians(azimuth)), math.sin(math.radians(azimuth))
    last = np.array(z.shape) - 1
    away, best = np.zeros(rows.size), np.zeros(rows.size)
    numbers = np.arange(len(dx))
    for number in range(1, steps_per_cell * max(z.shape)):
        along_x, along_y = (np.interp(rows, numbers, size) for size in (dx, dy))
        step = 1 / np.maximum(abs(east) / along_x, abs(north) / along_y) / steps_per_cell
        rows, columns = rows - north * step / along_y, columns + east * step / along_x
        away += step
        inside = (rows >= 0) & (rows <= last[0]) & (columns >= 0) & (columns <= last[1])
        if not inside.any():
            break
        if number < steps_per_cell:
            continue
        i = np.clip(rows.astype(int), 0, last[0] - 1)
        j = np.clip(columns.astype(int), 0, last[1] - 1)
        v, u = rows - i, columns - j
        ground = (z[i, j] * (1 - u) + z[i, j + 1] * u) * (1 - v)
        ground += (z[i + 1, j] * (1 - u) + z[i + 1, j + 1] * u) * v
        slope = (ground - high) / away - away * sag
        best = np.where(inside & (slope > best), slope, best)
    return best


def some_cells(shape, count, seed=0):
    rng = np.random.default_rng(seed)
    return rng.integers(0, shape[0], count), rng.integers(0, shape[1], count)


@pytest.mark.parametrize("azimuth", DIRECTIONS)
def test_a_wall_stands_as_high_as_its_height_by_its_distance(azimuth):
    size, reach, height = 81, 10.0, 70.0
    row, column = np.mgrid[:size, :size] - size // 2
    down, right = DIRECTIONS[azimuth]
    beyond = row * down + column * right  # steps towards the sun, two for each along diagonals
    steps = beyond / (abs(down) + abs(right))
    z = np.where(steps >= 20, height, 0.0)
    tangent = horizon_tangent(z, None, *metres(size, reach), azimuth, **ON_A_PLANE)
    away = reach * math.hypot(down, right) * (20 - steps)
    seen = (steps < 20) & (steps == np.round(steps))
    # Rays that leave the raster before the wall see none.
    seen &= (abs(row + (20 - steps) * down) <= 40) & (abs(column + (20 - steps) * right) <= 40)
    assert tangent[seen] == pytest.approx(height / away[seen], rel=1e-5)
    assert (tangent[steps >= 20] == 0).all()
    assert seen.sum() > 1000


@pytest.mark.parametrize("azimuth", DIRECTIONS)
@pytest.mark.parametrize("altitude", [10, 30, 60])
def test_a_walls_shadow_ends_where_it_must(azimuth, altitude):
    height, size = 50.0, 151
    tangent = math.tan(math.radians(altitude))
    row, column = np.mgrid[:size, :size] - size // 2
    down, right = DIRECTIONS[azimuth]
    steps = (row * down + column * right) / (abs(down) + abs(right))
    z = np.where(steps >= 0, height, 0.0)
    shaded = horizon_tangent(z, None, *metres(size), azimuth, **ON_A_PLANE) > tangent
    length = height / tangent / (10 * math.hypot(down, right))  # in steps
    middle = (abs(row) < 30) & (abs(column) < 30) & (steps == np.round(steps))
    assert np.array_equal(shaded[middle], (steps[middle] < 0) & (steps[middle] > -length))


@pytest.mark.parametrize("azimuth", [8, 16, 32, 40, 56, 72, 99, 130, 160])
def test_a_wall_across_the_rays_is_seen_from_everywhere(azimuth):
    """The end of its shadow is off by about a cell at most, whatever the angle."""
    z = np.zeros((1201, 60))
    z[:, 50:] = 30.0
    tangent = horizon_tangent(z, None, *metres(1201, 1.0), azimuth, **ON_A_PLANE)
    cells = np.arange(49, 0, -1.0)
    exact = math.sin(math.radians(azimuth)) * 30 / cells
    seen = tangent[500:700, 1:50]  # of the lines beside the first column, one is off the raster
    assert (seen <= exact * (1 + 1e-5)).all()
    off = math.sin(math.radians(azimuth)) * 30 / np.maximum(seen, 1e-9) - cells
    assert np.percentile(off, 99) <= 1.1
    assert off.mean() < 0.5


@pytest.mark.parametrize("azimuth", [277, 285, 300, 310, 320, 340])
def test_a_thin_wall_is_seen_along_it_too(azimuth):
    """One cell wide: rays nearly along it meet its crest far from where their neighbours do."""
    z = np.zeros((61, 901))
    z[10] = 30.0
    tangent = horizon_tangent(z, None, *metres(61, 1.0), azimuth, **ON_A_PLANE)
    behind = np.arange(1.0, 41.0)
    exact = math.cos(math.radians(azimuth)) * 30 / behind
    seen = tangent[11:51, 500:800] / exact[:, None]
    assert seen.max() <= 1 + 1e-5
    assert seen.min() >= 0.7
    assert seen.mean() >= 0.95


@pytest.mark.parametrize("azimuth", [0, 17, 45, 71, 90, 152, 200, 270, 341])
def test_a_pyramids_shadow_ends_below_its_top(azimuth):
    """The shadow of a pyramid on level ground: that of its top, and the lines to its corners."""
    size, side, height, altitude = 241, 30, 400.0, 20
    row, column = np.mgrid[:size, :size] - size // 2
    pyramid = height * np.clip(1 - np.maximum(abs(row), abs(column)) / side, 0, None)
    tangent = math.tan(math.radians(altitude))
    swept = horizon_tangent(pyramid, None, *metres(size), azimuth, **ON_A_PLANE)
    east, north = math.sin(math.radians(azimuth)), math.cos(math.radians(azimuth))
    shadow_of_top = np.array([-east, north]) * height / tangent / 10  # columns and rows
    shaded = np.zeros(row.shape, bool)
    for corner in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        for other in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            if abs(corner[0] - other[0]) + abs(corner[1] - other[1]) == 2:
                shaded |= within(column, row, shadow_of_top, np.array(corner) * side,
                                 np.array(other) * side)  # fmt: skip
    level = np.maximum(abs(row), abs(column)) > side
    wrong = level & ((swept > tangent) != shaded)
    assert shaded[level].sum() > 1000
    assert wrong.sum() <= 0.03 * shaded[level].sum()
    rim = shaded & ~shrunk(shaded)
    assert not (wrong & ~(rim | grown(rim))).any(), "cells differ that are off the shadow's rim"


def within(x, y, a, b, c):
    """Tell which points lie in a triangle."""

    def side(p, q):
        return (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])

    sides = np.array([side(a, b), side(b, c), side(c, a)])
    return (sides >= 0).all(axis=0) | (sides <= 0).all(axis=0)


def grown(mask):
    out = mask.copy()
    for axis in (0, 1):
        for step in (-1, 1):
            out |= np.roll(mask, step, axis)
    return out


def shrunk(mask):
    return ~grown(~mask)


@pytest.mark.parametrize("azimuth", [0, 90, 135, 250])
def test_an_island_sinks_behind_the_horizon_of_the_sea(azimuth):
    """Over d² / 2R of sea an island 300 m high is hidden from 62 km on, if light is straight."""
    size, cell, height, radius = 201, 800.0, 300.0, 6_371_000.0
    z = np.zeros((size, size))
    z[100, 100] = height
    row, column = np.mgrid[:size, :size] - 100
    east, north = math.sin(math.radians(azimuth)), math.cos(math.radians(azimuth))
    along = (column * east - row * north) * -cell  # how far the island is towards the azimuth
    beside = np.abs(column * north + row * east) * cell
    hit = (beside < 1) & (along > 0)
    sweep = dict(refraction=0.0, radius=radius)
    tangent = horizon_tangent(z, None, *metres(size, cell), azimuth, **sweep)
    expected = np.maximum(height / along[hit] - along[hit] / (2 * radius), 0)
    if azimuth != 250:  # a ray that hits the single cell
        assert tangent[hit] == pytest.approx(expected, abs=2e-6)
        assert (expected > 0).any() and (expected == 0).any()
    far = along > math.sqrt(2 * radius * height)
    assert (tangent[far] == 0).all()
    refracted = horizon_tangent(z, None, *metres(size, cell), azimuth, refraction=0.13)
    flat = horizon_tangent(z, None, *metres(size, cell), azimuth, curvature=False)
    assert (tangent <= refracted).all() and (refracted <= flat).all()
    assert (flat[far & (beside < 700)] > 0).any()


@pytest.mark.parametrize("azimuth", [0, 10, 33, 45, 70, 90, 135, 200, 284, 315])
def test_fractal_ground_agrees_with_marched_rays(azimuth):
    z = fractal((150, 190), seed=3, relief=2500.0, exponent=2.4)
    dx, dy = metres(150, 90.0)
    tangent = horizon_tangent(z, None, dx, dy, azimuth, **ON_A_PLANE)
    cells = some_cells(z.shape, 1000)
    check_against(march(z, dx, dy, cells, azimuth), tangent[cells])


@pytest.mark.parametrize("azimuth", [20, 58, 85, 127, 233, 300])
def test_rays_bend_as_pixels_narrow(azimuth):
    """In high latitudes columns draw together: 82° to 83° north, a fifth between the edges."""
    edges = 83 - np.arange(201) / 200
    dx, dy = geodesy.pixel_size_m(edges, 1 / 40)
    z = fractal((200, 300), seed=5, relief=8000.0, exponent=2.6)
    tangent = horizon_tangent(z, None, dx, dy, azimuth, **ON_A_PLANE)
    cells = some_cells(z.shape, 1000)
    check_against(march(z, dx, dy, cells, azimuth), tangent[cells])


def check_against(marched, swept):
    exact, found = (np.degrees(np.arctan(tangent)) for tangent in (marched, swept))
    off = np.abs(found - exact)
    assert off.mean() < 0.06
    assert np.percentile(off, 99) < 1.5
    for altitude in (5, 10, 20, 30, 45, 60):
        assert np.mean((found > altitude) == (exact > altitude)) >= 0.995


@pytest.mark.parametrize("tile", ["sierra_nevada/N37W004.hgt", "white_mountains/N44W072.hgt"])
@pytest.mark.parametrize("azimuth", [75, 137, 251])
def test_real_ground_agrees_with_marched_rays(tile, azimuth):
    z = np.fromfile(shared_data(tile), ">i2").reshape(1201, 1201)[400:700, 300:700].astype(float)
    north = int(tile.split("/")[1][1:3]) + 1 - 400 / 1200
    dx, dy = geodesy.pixel_size_m(north - np.arange(301) / 1200, 1 / 1200)
    cells = some_cells(z.shape, 1000)
    check_against(
        march(z, dx, dy, cells, azimuth, sag=(1 - 0.13) / (2 * 6_371_008.8)),
        horizon_tangent(z, None, dx, dy, azimuth)[cells],
    )


def test_pixels_twice_as_wide_as_high():
    z = np.zeros((5, 9))
    z[:, 8] = 40.0
    dx, dy = np.full(5, 20.0), np.full(5, 10.0)
    assert horizon_tangent(z, None, dx, dy, 90.0, **ON_A_PLANE)[2, 0] == pytest.approx(40 / 160)
    z = np.zeros((9, 5))
    z[0] = 40.0
    dx, dy = np.full(9, 20.0), np.full(9, 10.0)
    assert horizon_tangent(z, None, dx, dy, 0.0, **ON_A_PLANE)[8, 2] == pytest.approx(40 / 80)
    # One column for every two rows: a plane that rises to the north-east by 0.1 everywhere.
    row, column = np.mgrid[:40, :40]
    plane = (20.0 * column - 10.0 * row) * 0.1 / math.sqrt(2)
    dx, dy = np.full(40, 20.0), np.full(40, 10.0)
    tangent = horizon_tangent(plane, None, dx, dy, 45.0, **ON_A_PLANE)
    assert tangent[2:, :-2] == pytest.approx(0.1, rel=1e-4)


@pytest.mark.parametrize("azimuth", [0, 20, 45, 62, 90, 110, 164])
def test_turned_and_mirrored_ground_has_the_turned_and_mirrored_horizon(azimuth):
    z = fractal((90, 90), seed=2, relief=1500.0, exponent=2.2)
    sizes = metres(90, 60.0)
    seen = horizon_tangent(z, None, *sizes, azimuth, **ON_A_PLANE)
    turned = horizon_tangent(np.rot90(z), None, *sizes, azimuth - 90, **ON_A_PLANE)
    assert np.rot90(seen) == pytest.approx(turned, abs=2e-4)
    mirrored = horizon_tangent(z[:, ::-1], None, *sizes, -azimuth, **ON_A_PLANE)
    assert np.mean(np.abs(seen[:, ::-1] - mirrored) > 2e-4) < 0.02
    assert np.abs(seen[:, ::-1] - mirrored).mean() < 1e-3


def test_voids_cast_no_shadow_and_see_none():
    z = np.zeros((40, 40))
    z[:, 30] = 100.0
    void = np.zeros(z.shape, bool)
    void[10:20, 25:35] = True
    z[void] = 9999.0
    tangent = horizon_tangent(z, void, *metres(40), 90.0, **ON_A_PLANE)
    assert np.isnan(tangent[void]).all()
    assert (tangent[10:20, :25] == 0).all() and (tangent[10:20, 35:] == 0).all()
    assert tangent[5, 0] == pytest.approx(100 / 300)


def test_what_stands_before_a_void_is_seen_from_behind_it():
    """Tangent points are handed on through voids, also those that the void's rim itself makes."""
    z = np.zeros((3, 60))
    z[:, 50], z[:, 40] = 300.0, 100.0
    void = np.zeros(z.shape, bool)
    void[:, 20:40] = True
    tangent = horizon_tangent(z, void, *metres(3), 90.0, **ON_A_PLANE)[1]
    column = np.arange(20)
    assert tangent[:20] == pytest.approx(np.maximum(300 / (50 - column), 100 / (40 - column)) / 10)
    z[:, 40] = 290.0
    tangent = horizon_tangent(z, void, *metres(3), 90.0, **ON_A_PLANE)[1]
    assert tangent[:20] == pytest.approx(290 / (40 - column) / 10)


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 2), (3, 200), (200, 3)])
@pytest.mark.parametrize("azimuth", [0, 30, 90, 225])
def test_rasters_of_any_shape(shape, azimuth):
    z = np.arange(np.prod(shape), dtype=float).reshape(shape)
    tangent = horizon_tangent(z, None, *metres(shape[0], 1.0), azimuth, **ON_A_PLANE)
    assert tangent.shape == shape and tangent.dtype == np.float32
    assert (tangent >= 0).all() and np.isfinite(tangent).all()


def test_only_voids_give_only_nan():
    assert np.isnan(horizon_tangent(np.zeros((4, 5)), np.ones((4, 5), bool), *metres(4), 3.0)).all()


@given(
    st.sampled_from(["int16", "uint8", "int32", "float32", "float64"]),
    st.integers(1, 40), st.integers(1, 90), st.floats(-720, 720), st.integers(0, 99),
)  # fmt: skip
@settings(deadline=None, max_examples=40)
def test_ground_on_each_ray_is_no_higher_than_the_horizon(dtype, rows, columns, azimuth, seed):
    rng = np.random.default_rng(seed)
    z = rng.integers(0, 100, (rows, columns)).astype(dtype)
    tangent = horizon_tangent(z, None, *metres(rows, 7.0), azimuth, **ON_A_PLANE)
    assert (tangent >= 0).all()
    assert tangent.max(initial=0) <= 100 / 7 * math.sqrt(2)
    raised = horizon_tangent(z.astype(float) + 1e3, None, *metres(rows, 7.0), azimuth, **ON_A_PLANE)
    assert raised == pytest.approx(tangent, abs=1e-4)


def test_high_ground_loses_no_precision():
    z = np.zeros((1, 500))
    z[0, -1] = 0.5
    tangent = horizon_tangent(z + 4000.0, None, *metres(1, 1.0), 90.0, **ON_A_PLANE)
    assert tangent[0, :-1] == pytest.approx(0.5 / np.arange(499, 0, -1), rel=1e-4)


def test_threads_do_not_matter():
    z = fractal((300, 310), seed=7, relief=900.0, exponent=2.0)
    sweep = HorizonSweep(z, None, *metres(300, 30.0))
    for azimuth in (33.0, 99.0):
        one, three = (sweep.tangent(azimuth, threads=threads) for threads in (1, 3))
        assert one.tobytes() == three.tobytes()


def test_many_azimuths_at_once():
    z = fractal((50, 60), seed=1, relief=900.0, exponent=2.0)
    sizes = metres(50, 30.0)
    azimuths = [0.0, 100.0, 222.0]
    many = horizons(z, None, *sizes, azimuths)
    assert many.shape == (3, 50, 60)
    for azimuth, one in zip(azimuths, many, strict=True):
        assert np.array_equal(one, horizon_tangent(z, None, *sizes, azimuth))


class Stop:
    """A progress that asks to stop at once."""

    def report(self, fraction):
        pass

    def cancelled(self):
        return True


def test_it_can_be_cancelled():
    with pytest.raises(Cancelled):
        horizon_tangent(np.zeros((200, 200)), None, *metres(200), 10.0, progress=Stop())


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (dict(azimuth=math.nan), "azimuth is nan"),
        (dict(azimuth=0.0, refraction=1.0), "refraction is 1.0"),
        (dict(azimuth=0.0, radius=-1.0), "radius is -1.0"),
    ],
)
def test_bad_numbers_are_named(wrong, message):
    azimuth = wrong.pop("azimuth")
    with pytest.raises(InputError, match=message):
        horizon_tangent(np.zeros((4, 4)), None, *metres(4), azimuth, **wrong)


def test_pixel_sizes_must_fit():
    with pytest.raises(InputError, match="4 rows"):
        horizon_tangent(np.zeros((4, 4)), None, np.ones(3), np.ones(4), 0.0)
