"""Spikes and wells are found, and nothing that is ground."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal, holed, plane
from support import hills, shared_data

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.faults import REACH, FaultModel, find_outliers, learn_faults

CELL = 90.0


def rugged(shape=(200, 220), seed=3):
    """Mountains, about as rough as the Sierra Nevada is at 90 m."""
    return fractal(shape, seed=seed, relief=3000.0)


def planted(ground, height, side, places):
    """Ground with square clusters, and where they are."""
    mask = np.zeros(ground.shape, bool)
    for row, column in places:
        mask[row : row + side, column : column + side] = True
    return np.where(mask, ground + height, ground), mask


def cells(mask):
    return [tuple(int(term) for term in cell) for cell in np.argwhere(mask)]


@pytest.mark.parametrize("side", [1, 2, 3])
@pytest.mark.parametrize("height", [300.0, -300.0, 3000.0, 30000.0])
def test_planted_clusters_are_found_whole_and_alone(side, height):
    places = [(row, column) for row in range(12, 180, 28) for column in range(15, 200, 31)]
    values, mask = planted(rugged(), height, side, places)
    assert np.array_equal(find_outliers(values, pixel_size=CELL), mask)


def test_void_mark_amid_mountains():
    values = rugged() + 500
    values[[40, 41, 90], [50, 50, 60]] = -500.0
    assert cells(find_outliers(values, pixel_size=CELL)) == [(40, 50), (41, 50), (90, 60)]


def test_height_needed_grows_with_roughness():
    calm, rough = rugged() * 0.1, rugged()
    place = [(100, 100)]
    assert find_outliers(planted(calm, 40.0, 1, place)[0], pixel_size=CELL).any()
    assert not find_outliers(planted(rough, 40.0, 1, place)[0], pixel_size=CELL).any()


def test_slope_does_not_hide_a_spike():
    ground = plane((60, 60), slope=(80.0, -60.0))
    values, mask = planted(ground, 30.0, 1, [(30, 30)])
    assert np.array_equal(find_outliers(values, pixel_size=CELL), mask)


@pytest.mark.parametrize("height", [400.0, -400.0])
def test_beside_a_void_and_across_it(height):
    ground = rugged()
    void = holed(ground.shape, (50, 60, 50, 53), (100, 103, 100, 140), (150, 152, 20, 22))
    values, mask = planted(ground, height, 1, [(55, 53), (99, 120), (149, 20)])
    values[void] = -32768
    assert np.array_equal(find_outliers(values, void, pixel_size=CELL), mask)


def test_edges_are_judged_and_corners_not():
    ground = rugged()
    values, mask = planted(ground, 600.0, 1, [(0, 100), (90, 0), (199, 60), (0, 0)])
    mask[0, 0] = False
    assert np.array_equal(find_outliers(values, pixel_size=CELL), mask)


def test_known_cell_alone_in_a_large_void_is_not_judged():
    values = rugged()
    void = disc(values.shape, (100, 100), 15)
    void[100, 100] = False
    values[100, 100] += 1000
    assert not find_outliers(values, void, pixel_size=CELL).any()


@pytest.mark.parametrize("sign", [1, -1])
def test_the_end_of_a_valley_or_ridge_between_voids_stays_and_a_spike_in_it_does_not(sign):
    """As at row 1083, column 823 of the Pyrenees: the rays with ground all leave the valley."""
    rng = np.random.default_rng(0)
    ground = 850 + rng.normal(0, 12, (80, 80))
    floor = np.array(
        [(38, 42), (39, 40), (39, 41), (39, 42), (40, 40), (40, 41), (40, 42), (41, 41)]
    )
    ground[tuple(floor.T)] = [678, 718, 696, 668, 705, 678, 667, 664]
    void = np.zeros(ground.shape, bool)
    void[30:39, 30:42] = void[39:41, 30:40] = void[41, 30:39] = True
    ground *= sign
    assert not find_outliers(ground, void, pixel_size=CELL).any()
    ground[40, 41] -= sign * 250
    assert cells(find_outliers(ground, void, pixel_size=CELL)) == [(40, 41)]


def test_a_real_valley_between_voids_stays():
    raster = pytest.importorskip("demsmith.core.raster")
    pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
    tile = raster.read(shared_data("pyrenees_raw/N42E001.hgt"))
    part = slice(1000, 1150), slice(750, 900)
    size = tuple(each[part[0]] for each in tile.grid.pixel_size_m())
    found = find_outliers(
        tile.values[part], tile.void[part], model=learn_faults([tile]), pixel_size=size
    )
    assert not found[83, 73]


def ridge(row, column):
    return 800.0 - 60.0 * abs(column - 50)


def cliff(row, column):
    return np.where(column + 0 * row > 50, 900.0, 100.0)


def cone(row, column):
    return 1500.0 - 45.0 * np.hypot(row - 50, column - 50)


def inselberg(row, column):
    return np.maximum(200.0, 700.0 - 70.0 * np.hypot(row - 50, column - 50))


def headland(row, column):
    return np.where((abs(row - 50) < 6) & (column > 30), 150.0, 0.0)


def gorge(row, column):
    return np.where(abs(row - 50 + column // 9) < 2, 100.0, 600.0)


@pytest.mark.parametrize("shape", [ridge, cliff, cone, inselberg, headland, gorge])
@pytest.mark.parametrize("sign", [1, -1])
def test_landforms_stay(shape, sign):
    noise = np.random.default_rng(0).normal(0, 2, (100, 100))
    values = sign * shape(*np.ogrid[:100, :100]) + noise
    assert not find_outliers(values, pixel_size=CELL).any()


@pytest.mark.parametrize("seed", range(4))
def test_mountains_stay(seed):
    ground = rugged(seed=seed)
    void = fractal(ground.shape, seed=seed + 9) > 800
    assert not find_outliers(ground, pixel_size=CELL).any()
    assert not find_outliers(ground.astype(np.int16), void, pixel_size=CELL).any()


def test_rocks_in_water_stay_and_pits_do_not():
    land = rugged()
    sea = np.where(np.arange(220) < 110, 0.0, land)
    sea[60, 50], sea[80, 50:52], sea[100, 50], sea[120, 50] = 120, 90, -11, 4000
    assert cells(find_outliers(sea, pixel_size=CELL)) == [(100, 50), (120, 50)]


@pytest.mark.parametrize(
    "values",
    [np.full((1, 1), 5), np.full((1, 300), 7.0), np.zeros((40, 40), np.int16), hills(3, 2)],
)
def test_nothing_in_little_or_level_ground(values):
    assert not find_outliers(values).any()
    assert not find_outliers(values, np.ones(values.shape, bool)).any()


def test_what_lies_under_voids_does_not_matter():
    values, mask = planted(rugged(), 500.0, 1, [(60, 60)])
    void = fractal(values.shape, seed=5) > 700
    void[55:65, 55:65] = False
    found = []
    for content in (np.nan, 1e30, -32768):
        holed_values = np.where(void, content, values)
        found.append(find_outliers(holed_values, void, pixel_size=CELL))
    assert np.array_equal(found[0], mask)
    assert np.array_equal(found[0], found[1]) and np.array_equal(found[0], found[2])
    unmarked = find_outliers(np.where(void, np.nan, values), pixel_size=CELL)
    assert np.array_equal(unmarked, mask)


@settings(max_examples=25, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    dtype=st.sampled_from([np.int16, np.int32, np.uint16, np.float32, np.float64]),
    seed=st.integers(0, 99),
    spoiled=st.integers(0, 20),
)
def test_any_shape_and_type_gives_the_same(shape, dtype, seed, spoiled):
    rng = np.random.default_rng(seed)
    values = hills(*shape, dtype=np.int32, seed=seed) + 2000
    for _ in range(spoiled):
        values[rng.integers(shape[0]), rng.integers(shape[1])] += rng.integers(-900, 900)
    void = rng.random(shape) < 0.1
    model = FaultModel(4.0)
    found = find_outliers(values.astype(dtype), void, model=model, pixel_size=CELL)
    assert found.shape == shape and found.dtype == bool
    assert not (found & void).any()
    expected = find_outliers(values.astype(np.float64), void, model=model, pixel_size=CELL)
    assert np.array_equal(found, expected)


def test_datum_and_unit_do_not_matter():
    values, _ = planted(np.rint(rugged()), 160.0, 2, [(50, 50), (90, 30), (120, 160)])
    expected = find_outliers(values, pixel_size=CELL)
    assert expected.any()
    assert np.array_equal(find_outliers(values - 4096, pixel_size=CELL), expected)
    doubled = find_outliers(2 * values, pixel_size=2 * CELL, outlier_height=20.0)
    assert np.array_equal(doubled, expected)


def test_windows_of_a_mosaic_find_the_same():
    values, _ = planted(rugged(), 300.0, 2, [(r, c) for r in (29, 63, 99) for c in (31, 64, 130)])
    void = fractal(values.shape, seed=8) > 650
    dx = np.linspace(70, 90, values.shape[0])
    dy = np.full(values.shape[0], 92.0)
    model = learn_faults([SimpleNamespace(values=values, void=void)])
    whole = find_outliers(values, void, model=model, pixel_size=(dx, dy))
    assert whole.any()
    for top in range(0, 200, 32):
        for left in range(0, 220, 33):
            a, b = max(top - REACH, 0), max(left - REACH, 0)
            rows, columns = slice(a, top + 32 + REACH), slice(b, left + 33 + REACH)
            part = find_outliers(
                values[rows, columns], void[rows, columns], model=model,
                pixel_size=(dx[rows], dy[rows]),
            )  # fmt: skip
            inner = part[top - a :, left - b :][:32, :33]
            assert np.array_equal(inner, whole[top : top + 32, left : left + 33])


def test_threads_do_not_matter():
    values, _ = planted(rugged((400, 300)), 300.0, 1, [(127, 40), (128, 90), (260, 200)])
    found = [find_outliers(values, pixel_size=CELL, threads=threads) for threads in (1, 3)]
    assert found[0].sum() == 3 and np.array_equal(*found)


def test_model_does_not_mind_faults_or_water():
    values = rugged()
    model = learn_faults([SimpleNamespace(values=values, void=None)])
    spoiled, _ = planted(values, 9000.0, 2, [(r, c) for r in (40, 90) for c in (40, 90)])
    drowned = np.hstack([values, np.zeros((200, 300))])
    for other in (spoiled, drowned):
        learned = learn_faults([SimpleNamespace(values=other, void=None)])
        assert learned.roughness == pytest.approx(model.roughness, rel=0.02)
    assert learn_faults([]).roughness == 0


def test_options_and_cancel():
    values = hills()
    with pytest.raises(InputError, match="outlier_factor"):
        find_outliers(values, outlier_factor=0)
    with pytest.raises(InputError, match="find_outliers"):
        find_outliers(values, spikes=True)

    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    with pytest.raises(Cancelled):
        find_outliers(values, progress=Stop())


@pytest.mark.parametrize(
    ("name", "most"),
    [
        ("sierra_nevada/N37W004.hgt", 0),
        ("white_mountains/N44W072.hgt", 0),
        ("kossou_plain/n07_w006_3arc_v2.tif", 0),
        ("bigtujunga_utm/bigtujunga.tif", 0),
        ("gabilan_lidar1m/gabilan.bil", 0),
        ("sthelens_usgsdem/SainteHelens.dem", 0),
        ("pair_naples/filled/N40E014.hgt", 1),
    ],
)
def test_real_ground_stays_and_spikes_in_it_do_not(name, most):
    raster = pytest.importorskip("demsmith.core.raster")
    pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
    tile = raster.read(shared_data(name))
    size = tile.grid.pixel_size_m()
    model = learn_faults([tile])
    assert find_outliers(tile.values, tile.void, model=model, pixel_size=size).sum() <= most
    places = np.argwhere(~tile.void[20:-20:40, 20:-20:40]) * 40 + 20
    values = tile.values.astype(np.float64)
    values[tuple(places.T)] += 100 * model.roughness + 20
    found = find_outliers(values, tile.void, model=model, pixel_size=size)
    assert found[tuple(places.T)].mean() > 0.99
    assert found.sum() <= len(places) + most
