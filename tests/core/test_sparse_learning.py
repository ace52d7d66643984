"""Learning dictionaries from terrain: discs, voids, methods, two resolutions, weighting."""

import numpy as np
import pytest
from scenes import fractal
from support import shared_data

import demsmith
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.sparse import Dictionary, decompose, learn
from demsmith.core.sparse.learning import cosine_waves
from demsmith.core.sparse.metric import Metric
from demsmith.core.sparse.patches import PatchGrid, disc_weights
from demsmith.core.sparse.weighted import decompose_weighted

GROUND = fractal((120, 140), seed=5, relief=400).astype(np.float32)


def rmse(values, tree):
    return float(np.sqrt(((tree.evaluate() - values) ** 2).mean()))


def test_atoms_are_normalised():
    dictionary = learn(GROUND, atoms=20).dictionary
    inside = dictionary.disc.ravel()
    assert dictionary.samples.shape == (20, 100)
    assert (dictionary.samples[:, ~inside] == 0).all()
    np.testing.assert_allclose(dictionary.samples[:, inside].mean(axis=1), 0, atol=1e-5)
    squares = (dictionary.samples[:, inside] ** 2).mean(axis=1)
    np.testing.assert_allclose(np.sqrt(squares), 1, atol=1e-5)
    assert {dictionary.provenance(i).kind for i in range(20)} == {"sampled"}


def test_learned_atoms_are_better_than_cosine_waves_and_random_discs():
    waves = Dictionary.of_samples(cosine_waves(10, 10)[:32], 10, 10).samples
    random = learn(GROUND, atoms=32, sparsity=3, method="constrained", iterations=1)
    learned = learn(GROUND, atoms=32, sparsity=3)
    errors = [
        rmse(GROUND, decompose_weighted(GROUND, dictionary=each, sparsity=3))
        for each in (waves, random.dictionary.samples, learned.dictionary.samples)
    ]
    assert errors[2] < 0.92 * min(errors[:2])


def test_the_weighted_blend_is_nearer_to_the_ground():
    weighted = learn(GROUND, atoms=32).dictionary.samples
    even = learn(GROUND, atoms=32, weighting="even").dictionary.samples
    ours = rmse(GROUND, decompose_weighted(GROUND, dictionary=weighted, sparsity=2))
    assert ours < 0.75 * rmse(GROUND, decompose(GROUND, dictionary=even, sparsity=2))
    assert ours < rmse(GROUND, decompose_weighted(GROUND, dictionary=even, sparsity=2))


def test_polishing_lowers_the_error_of_the_blend():
    plain = learn(GROUND, atoms=32, polishing=0)
    polished = learn(GROUND, atoms=32, polishing=4)
    errors = [
        rmse(GROUND, decompose_weighted(GROUND, dictionary=each.dictionary.samples, sparsity=2))
        for each in (plain, polished)
    ]
    assert plain.blend_errors == ()
    assert plain.errors == polished.errors
    assert errors[1] < 0.97 * errors[0]
    assert polished.blend_errors[0] == pytest.approx(errors[0], rel=1e-3)
    assert min(polished.blend_errors) == pytest.approx(errors[1], rel=1e-3)
    threads = [learn(GROUND, atoms=20, threads=n).dictionary.samples.tobytes() for n in (1, 2)]
    assert threads[0] == threads[1]


def test_polishing_never_sees_a_void():
    void = np.zeros(GROUND.shape, bool)
    void[30:60, 50:90] = True
    results = [
        learn(np.where(void, fill, GROUND), void, atoms=16, iterations=3) for fill in (-500, 9000)
    ]
    assert results[0].blend_errors == results[1].blend_errors
    assert len(results[0].blend_errors) > 1


