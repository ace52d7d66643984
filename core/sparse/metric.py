"""How errors of a disc count: evenly, or as much as in the blend of overlapping discs.

In ``f = Σ α_i f_i / Σ α_i`` an error of disc i at a cell counts ``α_i / Σ α``: nothing at the rim,
where other discs outweigh it. The paper pursues and learns with all samples alike; to count them
as they count gains 3 to 5 dB at the same number of coefficients (`docs/dictionaries.md`).
"""

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.sparse.options import WEIGHTINGS
from demsmith.core.sparse.patches import disc_weights

_LEAST = 0.01
"""Least weight of a sample of the disc, by the largest: none of an atom's may be left to chance."""


class Metric:
    """A scalar product of a block's samples in which a constant does not count.

    Vectors are made such that their plain scalar products are those of the metric: over the disc's
    samples, times the weights, less their part along the weights, which is the constant's.

    Parameters
    ----------
    weighting : str
        ``blend`` or ``even``.
    side_rows, side_columns : int
        Cells across a disc.
    step_rows, step_columns : int, optional
        From one disc to the next; default: half of the sides.

    Attributes
    ----------
    inside : (side_rows * side_columns,) bool array
        Samples in the disc.
    weights : (inside.sum(),) float64 array
        Root mean square 1.

    Examples
    --------
    >>> metric = Metric("blend", 10, 10)
    >>> bool(abs(metric.vectors(np.full((1, 100), 7))).max() < 1e-5)
    True
    """

    def __init__(
        self, weighting, side_rows, side_columns, step_rows=None, step_columns=None
    ):  # fmt: skip
        if weighting not in WEIGHTINGS:
            raise InputError(f"weighting is {weighting!r}; choose one of {', '.join(WEIGHTINGS)}")
        alpha = disc_weights(side_rows, side_columns).astype(np.float64)
        self.inside = alpha.ravel() > 0
        weights = np.ones(np.count_nonzero(self.inside))
        if weighting == "blend":
            steps = step_rows or -(-side_rows // 2), step_columns or -(-side_columns // 2)
            weights = (alpha / _sums(alpha, *steps)).ravel()[self.inside]
            weights = np.maximum(weights, _LEAST * weights.max())
        self.weights = weights / np.sqrt((weights**2).mean())
        self._constant = self.weights / np.linalg.norm(self.weights)

    def vectors(self, samples):
        """Give the vectors of blocks of samples.

        Parameters
        ----------
        samples : (n, side_rows * side_columns) array

        Returns
        -------
        (n, inside.sum()) float32 array
        """
        vectors = samples[:, self.inside] * self.weights
        vectors -= np.outer(vectors @ self._constant, self._constant)
        return vectors.astype(np.float32)

    def samples(self, vectors):
        """Give blocks of samples that have these vectors, 0 outside the disc.

        Returns
        -------
        (n, side_rows * side_columns) float32 array
        """
        samples = np.zeros((len(vectors), self.inside.size), np.float32)
        samples[:, self.inside] = vectors / self.weights
        return samples

    def offsets(self, samples):
        """Give the constants that are nearest to blocks of samples.

        Returns
        -------
        (n,) float64 array
        """
        squares = self.weights**2
        return samples[:, self.inside] @ (squares / squares.sum())


def _sums(alpha, step_rows, step_columns):
    """Sum the weights of all discs of an endless lattice at the samples of one."""
    rows, columns = (np.arange(side) for side in alpha.shape)
    folded = np.zeros((step_rows, step_columns))
    np.add.at(folded, (rows[:, None] % step_rows, columns % step_columns), alpha)
    return folded[np.ix_(rows % step_rows, columns % step_columns)]
