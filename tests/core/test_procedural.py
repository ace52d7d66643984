"""Inverse procedural modelling: what is planted is found, and models say what they are of."""

import numpy as np
import pytest
from support import hills, shared_data

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.procedural import (
    ProceduralizeOptions,
    proceduralize,
    select,
)
from demsmith.core.procedural.functions import random_functions, sampled
from demsmith.core.progress import SILENT
from demsmith.core.sparse import PatchGrid, gather, pursue
from demsmith.core.trees import Node


def psnr(terrain, values):
    known = ~terrain.void
    error = terrain.evaluate()[known] - values[known]
    return 20 * np.log10(np.ptp(values[known]) / np.sqrt(np.mean(error**2)))


@pytest.fixture(scope="module")
def ground():
    return hills(90, 110, dtype=np.float32)


def quick(values, void=None, **options):
    return proceduralize(values, void, **{"candidates": 300, "atoms": 40, **options})


def test_a_planted_function_is_found():
    """Terrain of one function alone: the model's discs are that function."""
    grid = PatchGrid((10, 10))
    functions = random_functions(50, families=[1], terms=1, grid=grid, seed=0)
    made = sampled(functions, grid, progress=SILENT)
    chosen = select(7 * made.samples[[13, 13, 20]], made.samples, 2, 1)
    assert chosen.tolist() == [13, 20]
    indices, coefficients = pursue(7 * made.samples[[13, 20]], made.samples[chosen], 1)
    assert indices.ravel().tolist() == [0, 1]
    np.testing.assert_allclose(coefficients, 7, rtol=1e-5)


def test_atoms_have_no_mean_and_unit_norm():
    grid = PatchGrid((50, 50), 12, 8, 6, 4)
    functions = random_functions(60, families=range(3), terms=4, grid=grid, seed=1)
    made = sampled(functions, grid, progress=SILENT)
    disc = grid.disc.ravel()
    assert not made.samples[:, ~disc].any()
    np.testing.assert_allclose(made.samples[:, disc].mean(axis=1), 0, atol=1e-6)
    np.testing.assert_allclose((made.samples[:, disc] ** 2).mean(axis=1), 1, rtol=1e-5)
    shortest = functions.wavelengths[functions.amplitudes != 0].min()
    assert shortest >= 4 * 2 / 8
    assert set(functions.families) == {0, 1, 2}


def test_families_are_drawn_alike():
    grid = PatchGrid((50, 50))
    one, other = (
        random_functions(20, families=[family], terms=3, grid=grid, seed=5) for family in (0, 1)
    )
    np.testing.assert_array_equal(one.wavelengths, other.wavelengths)
    np.testing.assert_array_equal(one.amplitudes, other.amplitudes)


@pytest.mark.parametrize("sparsity", [1, 3])
def test_chosen_atoms_are_better_than_any(ground, sparsity):
    grid = PatchGrid(ground.shape)
    functions = random_functions(400, families=[1], terms=1, grid=grid, seed=2)
    candidates = sampled(functions, grid, progress=SILENT).samples
    patches = gather(ground, np.zeros(ground.shape, bool), grid)
    samples = patches.samples[patches.counts == patches.counts.max()]

    def error(chosen):
        indices, coefficients = pursue(samples, candidates[chosen], sparsity)
        rest = samples - np.einsum("ns,nsk->nk", coefficients, candidates[chosen][indices])
        return np.sqrt(np.mean(rest**2))

    chosen = select(samples, candidates, 30, sparsity)
    assert len(set(chosen.tolist())) == 30
    rng = np.random.default_rng(0)
    others = [error(rng.choice(400, 30, replace=False)) for _ in range(5)]
    assert error(chosen) < 0.9 * min(others)


def test_a_model_is_close_and_closer_with_more_atoms(ground):
    scores = [psnr(quick(ground, sparsity=s), ground) for s in (1, 2, 4)]
    assert scores[0] > 30
    assert np.all(np.diff(scores) > 1)
    assert psnr(quick(ground, radius=3.0), ground) > psnr(quick(ground, radius=9.0), ground) + 5


def test_a_model_is_a_continuous_function_of_the_ground(ground):
    terrain = quick(ground, pixel_size=(20.0, 30.0), radius=120.0)
    assert isinstance(terrain.node, Node)
    assert (terrain.grid.side_rows, terrain.grid.side_columns) == (8, 12)
    whole = terrain.evaluate()
    x, y = np.meshgrid(*terrain.frame.axes())
    np.testing.assert_allclose(terrain.node.elevation(x, y), whole, atol=2e-3)
    fine = terrain.evaluate(scale=3)
    assert fine.shape == (270, 330)
    np.testing.assert_allclose(fine[1::3, 1::3], whole, atol=2e-3)
    assert np.abs(np.diff(fine)).max() < np.abs(np.diff(whole)).max()
    coarse = terrain.evaluate(scale=0.5)
    assert coarse.shape == (45, 55)
    means = whole.reshape(45, 2, 55, 2).mean(axis=(1, 3))
    assert np.abs(coarse - means).max() < 0.1 * np.ptp(whole)


