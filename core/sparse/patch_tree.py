"""A raster as a blend of discs: decomposed over a dictionary, and evaluated at any scale."""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT
from demsmith.core.sparse.patches import PatchGrid, gather
from demsmith.core.sparse.pursuit import Pursuit, shifts

_BAND_CELLS = 1 << 18
"""Cells that a task evaluates, about."""


@dataclass(frozen=True, eq=False)
class PatchTree:
    """Discs on a lattice, each a mean and a few atoms, blended to one surface (§3 of the paper).

    ``f(p) = Σ f_i(p) α_i(p) / Σ α_i(p)`` over the discs, ``f_i(p) = z_i + Σ_j x_ij d_j(p - c_i)``.

    Parameters
    ----------
    grid : PatchGrid
    means : (n,) float32 array
        ``z_i`` of each disc.
    indices : (n, s) int32 array
        Atoms of each disc, the most important first.
    coefficients : (n, s) float32 array
        0 for no atom.
    atoms : (N, K) float32 array
        Samples at the centres of a block's cells, of root mean square 1 over the disc, 0 outside.

    Raises
    ------
    InputError
        If shapes do not fit or an index is none of the atoms'.
    """

    grid: PatchGrid
    means: np.ndarray
    indices: np.ndarray
    coefficients: np.ndarray
    atoms: np.ndarray

    def __post_init__(self):
        for name, kind in (
            ("means", np.float32), ("indices", np.int32), ("coefficients", np.float32),
            ("atoms", np.float32),
        ):  # fmt: skip
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), kind))
        count = self.grid.count
        if self.means.shape != (count,):
            raise InputError(f"{count} discs need as many means, got {self.means.shape}")
        if self.indices.ndim != 2 or len(self.indices) != count:
            raise InputError(f"{count} discs need as many indices, got {self.indices.shape}")
        if self.coefficients.shape != self.indices.shape:
            raise InputError(
                f"indices of shape {self.indices.shape} have coefficients of shape "
                f"{self.coefficients.shape}"
            )
        if self.atoms.ndim != 2 or self.atoms.shape[1] != self.grid.samples:
            raise InputError(
                f"atoms of shape {self.atoms.shape} do not fit discs of {self.grid.samples} samples"
            )
        if self.indices.size and not (
            self.indices.min() >= 0 and self.indices.max() < len(self.atoms)
        ):
            raise InputError(f"an index is none of the {len(self.atoms)} atoms")

    @property
    def shape(self):
        """Rows and columns of the raster."""
        return self.grid.shape

    @property
    def sparsity(self):
        """Atoms of a disc, at most."""
        return self.indices.shape[1]

    def evaluate(
        self, window=None, *, scale=1.0, coefficients=None, threads=None, progress=SILENT
    ):  # fmt: skip
        """Give the surface at the cells' centres, or at those of a finer or coarser raster.

        Parameters
        ----------
        window : (int, int, int, int), optional
            First row and one past the last, first column and one past the last, of the raster at
            this scale (`scaled_shape`); default: all. A cell's value does not depend on it.
        scale : float
            Cells of the output along a cell of the raster. Above 1 the atoms are interpolated
            bicubically; below 1 the surface is averaged over the output's cells.
        coefficients : int, optional
            Level of detail: use this many atoms of a disc, at most; 0 leaves the means alone.
        threads : int, optional
            Default: one for each core. The result does not depend on it.
        progress : Progress

        Returns
        -------
        (rows, columns) float32 array

        Raises
        ------
        InputError
            If the window is not in the raster or the scale not above 0.
        Cancelled
            If ``progress`` asks to stop.
        """
        if coefficients is not None and coefficients < 0:
            raise InputError(f"coefficients is {coefficients}; it must be 0 or more")
        discs = Discs(
            0, 0, *(
                part.reshape(self.grid.rows, self.grid.columns, *part.shape[1:])
                for part in (self.means, self.indices, self.coefficients)
            ),
        )  # fmt: skip
        return blend(
            self.grid, discs, self.atoms, window, scale=scale, coefficients=coefficients,
            threads=threads, progress=progress,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Discs:
    """A rectangle of a lattice's discs.

    Attributes
    ----------
    row, column : int
        The first disc's.
    means : (m, n) float32 array
    indices : (m, n, s) int32 array
    coefficients : (m, n, s) float32 array
    """

    row: int
    column: int
    means: np.ndarray
    indices: np.ndarray
    coefficients: np.ndarray

    def cut(self, rows, columns, used=None):
        """Give the arrays of some rows and columns (first, one past the last) of the lattice."""
        part = (
            slice(rows[0] - self.row, rows[1] - self.row),
            slice(columns[0] - self.column, columns[1] - self.column),
        )
        return (
            np.ascontiguousarray(self.means[part]),
            np.ascontiguousarray(self.indices[part][..., :used]),
            np.ascontiguousarray(self.coefficients[part][..., :used]),
        )


def blend(
    grid, discs, atoms, window=None, *, scale=1.0, coefficients=None, threads=None,
    progress=SILENT,
):  # fmt: skip
    """Blend discs over a window; see `PatchTree.evaluate`.

    Parameters
    ----------
    grid : PatchGrid
    discs : Discs
        At least those over the window, see `window_discs`.
    atoms : (N, K) float32 array
    window, scale, coefficients, threads, progress
        As of `PatchTree.evaluate`.

    Returns
    -------
    (rows, columns) float32 array
    """
    window = _checked_window(window, scaled_shape(grid.shape, scale))
    out = np.empty((window[1] - window[0], window[3] - window[2]), np.float32)
    work = _Evaluation(grid, discs, atoms, window, scale, coefficients, out)
    step = max(1, int(_BAND_CELLS * min(scale, 1.0) ** 2) // out.shape[1])
    # Discs that straddle two bands are combined twice.
    step = max(step, math.ceil(2 * grid.side_rows * scale))
    tasks = [
        partial(work.rows, first, min(first + step, len(out))) for first in range(0, len(out), step)
    ]
    parallel.run(tasks, threads=threads, progress=progress)
    return out


def window_discs(grid, window=None, *, scale=1.0):
    """Give the rows and columns (first, one past the last) of the discs over a window."""
    window = _checked_window(window, scaled_shape(grid.shape, scale))
    rows, columns = _cells_under(grid.shape, window, scale)
    return grid.rows_over(*rows), grid.columns_over(*columns)


def _cells_under(shape, window, scale):
    """Give the raster's rows and columns that cells of a scaled window touch."""
    return tuple(
        (math.floor(first / scale), min(math.ceil(last / scale), cells))
        for first, last, cells in ((*window[:2], shape[0]), (*window[2:], shape[1]))
    )


class _Evaluation:
    """The evaluation of a window, some rows after others."""

    def __init__(self, grid, discs, atoms, window, scale, used, out):
        self.grid, self.discs, self.atoms = grid, discs, atoms
        self.window, self.scale, self.used, self.out = window, scale, used, out
        if scale == 1:
            self.rows = self._cells
        elif scale < 1:
            self.rows = self._averages
        else:
            self.rows = self._points
            self.atoms = extended(atoms, grid.disc)

    def _over(self, rows, columns):
        """Give the discs over some cells of the raster, and where the first one's block begins."""
        rows, columns = self.grid.rows_over(*rows), self.grid.columns_over(*columns)
        return (
            self.discs.cut(rows, columns, self.used), self.grid.top(rows[0]),
            self.grid.left(columns[0]),
        )  # fmt: skip

    def _cells(self, first, last):
        row, column = self.window[0], self.window[2]
        self._fill(row + first, column, self.out[first:last])

    def _fill(self, row, column, out):
        """Blend at the cells' centres, from a row and column of the raster on."""
        from demsmith.core.sparse._blending import blend_cells

        grid, sums = self.grid, self.grid.sums
        end_row, end_column = row + out.shape[0], column + out.shape[1]
        discs, top, left = self._over((row, end_row), (column, end_column))
        blend_cells(
            *discs, self.atoms, grid.weights,
            (top - row, left - column, grid.step_rows, grid.step_columns),
            sums.over(column, end_column), sums.row_kinds[row:end_row], out, 0, len(out),
        )  # fmt: skip

    def _points(self, first, last):
        from demsmith.core.sparse._blending import blend_points

        grid, (row, _, column, end_column) = self.grid, self.window
        cells = _cells_under(
            grid.shape, (row + first, row + last, column, end_column), self.scale
        )  # fmt: skip
        discs, top, left = self._over(*cells)
        blend_points(
            *discs, self.atoms, (grid.side_rows, grid.side_columns),
            (top, left, grid.step_rows, grid.step_columns), grid.shape, self.scale,
            (row, column), self.out, first, last,
        )  # fmt: skip

    def _averages(self, first, last):
        from demsmith.core.sparse._blending import average_nodes

        (height, width), (row, _, column, end_column) = self.grid.shape, self.window
        (top, bottom), (left, right) = _cells_under(
            self.grid.shape, (row + first, row + last, column, end_column), self.scale
        )
        rows = np.minimum(np.arange(row + first, row + last + 1) / self.scale, height)
        columns = np.minimum(np.arange(column, end_column + 1) / self.scale, width)
        cells = np.empty((bottom - top, right - left), np.float32)
        self._fill(top, left, cells)
        average_nodes(cells, rows - top, columns - left, self.out[first:last], 0, last - first)


def scaled_shape(shape, scale):
    """Give rows and columns of a raster at another scale.

    Raises
    ------
    InputError
        If the scale is not above 0, or the raster would have more than 2³¹ rows or columns.

    Examples
    --------
    >>> scaled_shape((1201, 100), 0.25)
    (301, 25)
    """
    if not (math.isfinite(scale) and scale > 0 and max(shape) * scale < 2**31):
        raise InputError(f"scale is {scale}; give a number above 0 that leaves a possible raster")
    return tuple(max(1, math.ceil(round(cells * scale, 6))) for cells in shape)


def _checked_window(window, shape):
    window = (0, shape[0], 0, shape[1]) if window is None else tuple(int(side) for side in window)
    if not (0 <= window[0] < window[1] <= shape[0] and 0 <= window[2] < window[3] <= shape[1]):
        raise InputError(
            f"the window {window} (rows from, to, columns from, to) is not in the raster of "
            f"{shape[0]} by {shape[1]} cells"
        )
    return window


def extended(atoms, disc):
    """Let sampled atoms go on beyond their disc, for interpolation near its rim.

    Parameters
    ----------
    atoms : (N, K) float32 array
        0 outside the disc.
    disc : (side_rows, side_columns) bool array

    Returns
    -------
    (N, K) float32 array
        Each sample outside has the value of the nearest inside.
    """
    from scipy.ndimage import distance_transform_edt

    rows, columns = distance_transform_edt(
        ~disc, sampling=(1 / disc.shape[0], 1 / disc.shape[1]), return_indices=True,
        return_distances=False,
    )  # fmt: skip
    return np.ascontiguousarray(atoms[:, (rows * disc.shape[1] + columns).ravel()])


def decompose(
    values, void=None, *, dictionary, sparsity, grid=None, tolerance=0.0, threads=None,
    progress=SILENT,
):  # fmt: skip
    """Approximate a raster by discs of at most ``sparsity`` atoms each (§4.3 of the paper).

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array, optional
        As of `fill_voids`. Voids say nothing; a disc of voids alone takes the mean of the next
        one that is not.
    dictionary : (N, K) float32 array
        Atoms, 0 outside the disc.
    sparsity : int
    grid : PatchGrid, optional
        Default: discs of 10 by 10 cells, 5 cells apart.
    tolerance : float
        A disc whose residual's root mean square [m] is no larger takes no more atoms.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    PatchTree

    Raises
    ------
    InputError
        If arrays do not fit, nothing is known, or an option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    With the terrain's own discs as atoms, one each is exact:

    >>> y, x = np.mgrid[:40, :50]
    >>> ground = (1000 + 30 * np.sin(x / 5) * y).astype(np.float32)
    >>> grid = PatchGrid(ground.shape)
    >>> atoms = gather(ground, np.zeros(ground.shape, bool), grid).samples
    >>> tree = decompose(ground, dictionary=atoms, sparsity=1, grid=grid)
    >>> bool(abs(tree.evaluate() - ground).max() < 2e-3)
    True
    """
    values, void = checked(values, void)
    grid = PatchGrid(values.shape) if grid is None else grid
    pursuit = Pursuit(dictionary, sparsity, tolerance=tolerance)
    if pursuit.samples != grid.samples:
        raise InputError(
            f"the dictionary's atoms have {pursuit.samples} samples, the discs {grid.samples} "
            f"({grid.side_rows} by {grid.side_columns})"
        )
    if void.all():
        raise InputError("every cell is a void; there is nothing to decompose")
    values = np.ascontiguousarray(values, np.float32)
    atoms = np.ascontiguousarray(dictionary, np.float32)
    means = np.empty(grid.count, np.float32)
    empty = np.zeros(grid.count, bool)
    indices = np.empty((grid.count, sparsity), np.int32)
    coefficients = np.empty((grid.count, sparsity), np.float32)

    def block(part):
        patches = gather(values, void, grid, np.arange(part.start, part.stop))
        found = pursuit.block(patches.samples, patches.valid)
        indices[part], coefficients[part] = found
        means[part] = patches.means - shifts(patches.valid, atoms, *found)
        empty[part] = patches.counts == 0

    size = pursuit.block_size
    parts = [slice(at, min(at + size, grid.count)) for at in range(0, grid.count, size)]
    parallel.run([partial(block, part) for part in parts], threads=threads, progress=progress)
    if empty.any():
        means[empty] = _nearest(means, empty, grid)[empty]
    return PatchTree(grid, means, indices, coefficients, atoms)


def _nearest(means, empty, grid):
    """Give every disc the mean of the nearest that is not empty."""
    from scipy.ndimage import distance_transform_edt

    lattice = grid.rows, grid.columns
    at = distance_transform_edt(
        empty.reshape(lattice), sampling=(grid.step_rows, grid.step_columns),
        return_indices=True, return_distances=False,
    )  # fmt: skip
    return means.reshape(lattice)[tuple(at)].ravel()
