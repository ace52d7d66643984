"""The sparse construction tree's lattice of discs as a node (Guérin et al. 2016, §3 and §4)."""

import math
from functools import cached_property

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.trees.atoms import Atoms
from demsmith.core.trees.node import FULL, NOTHING, Bounds, Joint, JointNode, Limits

_WYVILL_SLOPE = 96 / (25 * math.sqrt(5))
"""Steepest slope of ``(1 − r²)³``, at r = 1/√5: the 96 √5 / 125 of Génevaux et al., §7.3."""

_COVERED = 1e-4
"""Sum of the discs' weights from which on there is terrain: `PatchGrid` leaves no cell with less
than 1.25e-4."""


class PatchLattice(JointNode):
    """Discs on a lattice, each a mean elevation and some atoms, blended.

    ``f(p) = Σ f_i(p) α_i(p) / Σ α_i(p)`` with ``α_i = (1 − r²)³`` of the distance from the disc's
    centre in radii, and ``f_i = z_i + Σ_j x_ij d_j``: once continuously differentiable. A disc is
    an ellipse of cells where these are no squares on the ground.

    As all of the raster is terrain, the node's weight is not the sum of the discs' but 1 wherever
    that sum is what it is in every cell of the raster; it falls to 0 at the outer rim of the
    outermost discs.

    Parameters
    ----------
    grid : PatchGrid
        Where the discs lie in the raster's cells.
    means : (n,) array of float
        Not-a-number for a disc that is left out, of nothing but voids.
    indices : (n, s) array of int
        Atoms of each disc, the most important first.
    coefficients : (n, s) array of float
        0 for no atom.
    atoms : Atoms
    frame : Frame
        Of the raster.

    Raises
    ------
    InputError
        If shapes do not fit, an index is no atom's, or a coefficient is not finite.
    """

    def __init__(self, grid, means, indices, coefficients, *, atoms, frame):
        self.grid, self.atoms, self.frame = grid, atoms, frame
        self.means = np.asarray(means, np.float64).reshape(-1)
        self.present = np.isfinite(self.means)
        self.indices = np.ascontiguousarray(indices, np.int32)
        self.coefficients = np.ascontiguousarray(coefficients, np.float32)
        self._check()

    @classmethod
    def of_tree(cls, tree, dictionary, *, frame):
        """Make the node of a `PatchTree` and the `Dictionary` that its atoms are of."""
        atoms = Atoms.of_dictionary(dictionary)
        return cls(
            tree.grid, tree.means, tree.indices, tree.coefficients, atoms=atoms, frame=frame
        )  # fmt: skip

    def _check(self):
        if tuple(self.frame.shape) != tuple(self.grid.shape):
            raise InputError(
                f"the discs are of {tuple(self.grid.shape)} cells, the frame of "
                f"{tuple(self.frame.shape)}"
            )
        n = self.grid.count
        if self.means.shape != (n,) or self.indices.ndim != 2 or len(self.indices) != n:
            raise InputError(f"{n} discs have {self.means.size} means, {len(self.indices)} indices")
        if self.indices.shape != self.coefficients.shape:
            raise InputError("indices and coefficients differ in shape")
        if self.indices.size and not 0 <= self.indices.min() <= self.indices.max() < len(
            self.atoms
        ):
            raise InputError(f"an index is none of the {len(self.atoms)} atoms")
        if not np.isfinite(self.coefficients).all():
            raise InputError("a coefficient is not finite")

    @cached_property
    def _lattice(self):
        rows, columns = self.grid.centres()
        return (
            self.grid.rows, self.grid.columns, float(rows[0]), float(columns[0]),
            float(self.grid.step_rows), float(self.grid.step_columns),
            self.grid.side_rows / 2, self.grid.side_columns / 2,
        )  # fmt: skip

    @property
    def _radii(self):
        """Metres east-west and north-south."""
        return (
            self.grid.side_columns / 2 * self.frame.dx, self.grid.side_rows / 2 * self.frame.dy
        )  # fmt: skip

    def bounds(self):
        """Give the rectangle round all discs."""
        rows, columns = self.grid.centres()
        radius_x, radius_y = self._radii
        east, north = self._ground(rows, columns)
        return Bounds(
            float(east[0] - radius_x), float(north[-1] - radius_y),
            float(east[-1] + radius_x), float(north[0] + radius_y),
        )  # fmt: skip

    def _ground(self, rows, columns):
        return columns * self.frame.dx, (self.grid.shape[0] - rows) * self.frame.dy

    def joint(self, x, y, *, detail=FULL):
        """Give elevation and weight with their gradients."""
        from demsmith.core.trees._lattice import fill_joint

        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        row, column = (place.ravel() + 0.5 for place in self.frame.place(x, y))
        sparsity = self.indices.shape[1]
        most = sparsity if detail.atoms is None else min(sparsity, detail.atoms)
        lines = np.empty((6, row.size))
        fill_joint(
            row, column, 0, row.size, self._lattice, self.means, self.present, self.indices,
            self.coefficients, most, *self.atoms.packed(), detail.resolution / max(self._radii),
            lines,
        )  # fmt: skip
        weight = lines[0] / _COVERED
        inside = weight < 1
        weight = np.minimum(weight, 1.0)
        lines[4:] *= inside / _COVERED
        dx, dy = self.frame.dx, -self.frame.dy
        parts = (
            lines[1], weight, lines[2] / dx, lines[3] / dy, lines[4] / dx, lines[5] / dy
        )  # fmt: skip
        return Joint(*(part.reshape(x.shape) for part in parts))

    def limits(self, bounds):
        """Bound elevation, weight and slopes by those of the discs that reach a rectangle.

        The slope of the blend is bounded as `Blend` bounds it, with the sum of weights at least
        its minimum over the lattice where no disc is missing.
        """
        rows, columns, whole = self._discs(bounds)
        if not rows.size or not columns.size:
            return NOTHING
        discs = (rows[:, None] * self.grid.columns + columns).ravel()
        whole = whole and bool(self.present[discs].all())
        discs = discs[self.present[discs]]
        if not discs.size:
            return NOTHING
        low, high, slope = (line[discs] for line in self._disc_limits)
        least = self._least_sum if whole else 0.5 * _COVERED
        each, most = _WYVILL_SLOPE / min(self._radii), self._most_discs
        mixing = (high.max() - low.min()) * max(most - 1, 0) * each
        return Limits(
            float(low.min()), float(high.max()), float(slope.max() + mixing / least),
            float(whole), 1.0, 0.0 if whole else most * each / _COVERED,
        )  # fmt: skip

    def _discs(self, bounds):
        """Give the rows and columns of the discs that may reach a rectangle.

        And tell whether it lies between the centres of discs, so that all it needs are there.
        """
        top, left = (place + 0.5 for place in self.frame.place(bounds.xmin, bounds.ymax))
        bottom, right = (place + 0.5 for place in self.frame.place(bounds.xmax, bounds.ymin))
        spans, whole = [], True
        for centres, first, last, side in zip(
            self.grid.centres(), (top, left), (bottom, right),
            (self.grid.side_rows, self.grid.side_columns), strict=True,
        ):  # fmt: skip
            near = (centres > first - side / 2) & (centres < last + side / 2)
            spans.append(np.flatnonzero(near))
            whole = whole and bool(centres[0] <= first and last <= centres[-1])
        return *spans, whole

    @cached_property
    def _disc_limits(self):
        """Low, high and slope per metre of every disc's own function; (3, n)."""
        radius_x, radius_y = self._radii
        low, high, by_u, by_v = self.atoms.limits
        slope = np.hypot(by_u / radius_x, by_v / radius_y)
        x = self.coefficients.astype(np.float64)
        ends = x * low[self.indices], x * high[self.indices]
        return np.stack([
            self.means + np.minimum(*ends).sum(axis=1),
            self.means + np.maximum(*ends).sum(axis=1),
            (np.abs(x) * slope[self.indices]).sum(axis=1),
        ])  # fmt: skip

    @property
    def _most_discs(self):
        """Discs over a point, at most."""
        across = math.ceil(self.grid.side_columns / self.grid.step_columns)
        return across * math.ceil(self.grid.side_rows / self.grid.step_rows)

    @cached_property
    def _least_sum(self):
        """Least sum of weights between the centres of four discs, with none missing."""
        steps = 64
        ratio_v = 2 * self.grid.step_rows / self.grid.side_rows
        ratio_u = 2 * self.grid.step_columns / self.grid.side_columns
        reach = [np.arange(-int(1 / ratio) - 1, int(1 / ratio) + 3) for ratio in (ratio_v, ratio_u)]
        t = np.linspace(0, 1, steps + 1)
        v = (t[:, None] - reach[0]) * ratio_v
        u = (t[:, None] - reach[1]) * ratio_u
        squares = v[:, None, :, None] ** 2 + u[None, :, None, :] ** 2
        least = (np.maximum(1 - squares, 0) ** 3).sum(axis=(2, 3)).min()
        # Between the places looked at, the sum may be less by its slope times half their distance.
        between = math.hypot(ratio_u, ratio_v) / (2 * steps) * _WYVILL_SLOPE * self._most_discs
        return max(float(least - between), 0.5 * _COVERED)
