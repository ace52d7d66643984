"""The learned covariance: from a known spectrum back to its energy, and to other cell sizes."""

import numpy as np
import pytest
from scenes import fractal, holed

from demsmith.core.voids.accurate.spectrum import HIGHEST, Covariance, learn_covariance

SIDE = 512
TURN = 2 - 2 * np.cos(2 * np.pi * np.fft.fftfreq(SIDE))


def energy(weights, down, across):
    """What a wave costs whose differences square to these factors."""
    return sum(
        weights[i, j] * down**i * across**j
        for i in range(HIGHEST + 1)
        for j in range(HIGHEST + 1 - i)
    )


def field(weights, *, noise=0.0, seed=0):
    """A Gaussian field with the energy of these weights, a torus, and white noise."""
    rng = np.random.default_rng(seed)
    cost = energy(weights, TURN[:, None], TURN[None, :])
    cost[0, 0] = np.inf
    waves = np.fft.fft2(rng.standard_normal((SIDE, SIDE))) / np.sqrt(cost)
    return np.fft.ifft2(waves).real + noise * rng.standard_normal((SIDE, SIDE))


def learned(z, void=None, dx=1.0, dy=1.0):
    void = np.zeros(z.shape, bool) if void is None else void
    return learn_covariance([(z, void, np.full(len(z), dx), np.full(len(z), dy))])


def weights(orders):
    out = np.zeros((HIGHEST + 1, HIGHEST + 1))
    for order, weight in orders.items():
        out[order] = weight
    return out


FIELDS = {
    "bending": {(2, 0): 1.0, (1, 1): 2.0, (0, 2): 1.0},
    "stretching and bending": {(1, 0): 0.2, (0, 1): 0.2, (2, 0): 1, (1, 1): 2, (0, 2): 1},
    "stiff across": {(2, 0): 0.1, (1, 1): 1.0, (0, 2): 10.0},
    "third": {(1, 0): 0.01, (0, 1): 0.01, (3, 0): 1, (2, 1): 3, (1, 2): 3, (0, 3): 1},
}
# Waves of 24, 8, 4 and 2.5 cells, along and across.
WAVES = 2 - 2 * np.cos(2 * np.pi / np.array([24, 8, 4, 2.5]))


@pytest.mark.parametrize("name", FIELDS)
def test_a_fields_energy_is_found(name):
    """The cost of waves of all lengths and both directions, within 40 %; their ratios too."""
    truth = weights(FIELDS[name])
    found = learned(field(truth))
    down, across = np.meshgrid(WAVES, WAVES, indexing="ij")
    ratio = energy(found.weights, down, across) / energy(truth, down, across)
    assert ratio.min() > 0.6 and ratio.max() < 1.6, ratio
    assert found.noise * energy(truth, WAVES, WAVES).max() < 0.2


def test_the_direction_of_the_stiffness_is_found():
    truth = weights(FIELDS["stiff across"])
    found = learned(field(truth)).weights
    for wave in WAVES[1:]:
        assert energy(found, 0, wave) / energy(found, wave, 0) == pytest.approx(100, rel=0.5)


def test_turned_ground_has_the_turned_weights():
    z = field(weights(FIELDS["stiff across"]))[:300, :300]
    straight, turned = learned(z, dx=60.0, dy=90.0), learned(z.T, dx=90.0, dy=60.0)
    assert (turned.dx, turned.dy) == (90, 60)
    down, across = np.meshgrid(WAVES, WAVES, indexing="ij")
    np.testing.assert_allclose(
        energy(turned.weights, across, down), energy(straight.weights, down, across), rtol=0.05
    )


@pytest.mark.parametrize("noise", [0.3, 1.0])
def test_noise_is_told_from_ground(noise):
    """Stiff ground under noise: both are found."""
    truth = weights({(2, 0): 1.0, (1, 1): 2.0, (0, 2): 1.0}) * 4
    found = learned(field(truth, noise=noise))
    assert np.sqrt(found.noise) == pytest.approx(noise, rel=0.2)
    slow = WAVES[0]
    assert energy(found.weights, slow, slow) == pytest.approx(energy(truth, slow, slow), rel=0.5)


def test_stretched_ground_costs_less():
    z = fractal((300, 300))
    one, ten = learned(z), learned(10 * z)
    np.testing.assert_allclose(energy(ten.weights, WAVES, WAVES) * 100,
                               energy(one.weights, WAVES, WAVES), rtol=0.02)  # fmt: skip


def test_a_plane_is_no_ground_to_learn():
    """Tilting the ground changes nothing."""
    z = fractal((300, 300))
    tilted = z + np.add.outer(3.0 * np.arange(300), -2.0 * np.arange(300))
    np.testing.assert_allclose(
        energy(learned(tilted).weights, WAVES, WAVES), energy(learned(z).weights, WAVES, WAVES),
        rtol=1e-3,
    )  # fmt: skip


def test_blocks_with_many_voids_are_not_looked_at():
    z, void = fractal((300, 300)), holed((300, 300), (0, 140, 0, 140))
    spoilt = np.where(void, 1e6 * np.random.default_rng(0).random(z.shape), z)
    whole = energy(learned(z).weights, WAVES, WAVES)
    np.testing.assert_allclose(energy(learned(spoilt, void).weights, WAVES, WAVES), whole, rtol=0.5)


@pytest.mark.parametrize("shape", [(1, 1), (3, 400), (33, 20), (31, 31)])
def test_too_little_ground_is_taken_to_bend_least(shape):
    found = learned(np.random.default_rng(0).normal(size=shape), dx=60.0, dy=90.0)
    assert found.noise == 0 and (found.dx, found.dy) == (60, 90)
    weight = found.weights
    assert weight[2, 0] > 0
    # Bending per metre is alike in both directions.
    assert weight[0, 2] / weight[2, 0] == pytest.approx((90 / 60) ** 4)
    assert weight[1, 1] / weight[2, 0] == pytest.approx(2 * (90 / 60) ** 2)
    assert 0 < weight[1, 0] < 0.1 * weight[2, 0]


def test_small_ground_is_learned_from_in_smaller_blocks():
    """Such as 40 cells a side: less sure, but of the right size."""
    z = fractal((300, 300))
    short = WAVES[1:]
    large, small = (energy(learned(each).weights, short, short) for each in (z, z[:40, :40]))
    assert (small / large < 6).all() and (small / large > 1 / 6).all()


def test_weights_at_other_cell_sizes():
    """A surface costs the same per cell whatever the cells: differences grow with their size."""
    at = Covariance(weights({(1, 0): 1, (0, 2): 2, (1, 1): 3}), 0.0, 60.0, 90.0).at
    same, twice = at([60.0, 120.0], [90.0, 180.0])
    assert same[1, 0] == 1 and same[0, 2] == 2 and same[1, 1] == 3
    assert twice[1, 0] == 1 / 4
    assert twice[0, 2] == 2 / 16
    assert twice[1, 1] == 3 / 16
    (narrow,) = at([30.0], [90.0])
    assert narrow[1, 0] == 1 and narrow[0, 2] == 32 and narrow[1, 1] == 12
