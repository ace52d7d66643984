"""A coarse lattice of a raster's cells, at whose nodes the Earth's frame is known."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.raster import places_of

# Nodes are this far apart at most: between them the frame is interpolated, whose error is an eighth
# of the squared angle, so below 0.001°; and so many cells are worked on at a time.
_ANGLE = 0.5  # degrees
_CELLS = 64
_DEGREE = 111.2e3  # metres


@dataclass(frozen=True, eq=False)
class Lattice:
    """Nodes among the cells of a raster whose first row is northern, first column western.

    Attributes
    ----------
    rows, columns : (R,), (C,) int64 arrays
        Of the nodes, the raster's first and last among them.
    frame : (R, C, 3, 3) float64 array
        As of `demsmith.core.raster.Places`; NaN where there is no place on the Earth.
    longitude : float
        Of the raster's middle [degrees].
    """

    rows: np.ndarray
    columns: np.ndarray
    frame: np.ndarray
    longitude: float

    def check(self, void):
        """Refuse ground that is nowhere on the Earth.

        Raises
        ------
        InputError
            If a cell beside a node that has no place is no void.
        """
        for row, column in np.argwhere(np.isnan(self.frame).any(axis=(2, 3))):
            above, below = self.rows[[max(row - 1, 0), min(row + 1, self.rows.size - 1)]]
            left, right = self.columns[[max(column - 1, 0), min(column + 1, self.columns.size - 1)]]
            if not void[above : below + 1, left : right + 1].all():
                raise InputError(
                    f"near row {self.rows[row]}, column {self.columns[column]} the raster's CRS "
                    "has no place on the Earth: crop it, or make voids of the cells there"
                )

    def ranges(self, z, void):
        """Give the lowest and the highest elevation of each patch between nodes.

        Returns
        -------
        (R - 1, C - 1, 2) array
            At least one patch each way; a patch has its first row and column of nodes, the last
            patch its last too. Infinite the wrong way round where all are voids.
        """
        rows, columns = (nodes[: max(nodes.size - 1, 1)] for nodes in (self.rows, self.columns))

        def extreme(ufunc, empty):
            known = np.where(void, z.dtype.type(empty), z)
            return ufunc.reduceat(ufunc.reduceat(known, rows), columns, axis=1)

        return np.stack([extreme(np.minimum, np.inf), extreme(np.maximum, -np.inf)], axis=-1)


def lattice_of(grid):
    """Lay a lattice over a raster.

    Parameters
    ----------
    grid : Grid
        With its first row in the north, its first column in the west.

    Returns
    -------
    Lattice

    Raises
    ------
    InputError
        As `demsmith.core.raster.places_of`.
    """
    height, width = grid.shape
    spacing = _spacing(grid)
    rows, columns = _nodes(height, spacing), _nodes(width, spacing)
    frame = places_of(grid, rows[:, None], columns).frame
    middle = places_of(grid, (height - 1) / 2, (width - 1) / 2)
    longitude = float(middle.longitude[0])
    return Lattice(
        rows, columns, frame.reshape(rows.size, columns.size, 3, 3),
        longitude if np.isfinite(longitude) else 0.0,
    )  # fmt: skip


def _spacing(grid):
    from demsmith.core.raster.crs import crs_units

    units = crs_units(grid.crs)
    side = max(abs(grid.geotransform[1]), abs(grid.geotransform[5])) * units.unit
    degrees = side if units.geographic else side / _DEGREE
    return int(min(max(_ANGLE // degrees, 1), _CELLS))


def _nodes(count, spacing):
    """Every ``spacing``-th cell, and the last."""
    return np.unique(np.append(np.arange(0, count, spacing), count - 1))
