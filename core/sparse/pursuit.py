"""Orthogonal matching pursuit: samples as sums of a few atoms of a dictionary.

After R. Rubinstein, M. Zibulevsky and M. Elad, "Efficient implementation of the K-SVD algorithm
using batch orthogonal matching pursuit", Technion CS-2008-08: the products of all samples with all
atoms are one matrix product, those of the residuals follow from the atoms' products with each
other.
"""

from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT

LARGEST_SPARSITY = 64

_LARGEST_GRAM = 4096
"""Atoms whose products with each other are kept in memory (64 MB); with more, the residuals are
multiplied with all atoms anew at each step."""

_BLOCK_PRODUCTS = 1 << 18
"""Products of samples with atoms in memory at once, for each thread."""


def pursue(
    samples, atoms, sparsity, *, valid=None, tolerance=0.0, threads=None, progress=SILENT
):  # fmt: skip
    """Approximate each sample vector by at most ``sparsity`` atoms (batch OMP).

    At each step the atom with the largest projection on the residual joins, then all coefficients
    are fitted anew by least squares. Atoms that tie to within the rounding of float32 are compared
    by their residuals in float64, so that an atom which fits exactly is found.

    Parameters
    ----------
    samples : (n, K) float32 array
        0 where not valid, of zero mean over the valid ones.
    atoms : (N, K) float32 array
        Of any norm; those of norm 0 are never chosen.
    sparsity : int
        1 to 64.
    valid : (n, K) bool array, optional
        Samples that count. Where any is missing that is not 0 in all atoms (raster's edge, void),
        norms and products are taken over the valid samples, from which the atoms' means over them
        are taken off: what the sum of atoms lacks is then a constant, see `shifts`.
    tolerance : float
        A vector whose residual's root mean square is no larger needs no more atoms.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    indices : (n, sparsity) int32 array
        Chosen atoms in the order of their choice; 0 where fewer were needed.
    coefficients : (n, sparsity) float32 array
        Their coefficients; exactly 0 where fewer were needed.

    Raises
    ------
    InputError
        If shapes do not fit, there are no atoms, or something is not finite.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> atoms = np.float32([[1, -1, 0, 0], [0, 0, 1, -1], [1, 1, -1, -1]])
    >>> pursue(np.float32([[3, 3, -7, 1]]), atoms, 2)
    (array([[2, 1]], dtype=int32), array([[ 3., -4.]], dtype=float32))
    """
    pursuit = Pursuit(atoms, sparsity, tolerance=tolerance)
    samples, valid = _checked(samples, valid, pursuit)
    indices = np.zeros((len(samples), sparsity), np.int32)
    coefficients = np.zeros((len(samples), sparsity), np.float32)

    def block(part):
        indices[part], coefficients[part] = pursuit.block(
            samples[part], None if valid is None else valid[part]
        )

    size = pursuit.block_size
    parts = [slice(first, first + size) for first in range(0, len(samples), size)]
    parallel.run([partial(block, part) for part in parts], threads=threads, progress=progress)
    return indices, coefficients