def test_decomposition_is_exact_where_discs_are_sums_of_few_atoms():
    y, x = np.mgrid[:60, :70]
    ground = (3 * x - 2 * y + 900).astype(np.float32)
    atoms = Dictionary.of_samples(
        np.stack([np.mgrid[:10, :10][0].ravel(), np.mgrid[:10, :10][1].ravel()]), 10, 10
    ).samples
    tree = decompose_weighted(ground, dictionary=atoms, sparsity=2)
    assert np.abs(tree.evaluate() - ground)[10:-10, 10:-10].max() < 0.01
    void = np.zeros(ground.shape, bool)
    void[20:30, 20:40] = True
    tree = decompose_weighted(np.where(void, -9999, ground), void, dictionary=atoms, sparsity=2)
    assert np.abs(tree.evaluate() - ground)[~void].mean() < 1


def test_weighted_decomposition_refuses_what_does_not_fit():
    atoms = cosine_waves(10, 10)
    np.testing.assert_array_equal(cosine_waves(10, 10, 7), atoms[:7])
    with pytest.raises(InputError, match="every cell is a void"):
        decompose_weighted(GROUND, GROUND < 1e9, dictionary=atoms, sparsity=1)
    with pytest.raises(InputError, match="do not fit"):
        decompose_weighted(GROUND, dictionary=atoms[:, :50], sparsity=1)
    with pytest.raises(InputError, match="raster of"):
        decompose_weighted(GROUND, dictionary=atoms, sparsity=1, grid=PatchGrid((50, 50)))


def test_voids_never_count():
    void = np.zeros(GROUND.shape, bool)
    void[40:52, 60:80] = True
    void[0, :] = True
    results = [
        learn(np.where(void, fill, GROUND), void, atoms=16, seed=3) for fill in (-9999, 50_000)
    ]
    atoms = [result.dictionary.samples.tobytes() for result in results]
    assert atoms[0] == atoms[1]
    whole = learn(GROUND, atoms=16, seed=3)
    assert results[0].discs_skipped > 0
    assert results[0].discs + results[0].discs_skipped == whole.discs
    nan = learn(np.where(void, np.nan, GROUND), atoms=16, seed=3)
    assert nan.dictionary.samples.tobytes() == atoms[0]


def test_constrained_atoms_are_discs_at_the_places_told():
    learned = learn([GROUND, -GROUND[:60]], atoms=24, method="constrained", names=["a", "b"])
    dictionary, disc = learned.dictionary, learned.dictionary.disc
    assert learned.errors[-1] <= learned.errors[0]
    seen = set()
    for atom in range(24):
        place = dictionary.provenance(atom)
        assert place.kind == "patch"
        ground = {"a": GROUND, "b": -GROUND[:60]}[place.exemplar]
        block = ground[place.row : place.row + 10, place.column : place.column + 10]
        shape = (block - block[disc].mean()) * disc
        shape /= np.sqrt((shape[disc] ** 2).mean())
        np.testing.assert_allclose(dictionary.samples[atom], shape.ravel(), atol=1e-4)
        seen.add(place)
    assert len(seen) == 24


def test_a_complete_dictionary_is_all_discs_and_represents_its_ground_best():
    complete = learn(GROUND, method="complete")
    assert complete.errors == ()
    assert len(complete.dictionary) == complete.discs == 23 * 27
    few = learn(GROUND, method="constrained", atoms=32, sparsity=1)
    errors = [
        rmse(GROUND, decompose_weighted(GROUND, dictionary=each.dictionary.samples, sparsity=1))
        for each in (complete, few)
    ]
    assert errors[0] < 0.9 * errors[1]


@pytest.mark.parametrize("method", ["ksvd", "constrained", "complete"])
def test_two_resolutions_share_a_norm(method):
    learned = learn(GROUND, method=method, atoms=16, factor=2)
    dictionary = learned.dictionary
    disc = disc_weights(10, 10) > 0
    high = dictionary.high([3, 7])
    assert high.shape == (2, 400)
    averages = high.reshape(2, 10, 2, 10, 2).mean(axis=(2, 4))
    inner = disc_weights(10, 10) > 0.1  # there all fine cells lie in the disc, too
    low = dictionary.samples[[3, 7]].reshape(2, 10, 10)
    difference = (averages - low)[:, inner]
    difference -= difference.mean(axis=1, keepdims=True)  # means are over discs of either
    assert np.sqrt((difference**2).mean()) < (0.1 if method == "ksvd" else 1e-4)
    assert (dictionary.samples[:, ~disc.ravel()] == 0).all()


