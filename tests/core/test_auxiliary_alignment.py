"""What the alignment of an auxiliary raster finds, repairs and refuses."""

import json

import numpy as np
import pytest
from array_sources import source
from scenes import fractal, holed

from demsmith.core.auxiliary import Resampler, align
from demsmith.core.errors import Cancelled
from demsmith.core.raster import Grid
from demsmith.core.voids.accurate import training_windows

SHAPE = (260, 300)
GRID = Grid(SHAPE, (500_000.0, 30.0, 0.0, 4_600_000.0, 0.0, -30.0), "EPSG:32631")
VOID = holed(SHAPE, (40, 90, 50, 120), (180, 200, 200, 260))


def ground():
    """Rough ground with some relief everywhere, wider than the grid by 20 cells."""
    return fractal((SHAPE[0] + 40, SHAPE[1] + 40), relief=800.0, exponent=1.7)


def cut(values, rows=0, columns=0):
    """The grid's window of the wider ground; moved, what lies there comes from further on."""
    return values[20 + rows : 20 + rows + SHAPE[0], 20 + columns : 20 + columns + SHAPE[1]]


def noisy(values, scale=1.0, seed=3):
    return values + np.random.default_rng(seed).normal(0, scale, values.shape)


def aligned(target, auxiliary, void=VOID, **options):
    windows = training_windows(np.where(void, -9999, target), void, GRID.pixel_size_m())
    resampler = Resampler(source(auxiliary, GRID), GRID)
    return align(windows, resampler, **options), resampler


def error(alignment, resampler, target):
    values, void = alignment.apply(resampler, 12, 12, (SHAPE[0] - 24, SHAPE[1] - 24))
    delta = (values - target[12:-12, 12:-12])[~void]
    return np.sqrt((delta**2).mean())


@pytest.mark.parametrize("moved", [(0, 0), (3, 0), (-9, 6), (14, -11)])
def test_a_shift_is_found_and_undone(moved):
    wide = ground()
    found, resampler = aligned(cut(wide), noisy(cut(wide, *moved)))
    assert found.accepted
    # What is at row r in the target is at r - moved in the auxiliary: so much further north.
    assert found.shift_north == pytest.approx(30 * moved[0], abs=3)
    assert found.shift_east == pytest.approx(-30 * moved[1], abs=3)
    assert error(found, resampler, cut(wide)) < 1.3


def test_part_of_a_cell_is_found():
    frequency = [np.fft.fftfreq(n) for n in (SHAPE[0] + 40, SHAPE[1] + 40)]
    phase = np.exp(2j * np.pi * (0.4 * frequency[0][:, None] - 0.7 * frequency[1]))
    wide = ground()
    wide = np.where(True, wide - wide.mean(), 0) * np.outer(
        *(np.hanning(n) ** 0.25 for n in wide.shape)
    )
    moved = np.fft.ifft2(np.fft.fft2(wide) * phase).real
    found, _ = aligned(cut(wide), noisy(cut(moved)))
    assert found.shift_north == pytest.approx(30 * 0.4, abs=2)
    assert found.shift_east == pytest.approx(30 * 0.7, abs=2)


def test_bias_tilt_and_scale_are_found_and_undone():
    target = cut(ground())
    rows, columns = np.indices(SHAPE)
    tilted = target + 140 + 0.06 * (columns - 150) - 0.03 * (rows - 130)
    found, resampler = aligned(target, noisy(tilted))
    assert found.bias == pytest.approx(140, abs=1)
    assert found.tilt_east == pytest.approx(2.0, abs=0.1)  # 0.06 m a cell of 30 m
    assert found.tilt_north == pytest.approx(1.0, abs=0.1)
    assert error(found, resampler, target) < 1.3
    feet, resampler = aligned(target, noisy(target) / 0.3048)
    assert feet.vertical_scale == pytest.approx(0.3048, rel=0.01)
    assert error(feet, resampler, target) < 1.3


@pytest.mark.parametrize("moved", [(2, -3), (-9, 6)])
@pytest.mark.parametrize("factor", [1 / 0.3048, 0.3048])
def test_a_shift_is_found_whatever_the_unit(moved, factor):
    wide = ground()
    found, resampler = aligned(cut(wide), factor * noisy(cut(wide, *moved)))
    assert found.accepted
    assert found.shift_north == pytest.approx(30 * moved[0], abs=3)
    assert found.shift_east == pytest.approx(-30 * moved[1], abs=3)
    assert error(found, resampler, cut(wide)) < 1.3


