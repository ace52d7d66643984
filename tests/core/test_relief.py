"""Gradient, slope and aspect: against theory, GDAL, and themselves turned and mirrored."""

import math
from importlib import import_module

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal
from support import shared_data

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.raster import Grid
from demsmith.core.relief import aspect, gradient, slope
from demsmith.core.relief.options import METHODS

every_method = pytest.mark.parametrize("method", METHODS)
compass = pytest.mark.parametrize("facing", [0, 30, 90, 135, 200, 270, 359])


def tilted(shape, cell, steepness, facing, *, south_up=False):
    """A plane that falls by ``steepness`` degrees toward ``facing``; cells are dx by dy metres."""
    run = math.tan(math.radians(steepness))
    east, north = (-run * turn(math.radians(facing)) for turn in (math.sin, math.cos))
    row, column = np.indices(shape)
    return 900 + east * cell[0] * column + north * cell[1] * (row if south_up else -row)


# --- planes --------------------------------------------------------------------------------------


@every_method
@compass
@pytest.mark.parametrize("south_up", [False, True])
def test_a_plane_has_its_slope_and_aspect_up_to_edges_and_voids(facing, method, south_up):
    cell = (7.0, 23.0)
    shape = (40, 50)
    ground = tilted(shape, cell, 33.0, facing, south_up=south_up)
    void = disc(shape, (20, 25), 8) | disc(shape, (0, 49), 4)
    void[30, 3] = void[31, 5] = True
    ground[void] = -32768
    how = dict(pixel_size=cell, method=method)
    steep, faces = slope(ground, void, **how), aspect(ground, void, south_up=south_up, **how)
    np.testing.assert_allclose(steep[~void], 33.0, rtol=1e-5)
    apart = (faces[~void] - facing + 180) % 360 - 180
    assert np.abs(apart).max() < 1e-3
    assert np.isnan(steep[void]).all()
    assert np.isnan(faces[void]).all()


def test_percent_is_rise_by_run():
    ground = tilted((9, 9), (30, 30), math.degrees(math.atan(0.4)), 90)
    np.testing.assert_allclose(slope(ground, pixel_size=30, unit="percent"), 40, rtol=1e-5)


def test_ground_steeper_than_a_wall_of_numbers_is_near_90_degrees():
    assert slope([[0.0, 1e9]]).min() == 90


@every_method
def test_a_geographic_tile_near_60_degrees_is_steep_in_metres(method):
    """3″ at 60° N: a pixel is 46.5 m wide and 92.8 m high (by GeographicLib, not by us)."""
    grid = Grid((60, 60), (20.0, 1 / 1200, 0, 60.025, 0, -1 / 1200), "EPSG:4326")
    row, column = np.indices(grid.shape)
    east, north = 46.51, 92.84  # metres a pixel at 60° on WGS 84
    how = dict(pixel_size=grid.pixel_size_m(), method=method, unit="percent")
    np.testing.assert_allclose(slope(10.0 * column, **how), 1000 / east, rtol=2e-3)
    np.testing.assert_allclose(slope(10.0 * row, **how), 1000 / north, rtol=2e-3)
    diagonal = aspect(-east * column - north * (59 - row), pixel_size=grid.pixel_size_m())
    np.testing.assert_allclose(diagonal, 45, atol=0.1)


@every_method
def test_a_parabola_has_its_derivative(method):
    """Central differences of quadratic ground are exact; Horn's neighbours change nothing."""
    row, column = np.indices((30, 30))
    ground = 0.02 * (column * 10.0) ** 2 - 0.01 * (row * 20.0) ** 2
    void = np.zeros(ground.shape, bool)
    dx, dy = np.full(30, 10.0), np.full(30, 20.0)
    east, north = gradient(ground, void, dx, dy, method=method)
    inner = np.s_[1:-1, 1:-1]
    np.testing.assert_allclose(east[inner], (0.04 * 10 * column)[inner], rtol=1e-5)
    np.testing.assert_allclose(north[inner], (0.02 * 20 * row)[inner], rtol=1e-5)


def test_the_two_methods_weigh_neighbours_differently():
    """A lone peak beside a cell is seen by Horn from the corner too, by the other not."""
    ground = np.zeros((5, 5))
    ground[1, 3] = 8.0
    void, one = np.zeros((5, 5), bool), np.ones(5)
    east, north = gradient(ground, void, one, one)
    assert (east[2, 2], north[2, 2]) == (1, 1)  # a corner's weight is 1 of 8
    assert east[1, 2] == 2  # an edge's is 2 of 8
    assert east[1, 2] * 2 == gradient(ground, void, one, one, method=METHODS[1])[0][1, 2]
    assert gradient(ground, void, one, one, method=METHODS[1])[0][2, 2] == 0


