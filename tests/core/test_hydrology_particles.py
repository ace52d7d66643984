"""Particles: their law, how they agree with MFD, and that chance depends on the seed alone."""

import numpy as np
import pytest
from scenes import fractal
from scipy import stats

from demsmith.core.errors import InputError
from demsmith.core.hydrology._chance import begin, binomial, uniform
from demsmith.core.hydrology.accumulation import accumulate_mfd
from demsmith.core.hydrology.depressions import fill_depressions
from demsmith.core.hydrology.flats import resolve_flats
from demsmith.core.hydrology.particles import drop_particles, standard_error
from demsmith.core.hydrology.traversal import Surface


@pytest.fixture(scope="module")
def ground():
    """Filled noise with a void, and the area of its cells."""
    void = np.zeros((50, 60), bool)
    void[20:24, 30:33] = True
    z = fill_depressions(np.round(fractal((50, 60), relief=60)).astype(np.float32), void)
    return z, resolve_flats(z, void), void, np.linspace(1, 2, 50), np.full(50, 2.0)


@pytest.fixture(scope="module")
def weights():
    return np.linspace(1, 2, 50) * 2


# --- draws ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("trials", "chance"),
    [(1, 0.3), (5, 0.8), (30, 0.1), (40, 0.5), (25, 0.41), (1000, 0.03), (1000, 0.7), (10**6, 0.2)],
)
def test_binomial_draws_have_the_binomial_distribution(trials, chance):
    state, draws = np.empty(1, np.uint64), []
    for place in range(4000):
        begin(state, 5, trials, place)
        draws.append(binomial(state, trials, chance))
    draws = np.array(draws)
    below, at = stats.binom.cdf(draws - 1, trials, chance), stats.binom.pmf(draws, trials, chance)
    spread = below + at * np.random.default_rng(0).random(draws.size)
    assert stats.kstest(spread, "uniform").pvalue > 1e-3


def test_many_trials():
    state = np.empty(1, np.uint64)
    begin(state, 1, 1, 1)
    n, p = 10**15, 0.4
    scores = [(binomial(state, n, p) - n * p) / np.sqrt(n * p * (1 - p)) for _ in range(2000)]
    assert stats.kstest(scores, "norm").pvalue > 1e-3


@pytest.mark.parametrize(("chance", "expected"), [(0, 0), (-0.1, 0), (1, 9), (1.1, 9)])
def test_certain_draws(chance, expected):
    state = np.empty(1, np.uint64)
    begin(state, 1, 1, 1)
    assert binomial(state, 9, chance) == expected


def test_streams_are_even_and_unrelated():
    state = np.empty(1, np.uint64)
    first = []
    for place in range(20_000):
        begin(state, 0, 3, place)
        first.append(uniform(state))
    assert stats.kstest(first, "uniform").pvalue > 1e-3
    assert abs(np.corrcoef(first[:-1], first[1:])[0, 1]) < 0.03


# --- law -----------------------------------------------------------------------------------------


def test_particles_walk_as_if_each_were_alone():
    # Three ways from the first row: numbers that leave are multinomial.
    z = np.array([[9, 9, 9], [4, 3, 5]], np.float32)
    void, one = np.zeros(z.shape, bool), np.ones(2)
    weights = np.array([[0, 1.0, 0], [0, 0, 0]])
    p = accumulate_mfd(z, None, void, one, one, weights)[1]
    # The middle of the second row gets from the others too.
    counts = np.array([
        drop_particles(z, None, void, one, one, weights, particles=60, seed=seed)[0][1] * 60
        for seed in range(400)
    ])  # fmt: skip
    np.testing.assert_allclose(counts.mean(axis=0) / 60, p, atol=0.012)
    sides = np.cov(counts[:, [0, 2]].T)
    np.testing.assert_allclose(np.diag(sides), 60 * p[[0, 2]] * (1 - p[[0, 2]]), rtol=0.25)


