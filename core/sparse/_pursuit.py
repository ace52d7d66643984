"""Kernels of the orthogonal matching pursuit: the choice of atoms and their least squares."""

import math

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")

_TIE = 64
"""Steps of float32 (4e-6 to 8e-6 of the value) within which two projections may be the same."""

_DEPENDENT, _DEPENDENT_PARTLY = 1e-9, 1e-2
"""Share of an atom's energy outside the span of those chosen before, below which it is no use:
with all samples, because nothing is left of it; with some missing, because large coefficients
that cancel each other on the few that are seen would say nonsense on the others."""

_HIDDEN = 0.01
"""Energy of an atom over a disc's valid samples, relative to what their number would let expect,
below which it says too little there: its coefficient would run wild."""


@numba.njit(**_JIT)
def _dot(a, b):
    """Give a scalar product in float64; four sums, so that they run side by side."""
    s0 = s1 = s2 = s3 = 0.0
    whole = a.size - a.size % 4
    for k in range(0, whole, 4):
        s0 += np.float64(a[k]) * np.float64(b[k])
        s1 += np.float64(a[k + 1]) * np.float64(b[k + 1])
        s2 += np.float64(a[k + 2]) * np.float64(b[k + 2])
        s3 += np.float64(a[k + 3]) * np.float64(b[k + 3])
    for k in range(whole, a.size):
        s0 += np.float64(a[k]) * np.float64(b[k])
    return (s0 + s1) + (s2 + s3)


@numba.njit(**_JIT)
def _best(products, rest, unit):
    """Give the atom with the largest projection of the residual, -1 if all are 0.

    Positive floats sort as their bits do, and a largest integer is found several at a time.
    """
    bits = products.view(np.int32)
    top = 0
    for a in range(bits.size):
        top = max(top, bits[a] & 0x7FFFFFFF)
    if top == 0:
        return -1
    bound = max(top - _TIE, 1)
    ties = 0
    for a in range(bits.size):
        ties += (bits[a] & 0x7FFFFFFF) >= bound
    best, least = -1, np.inf
    for a in range(bits.size):
        if (bits[a] & 0x7FFFFFFF) >= bound:
            if ties == 1:
                return a
            energy = _energy_without(rest, unit[a])
            if energy < least:
                best, least = a, energy
    return best


@numba.njit(**_JIT)
def _energy_without(rest, atom):
    """Give what remains of a residual's energy once its projection on a unit atom is taken off."""
    projection = _dot(rest, atom)
    energy = 0.0
    for k in range(rest.size):
        difference = rest[k] - projection * atom[k]
        energy += difference * difference
    return energy


@numba.njit(**_JIT)
def _append(factor, cross, energy, count, least):
    """Add a row to a Cholesky factor; give False if the new vector depends on those before.

    ``cross`` holds the new vector's products with the ``count`` vectors before, ``energy`` its own,
    of which the share ``least`` must be new.
    """
    rest = energy
    for j in range(count):
        value = cross[j]
        for i in range(j):
            value -= factor[count, i] * factor[j, i]
        value /= factor[j, j]
        factor[count, j] = value
        rest -= value * value
    if not rest > least * energy:
        return False
    factor[count, count] = math.sqrt(rest)
    return True


@numba.njit(**_JIT)
def _solve(factor, products, count, solution):
    """Solve the normal equations of ``count`` vectors by their Cholesky factor."""
    for j in range(count):
        value = products[j]
        for i in range(j):
            value -= factor[j, i] * solution[i]
        solution[j] = value / factor[j, j]
    for j in range(count - 1, -1, -1):
        value = solution[j]
        for i in range(j + 1, count):
            value -= factor[i, j] * solution[i]
        solution[j] = value / factor[j, j]


@numba.njit(**_JIT)
def _step(sample, products, unit, count, rest, factor, targets, work, indices):
    """Let an atom join and fit all coefficients anew; tell whether one could.

    ``work`` has two rows: the coefficients, of unit atoms, and scratch.
    """
    for j in range(count):
        products[indices[j]] = 0
    new = _best(products, rest, unit)
    if new < 0:
        return False
    for j in range(count):
        work[1, j] = _dot(unit[new], unit[indices[j]])
    if not _append(factor, work[1], _dot(unit[new], unit[new]), count, _DEPENDENT):
        return False
    indices[count] = new
    targets[count] = _dot(sample, unit[new])
    _solve(factor, targets, count + 1, work[0])
    rest[:] = sample
    for j in range(count + 1):
        share = np.float32(work[0, j])
        atom = unit[indices[j]]
        for k in range(rest.size):
            rest[k] -= share * atom[k]
    return True


@numba.njit(**_JIT)
def pursue_whole(samples, skip, products, gram, unit, inverse, limit, indices, coefficients):
    """Pursue vectors without missing samples; the residuals' products follow from the Gram matrix.

    Parameters
    ----------
    samples : (n, K) float32 array
    skip : (n,) bool array
        Vectors to leave alone.
    products : (n, N) float32 array
        Of samples and unit atoms.
    gram : (N, N) float32 array
        Products of unit atoms; may be empty for a sparsity of 1.
    unit : (N, K) float32 array
        Atoms of norm 1, or 0.
    inverse : (N,) float64 array
        What the atoms were multiplied with to be so.
    limit : float
        Energy of a residual at which it is well enough.
    indices : (n, s) int32 array
    coefficients : (n, s) float32 array
        Both of zeros, set here.
    """
    sparsity = indices.shape[1]
    atoms = len(unit)
    rest = np.empty(samples.shape[1], np.float32)
    current = np.empty(atoms, np.float32)
    factor = np.empty((sparsity, sparsity))
    targets = np.empty(sparsity)
    work = np.empty((2, sparsity))
    for v in range(len(samples)):
        if skip[v]:
            continue
        sample = samples[v]
        rest[:] = sample
        count = 0
        while count < sparsity and (count > 0 or _dot(sample, sample) > limit):
            current[:] = products[v]
            for j in range(count):
                share = np.float32(work[0, j])
                row = gram[indices[v, j]]
                for a in range(atoms):
                    current[a] -= share * row[a]
            if not _step(sample, current, unit, count, rest, factor, targets, work, indices[v]):
                break
            count += 1
            if limit > 0 and _dot(rest, rest) <= limit:
                break
        for j in range(count):
            coefficients[v, j] = work[0, j] * inverse[indices[v, j]]


