"""Orthogonal matching pursuit: against its definition, and where samples are missing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.sparse import pursue, pursuit
from demsmith.core.sparse.pursuit import shifts


def by_definition(sample, atoms, sparsity):
    """OMP of one vector in float64: largest projection, then least squares on all chosen."""
    unit = atoms / np.linalg.norm(atoms, axis=1)[:, None]
    rest, chosen, fit = sample.copy(), [], np.zeros(0)
    for _ in range(sparsity):
        chosen.append(int(np.argmax(np.abs(unit @ rest))))
        fit = np.linalg.lstsq(atoms[chosen].T, sample, rcond=None)[0]
        rest = sample - atoms[chosen].T @ fit
    return chosen, fit


def problem(seed, count=40, atoms=24, size=30):
    rng = np.random.default_rng(seed)
    dictionary = rng.normal(size=(atoms, size)) * rng.uniform(0.1, 10, (atoms, 1))
    dictionary -= dictionary.mean(axis=1, keepdims=True)
    samples = rng.normal(size=(count, size))
    samples -= samples.mean(axis=1, keepdims=True)
    return samples.astype(np.float32), dictionary.astype(np.float32)


@pytest.mark.parametrize("large", [False, True], ids=["gram", "no gram"])
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31), sparsity=st.integers(1, 6))
def test_pursuit_does_as_defined(large, seed, sparsity):
    samples, atoms = problem(seed)
    with pytest.MonkeyPatch.context() as patch:
        if large:
            patch.setattr(pursuit, "_LARGEST_GRAM", 1)
        indices, coefficients = pursue(samples, atoms, sparsity)
    for sample, chosen, found in zip(samples, indices, coefficients, strict=True):
        expected, fit = by_definition(sample.astype(float), atoms.astype(float), sparsity)
        assert list(chosen) == expected
        np.testing.assert_allclose(found, fit, rtol=1e-4, atol=1e-5)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31), sparsity=st.integers(1, 4))
def test_missing_samples_are_as_if_cut_out(seed, sparsity):
    """Pursuit over the valid samples, with atoms centred there, is plain pursuit of those."""
    samples, atoms = problem(seed, count=6)
    rng = np.random.default_rng(seed)
    valid = rng.random(samples.shape) < 0.8
    samples[~valid] = 0
    indices, coefficients = pursue(samples, atoms, sparsity, valid=valid)
    means = shifts(valid, atoms, indices, coefficients)
    for v, seen in enumerate(valid):
        target = samples[v, seen].astype(float)
        cut = atoms[:, seen].astype(float)
        centred = cut - cut.mean(axis=1, keepdims=True)
        chosen, fit = by_definition(target - target.mean(), centred, sparsity)
        assert list(indices[v]) == chosen
        np.testing.assert_allclose(coefficients[v], fit, rtol=1e-4, atol=1e-5)
        if not seen.all():
            assert means[v] == pytest.approx(coefficients[v] @ cut[indices[v]].mean(axis=1))


def test_an_atom_that_fits_exactly_is_found_among_the_nearly_same():
    """Projections that differ by less than float32 tells are compared by their residuals."""
    rng = np.random.default_rng(0)
    base = rng.normal(size=60)
    atoms = (base + 1e-3 * rng.normal(size=(300, 60))).astype(np.float32)
    atoms -= atoms.mean(axis=1, keepdims=True)
    indices, coefficients = pursue(7 * atoms, atoms, 1)
    np.testing.assert_array_equal(indices[:, 0], np.arange(300))
    np.testing.assert_allclose(coefficients, 7, rtol=1e-6)


def test_a_vector_takes_no_more_atoms_than_it_needs():
    samples, atoms = problem(1)
    samples[0] = 3 * atoms[5]
    samples[1] = 0
    indices, coefficients = pursue(samples, atoms, 4, tolerance=1e-4)
    assert indices[0, 0] == 5 and coefficients[0, 0] == pytest.approx(3)
    assert (coefficients[0, 1:] == 0).all() and (indices[0, 1:] == 0).all()
    assert (coefficients[1] == 0).all()
    assert (coefficients[2:] != 0).all()


def test_a_residual_within_the_tolerance_is_enough():
    samples, atoms = problem(2, atoms=90)
    indices, coefficients = pursue(samples, atoms, 20, tolerance=0.3)
    rest = samples - np.einsum("vs,vsk->vk", coefficients, atoms[indices])
    assert (np.sqrt((rest**2).mean(axis=1)) <= 0.3001).all()
    used = np.count_nonzero(coefficients, axis=1)
    assert used.max() < 20
    v = int(used.argmax())
    less = pursue(samples[v : v + 1], atoms, int(used[v]) - 1)
    rest = samples[v] - less[1][0] @ atoms[less[0][0]]
    assert np.sqrt((rest**2).mean()) > 0.3


def test_twins_and_nothings_are_never_chosen_twice():
    samples, atoms = problem(3, atoms=3)
    atoms = np.concatenate([atoms, atoms, np.zeros((2, 30), np.float32)])
    indices, coefficients = pursue(samples, atoms, 6)
    assert np.isfinite(coefficients).all()
    assert (np.count_nonzero(coefficients, axis=1) <= 3).all()
    assert indices[coefficients != 0].max() < 6


def test_an_atom_hardly_seen_is_left_alone():
    """Where an atom is nearly flat over the valid samples, its coefficient would run wild."""
    atoms = np.zeros((2, 20), np.float32)
    atoms[0, :10] = np.tile([1, -1], 5)
    atoms[1, 10:] = np.tile([1, -1], 5)
    atoms[0, 19] = 1e-3
    valid = np.zeros((1, 20), bool)
    valid[0, 10:] = True
    sample = np.zeros((1, 20), np.float32)
    sample[0, 19] = 9
    sample[0, 10:] -= 0.9
    indices, coefficients = pursue(sample, atoms, 2, valid=valid)
    assert indices[0, 0] == 1
    assert np.count_nonzero(coefficients) == 1


def test_no_valid_sample_no_atom():
    samples, atoms = problem(4)
    valid = np.ones(samples.shape, bool)
    valid[3] = False
    samples[3] = 0
    assert (pursue(samples, atoms, 2, valid=valid)[1][3] == 0).all()


def test_threads_do_not_matter():
    samples, atoms = problem(5, count=5000)
    one, many = (pursue(samples, atoms, 3, threads=threads) for threads in (1, 5))
    for a, b in zip(one, many, strict=True):
        assert a.tobytes() == b.tobytes()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (dict(sparsity=0), "sparsity is 0"),
        (dict(sparsity=65), "sparsity is 65"),
        (dict(tolerance=-1.0), "tolerance"),
        (dict(tolerance=np.nan), "tolerance"),
        (dict(atoms=np.zeros((0, 30))), "dictionary has shape"),
        (dict(atoms=np.zeros((3, 29))), "do not fit"),
        (dict(atoms=np.full((3, 30), np.inf)), "dictionary holds"),
        (dict(samples=np.full((3, 30), np.nan)), "samples hold"),
        (dict(valid=np.ones((1, 30), bool)), "valid has shape"),
    ],
)
def test_impossible_requests_are_refused(change, words):
    samples, atoms = problem(6)
    given = dict(samples=samples, atoms=atoms, sparsity=2) | change
    with pytest.raises(InputError, match=words):
        pursue(given.pop("samples"), given.pop("atoms"), given.pop("sparsity"), **given)


def test_cancel_is_heard():
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    with pytest.raises(Cancelled):
        pursue(*problem(7), 2, progress=Stop())
