"""Discs on a lattice that covers a raster, and the samples that lie in them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from demsmith.core.errors import InputError

LARGEST_SIDE = 512
"""Cells across a disc, at most."""

_OUTERMOST = 0.95
"""Squared distance from the nearest centre, in radii, that no point may exceed: a weight beyond
(1 - 0.95)³ ≈ 1e-4 keeps the blend well away from a division by nothing."""

_WEIGHT_UNITS = np.float64(1 << 30)
"""Weights are multiples of one by this, so that their sums in float64 are exact in any order: the
guarantee of coded terrains rests on the same bits on every machine."""


@dataclass(frozen=True)
class PatchGrid:
    """Discs on a lattice: where they lie in a raster, and what they weigh.

    A disc is inscribed in a block of ``side_rows`` by ``side_columns`` cells, its radius R half of
    that, so it is an ellipse of cells where those are no squares on the ground. Samples are at the
    centres of cells. There are ``ceil(H / step_rows) * ceil(W / step_columns)`` discs, numbered
    row by row; with a step of R these are the ``4 n / K`` of the paper.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns of the raster.
    side_rows, side_columns : int
        Cells across a disc.
    step_rows, step_columns : int
        Cells from one centre to the next.

    Raises
    ------
    InputError
        If a number is out of range, or a point would lie (nearly) outside all discs.

    Examples
    --------
    >>> grid = PatchGrid((23, 40))
    >>> grid.rows, grid.columns, grid.count
    (5, 8, 40)
    >>> grid.top(0), grid.left(7)
    (-2, 33)
    """

    shape: tuple[int, int]
    side_rows: int = 10
    side_columns: int = 10
    step_rows: int = 5
    step_columns: int = 5

    def __post_init__(self):
        if len(self.shape) != 2 or min(self.shape) < 1:
            raise InputError(f"a raster of shape {self.shape} has no cells")
        for name, side, step in (
            ("rows", self.side_rows, self.step_rows),
            ("columns", self.side_columns, self.step_columns),
        ):
            if not 1 <= side <= LARGEST_SIDE:
                raise InputError(f"side_{name} is {side}; it must be in 1 to {LARGEST_SIDE}")
            if not 1 <= step <= side:
                raise InputError(f"step_{name} is {step}; it must be in 1 to side_{name}, {side}")
        worst = self._farthest(0) ** 2 + self._farthest(1) ** 2
        if worst > _OUTERMOST:
            raise InputError(
                f"steps of {self.step_rows} by {self.step_columns} cells leave some ground out of "
                f"discs of {self.side_rows} by {self.side_columns} cells; give smaller steps"
            )

    def _farthest(self, axis):
        """Give the largest distance of the raster's points from the nearest centre, in radii."""
        side, step = self._side_and_step(axis)
        centre = self._first(side, step) + side / 2
        last = min(self.shape[axis], step)  # edge of the cells that the last disc has to itself
        inner = step / 2 if self.shape[axis] > step else 0.0
        return max(centre, last - centre, inner) / (side / 2)

    def _side_and_step(self, axis):
        return ((self.side_rows, self.step_rows), (self.side_columns, self.step_columns))[axis]

    @staticmethod
    def _first(side, step):
        """Give the first cell of the first disc: half of what overlaps lies before the raster."""
        return -((side - step) // 2)

    @property
    def rows(self):
        """Rows of discs."""
        return -(-self.shape[0] // self.step_rows)

    @property
    def columns(self):
        """Columns of discs."""
        return -(-self.shape[1] // self.step_columns)

    @property
    def count(self):
        """Number of discs."""
        return self.rows * self.columns

    @property
    def samples(self):
        """Cells of a block, K; those outside the disc count too."""
        return self.side_rows * self.side_columns

    def top(self, row):
        """Give the raster's row where the blocks of a row of discs begin; may be negative."""
        return self._first(self.side_rows, self.step_rows) + row * self.step_rows

    def left(self, column):
        """Give the raster's column where the blocks of a column of discs begin."""
        return self._first(self.side_columns, self.step_columns) + column * self.step_columns

    def corners(self, patches=None):
        """Give the first rows and columns of blocks.

        Parameters
        ----------
        patches : (n,) int array, optional
            Default: all, in their order.

        Returns
        -------
        (n,) int64 array, (n,) int64 array
        """
        patches = np.arange(self.count) if patches is None else np.asarray(patches, np.int64)
        rows, columns = np.divmod(patches, self.columns)
        return self.top(rows), self.left(columns)

    def centres(self):
        """Give the centres' rows and columns, in cells from the raster's upper left corner.

        Returns
        -------
        (rows,) float64 array, (columns,) float64 array
            The centre of the raster's first cell has 0.5.
        """
        return (
            self.top(np.arange(self.rows)) + self.side_rows / 2,
            self.left(np.arange(self.columns)) + self.side_columns / 2,
        )

    def rows_over(self, first, last):
        """Give the rows of discs, first and one past the last, that touch rows of the raster."""
        return self._over(first, last, self.side_rows, self.step_rows, self.rows)

    def columns_over(self, first, last):
        """Give the columns of discs, first and one past the last, that touch columns."""
        return self._over(first, last, self.side_columns, self.step_columns, self.columns)

    @classmethod
    def _over(cls, first, last, side, step, count):
        origin = cls._first(side, step)
        begin = -(-(first - origin - side + 1) // step)
        end = -(-(last - origin) // step)
        return min(max(begin, 0), count), min(max(end, 0), count)

    @cached_property
    def weights(self):
        """Weights ``(1 - r²)³`` of a block's samples, float32 (side_rows, side_columns)."""
        return disc_weights(self.side_rows, self.side_columns)

    @cached_property
    def disc(self):
        """Whether a block's samples lie in the disc, bool (side_rows, side_columns)."""
        return self.weights > 0

    @cached_property
    def sums(self):
        """What the weights of the discs over a cell sum to, a `WeightSums`."""
        rows, row_kinds = self._kinds(0)
        columns, column_kinds = self._kinds(1)
        totals = rows @ self.weights.astype(np.float64) @ columns.T
        return WeightSums((1 / totals).astype(np.float32), row_kinds, column_kinds)

    def _kinds(self, axis):
        """Sort the raster's rows, or columns, by which lines of blocks lie over them.

        Returns
        -------
        (kinds, side) float64 array
            1 for the lines of blocks that lie over rows of a kind, 0 for others.
        (H,) or (W,) int32 array
            The rows' or columns' kinds.
        """
        side, step = self._side_and_step(axis)
        origin = self._first(side, step)
        discs = (self.rows, self.columns)[axis]
        lines = np.arange(self.shape[axis])
        begin = np.maximum(-((origin + side - 1 - lines) // step), 0)
        end = np.minimum((lines - origin) // step + 1, discs)
        nearest = lines - origin - (end - 1) * step  # its line in the last block over it
        kinds, of = np.unique(nearest * (side + 1) + end - begin, return_inverse=True)
        nearest, count = np.divmod(kinds[:, None], side + 1)
        back = np.arange(side) - nearest
        return ((back % step == 0) & (back >= 0) & (back < count * step)).astype(float), of.astype(
            np.int32
        )


@dataclass(frozen=True, eq=False)
class WeightSums:
    """Sums of weights, the same for all cells over which the discs lie alike.

    Attributes
    ----------
    inverse : (m, n) float32 array
        One by the sum, for a kind of rows and a kind of columns.
    row_kinds : (H,) int32 array
    column_kinds : (W,) int32 array
    """

    inverse: np.ndarray
    row_kinds: np.ndarray
    column_kinds: np.ndarray

    def over(self, first, last):
        """Give ``inverse`` for each kind of rows and the columns ``first`` to ``last``."""
        return self.inverse[:, self.column_kinds[first:last]]


def disc_weights(side_rows, side_columns):
    """Give the weights of the samples of a block, ``(1 - r²)³`` within the disc and 0 outside.

    ``r`` is the distance of the samples, the cells' centres, from the block's, in radii: 1 in the
    middle of each edge.

    Returns
    -------
    (side_rows, side_columns) float32 array

    Examples
    --------
    >>> disc_weights(2, 4).round(3)
    array([[0.007, 0.325, 0.325, 0.007],
           [0.007, 0.325, 0.325, 0.007]], dtype=float32)
    """
    y = (np.arange(side_rows) + 0.5) * (2 / side_rows) - 1
    x = (np.arange(side_columns) + 0.5) * (2 / side_columns) - 1
    near = np.maximum(1 - (y * y)[:, None] - x * x, 0)
    weights = (near * near * near).astype(np.float32)  # products, for a power may differ
    return (np.round(weights * _WEIGHT_UNITS) / _WEIGHT_UNITS).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Patches:
    """The samples of some discs.

    Attributes
    ----------
    samples : (n, K) float32 array
        Elevation minus the disc's mean, blocks row by row; 0 where not ``valid``.
    means : (n,) float32 array
        Of the valid samples; 0 where there is none.
    valid : (n, K) bool array
        True in the disc and in the raster where there is no void.
    counts : (n,) int32 array
        Valid samples of each disc.
    """

    samples: np.ndarray
    means: np.ndarray
    valid: np.ndarray
    counts: np.ndarray


def gather(values, void, grid, patches=None):
    """Copy out the samples of discs.

    Parameters
    ----------
    values : (H, W) float32 array
    void : (H, W) bool array
    grid : PatchGrid
    patches : (n,) int array, optional
        Which discs, by number; default: all.

    Returns
    -------
    Patches

    Examples
    --------
    >>> slope = np.arange(40, dtype=np.float32) * np.ones((30, 1), np.float32)
    >>> patches = gather(slope, np.zeros(slope.shape, bool), PatchGrid(slope.shape), [9])
    >>> patches.means, patches.counts
    (array([7.5], dtype=float32), array([80], dtype=int32))
    """
    if values.shape != grid.shape or void.shape != grid.shape:
        raise InputError(
            f"the discs are of a raster of shape {grid.shape}; values have {values.shape}, "
            f"void {void.shape}"
        )
    return gather_at(values, void, *grid.corners(patches), grid.disc)


def gather_at(values, void, tops, lefts, disc):
    """Copy out the samples of discs anywhere in a raster, also across its edges.

    Parameters
    ----------
    values : (H, W) float32 array
    void : (H, W) bool array
    tops, lefts : (n,) int arrays
        First row and column of each block; may be negative.
    disc : (side_rows, side_columns) bool array
        Samples of a block that count, as in `PatchGrid.disc`.

    Returns
    -------
    Patches
    """
    from demsmith.core.sparse._patches import gather_blocks

    tops, lefts = np.asarray(tops, np.int64), np.asarray(lefts, np.int64)
    found = Patches(
        np.zeros((tops.size, disc.size), np.float32),
        np.zeros(tops.size, np.float32),
        np.zeros((tops.size, disc.size), bool),
        np.zeros(tops.size, np.int32),
    )
    gather_blocks(
        np.ascontiguousarray(values, np.float32), np.ascontiguousarray(void, bool), tops, lefts,
        np.ascontiguousarray(disc), found.samples, found.means, found.valid, found.counts,
    )  # fmt: skip
    return found