@numba.njit(**_JIT)
def pursue_step(
    samples, skip, products, unit, inverse, limit, step, rests, factors, targets, active,
    indices, coefficients,
):  # fmt: skip
    """Do one step of all vectors; the caller multiplies residuals with atoms in between.

    For dictionaries too large for their Gram matrix. Parameters as of `pursue_whole`, and ``step``
    atoms are chosen already of the vectors that are ``active``, whose residuals are ``rests``.
    """
    sparsity = indices.shape[1]
    work = np.empty((2, sparsity))
    for v in range(len(samples)):
        if skip[v] or not active[v]:
            continue
        rest = rests[v]
        active[v] = _dot(rest, rest) > limit and _step(
            samples[v], products[v], unit, step, rest, factors[v], targets[v], work, indices[v]
        )
        if active[v]:
            for j in range(step + 1):
                coefficients[v, j] = work[0, j] * inverse[indices[v, j]]


@numba.njit(**_JIT)
def pursue_partial(
    samples, valid, which, transposed, support, inverse, tolerance, indices, coefficients
):
    """Pursue vectors of which samples are missing, by products over the others.

    The atoms' means over the valid samples are taken off: what they lack is a constant.

    Parameters
    ----------
    samples, indices, coefficients
        As of `pursue_whole`.
    valid : (n, K) bool array
    which : (n,) bool array
        Vectors to pursue.
    transposed : (K, N) float32 array
        Unit atoms.
    support : (K,) bool array
        Samples in which any atom is not 0.
    tolerance : float
        Mean square of a residual at which it is well enough.
    """
    size, atoms = transposed.shape
    sparsity = indices.shape[1]
    cells = 0
    for k in range(size):
        cells += support[k]
    at = np.empty(size, np.int64)
    target = np.empty(size)
    rest = np.empty(size)
    vectors = np.empty((sparsity, size))
    means = np.empty(atoms)
    scales = np.empty(atoms)
    scores = np.empty(atoms)
    factor = np.empty((sparsity, sparsity))
    targets = np.empty(sparsity)
    work = np.empty((2, sparsity))
    for v in range(len(samples)):
        if not which[v]:
            continue
        n = 0
        for k in range(size):
            if valid[v, k] and support[k]:
                at[n] = k
                target[n] = samples[v, k]
                n += 1
        if n == 0:
            continue
        target[:n] -= target[:n].mean()
        rest[:n] = target[:n]
        _visible(transposed, at[:n], n / cells, means, scales)
        count = 0
        while count < sparsity and _dot(rest[:n], rest[:n]) > tolerance * n:
            scores[:] = 0
            for i in range(n):
                row = transposed[at[i]]
                for a in range(atoms):
                    scores[a] += rest[i] * row[a]
            for j in range(count):
                scores[indices[v, j]] = 0
            new = np.argmax(np.abs(scores * scales))
            if scores[new] * scales[new] == 0:
                break
            for i in range(n):
                vectors[count, i] = (transposed[at[i], new] - means[new]) * scales[new]
            vector = vectors[count, :n]
            for j in range(count):
                work[1, j] = _dot(vector, vectors[j, :n])
            if not _append(factor, work[1], _dot(vector, vector), count, _DEPENDENT_PARTLY):
                scales[new] = 0
                continue
            indices[v, count] = new
            targets[count] = _dot(vector, target[:n])
            count += 1
            _solve(factor, targets, count, work[0])
            rest[:n] = target[:n]
            for j in range(count):
                rest[:n] -= work[0, j] * vectors[j, :n]
        for j in range(count):
            index = indices[v, j]
            coefficients[v, j] = work[0, j] * scales[index] * inverse[index]


@numba.njit(**_JIT)
def _visible(transposed, at, share, means, scales):
    """Set the atoms' means over some samples, and what makes their norms there 1, or 0."""
    atoms = transposed.shape[1]
    means[:] = 0
    scales[:] = 0
    for k in at:
        row = transposed[k]
        for a in range(atoms):
            means[a] += row[a]
            scales[a] += np.float64(row[a]) * row[a]
    for a in range(atoms):
        means[a] /= at.size
        energy = scales[a] - means[a] * means[a] * at.size
        scales[a] = 1 / math.sqrt(energy) if energy > _HIDDEN * share else 0.0


@numba.njit(**_JIT)
def means_over(valid, which, atoms, support, indices, coefficients, means):
    """Set the means of sums of atoms over the valid samples, of the vectors ``which``."""
    for v in range(len(valid)):
        if not which[v]:
            continue
        total = 0.0
        n = 0
        for k in range(valid.shape[1]):
            if valid[v, k] and support[k]:
                n += 1
                for j in range(indices.shape[1]):
                    total += np.float64(coefficients[v, j]) * atoms[indices[v, j], k]
        if n:
            means[v] = total / n
