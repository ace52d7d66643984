"""Fitting learned atoms to the blend of discs, where errors of neighbours add up or cancel.

K-SVD lowers the error of single discs. Here, in turns, terrain is decomposed, and all atoms are
fitted to its blended surface by least squares, places and coefficients kept: the blend is linear
in the atoms, and conjugate gradients (on the normal equations) lead towards the optimum. This goes
beyond the paper.
"""

import numpy as np

from demsmith.core.progress import SILENT, Muted, Span, checkpoint
from demsmith.core.sparse.dictionary import Dictionary
from demsmith.core.sparse.patch_tree import PatchTree
from demsmith.core.sparse.patches import PatchGrid, gather
from demsmith.core.sparse.weighted import decompose_weighted

_STEPS = 6
"""Steps of conjugate gradients in a round."""


def polish(grounds, atoms, sides, sparsity, *, rounds, threads=None, progress=SILENT):
    """Fit atoms to the blend of discs.

    Parameters
    ----------
    grounds : list of (values, void)
        Terrain to fit, (H, W) float32 and bool arrays.
    atoms : (N, K) float32 array
    sides : (int, int)
        Rows and columns of cells across a disc.
    sparsity : int
    rounds : int
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    (N, K) float32 array
        The atoms of the lowest error, of mean 0 and root mean square 1 over the disc.
    tuple of float
        Root mean square error of the blend, before the first round and after each; one that does
        not lower it is the last.

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop.
    """
    blends = [_Blend(values, void, sides, sparsity, threads) for values, void in grounds]
    cells = sum(blend.cells for blend in blends)
    best, errors = atoms, []
    for turn in range(rounds + 1):
        span = Span(progress, turn / (rounds + 1), (turn + 1) / (rounds + 1))
        for number, blend in enumerate(blends):
            checkpoint(span, 0.5 * number / len(blends))
            blend.decompose(atoms, Muted(span))
        errors.append(float(np.sqrt(sum(blend.energy() for blend in blends) / cells)))
        if errors[-1] > min(errors):
            break
        best = atoms
        if turn < rounds:
            atoms = _fitted(blends, atoms, sides, Span(span, 0.5, 1))
    checkpoint(progress, 1)
    return best, tuple(errors)


def _fitted(blends, atoms, sides, progress):
    """Change the atoms by conjugate gradients, and normalise them."""
    atoms = atoms.astype(np.float64)
    gradient = sum(blend.gradient() for blend in blends)
    direction, power = gradient, float((gradient**2).sum())
    for step in range(_STEPS):
        checkpoint(progress, step / _STEPS)
        energy = sum(blend.move(direction, Muted(progress)) for blend in blends)
        if not energy > 0:
            break
        length = power / energy
        atoms += length * direction
        for blend in blends:
            blend.take(length)
        gradient = sum(blend.gradient() for blend in blends)
        power, before = float((gradient**2).sum()), power
        direction = gradient + power / before * direction
    return Dictionary.of_samples(atoms, *sides).samples


class _Blend:
    """A terrain's blended surface as a linear function of the atoms."""

    def __init__(self, values, void, sides, sparsity, threads):
        self.values, self.void = values, void
        steps = (max(1, side // 2) for side in sides)
        self.grid = PatchGrid(values.shape, *sides, *steps)
        self.sparsity, self.threads = sparsity, threads
        self.cells = int(np.count_nonzero(~void))
        sums = self.grid.sums
        self.inverse = sums.inverse[np.ix_(sums.row_kinds, sums.column_kinds)]
        self.inverse[void] = 0

    def decompose(self, atoms, progress):
        """Choose atoms and coefficients anew."""
        from scipy.sparse import csr_array

        self.tree = decompose_weighted(
            self.values, self.void, dictionary=atoms, sparsity=self.sparsity, grid=self.grid,
            threads=self.threads, progress=progress,
        )  # fmt: skip
        self.rest = self.values - self.tree.evaluate(threads=self.threads, progress=progress)
        self.rest[self.void] = 0
        rows = np.arange(0, self.tree.indices.size + 1, self.sparsity)
        shares = csr_array(
            (self.tree.coefficients.ravel(), self.tree.indices.ravel(), rows),
            shape=(self.grid.count, len(atoms)),
        )
        self.users = shares.T.tocsr()

    def energy(self):
        """Give the squared error."""
        return float((self.rest.astype(np.float64) ** 2).sum())

    def gradient(self):
        """Give half of how the squared error falls with each sample of the atoms."""
        weighted = gather(self.rest * self.inverse, np.zeros_like(self.void), self.grid)
        samples = (weighted.samples + weighted.means[:, None]) * weighted.valid
        samples *= self.grid.weights.ravel()
        return (self.users @ samples).astype(np.float64)

    def move(self, direction, progress):
        """Find how the surface changes with the atoms; give the change's energy."""
        tree = PatchTree(
            self.grid, np.zeros(self.grid.count), self.tree.indices, self.tree.coefficients,
            direction,
        )  # fmt: skip
        self.change = tree.evaluate(threads=self.threads, progress=progress)
        self.change[self.void] = 0
        return float((self.change.astype(np.float64) ** 2).sum())

    def take(self, length):
        """Take a step along the change."""
        self.rest -= np.float32(length) * self.change
