"""Learning a dictionary from sample vectors: K-SVD, and its constrained variant.

Both lower the squared error of the samples' sums of at most ``s`` atoms, taking turns: pursue all
samples, then replace the atoms one after the other, each with its coefficients, by what fits its
users best (§4.4 of the paper).

References
----------
M. Aharon, M. Elad and A. Bruckstein, "K-SVD: an algorithm for designing overcomplete dictionaries
for sparse representation", IEEE Transactions on Signal Processing 54(11), 2006. R. Rubinstein,
M. Zibulevsky and M. Elad, Technion CS-2008-08, whose approximate replacement is used: one step
towards the singular vector, from where the atom was.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Muted, Span, checkpoint
from demsmith.core.sparse.pursuit import pursue

_BLOCK = 4096
"""Samples of a task."""

_COMPARED = 1024
"""Atoms that are compared with all others at once."""

_ALIKE = 0.99
"""Cosine of the angle above which two atoms are one too many."""

_FEWEST_USERS = 2
"""An atom that fewer samples use is better spent on those that are represented worst."""

_SETTLED = 1e-4
"""Relative fall of the error below which an iteration no longer pays."""

_PATIENCE = 3
"""Iterations in a row that do not pay before learning ends."""

_START_POOL = 10_000
"""Samples among which the first atoms are sought."""


class TooFewSamplesError(InputError):
    """There are fewer samples, or fewer that are not flat, than atoms that are to be learned."""


@dataclass(frozen=True, eq=False)
class LearnedAtoms:
    """What was learned.

    Attributes
    ----------
    atoms : (N, K) float32 array
        Of norm 1.
    chosen : (N,) int64 array or None
        Which candidates they are, for the constrained variant.
    indices : (n, s) int32 array
    coefficients : (n, s) float32 array
        Of the samples over these atoms, as of `pursue`.
    errors : tuple of float
        Root mean square, per number of the samples, of what the pursuit left in each iteration.
        The atoms are those of the lowest.
    """

    atoms: np.ndarray
    chosen: np.ndarray | None
    indices: np.ndarray
    coefficients: np.ndarray
    errors: tuple


def ksvd(
    samples, atoms, sparsity, *, iterations=30, tolerance=0.0, seed=0, start=None, threads=None,
    progress=SILENT,
):  # fmt: skip
    """Learn a dictionary by K-SVD (problem 1 of the paper).

    Parameters
    ----------
    samples : (n, K) float32 array
    atoms : int
        How many, at most as many as there are samples.
    sparsity : int
    iterations : int
        Pursuits, at most; learning ends before when it no longer pays.
    tolerance : float
        Error, as in `LearnedAtoms.errors`, that is low enough to end with.
    seed : int
        Of the samples that are the first atoms: each is taken with a chance in proportion to what
        the atoms before leave of its energy.
    start : (m, K) float32 array, optional
        First atoms, at most so many; those that lack are samples.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    LearnedAtoms

    Raises
    ------
    InputError
        If there are fewer samples that are not 0 than atoms, or an option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    Samples made of one of three directions each are found out:

    >>> rng = np.random.default_rng(1)
    >>> directions = np.eye(3, 8, dtype=np.float32)
    >>> samples = directions[rng.integers(3, size=50)] * rng.normal(size=(50, 1))
    >>> learned = ksvd(samples, 3, 1)
    >>> bool(learned.errors[-1] < 1e-6), int((abs(learned.atoms).max(axis=1) > 0.999).sum())
    (True, 3)
    """
    samples = _checked(samples)
    _check_count(atoms, samples)
    start = np.zeros((0, samples.shape[1]), np.float32) if start is None else _unit(start)
    chosen = _spread(samples, atoms - len(start), seed, Span(progress, 0, 0.05), start)
    start = np.concatenate([start, samples[chosen]])
    learner = _Learner(samples, _unit(start), None, sparsity, threads)
    return learner.learn(iterations, tolerance, Span(progress, 0.05, 1))


def constrained(
    samples, candidates, atoms, sparsity, *, iterations=10, tolerance=0.0, seed=0, threads=None,
    progress=SILENT,
):  # fmt: skip
    """Learn a dictionary whose atoms are some of given vectors (problem 2 of the paper).

    As `ksvd`, but an atom is replaced by the candidate that leaves its users the least, found by
    trying all.

    Parameters
    ----------
    samples : (n, K) float32 array
    candidates : (m, K) float32 array
        Of any norm; those of norm 0 are never chosen. The samples themselves, for one.
    atoms : int
        How many, at most as many as there are candidates.
    sparsity, iterations, tolerance, seed, threads, progress
        As of `ksvd`; the first atoms are chosen among the candidates by what they have of the
        samples' energy.

    Returns
    -------
    LearnedAtoms
        All of its ``chosen`` differ.

    Raises
    ------
    InputError, Cancelled
        As of `ksvd`.

    Examples
    --------
    >>> samples = np.float32([[2, 0, 0], [3, 0.1, 0], [0, 0, 5], [0, 0.1, 4]])
    >>> constrained(samples, np.eye(3), 2, 1).chosen.tolist()
    [2, 0]
    """
    samples, candidates = _checked(samples), _checked(candidates)
    if samples.shape[1] != candidates.shape[1]:
        raise InputError(
            f"samples of {samples.shape[1]} numbers do not go with candidates of "
            f"{candidates.shape[1]}"
        )
    _check_count(atoms, candidates)
    unit = _unit(candidates)
    chosen = _spread(candidates, atoms, seed, Span(progress, 0, 0.05))
    learner = _Learner(samples, unit[chosen], _Candidates(unit, chosen), sparsity, threads)
    return learner.learn(iterations, tolerance, Span(progress, 0.05, 1))


class _Candidates:
    """The vectors that atoms may be, and which of them they are."""

    def __init__(self, unit, chosen):
        self.unit, self.chosen = unit, chosen.copy()
        self.taken = np.zeros(len(unit), bool)
        self.taken[chosen] = True

    def best(self, without):
        """Give the candidate with the most of some vectors' energy, that is not taken."""
        if len(without) < without.shape[1]:
            products = self.unit @ without.T
            return self._largest(np.einsum("ij,ij->i", products, products))
        return self.most(without.T @ without)

    def most(self, gram):
        """Give the same of vectors with these products of their samples, (K, K)."""
        products = self.unit @ gram.astype(np.float32)
        return self._largest(np.einsum("ij,ij->i", products, self.unit))

    def _largest(self, energies):
        energies[self.taken] = -1
        return int(np.argmax(energies)), float(energies.max())

    def put_all(self, chosen):
        """Let the atoms be these candidates."""
        self.chosen[:] = chosen
        self.taken[:] = False
        self.taken[chosen] = True

    def put(self, atom, candidate):
        """Let an atom be another candidate."""
        self.taken[self.chosen[atom]] = False
        self.taken[candidate] = True
        self.chosen[atom] = candidate
        return self.unit[candidate]