def test_voids_stay_voids_and_say_nothing(ground):
    void = np.zeros(ground.shape, bool)
    void[30:60, 40:75] = True
    void[0, :7] = True
    holed = ground.copy()
    holed[void] = -32768
    terrain = quick(holed, void)
    made = terrain.evaluate()
    np.testing.assert_array_equal(np.isnan(made), void)
    assert psnr(terrain, ground) > 30
    np.testing.assert_array_equal(np.isnan(terrain.evaluate(scale=2)),
                                  np.kron(void, np.ones((2, 2), bool)))  # fmt: skip
    holed[void] = np.nan
    np.testing.assert_array_equal(quick(holed).evaluate(), made)


@pytest.mark.parametrize("shape", [(1, 1), (3, 40), (10, 10), (11, 6)])
def test_small_rasters(shape):
    values = hills(*shape, dtype=np.float32)
    made = quick(values, sparsity=2, candidates=64, atoms=64).evaluate()
    assert np.isfinite(made).all()
    assert np.abs(made - values).max() <= np.ptp(values) + 1e-3


def test_flat_ground_is_flat():
    np.testing.assert_allclose(quick(np.full((30, 30), 123, np.int16)).evaluate(scale=2), 123)


def test_seeds_and_threads():
    ground = hills(60, 60)
    one, same, other = (
        quick(ground, seed=seed, threads=threads) for seed, threads in ((0, 1), (0, 3), (1, None))
    )
    for name in ("heights", "indices", "coefficients", "means"):
        np.testing.assert_array_equal(getattr(one, name), getattr(same, name))
    assert not np.array_equal(one.functions.seeds, other.functions.seeds)


def test_every_option_matters():
    ground = hills(60, 60)
    changes = [{}, dict(family="perlin"), dict(family="multifractal"), dict(family="mixed"),
               dict(atoms=20), dict(sparsity=3), dict(radius=7.0), dict(candidates=200),
               dict(terms=3), dict(seed=3)]  # fmt: skip
    made = {quick(ground, **change).evaluate().tobytes() for change in changes}
    assert len(made) == len(changes)
    mixed = quick(ground, family="mixed").functions.families
    assert set(mixed) == {0, 1, 2}


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (dict(family="simplex"), "family"),
        (dict(atoms=0), "atoms"),
        (dict(sparsity=99), "sparsity"),
        (dict(radius=1e6), "radius of 1e\\+06 m"),
        (dict(terms=9), "terms"),
        (dict(shape=3), "shape"),
        (dict(pixel_size=-1), "pixel_size"),
    ],
)
def test_wrong_options_are_refused(ground, wrong, said):
    with pytest.raises(InputError, match=said):
        proceduralize(ground, **wrong)


def test_nothing_but_voids_is_refused(ground):
    with pytest.raises(InputError, match="every cell is a void"):
        proceduralize(np.full((9, 9), np.nan))


@pytest.mark.parametrize("scale", [0, -1, np.nan, 1e5])
def test_scales_that_make_no_raster_are_refused(ground, scale):
    with pytest.raises(InputError, match="scale"):
        quick(ground).evaluate(scale=scale)


def test_it_is_cancelled(ground):
    class Stop:
        def __init__(self, after):
            self.left = after

        def report(self, fraction):
            self.left -= 1

        def cancelled(self):
            return self.left < 0

    for after in (0, 5, 40):
        with pytest.raises(Cancelled):
            quick(ground, progress=Stop(after))


def test_ridged_noise_beats_perlins_on_mountains():
    """Figure 8 of the paper, on real mountains, with dictionaries drawn and chosen alike."""
    tile = raster.read(shared_data("sierra_nevada/N37W004.hgt"))
    values = tile.values[:300, :300].astype(np.float32)
    ridged, smooth = (
        psnr(proceduralize(values, family=family, candidates=1500), values)
        for family in ("ridged", "perlin")
    )
    assert ridged > smooth + 0.1


def test_defaults_are_the_papers_sizes():
    options = ProceduralizeOptions()
    assert (options.atoms, options.sparsity, options.family) == (128, 2, "ridged")