def test_a_radius_is_metres_on_the_ground():
    dictionary = learn(GROUND, atoms=8, radius=120, pixel_size=(20.0, 30.0)).dictionary
    assert (dictionary.side_rows, dictionary.side_columns) == (8, 12)
    assert dictionary.cell_size == (20, 30)
    halved = learn(GROUND, atoms=8, radius=120, pixel_size=(10.0, 15.0), factor=2).dictionary
    assert (halved.side_rows, halved.side_columns, halved.cell_size) == (8, 12, (20, 30))


def test_a_choice_of_discs_is_by_seed():
    first, same, other = (
        learn(GROUND, atoms=8, most_discs=200, seed=seed).dictionary.samples.tobytes()
        for seed in (0, 0, 1)
    )
    assert first == same != other


def test_metric_is_the_weighted_scalar_product_without_a_constant():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 1, 80))
    metric = Metric("blend", 8, 10)
    inside = metric.inside
    weights = metric.weights**2 / (metric.weights**2).sum()
    shifted = [each - each[:, inside] @ weights for each in (a, b)]
    product = (metric.weights**2 * shifted[0][:, inside] * shifted[1][:, inside]).sum()
    got = metric.vectors(a) @ metric.vectors(b + 100).T
    assert got.item() == pytest.approx(product, rel=1e-3)
    alpha = disc_weights(8, 10)
    total = sum(np.roll(alpha, shift, (0, 1)) for shift in ((0, 0), (4, 0), (0, 5), (4, 5)))
    share = (alpha / total).ravel()[inside]
    big = share > 0.02
    np.testing.assert_allclose(
        metric.weights[big] / metric.weights.max(), share[big] / share.max(), rtol=1e-5
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (dict(exemplars=[]), "at least one exemplar"),
        (dict(exemplars=np.ones((8, 8))), "no disc of 10 by 10 cells"),
        (dict(exemplars=np.ones((80, 80))), "not flat"),
        (dict(exemplars=GROUND, voids=np.ones(GROUND.shape, bool)), "without a void"),
        (dict(exemplars=GROUND, atoms=5000), "5000 atoms cannot be learned from 621"),
        (dict(exemplars=GROUND, atoms=0), "atoms is 0"),
        (dict(exemplars=GROUND, method="svd"), "method is 'svd'"),
        (dict(exemplars=GROUND, radius=1e5), "cells of 1 m"),
        (dict(exemplars=[GROUND, GROUND], names=["a"]), "2 exemplars have 1 names"),
        (dict(exemplars=GROUND[:5], factor=8), "no disc"),
        (dict(exemplars=GROUND, colour="red"), "colour"),
    ],
)
def test_refusals(arguments, message):
    with pytest.raises(InputError, match=message):
        demsmith.learn(**arguments)


def test_on_real_mountains_the_gain_over_cosine_waves_is_more_than_a_decibel():
    tile = raster.read(shared_data("pyrenees_raw/N42E001.hgt"))
    ground = tile.values[500:692, 100:292].astype(np.float32)
    void = tile.void[500:692, 100:292]
    for sparsity in (2, 8):
        learned = learn(ground, void, sparsity=sparsity, iterations=5).dictionary.samples
        waves = Dictionary.of_samples(cosine_waves(10, 10), 10, 10).samples
        errors = []
        for atoms in (learned, waves):
            tree = decompose_weighted(ground, void, dictionary=atoms, sparsity=sparsity)
            errors.append(np.sqrt(((tree.evaluate() - ground)[~void] ** 2).mean()))
        assert 20 * np.log10(errors[1] / errors[0]) > 1
