"""Noise: the same everywhere, within its bounds, and with exact gradients."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from demsmith.core.errors import InputError
from demsmith.core.noise import (
    FAMILIES,
    PERLIN_LIPSCHITZ,
    NoiseSums,
    perlin,
    ridged,
    ridged_multifractal,
)

PERLIN_BITS = ["-0x1.91e8ec539cac0p-2", "0x1.995afb43fb354p-5", "0x1.4b27ba3b9c00cp-4"]


@pytest.fixture(scope="module")
def places():
    return np.random.default_rng(5).uniform(-300, 300, (2, 20_000))


def slopes(function, x, y, step=1e-6):
    """Central differences."""
    return (
        (function(x + step, y) - function(x - step, y)) / (2 * step),
        (function(x, y + step) - function(x, y - step)) / (2 * step),
    )  # fmt: skip


def test_the_bits_are_the_same_on_every_machine():
    made = perlin(np.array([0.25, 7.5, -3.7]), np.array([0.75, -2.25, 100.1]), seed=42)
    assert [value.hex() for value in made] == PERLIN_BITS


def test_noise_is_nought_on_the_lattice_and_nowhere_else_for_all(places):
    column, row = np.meshgrid(np.arange(-5, 6), np.arange(-5, 6))
    assert not perlin(column, row, seed=3).any()
    np.testing.assert_array_equal(ridged(column, row, seed=3), 1)
    assert np.count_nonzero(perlin(*places)) > 0.99 * places.shape[1]


@pytest.mark.parametrize("noise", [perlin, ridged])
def test_gradients_are_those_of_the_values(noise, places):
    joint = noise(*places, seed=9, with_gradient=True)
    np.testing.assert_array_equal(joint.value, noise(*places, seed=9))
    away = np.abs(perlin(*places, seed=9)) > 1e-5  # of crests, where ridged noise has none
    for found, wanted in zip(joint[1:], slopes(lambda x, y: noise(x, y, seed=9), *places),
                             strict=True):  # fmt: skip
        np.testing.assert_allclose(found[away], wanted[away], atol=1e-6)


def test_noise_stays_in_its_bounds_and_uses_them(places):
    joint = perlin(*places, with_gradient=True)
    assert -1 <= joint.value.min() < -0.8 < 0.8 < joint.value.max() <= 1
    assert abs(joint.value.mean()) < 0.01
    steepest = np.hypot(joint.gradient_x, joint.gradient_y).max()
    assert 0.8 * PERLIN_LIPSCHITZ < steepest <= PERLIN_LIPSCHITZ


def test_no_direction_is_preferred(places):
    joint = perlin(*places, with_gradient=True)
    angle = np.arctan2(joint.gradient_y, joint.gradient_x)
    shares = np.histogram(angle, 8, (-np.pi, np.pi))[0] / angle.size
    assert np.all(np.abs(shares - 1 / 8) < 0.02)


def test_seeds_make_other_noises(places):
    one, other = perlin(*places, seed=1), perlin(*places, seed=2)
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.03
    assert not np.array_equal(perlin(*places, seed=-1), perlin(*places, seed=1))


def test_the_joints_of_cells_are_smooth():
    near = np.array([2 - 1e-9, 2 + 1e-9])
    joint = perlin(near, 0.3, with_gradient=True)
    for line in joint:
        assert abs(line[0] - line[1]) < 1e-6


def test_shapes_and_odd_places():
    assert perlin(np.zeros((3, 1)), np.zeros(4)).shape == (3, 4)
    assert perlin(np.zeros((0,)), 1.0).shape == (0,)
    assert np.isnan(perlin([np.nan, np.inf], [0.0, 0.0])).all()
    with pytest.raises(InputError, match="do not go together"):
        perlin(np.zeros(3), np.zeros(4))


def test_threads_change_nothing():
    x, y = np.random.default_rng(0).normal(size=(2, 70_000))
    np.testing.assert_array_equal(perlin(x, y, threads=1), perlin(x, y, threads=3))
    sums = some_sums(30)
    np.testing.assert_array_equal(
        sums.values(x[:9999], y[:9999], threads=1), sums.values(x[:9999], y[:9999], threads=3)
    )


def some_sums(count, seed=0):
    rng = np.random.default_rng(seed)
    return NoiseSums(
        np.arange(count) % 3, rng.integers(0, 1 << 48, count), rng.normal(size=(count, 4)),
        rng.uniform(0.3, 4, (count, 4)),
    )  # fmt: skip


@pytest.mark.parametrize("family", FAMILIES)
def test_sums_have_exact_gradients_and_true_bounds(family, places):
    sums = NoiseSums([FAMILIES.index(family)], [7], [[1, 0.5, 0, -0.25]], [[3, 1.5, 9, 0.7]])
    joint = sums.joint(0, *places)
    (values,) = sums.values(*places)
    np.testing.assert_array_equal(values, joint.value.astype(np.float32))
    for found, wanted in zip(joint[1:], slopes(lambda x, y: sums.joint(0, x, y).value, *places),
                             strict=True):  # fmt: skip
        wrong = np.abs(found - wanted) > 1e-5
        assert wrong.mean() < (1e-4 if family == "perlin" else 1e-3)  # crests
    low, high = sums.bounds()
    assert low[0] <= joint.value.min() < joint.value.max() <= high[0]
    steepest = np.hypot(joint.gradient_x, joint.gradient_y).max()
    assert 0.1 * sums.lipschitz()[0] < steepest <= sums.lipschitz()[0]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**48 - 1), st.sampled_from(range(3)), st.integers(1, 8), st.data())
def test_bounds_hold_for_any_sum(seed, family, terms, data):
    numbers = st.lists(st.floats(-5, 5), min_size=terms, max_size=terms)
    lengths = st.lists(st.floats(0.01, 100), min_size=terms, max_size=terms)
    sums = NoiseSums([family], [seed], [data.draw(numbers)], [data.draw(lengths)])
    joint = sums.joint(0, *np.random.default_rng(1).uniform(-9, 9, (2, 500)))
    low, high = sums.bounds()
    assert np.all((low[0] - 1e-9 <= joint.value) & (joint.value <= high[0] + 1e-9))
    steepest = np.hypot(joint.gradient_x, joint.gradient_y).max()
    assert steepest <= sums.lipschitz()[0] * (1 + 1e-9)


def test_a_sum_is_the_sum_of_its_terms(places):
    whole = NoiseSums([1], [5], [[1, 0.5]], [[3, 1.5]]).joint(0, *places)
    first = NoiseSums([1], [5], [[1, 0]], [[3, 1.5]]).joint(0, *places)
    second = NoiseSums([1], [5], [[0, 0.5]], [[3, 1.5]]).joint(0, *places)
    np.testing.assert_allclose(whole.value, first.value + second.value, atol=1e-12)


def test_families_are_what_they_are_called(places):
    plain, folded, fractal = (
        NoiseSums([family], [5], [[1.0]], [[2.0]]).joint(0, *places).value for family in range(3)
    )
    np.testing.assert_allclose(folded, 1 - np.abs(plain), atol=1e-12)
    np.testing.assert_allclose(fractal, folded**2, atol=1e-12)


def test_multifractals_are_rough_on_crests_and_smooth_in_valleys():
    sums = NoiseSums([2, 2], [5, 5], [[1, 0], [1, 0.5]], [[8, 0.5], [8, 0.5]])
    x = np.linspace(0, 80, 4001)
    coarse, whole = sums.values(x, np.full(x.size, 3.3))
    fine = whole - coarse
    assert fine[coarse > 0.8].std() > 4 * fine[coarse < 0.1].std()


def test_wavelengths_are_lengths():
    """The noise crosses nought about as often as its wavelength says."""
    x = np.linspace(0, 5000, 100_001)
    counts = []
    for wavelength in (5.0, 20.0):
        sums = NoiseSums([0], [1], [[1.0]], [[wavelength]])
        values = sums.joint(0, x, np.zeros(x.size)).value
        counts.append(np.count_nonzero(np.diff(np.sign(values))))
    assert counts[0] / counts[1] == pytest.approx(4, rel=0.15)


def test_terms_fade_with_the_resolution(places):
    sums = NoiseSums([0], [3], [[1.0, 1.0]], [[16.0, 1.0]])
    coarse = NoiseSums([0], [3], [[1.0, 0.0]], [[16.0, 1.0]])
    fine_part = [
        np.abs(sums.joint(0, *places, resolution=cell).value - coarse.joint(0, *places).value).max()
        for cell in (0, 0.25, 0.35, 0.45, 0.5, 1)
    ]
    assert fine_part[0] == fine_part[1] > fine_part[2] > fine_part[3] > fine_part[4] == 0
    assert fine_part[5] == 0


def test_ridged_multifractal_is_the_sum_of_its_octaves():
    x, y = np.random.default_rng(3).uniform(-9, 9, (2, 100))
    sums = NoiseSums([2], [4], [[1, 0.4, 0.16]], [[1, 1 / 3, 1 / 9]])
    made = ridged_multifractal(x, y, seed=4, octaves=3, lacunarity=3, gain=0.4)
    np.testing.assert_allclose(made, sums.joint(0, x, y).value, rtol=1e-12)
    assert ridged_multifractal(x, y, with_gradient=True).gradient_x.shape == (100,)
    for wrong in (dict(octaves=0), dict(octaves=9), dict(lacunarity=0), dict(seed=-1)):
        with pytest.raises(InputError):
            ridged_multifractal(x, y, **wrong)


def test_sums_are_picked_and_joined():
    sums = some_sums(6)
    joined = NoiseSums.joined([sums[:2], NoiseSums([0], [1], [[1.0]], [[2.0]]), sums[[5]]])
    assert len(joined) == 4
    x, y = np.random.default_rng(3).uniform(-9, 9, (2, 50))
    np.testing.assert_array_equal(joined.values(x, y)[[0, 1, 3]], sums.values(x, y)[[0, 1, 5]])


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (dict(families=[3]), "family"),
        (dict(families=[-1]), "family"),
        (dict(families=[0, 0]), "do not go together"),
        (dict(seeds=[1 << 48]), "seed"),
        (dict(amplitudes=[[np.nan]]), "amplitude"),
        (dict(wavelengths=[[0.0]]), "wavelength"),
        (dict(wavelengths=[[np.nan]]), "wavelength"),
        (dict(amplitudes=np.ones((1, 9)), wavelengths=np.ones((1, 9))), "terms"),
    ],
)
def test_sums_that_make_no_sense_are_refused(wrong, said):
    right = dict(families=[0], seeds=[1], amplitudes=[[1.0]], wavelengths=[[1.0]])
    with pytest.raises(InputError, match=said):
        NoiseSums(**{**right, **wrong})