class Pursuit:
    """A dictionary made ready for the pursuit of one block of vectors after the other.

    Parameters
    ----------
    atoms, sparsity, tolerance
        As of `pursue`.

    Attributes
    ----------
    block_size : int
        Vectors best given at once; the same vectors in the same blocks have the same result.
    """

    def __init__(self, atoms, sparsity, *, tolerance=0.0):
        atoms = np.ascontiguousarray(atoms, np.float32)
        if atoms.ndim != 2 or not len(atoms):
            raise InputError(f"the dictionary has shape {atoms.shape}; give (atoms, samples)")
        if not np.isfinite(atoms).all():
            raise InputError("the dictionary holds numbers that are not finite")
        if not 1 <= sparsity <= LARGEST_SPARSITY:
            raise InputError(f"sparsity is {sparsity}; it must be in 1 to {LARGEST_SPARSITY}")
        if not tolerance >= 0:
            raise InputError(f"tolerance is {tolerance}; it must be 0 or more")
        self.sparsity, self.tolerance = sparsity, tolerance
        norms = np.sqrt(np.einsum("nk,nk->n", atoms, atoms, dtype=np.float64))
        self._inverse = np.divide(1, norms, out=np.zeros_like(norms), where=norms > 0)
        self._unit = (atoms * self._inverse[:, None]).astype(np.float32)
        self._transposed = np.ascontiguousarray(self._unit.T)
        self._support = atoms.any(axis=0)
        with_gram = sparsity > 1 and len(atoms) <= _LARGEST_GRAM
        self._gram = self._unit @ self._transposed if with_gram else np.zeros((0, 0), np.float32)
        self.block_size = min(max(_BLOCK_PRODUCTS // len(atoms), 16), 2048)

    @property
    def samples(self):
        """Samples of an atom, K."""
        return self._unit.shape[1]

    def block(self, samples, valid=None):
        """Pursue some vectors in this thread.

        Parameters
        ----------
        samples : (n, K) float32 array, contiguous and finite
        valid : (n, K) bool array, optional

        Returns
        -------
        (n, sparsity) int32 array, (n, sparsity) float32 array
            As of `pursue`.
        """
        from demsmith.core.sparse._pursuit import pursue_partial

        indices = np.zeros((len(samples), self.sparsity), np.int32)
        coefficients = np.zeros((len(samples), self.sparsity), np.float32)
        incomplete = _incomplete(valid, self._support, len(samples))
        if incomplete.any():
            pursue_partial(
                samples, valid, incomplete, self._transposed, self._support, self._inverse,
                self.tolerance**2, indices, coefficients,
            )  # fmt: skip
        if not incomplete.all():
            self._complete(samples, incomplete, indices, coefficients)
        return indices, coefficients

    def _complete(self, samples, skip, indices, coefficients):
        """Pursue the vectors no sample of which is missing."""
        from demsmith.core.sparse._pursuit import pursue_step, pursue_whole

        products = samples @ self._transposed
        limit = self.tolerance**2 * np.count_nonzero(self._support)
        fixed = self._unit, self._inverse, limit
        if self.sparsity == 1 or self._gram.size:
            pursue_whole(samples, skip, products, self._gram, *fixed, indices, coefficients)
            return
        count, sparsity = indices.shape
        rests = samples.copy()
        state = np.empty((count, sparsity, sparsity)), np.empty((count, sparsity)), ~skip
        for step in range(sparsity):
            if step:
                np.matmul(rests, self._transposed, out=products)
            pursue_step(samples, skip, products, *fixed, step, rests, *state, indices, coefficients)


def _checked(samples, valid, pursuit):
    samples = np.ascontiguousarray(samples, np.float32)
    if samples.ndim != 2 or samples.shape[1] != pursuit.samples:
        raise InputError(
            f"samples of shape {samples.shape} do not fit atoms of {pursuit.samples} samples"
        )
    if not np.isfinite(samples).all():
        raise InputError("samples hold numbers that are not finite")
    if valid is not None:
        valid = np.ascontiguousarray(valid, bool)
        if valid.shape != samples.shape:
            raise InputError(f"valid has shape {valid.shape}, samples {samples.shape}")
    return samples, valid


def _incomplete(valid, support, count):
    """Tell the vectors that lack a sample in which some atom is not 0."""
    if valid is None:
        return np.zeros(count, bool)
    return (~valid & support).any(axis=1)


def shifts(valid, atoms, indices, coefficients):
    """Give the means of sums of atoms over the valid samples, where some are missing.

    Taken off the mean elevation of a disc that lies in part beyond the raster's edge or over a
    void, they make `pursue`'s least squares one with a constant.

    Parameters
    ----------
    valid : (n, K) bool array
    atoms : (N, K) float32 array
    indices : (n, s) int32 array
    coefficients : (n, s) float32 array

    Returns
    -------
    (n,) float64 array
        0 where no sample is missing, or all are.
    """
    from demsmith.core.sparse._pursuit import means_over

    support = atoms.any(axis=0)
    means = np.zeros(len(valid))
    incomplete = _incomplete(valid, support, len(valid))
    means_over(valid, incomplete, atoms, support, indices, coefficients, means)
    return means