# --- edges, voids, level ground ------------------------------------------------------------------


def test_level_ground_has_no_aspect_and_no_slope():
    assert np.isnan(aspect(np.full((4, 5), 7))).all()
    assert (slope(np.full((4, 5), 7)) == 0).all()


def test_a_cell_alone_is_level():
    void = np.ones((5, 5), bool)
    void[2, 2] = False
    assert slope(np.full((5, 5), 9.0), void)[2, 2] == 0
    assert slope([[3]]).tolist() == [[0]]


def test_a_cell_with_neighbours_in_a_row_alone_falls_along_it():
    void = np.ones((3, 3), bool)
    void[1] = False
    ground = np.full((3, 3), -9999.0)
    ground[1] = 4, 2, 0
    assert slope(ground, void, unit="percent")[1].tolist() == [200, 200, 200]
    assert aspect(ground, void)[1].tolist() == [90, 90, 90]


def test_what_voids_hold_does_not_matter():
    ground = fractal((40, 40))
    void = disc(ground.shape, (20, 20), 7)
    results = []
    for fill in (-32768, np.nan, np.inf, 1e30):
        holed = np.where(void, fill, ground)
        results.append(slope(holed, void).tobytes())
    assert len(set(results)) == 1
    assert slope(np.ma.MaskedArray(ground, void)).tobytes() == results[0]


def test_north_is_zero_and_never_360_or_minus_zero():
    rising_south = np.indices((5, 5))[0].astype(float)
    north = aspect(rising_south)
    assert (north == 0).all()
    assert not np.signbit(north).any()
    barely_west = rising_south + 1e-9 * np.indices((5, 5))[1]
    assert (aspect(barely_west) < 360).all()


# --- turned and mirrored -------------------------------------------------------------------------


@every_method
def test_mirrored_and_turned_ground_gives_the_mirrored_and_turned_gradient(method):
    ground = fractal((33, 47), seed=4).astype(np.float32)
    void = disc(ground.shape, (10, 30), 5)
    void[20:, 12] = True

    def derive(ground, void, **options):
        sizes = np.full(ground.shape[0], 30.0)
        return gradient(ground, void, sizes, sizes, method=method, **options)

    east, north = derive(ground, void)
    mirrored_east, mirrored_north = derive(ground[:, ::-1], void[:, ::-1])
    np.testing.assert_array_equal(mirrored_east[:, ::-1], -east)
    np.testing.assert_array_equal(mirrored_north[:, ::-1], north)
    flipped_east, flipped_north = derive(ground[::-1], void[::-1], south_up=True)
    np.testing.assert_array_equal(flipped_east[::-1], east)
    np.testing.assert_array_equal(flipped_north[::-1], north)
    # A quarter turn counterclockwise: what was east is north.
    turned_east, turned_north = derive(np.rot90(ground), np.rot90(void))
    known = ~void
    np.testing.assert_allclose(np.rot90(turned_north, -1)[known], east[known], atol=1e-5)
    np.testing.assert_allclose(np.rot90(turned_east, -1)[known], -north[known], atol=1e-5)


# --- agreement with gdaldem ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "word"), [("horn", "Horn"), ("zevenbergen-thorne", "ZevenbergenThorne")]
)
def test_agrees_with_gdaldem_on_a_real_tile(tmp_path, method, word):
    gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
    tif = raster.read(shared_data("bigtujunga_utm/bigtujunga.tif"))
    window = np.s_[100:500, 100:500]
    sizes = [float(size[0]) for size in tif.grid.pixel_size_m()]
    ground = tif.values[window].astype(np.float32)
    driver = gdal.GetDriverByName("MEM")
    dataset = driver.Create("", 400, 400, 1, gdal.GDT_Float32)
    dataset.SetGeoTransform((0, sizes[0], 0, 0, 0, -sizes[1]))
    dataset.GetRasterBand(1).WriteRaster(0, 0, 400, 400, ground.tobytes())

    def theirs(kind):
        made = gdal.DEMProcessing(
            str(tmp_path / f"{kind}.tif"), dataset, kind, alg=word, computeEdges=True
        )
        return np.frombuffer(made.ReadRaster(), np.float32).reshape(400, 400)

    how = dict(pixel_size=sizes, method=method)
    inner = np.s_[1:-1, 1:-1]
    np.testing.assert_allclose(slope(ground, **how)[inner], theirs("slope")[inner], atol=1e-3)
    edges = np.s_[0, 1:-1], np.s_[-1, 1:-1], np.s_[1:-1, 0], np.s_[1:-1, -1]
    for edge in edges:
        np.testing.assert_allclose(slope(ground, **how)[edge], theirs("slope")[edge], atol=1e-3)
    ours, known = aspect(ground, **how), theirs("aspect") != -9999
    np.testing.assert_array_equal(np.isnan(ours[inner]), ~known[inner])
    apart = (ours - theirs("aspect") + 180) % 360 - 180
    assert np.abs(apart[inner][known[inner]]).max() < 0.02


