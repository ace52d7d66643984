"""Natural roughness: filled ground as rough as its surroundings, quiet at the rim."""

import numpy as np
import pytest
from scenes import disc, fractal, plane
from support import fill_by_mcmd

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.voids import fill_voids, find_voids
from demsmith.core.voids._roughness import smooth, squares_around, squares_within
from demsmith.core.voids.roughness import LAGS


def rough_ground(shape=(300, 300), *, seed=0, relief=400.0, exponent=1.6):
    """Fractal ground of Hurst exponent 0.6."""
    return fractal(shape, seed=seed, relief=relief, exponent=exponent)


def structure(z, mask, lag):
    """Mean squared difference of the pairs within a mask, along rows and columns."""
    down = (z[lag:] - z[:-lag])[mask[lag:] & mask[:-lag]]
    along = (z[:, lag:] - z[:, :-lag])[mask[:, lag:] & mask[:, :-lag]]
    return (np.concatenate([down, along]) ** 2).mean()


def bends(z, mask, lag):
    """Mean squared second difference of the cells within a mask, along rows and columns."""
    out = []
    for values, inside in ((z, mask), (z.T, mask.T)):
        second = values[2 * lag :] - 2 * values[lag:-lag] + values[: -2 * lag]
        out.append(second[inside[2 * lag :] & inside[lag:-lag] & inside[: -2 * lag]])
    return (np.concatenate(out) ** 2).mean()


def voids_of(shape):
    """Sixteen discs, far enough apart that each has surroundings."""
    void = np.zeros(shape, bool)
    for row in range(37, shape[0], 75):
        for column in range(37, shape[1], 75):
            void |= disc(shape, (row, column), 17)
    return void


def test_kernels_measure_second_differences():
    z = np.random.default_rng(0).normal(size=(40, 50))
    void = disc(z.shape, (20, 25), 9)
    voids = find_voids(void)
    lags = np.array(LAGS)
    out = np.empty((1, lags.size))
    squares_within(0, 1, z, voids.labels, voids.runs, voids.first_run, lags, out)
    assert out[0] == pytest.approx([bends(z, void, lag) for lag in LAGS])
    squares_around(0, 1, z, voids.labels, voids.runs, voids.first_run, lags, out, 100)
    assert out[0] == pytest.approx([bends(z, ~void, lag) for lag in LAGS])


def test_surroundings_end_at_the_margin():
    z = np.zeros((60, 60))
    void = disc(z.shape, (30, 30), 3)
    z[:20] = 1e6  # 7 rows off the void
    voids = find_voids(void)
    out = np.empty((1, 1))
    lags = np.array([1])
    squares_around(0, 1, z, voids.labels, voids.runs, voids.first_run, lags, out, 6)
    assert out[0, 0] == 0
    squares_around(0, 1, z, voids.labels, voids.runs, voids.first_run, lags, out, 12)
    assert out[0, 0] > 0


@pytest.mark.parametrize("exponent", [1.4, 1.6, 1.9])
def test_as_rough_as_the_surroundings(exponent):
    z = rough_ground(exponent=exponent)
    void = voids_of(z.shape)
    smooth = fill_voids(z, void).values
    rough = fill_voids(z, void, natural_roughness=True).values
    for lag in LAGS:
        around = structure(z, ~void, lag)
        assert structure(rough, void, lag) == pytest.approx(around, rel=0.2)
    assert structure(smooth, void, 1) < 0.75 * structure(z, ~void, 1)
    np.testing.assert_array_equal(rough[~void], z[~void])


def test_step_across_the_rim_is_none():
    z = rough_ground()
    void = voids_of(z.shape)
    rough = fill_voids(z, void, natural_roughness=True).values
    step = np.abs(np.diff(rough, axis=1))
    across = void[:, 1:] != void[:, :-1]
    inside = void[:, 1:] & void[:, :-1]
    assert step[across].mean() < 1.05 * step[inside].mean()


def test_roughness_follows_the_ground_around_each_void():
    """Where one half of a tile is ten times as rough, so are its voids."""
    z = rough_ground(relief=100.0)
    z[:, 150:] *= 10
    void = voids_of(z.shape)
    filled = fill_voids(z, void, natural_roughness=True)
    left = filled.voids.runs[filled.voids.first_run[:-1], 1] < 150
    amplitude = filled.roughness.amplitude
    assert np.median(amplitude[~left]) == pytest.approx(10 * np.median(amplitude[left]), rel=0.5)


