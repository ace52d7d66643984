"""Kernels of dictionary learning: residuals, who uses an atom, and an atom's replacement."""

import math

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def _dot(a, b):
    """Give a scalar product; four sums, so that they run side by side."""
    s0 = s1 = s2 = s3 = np.float32(0)
    whole = a.size - a.size % 4
    for k in range(0, whole, 4):
        s0 += a[k] * b[k]
        s1 += a[k + 1] * b[k + 1]
        s2 += a[k + 2] * b[k + 2]
        s3 += a[k + 3] * b[k + 3]
    for k in range(whole, a.size):
        s0 += a[k] * b[k]
    return (s0 + s1) + (s2 + s3)


@numba.njit(**_JIT)
def subtract_sums(samples, atoms, indices, coefficients, rests, energies):
    """Set what the atoms leave of samples, and its energies.

    Parameters
    ----------
    samples, rests : (n, K) float32 arrays
    atoms : (N, K) float32 array
    indices : (n, s) int32 array
    coefficients : (n, s) float32 array
    energies : (n,) float64 array
    """
    for v in range(len(samples)):
        rest = rests[v]
        rest[:] = samples[v]
        for j in range(indices.shape[1]):
            share = coefficients[v, j]
            if share != 0:
                atom = atoms[indices[v, j]]
                for k in range(rest.size):
                    rest[k] -= share * atom[k]
        energies[v] = _dot(rest, rest)


@numba.njit(**_JIT)
def find_users(indices, coefficients, firsts, users):
    """List the places ``v * s + j`` where each atom is used, atom by atom, in order.

    Parameters
    ----------
    indices : (n, s) int32 array
    coefficients : (n, s) float32 array
        0 for no atom.
    firsts : (N + 1,) int64 array
        Set to the first place of every atom in ``users``, and one past the last.
    users : (n * s,) int64 array
    """
    sparsity = indices.shape[1]
    firsts[:] = 0
    for v in range(len(indices)):
        for j in range(sparsity):
            if coefficients[v, j] != 0:
                firsts[indices[v, j] + 1] += 1
    for atom in range(len(firsts) - 1):
        firsts[atom + 1] += firsts[atom]
    ends = firsts.copy()
    for v in range(len(indices)):
        for j in range(sparsity):
            if coefficients[v, j] != 0:
                atom = indices[v, j]
                users[ends[atom]] = v * sparsity + j
                ends[atom] += 1


@numba.njit(**_JIT)
def add_back(rests, atom, users, coefficients):
    """Give the residuals of an atom's users as they were without it.

    Parameters
    ----------
    rests : (n, K) float32 array
    atom : (K,) float32 array
    users : (m,) int64 array
    coefficients : (n, s) float32 array

    Returns
    -------
    (m, K) float32 array
    """
    found = np.empty((users.size, atom.size), np.float32)
    for i in range(users.size):
        v, j = divmod(users[i], coefficients.shape[1])
        share = coefficients[v, j]
        for k in range(atom.size):
            found[i, k] = rests[v, k] + share * atom[k]
    return found


@numba.njit(**_JIT)
def take_off(rests, without, atom, users, coefficients):
    """Fit an atom's coefficients anew and set the residuals; the inverse of `add_back`."""
    for i in range(users.size):
        v, j = divmod(users[i], coefficients.shape[1])
        share = _dot(without[i], atom)
        coefficients[v, j] = share
        for k in range(atom.size):
            rests[v, k] = without[i, k] - share * atom[k]


@numba.njit(**_JIT)
def replace_atoms(rests, atoms, firsts, users, coefficients, begin, end):
    """Replace some atoms, one after the other, by one power step of K-SVD's decomposition.

    An atom becomes the sum of its users' residuals without it, each times its coefficient, of norm
    1; the coefficients follow as projections on it. All arrays are changed in place.

    Parameters
    ----------
    rests : (n, K) float32 array
    atoms : (N, K) float32 array
        Of norm 1.
    firsts, users
        As of `find_users`.
    coefficients : (n, s) float32 array
    begin, end : int
        First atom and one past the last.
    """
    new = np.empty(rests.shape[1], np.float32)
    for a in range(begin, end):
        mine = users[firsts[a] : firsts[a + 1]]
        if mine.size == 0:
            continue
        without = add_back(rests, atoms[a], mine, coefficients)
        new[:] = 0
        for i in range(mine.size):
            v, j = divmod(mine[i], coefficients.shape[1])
            share = coefficients[v, j]
            for k in range(new.size):
                new[k] += share * without[i, k]
        norm = math.sqrt(_dot(new, new))
        if not norm > 0:
            continue
        for k in range(new.size):
            atoms[a, k] = new[k] / norm
        take_off(rests, without, atoms[a], mine, coefficients)


@numba.njit(**_JIT)
def explain(samples, atom, rests):
    """Lower, in place, what is left of samples' energies to what one atom of norm 1 leaves.

    Parameters
    ----------
    samples : (n, K) float32 array
    atom : (K,) float32 array
    rests : (n,) float64 array
        The least that any atom has left so far.
    """
    for v in range(len(samples)):
        share = np.float64(_dot(samples[v], atom))
        rests[v] = max(min(rests[v], np.float64(_dot(samples[v], samples[v])) - share * share), 0.0)