class _Learner:
    """The turns of pursuit and replacement."""

    def __init__(self, samples, atoms, candidates, sparsity, threads):
        self.samples, self.sparsity, self.threads = samples, sparsity, threads
        self.atoms, self.candidates = np.array(atoms), candidates
        self.rests = np.empty_like(samples)
        self.energies = np.empty(len(samples))
        self.firsts = np.empty(len(atoms) + 1, np.int64)
        self.users = np.empty(len(samples) * sparsity, np.int64)

    def learn(self, iterations, tolerance, progress):
        if iterations < 1:
            raise InputError(f"iterations is {iterations}; it must be at least 1")
        errors, best, waited = [], None, 0
        swaps = len(self.atoms) // 4
        for turn in range(iterations):
            span = Span(progress, turn / iterations, (turn + 1) / iterations)
            errors.append(self._pursue(Span(span, 0, 0.5)))
            lowest = min(errors[:-1], default=np.inf)
            if errors[-1] < lowest:
                chosen = None if self.candidates is None else self.candidates.chosen.copy()
                best = self.atoms.copy(), chosen, self.indices, self.coefficients.copy()
            pays = errors[-1] < lowest * (1 - _SETTLED)
            waited = 0 if pays else waited + 1
            if errors[-1] <= tolerance:
                break
            if self.candidates is not None and not pays:
                # Candidates are stiff: where replacing them one by one ends, others may do better.
                self._return(*best)
                if not swaps:
                    break
                self._swap(swaps)
                swaps //= 2
                self._pursue(Muted(span))
            elif waited >= _PATIENCE:
                break
            if turn + 1 < iterations:
                self._replace(Span(span, 0.5, 1))
        checkpoint(progress, 1)
        return LearnedAtoms(*best, tuple(errors))

    def _pursue(self, progress):
        """Pursue the samples, and give the error."""
        self.indices, self.coefficients = pursue(
            self.samples, self.atoms, self.sparsity, threads=self.threads,
            progress=Span(progress, 0, 0.8),
        )  # fmt: skip
        return self._subtract(Span(progress, 0.8, 1))

    def _subtract(self, progress):
        """Set what the sums of atoms leave, and who uses which atom; give the error."""
        from demsmith.core.sparse._ksvd import find_users, subtract_sums

        tasks = [
            partial(
                subtract_sums, self.samples[part], self.atoms, self.indices[part],
                self.coefficients[part], self.rests[part], self.energies[part],
            )
            for part in _parts(len(self.samples))
        ]  # fmt: skip
        parallel.run(tasks, threads=self.threads, progress=progress)
        find_users(self.indices, self.coefficients, self.firsts, self.users)
        return float(np.sqrt(self.energies.sum() / self.samples.size))

    def _replace(self, progress):
        """Replace the atoms one by one, then those that are hardly of use."""
        atoms = len(self.atoms)
        # So many at a time as take less than half a second.
        step = max(1, int(atoms * 2e7 / (self.samples.size * self.sparsity)))
        for begin in range(0, atoms, step):
            checkpoint(progress, begin / atoms)
            end = min(begin + step, atoms)
            if self.candidates is None:
                from demsmith.core.sparse._ksvd import replace_atoms

                replace_atoms(
                    self.rests, self.atoms, self.firsts, self.users, self.coefficients, begin, end
                )
            else:
                for atom in range(begin, end):
                    checkpoint(progress, atom / atoms)
                    self._choose(atom)
        self._renew()

    def _choose(self, atom):
        """Replace an atom by the candidate that fits its users best."""
        from demsmith.core.sparse._ksvd import add_back, take_off

        users = self.users[self.firsts[atom] : self.firsts[atom + 1]]
        if not users.size:
            return
        without = add_back(self.rests, self.atoms[atom], users, self.coefficients)
        candidate, energy = self.candidates.best(without)
        products = without @ self.atoms[atom]
        if energy > products @ products:
            self.atoms[atom] = self.candidates.put(atom, candidate)
        take_off(self.rests, without, self.atoms[atom], users, self.coefficients)

    def _return(self, atoms, chosen, indices, coefficients):
        """Go back to atoms that were better."""
        self.atoms[:] = atoms
        self.candidates.put_all(chosen)
        self.indices, self.coefficients = indices, coefficients.copy()
        self._subtract(SILENT)

    def _swap(self, count):
        """Give up the atoms with the least energy for candidates with the most of the rest's."""
        used = np.bincount(
            self.indices.ravel(), self.coefficients.ravel().astype(np.float64) ** 2, len(self.atoms)
        )
        rest = (self.rests.T @ self.rests).astype(np.float64)
        for atom in np.argsort(used, kind="stable")[:count]:
            candidate, energy = self.candidates.most(rest)
            if not energy > 0:
                break
            self.atoms[atom] = self.candidates.put(atom, candidate)
            other = np.eye(len(rest)) - np.outer(self.atoms[atom], self.atoms[atom])
            rest = other @ rest @ other

    def _renew(self):
        """Spend atoms that hardly any sample uses, or that others double, on the worst samples."""
        likeness = np.zeros(len(self.atoms))  # to those before
        for first in range(0, len(self.atoms), _COMPARED):
            part = np.s_[first : first + _COMPARED]
            products = np.tril(self.atoms[part] @ self.atoms[: part.stop].T, first - 1)
            likeness[part] = np.abs(products).max(axis=1)
        spare = np.flatnonzero((np.diff(self.firsts) < _FEWEST_USERS) | (likeness > _ALIKE))
        if not spare.size:
            return
        energies = np.einsum("ij,ij->i", self.rests, self.rests)
        worst = np.argsort(-energies, kind="stable")[: spare.size]
        for atom, sample in zip(spare, worst, strict=False):
            if not energies[sample] > 0:
                break
            if self.candidates is None:
                self.atoms[atom] = _unit(self.samples[sample][None])[0]
                continue
            candidate, energy = self.candidates.best(self.rests[sample][None])
            if energy > 0:
                self.atoms[atom] = self.candidates.put(atom, candidate)