@pytest.mark.parametrize("shape", ["plane", "cone", "hill"])
def test_smooth_ground_stays_smooth(shape):
    """However steep it is, and however much of it the fill misses."""
    row, column = np.indices((200, 200)) - 100.0
    radius = np.hypot(row, column)
    hill = {"plane": plane(row.shape), "cone": 1000 - 3 * radius}
    z = hill.get(shape, 1000 * np.exp(-(radius**2) / 3000))
    void = disc(z.shape, (100, 100), 40)
    smooth = fill_voids(z, void).values
    rough = fill_voids(z, void, natural_roughness=True).values
    assert (rough - smooth).std() < 1


def test_steep_ground_is_roughened_all_the_same():
    """A steep slope is not roughness: its voids are given what level ground would be."""
    z = rough_ground(relief=100.0)
    void = voids_of(z.shape)

    def amplitudes(ground):
        return fill_by_mcmd(ground, void, natural_roughness=True).roughness.amplitude

    level, steep = amplitudes(z), amplitudes(z + plane(z.shape, (40.0, 25.0)))
    assert (level > 0).all()
    np.testing.assert_allclose(steep, level, rtol=0.1)


def test_each_void_depends_on_its_own_surroundings():
    z = rough_ground()
    void = voids_of(z.shape)
    others = void.copy()
    others[:150] = False
    # MCMD, for what another fill learns of the ground depends on all its voids.
    with_all = fill_by_mcmd(z, void, natural_roughness=True).values
    with_few = fill_by_mcmd(z, others, natural_roughness=True).values
    # The window of the last row of voids does not reach the others.
    np.testing.assert_array_equal(with_all[240:], with_few[240:])


def test_seed_and_threads():
    z = rough_ground((150, 150)).astype(np.float32)
    void = voids_of(z.shape)

    def fill(**options):
        return fill_voids(z, void, natural_roughness=True, **options).values

    assert np.array_equal(fill(threads=1), fill(threads=3))
    assert not np.array_equal(fill(), fill(seed=1))


@pytest.mark.parametrize("dtype", [np.int16, np.float32, np.float64])
def test_tiny_voids_and_types(dtype):
    z = rough_ground((40, 40)).astype(dtype)
    void = np.zeros(z.shape, bool)
    void[0, 0] = void[5, 5:7] = void[20, :] = True
    filled = fill_voids(z, void, natural_roughness=True)
    assert filled.values.dtype == dtype
    assert np.isfinite(filled.values).all()
    assert filled.roughness.amplitude[0] == 0  # one cell has no structure


def test_left_voids_are_left():
    z = rough_ground((60, 60))
    void = disc(z.shape, (30, 30), 10)
    void[0, 0] = True
    z[0, 0] = -9999
    filled = fill_voids(z, void, natural_roughness=True, interior_only=True)
    assert filled.values[0, 0] == -9999


def test_not_together_with_r_s():
    z = rough_ground((20, 20))
    with pytest.raises(InputError, match="natural_roughness"):
        fill_voids(z, disc(z.shape, (10, 10), 3), natural_roughness=True, r_s=0.1)


def test_cancel():
    z = rough_ground()
    void = voids_of(z.shape)
    told = []

    class Stop:
        def report(self, fraction):
            told.append(fraction)

        def cancelled(self):
            return told and told[-1] > 0.6

    with pytest.raises(Cancelled):
        fill_voids(z, void, natural_roughness=True, progress=Stop())
    assert max(told) < 0.8


def test_smoothing_is_a_mean_of_neighbours_within_the_void():
    from scipy.ndimage import convolve

    void = disc((40, 50), (20, 25), 9) | disc((40, 50), (0, 0), 4)
    noise = np.where(void, np.random.default_rng(0).normal(size=void.shape), 0.0)
    kernel = np.outer([1, 6, 1], [1, 6, 1]) / 64
    expected = np.where(void, convolve(noise, kernel, mode="constant"), 0.0)
    voids = find_voids(void)
    smooth(0, len(voids), noise, voids.labels, voids.runs, voids.first_run)
    np.testing.assert_allclose(noise, expected, atol=1e-15)
