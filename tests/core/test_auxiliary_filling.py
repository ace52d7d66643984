"""Voids filled from auxiliary rasters: what they gain, which are refused, and where."""

from types import SimpleNamespace

import numpy as np
import pytest
from array_sources import source
from scenes import fractal, holed
from support import shared_data

from demsmith.core.auxiliary import (
    REFUSED,
    UNKNOWN,
    UNLIKE,
    USED,
    WORSE,
    Alignment,
    Resampler,
    Surface,
    fill_from_auxiliaries,
    learn_surface,
)
from demsmith.core.raster import Grid, open_tiles, read
from demsmith.core.raster.peer import gdal_fill
from demsmith.core.validation import single_holes
from demsmith.core.voids import accurate, fill_voids, find_voids
from demsmith.core.voids.accurate import training_windows

SHAPE = (180, 200)
GRID = Grid(SHAPE, (500_000.0, 30.0, 0.0, 4_600_000.0, 0.0, -30.0), "EPSG:32631")
VOID = holed(SHAPE, (30, 60, 30, 70), (100, 104, 20, 26), (90, 140, 120, 170))
ALIGNED = Alignment(True, "As if.", spread_after=1.0)


def flat_engine(error=1.0):
    """An engine that gives void cells the mean of the known ones on the void's rim."""

    def estimate(work, void, voids, selected, model, *, sigma=None, **_):
        from scipy.ndimage import binary_dilation

        for number in selected:
            cells = voids.labels == number + 1
            rim = binary_dilation(cells) & ~void
            work[cells] = work[rim].mean()
            if sigma is not None:
                sigma[cells] = error
        return SimpleNamespace(error=np.full(len(selected), error))

    return SimpleNamespace(
        estimate=estimate, margin=lambda high, wide: 6, learn=lambda windows, **_: len(windows)
    )


def surface(values, void=None, alignment=ALIGNED):
    return Surface(Resampler(source(values, GRID, void), GRID), alignment)


def filled(target, surfaces, void=VOID, engine=None, **options):
    voids = find_voids(void)
    work = np.where(void, -1000.0, target)
    fill = fill_from_auxiliaries(
        work, void, voids, np.arange(len(voids)), surfaces, engine=engine or flat_engine(),
        **options,
    )  # fmt: skip
    assert np.array_equal(work[~void], target[~void])
    return work, fill


def test_a_void_takes_the_shape_of_the_auxiliary_and_the_level_of_its_rim():
    target = fractal(SHAPE)
    work, fill = filled(target, [surface(target - 50)])
    np.testing.assert_allclose(work, target, atol=1e-6)
    assert (fill.surface == 1).all()
    assert (fill.verdict == USED).all()
    assert np.array_equal(fill.source, VOID.astype(np.uint8))


def test_sigma_is_that_of_the_delta_and_only_where_filled():
    target = fractal(SHAPE)
    sigma = np.full(SHAPE, np.nan, np.float32)
    filled(target, [surface(target)], engine=flat_engine(2.5), sigma=sigma)
    assert (sigma[VOID] == 2.5).all()
    assert np.isnan(sigma[~VOID]).all()


def test_one_refused_as_a_whole_changes_nothing():
    target = fractal(SHAPE)
    work, fill = filled(target, [surface(target, alignment=Alignment(False, "Other ground."))])
    assert (work[VOID] == -1000).all()
    assert (fill.verdict == REFUSED).all()
    assert not fill.source.any()
    assert np.isnan(fill.error).all()


def test_one_that_is_expected_to_do_worse_than_interpolation_is_refused_for_that_void():
    target = fractal(SHAPE)
    expected = np.array([9.0, 2.0, 9.0])
    work, fill = filled(
        target, [surface(target)], engine=flat_engine(4.0), interpolation_error=expected
    )
    labels = find_voids(VOID).labels
    assert fill.verdict[0].tolist() == [USED, WORSE, USED]
    assert (work[labels == 2] == -1000).all()
    np.testing.assert_allclose(work[labels == 3], target[labels == 3], atol=1e-6)


def test_one_that_disagrees_with_a_rim_is_refused_there():
    target = fractal(SHAPE, relief=200)
    spoilt = target.copy()
    spoilt[85:145, 115:175] += np.random.default_rng(0).normal(0, 90, (60, 60))
    _, fill = filled(target, [surface(spoilt)])
    assert fill.verdict[0].tolist() == [USED, UNLIKE, USED]  # numbered by their first cells


