"""The kinds of atoms: sampled terrain, discs of an exemplar, and functions.

Each kind gives its atoms' samples on the block round a disc, not normalised (``made``), the same
atoms at another resolution (``resampled``), and tells where an atom comes from (``provenance``).
"""

from dataclasses import dataclass

import numpy as np

from demsmith.core.sparse.patch_tree import extended
from demsmith.core.sparse.patches import disc_weights, gather_at

MADE_AT_ONCE = 1 << 22
"""Finer samples that are resampled or averaged in one go."""


@dataclass(frozen=True)
class Provenance:
    """Where an atom comes from.

    Attributes
    ----------
    kind : str
        ``sampled``, ``patch`` (a disc of an exemplar as it is) or ``function``.
    exemplar : str
        Name of the exemplar a patch is of, or empty.
    row, column : int or None
        First cell of a patch's block in the exemplar (of the finer resolution if there are two).
    function : int or None
        Which of the part's functions it is.
    """

    kind: str
    exemplar: str = ""
    row: int | None = None
    column: int | None = None
    function: int | None = None


@dataclass(frozen=True, eq=False)
class SampledAtoms:
    """Atoms given by their samples.

    Parameters
    ----------
    low : (N, rows, columns) float32 array
        Samples at the centres of a block's cells; what lies outside the disc does not count.
    high : (N, factor * rows, factor * columns) float32 array, optional
        The same shapes at the finer resolution.
    names : tuple of str
        Exemplars, where the atoms are discs of them.
    origins : (N, 3) int array, optional
        Then the number of the exemplar, and the row and column where the block begins.
    """

    low: np.ndarray
    high: np.ndarray | None = None
    names: tuple = ()
    origins: np.ndarray | None = None

    def __len__(self):
        return len(self.low)

    def provenance(self, index):
        """Tell where an atom comes from."""
        if self.origins is None:
            return Provenance("sampled")
        exemplar, row, column = map(int, self.origins[index])
        return Provenance("patch", self.names[exemplar], row, column)

    def made(self, side_rows, side_columns, factor, indices):
        """Give some atoms' samples, not normalised: coarser, and finer or None."""
        low = self.low[indices]
        high = None if factor == 1 else self.high[indices]
        return low, high

    def resampled(self, side_rows, side_columns, factor, old):
        """Give the same atoms at another resolution, interpolated bicubically."""
        low = _resized(self.low, old, (side_rows, side_columns))
        high = None
        if factor > 1:
            old = tuple(factor * side for side in old)
            high = _resized(self.high, old, (factor * side_rows, factor * side_columns))
        return SampledAtoms(low, high, self.names, self.origins)


@dataclass(frozen=True, eq=False)
class CutAtoms:
    """Atoms that are discs of exemplars: a complete dictionary is nothing but their places.

    Parameters
    ----------
    exemplars : tuple of (H, W) array
        Elevations, of the finer resolution if there are two.
    names : tuple of str
    origins : (N, 3) int array
        Number of the exemplar, row and column where the block begins in it.
    """

    exemplars: tuple
    names: tuple
    origins: np.ndarray

    def __len__(self):
        return len(self.origins)

    def provenance(self, index):
        """Tell where an atom comes from."""
        exemplar, row, column = map(int, self.origins[index])
        return Provenance("patch", self.names[exemplar], row, column)

    def made(self, side_rows, side_columns, factor, indices):
        """Give some atoms' samples, not normalised: coarser, and finer or None."""
        origins = self.origins[indices]
        rows, columns = factor * side_rows, factor * side_columns
        fine = np.empty((len(origins), rows, columns), np.float32)
        whole = np.ones((rows, columns), bool)
        for number, values in enumerate(self.exemplars):
            mine = np.flatnonzero(origins[:, 0] == number)
            if mine.size:
                found = gather_at(
                    values, np.zeros(values.shape, bool), origins[mine, 1], origins[mine, 2], whole
                )
                fine[mine] = found.samples.reshape(-1, rows, columns)
        if factor == 1:
            return fine, None
        return averaged(fine, factor), fine

    def resampled(self, side_rows, side_columns, factor, old):
        """Give the same atoms at another resolution; their samples are needed then."""
        atoms = SampledAtoms(*self.made(*old, factor, slice(None)), self.names, self.origins)
        return atoms.resampled(side_rows, side_columns, factor, old)


@dataclass(frozen=True, eq=False)
class FunctionAtoms:
    """Atoms that are functions on the disc of radius 1, exact at any resolution.

    Parameters
    ----------
    sums : demsmith.core.noise.NoiseSums
        Wavelengths in radii; the first coordinate points east, the second south.
    """

    sums: object

    def __len__(self):
        return len(self.sums)

    def provenance(self, index):
        """Tell where an atom comes from."""
        return Provenance("function", function=int(index))

    def made(self, side_rows, side_columns, factor, indices):
        """Give some atoms' samples, not normalised: coarser, and finer or None."""
        sums = self.sums[indices]
        low = _values(sums, side_rows, side_columns)
        return low, None if factor == 1 else _values(
            sums, factor * side_rows, factor * side_columns
        )

    def resampled(self, side_rows, side_columns, factor, old):
        """Give the same functions."""
        return self


def averaged(fine, factor):
    """Give blocks of cells averaged by ``factor`` both ways.

    Parameters
    ----------
    fine : (n, rows, columns) or (rows, columns) array
        Rows and columns are multiples of ``factor``.

    Returns
    -------
    float32 array of the same number of dimensions
    """
    *several, rows, columns = fine.shape
    cells = fine.reshape(*several, rows // factor, factor, columns // factor, factor)
    return cells.mean(axis=(-3, -1), dtype=np.float64).astype(np.float32)


def _resized(blocks, old, new):
    """Interpolate atoms; what lies beyond the disc is made to go on from its rim before."""
    from skimage.transform import resize

    disc = disc_weights(*old) > 0
    flat = extended(np.ascontiguousarray(blocks, np.float32).reshape(len(blocks), -1), disc)
    out = np.empty((len(blocks), *new), np.float32)
    step = max(1, MADE_AT_ONCE // max(old[0] * old[1], new[0] * new[1]))
    for first in range(0, len(blocks), step):
        some = np.moveaxis(flat[first : first + step].reshape(-1, *old), 0, -1)
        smaller = min(n / o for n, o in zip(new, old, strict=True)) < 1
        sized = resize(some, (*new, some.shape[-1]), order=3, mode="edge", clip=False,
                       anti_aliasing=smaller, preserve_range=True)  # fmt: skip
        out[first : first + step] = np.moveaxis(sized, -1, 0)
    return out


def _values(sums, rows, columns):
    v = (np.arange(rows) + 0.5) * (2 / rows) - 1
    u = (np.arange(columns) + 0.5) * (2 / columns) - 1
    values = sums.values(
        np.tile(u, rows), np.repeat(v, columns), resolution=2 / max(rows, columns)
    )  # fmt: skip
    return values.reshape(-1, rows, columns)
