"""What the accurate engine learns of a ground: covariance, noise, shares, expected errors."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import disc, fractal, holed, plane

from demsmith.core.errors import Cancelled
from demsmith.core.pixel_size import metres
from demsmith.core.validation import punch_voids
from demsmith.core.voids import fill_voids
from demsmith.core.voids.accurate import ESTIMATORS, learn, training_windows
from demsmith.core.voids.sizes import SIZE_CLASSES

SIDE = 300


def windows_of(values, void=None, pixel_size=None):
    void = np.zeros(values.shape, bool) if void is None else void
    return training_windows(values, void, metres(values.shape, pixel_size))


def rough_plane(noise, *, seed=0):
    return plane((SIDE, SIDE), (2.0, -1.0)) + np.random.default_rng(seed).normal(
        0, noise, (SIDE, SIDE)
    )


@pytest.fixture(scope="module")
def ground():
    return fractal((SIDE, SIDE), seed=3, relief=800, exponent=1.9)


@pytest.fixture(scope="module")
def model(ground):
    return learn(windows_of(ground))


def test_shares_add_up_to_one_and_none_is_negative(model):
    assert model.weights.shape == (len(SIZE_CLASSES), len(ESTIMATORS))
    np.testing.assert_allclose(model.weights.sum(axis=1), 1)
    assert (model.weights >= 0).all()


def test_the_blend_is_no_worse_than_its_parts(model):
    """In the voids it was fitted to, where they were enough not to be drawn to the usual shares."""
    for tried, row in zip(model.tried, model.rmse, strict=True):
        assert (tried > 0) == np.isfinite(row[-1])
        if tried >= 10:
            assert row[-1] <= 1.1 * np.nanmin(row[:-1])


def test_reasons_say_shares_and_errors_in_numbers(model):
    for k in range(len(SIZE_CLASSES)):
        reason = model.reason(k)
        assert "%" in reason
        if model.tried[k]:
            assert f"in {model.tried[k]} artificial voids" in reason
            assert f"blend {model.rmse[k, -1]:.1f}" in reason
        else:
            assert "the usual shares" in reason
    assert model.tried[0] > 0


def test_same_model_whatever_the_threads(ground):
    one, other = (learn(windows_of(ground[:150, :160]), threads=threads) for threads in (1, 3))
    for name in ("weights", "rmse", "tried", "spread", "scale"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_array_equal(one.covariance.weights, other.covariance.weights)
    assert one.roughness == other.roughness


def test_what_lies_in_voids_is_not_learned(ground):
    ground = ground[:150, :160]
    void = disc(ground.shape, (70, 70), 12) | holed(ground.shape, (0, 5, 0, 9))
    one, other = (
        learn(windows_of(np.where(void, rubbish, ground), void)) for rubbish in (np.nan, -9999.0)
    )
    np.testing.assert_array_equal(one.covariance.weights, other.covariance.weights)
    np.testing.assert_array_equal(one.weights, other.weights)
    assert np.isfinite(one.scale).all()


@pytest.mark.parametrize("factor", [0.01, 50.0])
def test_stretched_ground_teaches_the_same_shares(ground, model, factor):
    again = learn(windows_of(factor * ground))
    np.testing.assert_allclose(again.weights, model.weights, atol=0.02)
    np.testing.assert_allclose(again.rmse[:, -1], factor * model.rmse[:, -1], rtol=0.02)
    np.testing.assert_allclose(again.roughness, factor * model.roughness, rtol=0.02)


def test_raised_ground_teaches_the_same(ground, model):
    again = learn(windows_of(ground + 3000))
    np.testing.assert_allclose(again.weights, model.weights, atol=0.02)
    np.testing.assert_allclose(again.rmse[:, -1], model.rmse[:, -1], rtol=0.02)


@pytest.mark.parametrize("noise", [0.5, 4.0])
def test_the_noise_of_a_plane_is_found(noise):
    found = learn(windows_of(rough_plane(noise))).covariance
    assert np.sqrt(found.noise) == pytest.approx(noise, rel=0.15)


def test_smooth_ground_has_no_noise():
    smooth = fractal((SIDE, SIDE), exponent=3.0)
    found = learn(windows_of(smooth)).covariance
    assert np.sqrt(found.noise) < 0.01 * np.abs(np.diff(smooth)).mean()


def test_a_void_in_a_noisy_plane_is_filled_by_the_plane():
    """By fitting through the noise: the error is far below that of one noisy cell."""
    truth, void = plane((SIDE, SIDE), (2.0, -1.0)), np.zeros((SIDE, SIDE), bool)
    for top in range(10, 290, 20):
        for left in range(10, 290, 20):
            void[top : top + 3, left : left + 3] = True
    noisy = rough_plane(4.0)
    error = {
        method: np.sqrt(((fill_voids(noisy, void, method=method).values - truth)[void] ** 2).mean())
        for method in ("auto", "mcmd")
    }
    assert error["auto"] < 0.5 * 4.0
    assert error["auto"] < 0.7 * error["mcmd"]


@pytest.mark.parametrize("exponent", [1.7, 2.3])
def test_intervals_hold_what_they_should(exponent):
    """Sigma on ground that was not learned from: near 68 and 95 %, within wide limits."""
    truth = fractal((SIDE, SIDE), seed=11, relief=800, exponent=exponent)
    void = punch_voids(truth, seed=5)
    filled = fill_voids(truth, void)
    ratio = abs(filled.values - truth)[void] / filled.sigma[void]
    assert 0.5 < (ratio < 1).mean() < 0.85
    assert 0.85 < (ratio < 1.96).mean() < 0.995


def test_more_is_expected_where_more_goes_wrong():
    """Smooth ground in the west, rough in the east: the expected errors know."""
    truth = fractal((SIDE, SIDE), seed=4, exponent=1.8)
    truth[:, : SIDE // 2] = 0.02 * truth[:, : SIDE // 2] + 300
    filled = fill_voids(truth, punch_voids(truth, seed=1) & ~disc(truth.shape, (150, 150), 30))
    west = filled.voids.runs[filled.voids.first_run[:-1], 1] < 130
    east = filled.voids.runs[filled.voids.first_run[:-1], 1] > 170
    assert np.median(filled.choices.error[east]) > 5 * np.median(filled.choices.error[west])


# --- little to learn from ------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (50, 1), (2, 2), (7, 9), (31, 31), (20, 400)])
def test_small_rasters_have_a_model(shape):
    values = np.random.default_rng(0).normal(size=shape)
    found = learn(windows_of(values))
    np.testing.assert_allclose(found.weights.sum(axis=1), 1)
    assert np.isfinite(found.covariance.weights).all() and np.isfinite(found.scale).all()


@pytest.mark.parametrize("shape", [(40, 50), (200, 200)])
@pytest.mark.parametrize(
    "ground",
    [
        lambda shape: np.full(shape, 7.0),
        lambda shape: plane(shape),
        lambda shape: np.clip(plane(shape), 400, 450),
        lambda shape: np.where(np.indices(shape)[1] < shape[1] // 2, 0.0, fractal(shape)),
    ],
    ids=["flat", "plane", "clipped plane", "sea and land"],
)
def test_ground_with_nothing_to_learn_is_filled(ground, shape):
    """Level ground is filled level, with a small expected error, and without a warning."""
    truth, void = ground(shape), disc(shape, (20, 20), 5) | holed(shape, (3, 5, 40, 45))
    filled = fill_voids(truth, void)
    assert np.isfinite(filled.values).all() and np.isfinite(filled.sigma).all()
    assert (filled.sigma[void] > 0).all()
    if np.ptp(truth) == 0:
        assert (filled.values == truth).all()


def test_mostly_void():
    truth = fractal((120, 120))
    void = np.random.default_rng(0).random(truth.shape) < 0.97
    filled = fill_voids(truth, void)
    assert np.isfinite(filled.values).all() and (filled.sigma[void] > 0).all()


def test_no_voids_need_no_model():
    filled = fill_voids(fractal((30, 30)))
    assert filled.model is None and not filled.sigma.any() and filled.choices.error.size == 0


def test_learning_can_be_cancelled(ground):
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    with pytest.raises(Cancelled):
        learn(windows_of(ground), progress=Stop())


def test_a_tension_that_is_given_is_not_learned():
    rough = fractal((200, 200), exponent=1.5)
    usual = learn(windows_of(rough, pixel_size=30.0))
    taut = learn(windows_of(rough, pixel_size=30.0), tension=90.0)
    np.testing.assert_allclose(taut.tension, 3)
    assert (usual.tension > 3).all()
    # Each estimator is judged under the tension it will fill with.
    differ = (taut.rmse != usual.rmse)[0]
    assert differ[ESTIMATORS.index("mcmd")] and differ[ESTIMATORS.index("structured")]


def test_a_model_goes_between_processes(model):
    """Plain numbers and arrays: what a mosaic's workers are sent."""
    import pickle

    again = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(again.weights, model.weights)
    assert replace(again, roughness=0.0).roughness == 0
