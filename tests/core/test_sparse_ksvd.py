"""K-SVD and its constrained variant on plain vectors: what they find, and that they are exact."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.sparse import constrained, ksvd, pursue

ATOMS, SIZE = 12, 20


def mixtures(count=800, sparsity=2, *, noise=0.0, seed=0):
    """Make sums of few of some random directions, and these."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(ATOMS, SIZE))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    samples = np.zeros((count, SIZE))
    for _ in range(sparsity):
        samples += rng.normal(size=(count, 1)) * directions[rng.integers(ATOMS, size=count)]
    return (samples + noise * rng.normal(size=samples.shape)).astype(np.float32), directions


def left(samples, learned):
    sums = np.einsum("ij,ijk->ik", learned.coefficients, learned.atoms[learned.indices])
    return float(np.sqrt(((samples - sums) ** 2).mean()))


def test_finds_the_directions_that_samples_were_made_of():
    samples, directions = mixtures()
    learned = ksvd(samples, ATOMS, 2, iterations=60)
    likeness = np.abs(directions @ learned.atoms.T).max(axis=1)
    assert np.count_nonzero(likeness > 0.99) >= ATOMS - 2
    assert learned.errors[-1] < 0.2 * np.sqrt((samples**2).mean())


def test_one_atom_is_the_first_singular_vector():
    samples, _ = mixtures(200)
    learned = ksvd(samples, 1, 1, iterations=200)
    vector = np.linalg.svd(samples)[2][0]
    assert abs(vector @ learned.atoms[0]) > 0.9999


def test_the_error_told_is_that_of_the_atoms_and_coefficients_given():
    samples, _ = mixtures(noise=0.1)
    for learned in (ksvd(samples, 9, 3), constrained(samples, samples, 9, 3)):
        assert left(samples, learned) == pytest.approx(min(learned.errors), rel=1e-4)
        np.testing.assert_allclose(np.linalg.norm(learned.atoms, axis=1), 1, atol=1e-5)
        indices, coefficients = pursue(samples, learned.atoms, 3)
        np.testing.assert_array_equal(indices, learned.indices)
        np.testing.assert_array_equal(coefficients, learned.coefficients)


def test_learning_lowers_the_error_and_the_replacement_never_raises_it():
    samples, _ = mixtures(noise=0.2)
    learned = ksvd(samples, ATOMS, 1, iterations=15)  # of one atom, pursuit is optimal
    assert learned.errors[-1] < 0.9 * learned.errors[0]
    assert all(
        b <= a * (1 + 1e-5) for a, b in zip(learned.errors, learned.errors[1:], strict=False)
    )


def test_start_is_where_learning_starts():
    samples, directions = mixtures()
    assert ksvd(samples, ATOMS, 2, start=directions, iterations=1).errors[0] < 1e-6
    assert ksvd(samples, ATOMS, 2, start=directions[:11], iterations=1).errors[0] < 0.05
    assert ksvd(samples, ATOMS, 2, iterations=1).errors[0] > 0.1


def test_ends_when_the_error_is_low_enough_or_no_longer_falls():
    samples, directions = mixtures()
    assert len(ksvd(samples, ATOMS, 2, start=directions, tolerance=0.2).errors) == 1
    assert len(ksvd(samples, ATOMS, 1, iterations=500).errors) < 100


def test_unused_and_double_atoms_are_spent_on_the_worst_samples():
    samples, directions = mixtures(sparsity=1)
    start = np.repeat(directions[:4], 3, axis=0)
    assert ksvd(samples, ATOMS, 1, start=start, iterations=30).errors[-1] < 1e-3


def test_constrained_atoms_are_candidates_and_differ():
    samples, _ = mixtures(noise=0.05)
    candidates = 7 * samples[:300]
    learned = constrained(samples, candidates, ATOMS, 2)
    unit = candidates / np.linalg.norm(candidates, axis=1, keepdims=True)
    np.testing.assert_allclose(learned.atoms, unit[learned.chosen], atol=1e-6)
    assert len(set(learned.chosen.tolist())) == ATOMS
    assert min(learned.errors) < learned.errors[0]


def test_constrained_finds_the_directions_among_candidates():
    samples, directions = mixtures(sparsity=1)
    others = np.random.default_rng(3).normal(size=(200, SIZE))
    learned = constrained(samples, np.vstack([others, directions]), ATOMS, 1, iterations=40)
    assert (learned.chosen >= 200).sum() >= ATOMS - 1


@pytest.mark.parametrize("learn", [ksvd, lambda s, *a, **k: constrained(s, s, *a, **k)])
def test_the_same_bytes_for_any_number_of_threads_and_by_seed(learn):
    samples, _ = mixtures(6000, noise=0.1)
    one, other = (learn(samples, 10, 2, iterations=4, threads=n) for n in (1, 3))
    assert one.atoms.tobytes() == other.atoms.tobytes()
    assert one.errors == other.errors
    assert learn(samples, 10, 2, iterations=4, seed=1).atoms.tobytes() != one.atoms.tobytes()


@settings(max_examples=25, deadline=None)
@given(
    count=st.integers(1, 40), size=st.integers(1, 12), atoms=st.integers(1, 40),
    sparsity=st.integers(1, 5), seed=st.integers(0, 5),
)  # fmt: skip
def test_any_shape_learns_or_says_why_not(count, size, atoms, sparsity, seed):
    samples = np.random.default_rng(seed).normal(size=(count, size)).astype(np.float32)
    samples[::3] = 0
    if atoms > np.count_nonzero(samples.any(axis=1)):
        with pytest.raises(InputError, match="cannot be learned"):
            ksvd(samples, atoms, sparsity)
        return
    learned = ksvd(samples, atoms, sparsity, iterations=3)
    assert np.isfinite(learned.atoms).all()
    assert min(learned.errors) <= np.sqrt((samples**2).mean()) * (1 + 1e-5)


@pytest.mark.parametrize(
    ("samples", "atoms", "message"),
    [
        (np.ones((5, 3)), 6, "6 atoms cannot be learned from 5 samples"),
        (np.zeros((5, 3)), 2, "not flat"),
        (np.full((5, 3), np.nan), 2, "not finite"),
        (np.ones(5), 2, "nothing to learn from"),
        (np.ones((0, 3)), 2, "nothing to learn from"),
    ],
)
def test_what_cannot_be_learned_from(samples, atoms, message):
    with pytest.raises(InputError, match=message):
        ksvd(samples, atoms, 1)
    with pytest.raises(InputError):
        ksvd(np.ones((5, 3)), 2, 1, iterations=0)


@pytest.mark.parametrize("learn", [ksvd, lambda s, *a, **k: constrained(s, s, *a, **k)])
def test_cancel_is_heard(learn):
    class Stop:
        told = 0

        def report(self, fraction):
            assert fraction >= self.told
            self.told = fraction

        def cancelled(self):
            return self.told > 0.3

    with pytest.raises(Cancelled):
        learn(mixtures(2000)[0], 10, 2, progress=Stop())