def test_areas_agree_with_mfd_within_their_standard_error(ground, weights):
    expected = accumulate_mfd(*ground, weights)
    void, total = ground[2], weights.sum() * 60 - (weights[20:24] * 3).sum()
    share = expected[~void] / total
    exact = total * np.sqrt(share * (1 - share) / 20_000)
    squares = np.zeros(share.size)
    seeds = 30
    for seed in range(seeds):
        area, error = drop_particles(*ground, weights, particles=20_000, seed=seed)
        squares += ((area - expected)[~void] / exact) ** 2
        many = share * 20_000 > 50
        np.testing.assert_allclose(error[~void][many], exact[many], rtol=0.6)
    # Chi-square with as many degrees of freedom as seeds, cell by cell; cells are related.
    assert squares.mean() / seeds == pytest.approx(1, abs=0.15)
    tail = stats.chi2.sf(squares, seeds)
    assert np.mean(tail < 1e-4) < 2e-3
    assert np.mean(tail > 0.5) == pytest.approx(0.5, abs=0.15)


def test_the_error_falls_with_the_square_root_of_the_number(ground, weights):
    expected = accumulate_mfd(*ground, weights)

    def error(particles):
        return np.sqrt(np.mean([
            (drop_particles(*ground, weights, particles=particles, seed=seed)[0] - expected) ** 2
            for seed in range(12)
        ]))  # fmt: skip

    few, more, many = error(10**3), error(10**5), error(10**9)
    assert few / more == pytest.approx(10, rel=0.35)
    assert more / many == pytest.approx(100, rel=0.35)


def test_every_particle_ends_somewhere(ground, weights):
    area, _ = drop_particles(*ground, weights, particles=12_345, seed=3)
    ends = (Surface(*ground).receivers(1.1) == 0) & ~ground[2]
    total = weights.sum() * 60 - (weights[20:24] * 3).sum()
    assert area[ends].sum() == pytest.approx(total, rel=1e-12)
    counts = area * 12_345 / total
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    assert (area[ground[2]] == 0).all()


# --- chance depends on the seed alone ------------------------------------------------------------


def test_same_bytes_for_any_number_of_threads():
    z = fractal((1100, 1000)).astype(np.float32)
    void, one = np.zeros(z.shape, bool), np.ones(1100)
    results = {
        drop_particles(z, None, void, one, one, one, particles=10**5, threads=n)[0].tobytes()
        for n in (1, 3)
    }
    assert len(results) == 1


def test_another_seed_gives_other_walks(ground, weights):
    one, other = (drop_particles(*ground, weights, particles=1000, seed=seed)[0] for seed in (0, 1))
    assert np.mean(one != other) > 0.3


def test_one_particle_leaves_one_trail(ground, weights):
    area, error = drop_particles(*ground, weights, particles=1, seed=7)
    total = weights.sum() * 60 - (weights[20:24] * 3).sum()
    np.testing.assert_allclose(np.unique(area), [0, total])
    assert np.isfinite(error).all()


def test_weights_say_where_particles_drop():
    z = np.zeros((4, 5), np.float32)
    weights = np.zeros((4, 5))
    weights[1, 2], weights[3, 4] = 1, 3
    void, one = np.zeros(z.shape, bool), np.ones(4)
    area, _ = drop_particles(z, None, void, one, one, weights, particles=40_000)
    assert np.flatnonzero(area).tolist() == [7, 19]
    assert area[1, 2] == pytest.approx(1, abs=0.05)


def test_standard_error_of_nothing_is_that_of_one_particle():
    np.testing.assert_allclose(
        standard_error(np.array([[0.0, 1.0]]), 100.0, 100),
        np.full((1, 2), np.sqrt(0.99)),
        rtol=1e-6,
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(particles=0), "particles is 0"),
        (dict(particles=10**16), "particles"),
        (dict(seed=-1), "seed is -1"),
        (dict(exponent=-1), "exponent"),
    ],
)
def test_options_out_of_range_are_refused(change, message, ground, weights):
    with pytest.raises(InputError, match=message):
        drop_particles(*ground, weights, **change)


@pytest.mark.parametrize(
    ("value", "message"), [(-1.0, "row 0, column 0 is -1"), (0.0, "all weights are 0")]
)
def test_weights_must_be_a_distribution(value, message, ground):
    with pytest.raises(InputError, match=message):
        drop_particles(*ground, np.full((50, 60), value))