def test_the_first_that_is_accepted_wins_and_the_next_fills_what_it_does_not_know():
    target = fractal(SHAPE)
    hidden = np.zeros(SHAPE, bool)
    hidden[:, 150:] = True  # a part of the second void
    hidden[95:110, 10:40] = True  # all of the third
    first, second = surface(target - 50, hidden), surface(target + 30)
    work, fill = filled(target, [first, second])
    np.testing.assert_allclose(work, target, atol=1e-6)
    assert fill.verdict.tolist() == [[USED, USED, UNKNOWN], [0, USED, USED]]
    assert fill.surface.tolist() == [1, 1, 2]
    assert np.array_equal(fill.source == 2, VOID & hidden)


def test_cells_that_none_knows_are_left_or_meet_the_rest():
    target = fractal(SHAPE)
    hidden = np.zeros(SHAPE, bool)
    hidden[:, 150:] = True
    work, fill = filled(target, [surface(target, hidden)])
    left = VOID & hidden
    assert (work[left] == -1000).all()
    assert not fill.source[left].any()
    work, _ = filled(target, [surface(target, hidden)], model="of the target")
    assert work[left].min() >= target.min()
    assert len(np.unique(work[left])) == 1


def test_a_fill_does_not_depend_on_the_window():
    target = fractal(SHAPE)
    hidden = holed(SHAPE, (0, 180, 60, 64), (120, 125, 160, 190))
    shaped = surface(target + fractal(SHAPE, seed=8, relief=20), hidden)
    whole, _ = filled(target, [shaped], model="of the target")
    part = np.s_[20:75, 20:90]  # the first void and what it may depend on
    work, _ = filled(
        target[part], [shaped], void=np.ascontiguousarray(VOID[part]), place=(20, 20),
        model="of the target",
    )  # fmt: skip
    assert work.tobytes() == whole[part].tobytes()


def test_the_engine_fills_the_delta_of_a_learned_surface():
    target = fractal(SHAPE, exponent=1.7)
    rough = fractal(SHAPE, seed=5, relief=15) + np.random.default_rng(1).normal(0, 0.5, SHAPE)
    resampler = Resampler(source(target + rough - 80, GRID), GRID)
    windows = training_windows(np.where(VOID, 0, target), VOID, GRID.pixel_size_m())
    learned = learn_surface(windows, resampler, engine=accurate)
    sigma = np.zeros(SHAPE, np.float32)
    work, fill = filled(target, [learned], engine=accurate, sigma=sigma)
    assert (fill.verdict == USED).all()
    assert np.abs((work - target)[VOID]).max() < 6
    assert (sigma[VOID] > 0).all()


def real_void(name):
    return read(shared_data(name)).void[:1200, :1200][-700:, -700:]


@pytest.mark.parametrize(
    "void",
    [
        lambda: real_void("pyrenees_raw/N42E001.hgt"),
        lambda: real_void("rainier_raw/mt_rainier_90m_N46W122.tif"),
        lambda: single_holes(np.ones((700, 700), bool), cells=(1500, 3500, 6500), count=4, seed=0),
    ],
)
def test_on_a_real_pair_it_beats_idw_of_the_delta_by_far(void):
    target = read(shared_data("pair_sangabriel/nasadem_1s.tif"))
    path = shared_data("pair_sangabriel/copernicus_glo30_1s.tif")
    part = np.s_[0:700, 0:700]
    truth = target.values[part].astype(np.float64)
    grid = target.grid.part(*part)
    void = np.ascontiguousarray(void())
    auxiliary = read(path).values[part]
    by_idw = auxiliary + gdal_fill(truth - auxiliary, void)[0]
    pixel_size = grid.pixel_size_m()
    windows = training_windows(np.where(void, 0, truth), void, pixel_size)
    learned = learn_surface(windows, Resampler(open_tiles([path]), grid), engine=accurate)
    assert learned.alignment.accepted
    voids = find_voids(void)
    work = np.array(fill_voids(truth, void).values)
    fill_from_auxiliaries(
        work, void, voids, np.arange(len(voids)), [learned], engine=accurate,
        pixel_size=pixel_size,
    )  # fmt: skip

    def rmse(values):
        return np.sqrt(((values - truth)[void] ** 2).mean())

    assert rmse(work) <= 0.62 * rmse(by_idw)
