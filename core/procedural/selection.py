"""Choosing a dictionary among candidates: those that together explain most of the terrain."""

import heapq

import numpy as np

from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.sparse import pursue

_BLOCK = 512


def select(samples, candidates, count, sparsity, *, threads=None, progress=SILENT):
    """Choose atoms among candidates, one after the other, each the one that explains most more.

    As many as for one atom a disc are chosen for the terrain itself, as many again for what these
    leave of it, and so on. The energy that the best atom of each disc explains is a submodular
    function of the atoms chosen, so of one such stage at least 63 % of the best possible choice's
    is explained (G. L. Nemhauser, L. A. Wolsey and M. L. Fisher, *An analysis of approximations
    for maximizing submodular set functions*, 1978), and a candidate's gain need only be computed
    anew when its old one, which can only be more, is the largest (M. Minoux, *Accelerated greedy
    algorithms*, 1978).

    It is the constrained learning problem of Guérin et al. 2016 (problem 2) with functions in the
    place of the terrain's own patches; their alternation of pursuit and replacement, begun at
    random, ends with larger errors, and begun here changes next to nothing (docs/procedural.md).

    Parameters
    ----------
    samples : (n, K) float32 array
        Discs less their means.
    candidates : (M, K) float32 array
        Of one norm, or 0.
    count : int
        Atoms to choose; all candidates are if there are no more.
    sparsity : int
        Atoms that will be summed in a disc.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    (count,) ndarray of int
        Which candidates, in the order of their choice.
    """
    count = min(count, len(candidates))
    chosen, rests = [], samples
    for stage in range(min(sparsity, count)):
        part = Span(progress, stage / sparsity, (stage + 1) / sparsity)
        wanted = count * (stage + 1) // min(sparsity, count) - len(chosen)
        explained = _explained(rests, candidates, Span(part, 0, 0.3))
        chosen += _greedy(explained, chosen, wanted, Span(part, 0.3, 0.8))
        atoms = candidates[chosen]
        found = pursue(samples, atoms, stage + 1, threads=threads, progress=Span(part, 0.8, 1))
        rests = samples - _sums(atoms, *found)
    return np.array(chosen)


def _explained(rests, candidates, progress):
    """Give the energy that each candidate explains of each disc, (M, n) float32."""
    norms = np.einsum("ij,ij->i", candidates, candidates)
    scale = np.divide(1, np.sqrt(norms), out=np.zeros_like(norms), where=norms > 0)
    unit = candidates * scale[:, None]
    explained = np.empty((len(candidates), len(rests)), np.float32)
    for start in range(0, len(candidates), _BLOCK):
        checkpoint(progress, start / len(candidates))
        part = slice(start, start + _BLOCK)
        np.matmul(unit[part], rests.T, out=explained[part])
        np.square(explained[part], out=explained[part])
    return explained


def _greedy(explained, taken, wanted, progress):
    from demsmith.core.procedural._selection import gain

    best = np.zeros(explained.shape[1], np.float32)
    out = set(taken)
    heap = []
    for candidate in range(len(explained)):
        if candidate % _BLOCK == 0:
            checkpoint(progress, 0.5 * candidate / len(explained))
        if candidate not in out:
            heap.append((-gain(explained, candidate, best), candidate))
    heapq.heapify(heap)
    chosen = []
    while len(chosen) < wanted:
        checkpoint(progress, 0.5 + 0.5 * len(chosen) / wanted)
        _, candidate = heapq.heappop(heap)
        now = -gain(explained, candidate, best), candidate
        if heap and now > heap[0]:
            heapq.heappush(heap, now)
            continue
        chosen.append(candidate)
        np.maximum(best, explained[candidate], out=best)
    return chosen


def _sums(atoms, indices, coefficients):
    return sum(
        coefficients[:, k, None] * atoms[indices[:, k]] for k in range(indices.shape[1])
    )  # fmt: skip
