"""Joint refinement of a patch tree: the least-squares optimum of the blended surface.

Pursuit fits every disc on its own, but where discs overlap it is their blend that should fit. With
the chosen atoms kept, the blend is linear in means and coefficients, and conjugate gradients (on
the normal equations, scaled by their diagonal) lead to the optimum; a few steps give most of it.
This goes beyond the paper.
"""

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from demsmith.core import parallel
from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span, checkpoint

_DISC_ROWS = 16
"""Rows of discs that a task projects on."""

_FLOOR = 1e-3
"""Share of the mean diagonal below which an unknown is too little seen to be changed."""


def refine(values, void=None, *, tree, sweeps, threads=None, progress=SILENT):
    """Improve means and coefficients of a tree for the blended surface, its atoms kept.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations [m] to approximate.
    void : (H, W) bool array, optional
        As of `decompose`.
    tree : PatchTree
    sweeps : int
        Steps of conjugate gradients; none makes the sum of squared errors larger.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    PatchTree

    Raises
    ------
    InputError
        If the shapes differ.
    Cancelled
        If ``progress`` asks to stop.
    """
    values, void = checked(values, void)
    if values.shape != tree.shape:
        raise InputError(f"the tree is of shape {tree.shape}, values have {values.shape}")
    ends = pairwise(np.linspace(0, 1, 2 * sweeps + 4))
    system = _System(tree, void, threads, lambda: Span(progress, *next(ends)))
    unknowns = np.column_stack([tree.means, tree.coefficients])
    rest = np.where(void, 0, values).astype(np.float32)
    rest -= system.surface(unknowns)
    rest[void] = 0
    scale = system.scale()
    gradient = system.adjoint(rest)
    change = direction = scale * gradient
    power = _product(gradient, change)
    for _ in range(sweeps):
        if not power > 0:
            break
        surface = system.surface(direction)
        surface[void] = 0
        energy = _product(surface, surface)
        if not energy > 0:
            break
        length = power / energy
        unknowns = unknowns + np.float32(length) * direction
        rest -= np.float32(length) * surface
        gradient = system.adjoint(rest)
        change = scale * gradient
        power, before = _product(gradient, change), power
        direction = change + np.float32(power / before) * direction
    checkpoint(progress, 1)
    return replace(tree, means=unknowns[:, 0], coefficients=unknowns[:, 1:])


def _product(a, b):
    return float(np.einsum("ij,ij->", a, b, dtype=np.float64))


class _System:
    """The blend as a linear function of means and coefficients, an (n, 1 + s) array.

    ``next_part()`` gives the progress of the next pass over the raster.
    """

    def __init__(self, tree, void, threads, next_part):
        self.tree, self.threads, self.next_part = tree, threads, next_part
        sums = tree.grid.sums
        self.inverse = sums.over(0, tree.shape[1])[sums.row_kinds]
        self.inverse[void] = 0
        self.used = tree.coefficients != 0

    def surface(self, unknowns):
        """Blend."""
        means, coefficients = unknowns[:, 0], unknowns[:, 1:]
        tree = replace(self.tree, means=means, coefficients=coefficients)
        return tree.evaluate(threads=self.threads, progress=self.next_part())

    def adjoint(self, cells):
        """Project cells on means and atoms."""
        out = self._projected(cells * self.inverse, 1)
        out[:, 1:] *= self.used
        return out

    def scale(self):
        """Give one by the diagonal of the normal equations."""
        diagonal = self._projected(self.inverse**2, 2)
        floor = _FLOOR * diagonal.mean(axis=0)
        seen = diagonal > floor
        seen[:, 1:] &= self.used
        return np.divide(1, diagonal, out=np.zeros_like(diagonal), where=seen)

    def _projected(self, cells, power):
        from demsmith.core.sparse._blending import project

        tree, grid = self.tree, self.tree.grid
        out = np.empty((grid.count, 1 + tree.sparsity), np.float32)
        lattice = grid.top(0), grid.left(0), grid.step_rows, grid.step_columns
        tasks = [
            partial(
                project, cells, tree.indices, tree.atoms, grid.weights, lattice, grid.columns,
                power, out, first * grid.columns,
                min(first + _DISC_ROWS, grid.rows) * grid.columns,
            )
            for first in range(0, grid.rows, _DISC_ROWS)
        ]  # fmt: skip
        parallel.run(tasks, threads=self.threads, progress=self.next_part())
        return out