def _checked(vectors):
    vectors = np.ascontiguousarray(vectors, np.float32)
    if vectors.ndim != 2 or not vectors.size:
        raise InputError(f"there is nothing to learn from in an array of shape {vectors.shape}")
    if not np.isfinite(vectors).all():
        raise InputError("samples hold numbers that are not finite")
    return vectors


def _check_count(atoms, vectors):
    if not 1 <= atoms <= len(vectors):
        raise TooFewSamplesError(f"{atoms} atoms cannot be learned from {len(vectors)} samples")


def _unit(vectors):
    vectors = np.asarray(vectors, np.float32)
    norms = np.sqrt(np.einsum("ij,ij->i", vectors, vectors, dtype=np.float64))[:, None]
    return np.divide(vectors, norms, out=np.zeros_like(vectors), where=norms > 0)


def _spread(vectors, count, seed, progress, before=()):
    """Choose vectors that differ: each by chance, in proportion to what those before leave of it.

    ``before`` are vectors of norm 1 that are chosen already.

    This is the seeding of D. Arthur and S. Vassilvitskii, "k-means++", SODA 2007, for directions.
    """
    from demsmith.core.sparse._ksvd import explain

    rng = np.random.default_rng(seed)
    pool = np.arange(len(vectors))
    if pool.size > max(_START_POOL, 4 * count):
        pool = np.sort(rng.choice(pool, max(_START_POOL, 4 * count), replace=False))
    members = np.ascontiguousarray(vectors[pool])
    energies = np.einsum("ij,ij->i", members, members, dtype=np.float64)
    rests, free = energies.copy(), energies > 0
    if np.count_nonzero(free) < count:
        raise TooFewSamplesError(
            f"{count + len(before)} atoms cannot be learned from {np.count_nonzero(free)} samples "
            "that are not flat; ask for fewer, or give more terrain"
        )
    chosen = np.empty(count, np.int64)
    unit = _unit(members)
    for vector in before:
        explain(members, vector, rests)
    for turn in range(count):
        checkpoint(Muted(progress), 0)
        chances = np.where(free, rests, 0)
        if not chances.sum() > 1e-9 * energies.sum():  # all else is explained: take any
            chances = free.astype(np.float64)
        totals = np.cumsum(chances)
        taken = int(np.searchsorted(totals, rng.random() * totals[-1], side="right"))
        free[taken] = False
        chosen[turn] = taken
        explain(members, unit[taken], rests)
        checkpoint(progress, (turn + 1) / count)
    return pool[chosen]


def _parts(count):
    return [slice(first, min(first + _BLOCK, count)) for first in range(0, count, _BLOCK)]