def test_a_sharper_auxiliary_is_smoothed_and_a_smoother_one_sharpened():
    from scipy.ndimage import gaussian_filter

    sharp = ground() + fractal((SHAPE[0] + 40, SHAPE[1] + 40), seed=9, exponent=1.2, relief=300)
    soft = gaussian_filter(sharp, (0.8, 1.2))
    found, resampler = aligned(cut(soft), noisy(cut(sharp), 0.2))
    assert found.blur_north == pytest.approx(30 * 0.8, rel=0.15)
    assert found.blur_east == pytest.approx(30 * 1.2, rel=0.15)
    assert found.spread_after < 0.2 * found.spread_before
    assert error(found, resampler, cut(soft)) < 1
    feet, _ = aligned(cut(soft), noisy(cut(sharp), 0.2) / 0.3048)
    assert feet.blur_north == pytest.approx(30 * 0.8, rel=0.15)
    back, resampler = aligned(cut(sharp), noisy(cut(soft), 0.2))
    assert back.blur_east < -20
    assert back.spread_after < 0.7 * back.spread_before


def test_outliers_do_not_matter():
    target = cut(ground())
    spiked = target.copy()
    at = np.random.default_rng(5).random(SHAPE) < 0.03
    spiked[at] += 700
    clean, _ = aligned(target, noisy(target + 20))
    found, _ = aligned(spiked, noisy(target + 20))
    assert found.accepted
    assert found.bias == pytest.approx(clean.bias, abs=0.5)
    assert found.shift_east == pytest.approx(clean.shift_east, abs=1)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_other_ground_is_refused(seed):
    other = fractal(SHAPE, seed=seed, relief=800.0, exponent=1.7)
    found, _ = aligned(cut(ground()), other)
    assert not found.accepted
    assert found.correlation < 0.5
    assert "other ground" in found.reason


def test_flipped_ground_a_constant_and_noise_are_refused():
    target = cut(ground())
    noise = np.random.default_rng(0).normal(0, 300, SHAPE)
    for other in (target[::-1], target[:, ::-1], np.full(SHAPE, 500.0), noise):
        assert not aligned(target, other)[0].accepted


def test_one_elsewhere_or_nothing_to_compare_is_refused():
    target = cut(ground())
    far = Grid(SHAPE, (900_000.0, 30.0, 0.0, 4_600_000.0, 0.0, -30.0), "EPSG:32631")
    windows = training_windows(target, VOID, GRID.pixel_size_m())
    found = align(windows, Resampler(source(target, far), GRID))
    assert not found.accepted
    assert "knows none" in found.reason
    assert not align([], Resampler(source(target, GRID), GRID)).accepted


def test_a_few_cells_are_no_ground_to_judge_by():
    small = np.arange(12.0).reshape(3, 4)
    windows = training_windows(small, np.zeros((3, 4), bool), (np.ones(3), np.ones(3)))
    grid = Grid((3, 4), GRID.geotransform, GRID.crs)
    found = align(windows, Resampler(source(small, grid), grid))
    assert not found.accepted
    assert "too little" in found.reason


def test_a_cell_does_not_depend_on_the_window_or_the_threads():
    target = cut(ground())
    found, resampler = aligned(target, noisy(cut(ground(), 2, 1)), threads=1)
    again, _ = aligned(target, noisy(cut(ground(), 2, 1)), threads=2)
    assert found == again
    assert found.correction.weights
    values, void = found.apply(resampler, -5, 0, (SHAPE[0] + 9, SHAPE[1]))
    part, part_void = found.apply(resampler, 100, 37, (50, 61))
    assert part.tobytes() == values[105:155, 37:98].tobytes()
    assert part_void.tobytes() == void[105:155, 37:98].tobytes()


def test_its_numbers_can_be_written_as_json():
    found, _ = aligned(cut(ground()), noisy(cut(ground())))
    told = json.loads(json.dumps(found.as_dict()))
    assert told["accepted"] is True
    assert set(told) >= {"shift_east", "bias", "tilt_north", "blur_east", "correlation", "reason"}


def test_it_can_be_cancelled():
    class Impatient:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    with pytest.raises(Cancelled):
        aligned(cut(ground()), cut(ground()), progress=Impatient())
