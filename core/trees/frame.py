"""The local frame of a raster: metres east and north of its south-western corner."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.raster import Shape
from demsmith.core.sparse.patch_tree import scaled_shape
from demsmith.core.trees.node import Bounds


@dataclass(frozen=True)
class Frame:
    """A plane over a raster, in which its cells all have the size of those of the middle row.

    Cells may be counted in fractions: cell ``(row, column)`` reaches half a cell about its
    centre, so that the raster begins at −0.5.

    Parameters
    ----------
    shape : (rows, columns)
    dx, dy : float
        Ground metres per cell, east-west and north-south.

    Examples
    --------
    >>> frame = Frame((100, 200), 20.0, 30.0)
    >>> frame.xy(99, 0)
    (10.0, 15.0)
    >>> frame.place(10.0, 15.0)
    (99.0, 0.0)
    """

    shape: Shape
    dx: float
    dy: float

    @classmethod
    def of(cls, grid):
        """Make the frame of a `Grid`, whose rows run east and columns south."""
        sizes = grid.pixel_size_m()
        middle = grid.shape.rows // 2
        return cls(grid.shape, float(sizes.dx[middle]), float(sizes.dy[middle]))

    def xy(self, row, column):
        """Give metres east and north of the centre of a cell, or of many given by arrays."""
        return (column + 0.5) * self.dx, (self.shape[0] - 0.5 - row) * self.dy

    def place(self, x, y):
        """Give row and column of points, 0 being the centre of the first cell."""
        return self.shape[0] - 0.5 - y / self.dy, x / self.dx - 0.5

    def bounds(self):
        """Give the raster's extent in the plane."""
        rows, columns = self.shape
        return Bounds(0.0, 0.0, columns * self.dx, rows * self.dy)

    def axes(self, scale=1.0):
        """Give the coordinates of the columns and rows of this raster, or of one finer or coarser.

        Parameters
        ----------
        scale : float
            Cells of the other raster along a cell of this one. It begins at the same
            north-western corner, and reaches beyond the others where it must.

        Returns
        -------
        x, y : 1-D ndarray of float64
            Eastings from west to east, northings from north to south.

        Raises
        ------
        InputError
            If the scale is not above 0.

        Examples
        --------
        >>> [side.tolist() for side in Frame((2, 3), 10.0, 30.0).axes(0.5)]
        [[10.0, 30.0], [30.0]]
        """
        rows, columns = scaled_shape(self.shape, scale)
        return self.xy(*((np.arange(cells) + 0.5) / scale - 0.5 for cells in (rows, columns)))
