"""The tree of patches that a user asks for by atoms, sparsity, radius or dictionary."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span

_ATOMS, _SPARSITY = 128, 2
_SIDE = 10
"""Cells across a disc, where neither radius nor dictionary tells."""

_SMALLEST_SIDE = 3
"""With two cells, discs a cell apart would leave corners out."""

_FINEST_STEP = 1e-3
"""In units."""

_ROUNDS = {"low": 8, "normal": 30, "high": 60}
"""Of learning, at most, by effort."""

_SWEEPS = {"low": 0, "normal": 2, "high": 8}
"""Of the joint refinement of means and coefficients, by effort."""


@dataclass(frozen=True, kw_only=True)
class PatchMaker:
    """Makes the coded tree of patches of a surface; `CodecOptions.patches` takes it.

    Attributes
    ----------
    cell : (float, float)
        Ground metres of a cell in the middle row, north-south and east-west.
    atoms, sparsity : int or None
    radius : float or None
        Ground metres.
    dictionary : path or None
        Default: one is learned from the surface, or consists of cosine waves where that is too
        small or flat to learn from.
    max_error : int or None
        Error that a residual will leave, in the surface's unit: what is finer is not coded.
    effort : str
    """

    cell: tuple
    atoms: int | None = None
    sparsity: int | None = None
    radius: float | None = None
    dictionary: object = None
    max_error: int | None = None
    effort: str = "normal"

    @classmethod
    def of(cls, options, dictionary, grid, max_error):
        """Make it from `CompressOptions`, for a raster's `Grid`.

        Raises
        ------
        InputError
            If a dictionary and a number of atoms are given.
        """
        if dictionary is not None and options.atoms is not None:
            raise InputError(
                f"atoms is {options.atoms}, but the dictionary '{dictionary}' has atoms of its "
                "own; give one of the two"
            )
        sizes = grid.pixel_size_m()
        middle = grid.shape.rows // 2
        return cls(
            cell=(float(sizes.dy[middle]), float(sizes.dx[middle])), atoms=options.atoms,
            sparsity=options.sparsity, radius=options.radius, dictionary=dictionary,
            max_error=max_error, effort=options.effort,
        )  # fmt: skip

    def __call__(self, surface, void, *, threads=None, progress=SILENT):
        """Find and code the tree.

        Parameters
        ----------
        surface : (H, W) float32 array
            In units.
        void : (H, W) bool array
        threads, progress
            As everywhere.

        Returns
        -------
        params : dict
        sections : dict of list of bytes
            As of `demsmith.core.codec.patch_base.encode`.

        Raises
        ------
        InputError
            If the dictionary cannot be read, or the radius is too small or large.
        Cancelled
            If ``progress`` asks to stop.
        """
        from demsmith.core.codec import patch_base
        from demsmith.core.sparse import PatchGrid, decompose
        from demsmith.core.sparse.weighted import decompose_weighted

        sparsity = self.sparsity or _SPARSITY
        atoms, sides = self._atoms(surface, void, sparsity, threads, Span(progress, 0, 0.5))
        grid = PatchGrid(surface.shape, *sides, *(max(1, side // 2) for side in sides))
        pursue = decompose if self.effort == "low" else decompose_weighted
        tree = pursue(
            surface, void, dictionary=atoms, sparsity=min(sparsity, len(atoms)), grid=grid,
            threads=threads, progress=Span(progress, 0.5, 0.6),
        )  # fmt: skip
        return patch_base.encode(
            surface, void, tree=tree, step=self._step(surface, void, tree, threads),
            sweeps=_SWEEPS[self.effort], threads=threads, progress=Span(progress, 0.6, 1),
        )  # fmt: skip

    def _step(self, surface, void, tree, threads):
        """Choose the step of means and coefficients: as coarse as the tree's own error allows."""
        wrong = (tree.evaluate(threads=threads) - surface)[~void].astype(np.float64)
        rmse = float(np.sqrt(np.mean(wrong**2)))
        if self.max_error is None:
            return max(rmse / 2, _FINEST_STEP)
        return max(rmse, 2 * self.max_error + 1)

    def _atoms(self, surface, void, sparsity, threads, progress):
        """Give the atoms' samples and the cells across their disc, both ways."""
        if self.dictionary is None:
            return self._learned(surface, void, sparsity, threads, progress)
        from demsmith.core.sparse.dictionary_file import read_dictionary

        dictionary = read_dictionary(self.dictionary)
        sides = self._sides((dictionary.side_rows, dictionary.side_columns), dictionary.cell_size)
        return dictionary.resampled(*sides).samples, sides

    def _learned(self, surface, void, sparsity, threads, progress):
        from demsmith.core.sparse import Dictionary
        from demsmith.core.sparse.ksvd import TooFewSamplesError
        from demsmith.core.sparse.learning import cosine_waves, learn

        sides, count = self._sides((_SIDE, _SIDE), None), self.atoms or _ATOMS
        try:
            # A radius of half the rows, in a unit in which that is as wide as the columns.
            learned = learn(
                surface, void, radius=sides[0] / 2, pixel_size=(sides[0] / sides[1], 1.0),
                atoms=count, sparsity=sparsity, iterations=_ROUNDS[self.effort],
                threads=threads, progress=progress,
            )  # fmt: skip
            dictionary = learned.dictionary
        except TooFewSamplesError:
            dictionary = Dictionary.of_samples(cosine_waves(*sides, count), *sides)
        return dictionary.samples, sides

    def _sides(self, sides, size):
        """Give the cells across a disc: by the radius, a dictionary's, or as they are."""
        if self.radius is not None:
            radii, what = (self.radius,) * 2, "a radius"
        elif size is not None:  # east-west comes first
            radii = sides[0] * size[1] / 2, sides[1] * size[0] / 2
            what = f"the radius of the discs of '{self.dictionary}',"
        else:
            return sides
        for radius, cell in zip(radii, self.cell, strict=True):
            self._check_radius(what, radius, cell)
        return tuple(
            max(_SMALLEST_SIDE, round(2 * radius / cell))
            for radius, cell in zip(radii, self.cell, strict=True)
        )

    @staticmethod
    def _check_radius(what, radius, cell):
        from demsmith.core.sparse.patches import LARGEST_SIDE

        if round(2 * radius / cell) > LARGEST_SIDE:
            why = f"more than the {LARGEST_SIDE // 2} that a disc may have: give a smaller radius"
        elif radius < (1 - 1e-6) * cell:  # cells on the ground are rounded
            why = "less than one: give a larger radius"
        else:
            return
        raise InputError(
            f"{what} of {radius:.6g} m is {radius / cell:.3g} cells of {cell:.4g} m, {why}"
        )