# --- any shape and type, threads, errors ---------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 12), st.integers(1, 12)),
    dtype=st.sampled_from(["int8", "uint8", ">i2", "int32", "uint64", "float16", "float32", ">f8"]),
    method=st.sampled_from(METHODS),
    voids=st.sampled_from([0.0, 0.3, 0.9, 1.0]),
    seed=st.integers(0, 2**31 - 1),
)
def test_any_shape_and_type(shape, dtype, method, voids, seed):
    """No derivative is larger than the largest step between two neighbours that are known."""
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 100, shape).astype(dtype)
    void = rng.random(shape) < voids
    before = values.copy()
    sizes = np.full(shape[0], 2.0)
    east, north = gradient(values, void, sizes, sizes, method=method, threads=1)
    known = np.where(void, np.nan, values.astype(float))
    for part, axis in ((east, 1), (north, 0)):
        assert part.dtype == np.float32
        np.testing.assert_array_equal(np.isnan(part), void)
        steps = np.abs(np.diff(known, axis=axis))
        limit = steps[np.isfinite(steps)].max(initial=0)
        skips = (
            np.abs(known[2:] - known[:-2]) if axis == 0 else np.abs(known[:, 2:] - known[:, :-2])
        )
        limit = max(limit, skips[np.isfinite(skips)].max(initial=0) / 2) / 2.0
        assert np.abs(part[~void]).max(initial=0) <= limit * (1 + 1e-6)
    np.testing.assert_array_equal(values, before)


def test_integers_and_floats_agree():
    ground = np.rint(fractal((50, 60))).astype(np.int16)
    for dtype in ("int32", "float32", "float64"):
        made = slope(ground.astype(dtype), pixel_size=30)
        np.testing.assert_allclose(made, slope(ground, pixel_size=30), rtol=1e-5, atol=1e-5)


def test_result_does_not_depend_on_threads_or_strips(monkeypatch):
    ground = fractal((97, 60))
    void = disc(ground.shape, (40, 20), 9)
    whole = slope(ground, void, threads=1), aspect(ground, void, threads=1)
    for name, cells in (
        ("strips._STRIP_CELLS", 700),
        ("relief.gradient._CHUNK_CELLS", 200),
    ):
        module, constant = name.rsplit(".", 1)
        monkeypatch.setattr(import_module(f"demsmith.core.{module}"), constant, cells)
    for threads in (1, 3):
        parts = slope(ground, void, threads=threads), aspect(ground, void, threads=threads)
        for made, expected in zip(parts, whole, strict=True):
            assert made.tobytes() == expected.tobytes()


class _Stop:
    def report(self, fraction):
        pass

    def cancelled(self):
        return True


@pytest.mark.parametrize("function", [slope, aspect])
def test_cancel(function):
    with pytest.raises(Cancelled):
        function(np.zeros((9, 9)), progress=_Stop())


@pytest.mark.parametrize(
    ("values", "options", "said"),
    [
        (np.zeros(4), {}, "2-D array"),
        (np.zeros((3, 3)), {"method": "sobel"}, "method is 'sobel'"),
        (np.zeros((3, 3)), {"unit": "radians"}, "unit is 'radians'"),
        (np.zeros((3, 3)), {"pixel_size": -1}, "pixel_size"),
        (np.zeros((3, 3)), {"void": np.zeros((2, 2), bool)}, "void has shape"),
    ],
)
def test_refused(values, options, said):
    with pytest.raises(InputError, match=said):
        slope(values, **options)


def test_gradient_refuses_a_method_it_does_not_know():
    with pytest.raises(InputError, match="method is 'sobel'"):
        gradient(np.zeros((3, 3)), np.zeros((3, 3), bool), np.ones(3), np.ones(3), method="sobel")
