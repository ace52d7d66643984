"""Ground: known elevations on a grid, read by windows, whatever holds them.

`demsmith.core.raster.TileSet` is ground on disk, `ArrayGround` ground in memory. All of
reconstruction sees one of these, so a mosaic is computed as its merged raster would be.
"""

from typing import Protocol

import numpy as np

from demsmith.core.progress import SILENT
from demsmith.core.raster import Grid


class Ground(Protocol):
    """What reconstruction asks of elevations.

    Attributes
    ----------
    grid : Grid
    shape : (int, int)
    dtype : numpy.dtype
        float32 or float64, of the elevations that are read.
    unit : float or None
        Metres in the unit of the elevations; None if unknown.
    """

    grid: Grid
    shape: tuple
    dtype: np.dtype
    unit: float | None

    def read(self, rows, columns, *, progress=SILENT):
        """Read the window of these slices: ``(h, w)`` elevations and bool voids.

        Nothing is written to what is returned. Cells that belong to no tile are void.
        """

    def covered(self, rows, columns):
        """Tell which cells of a window belong to the ground at all: ``(h, w)`` bool array."""


class ArrayGround:
    """Ground in memory.

    Parameters
    ----------
    values : (H, W) float32 or float64 array
        Real elevations.
    void : (H, W) bool array
    grid : Grid
    covered : (H, W) bool array, optional
        The cells that are ground or void; the others belong to no tile. Default: all.
    unit : float, optional
        Metres in the unit of the elevations.
    """

    def __init__(self, values, void, grid, covered=None, unit=None):
        self._values, self._void, self._covered = values, void, covered
        self.grid, self.shape, self.dtype, self.unit = grid, values.shape, values.dtype, unit

    def read(self, rows, columns, *, progress=SILENT):
        """Give views of a window, see `Ground`."""
        return self._values[rows, columns], self._void[rows, columns]

    def covered(self, rows, columns):
        """Tell which cells of a window belong to the ground, see `Ground`."""
        if self._covered is None:
            return np.ones((rows.stop - rows.start, columns.stop - columns.start), bool)
        return self._covered[rows, columns]


def steady_grid(grid):
    """Give a grid without the last digits of its numbers.

    The same place may be spelt with different last digits by a tile and by the raster it was cut
    from; what is computed from it must not tell.
    """
    if not grid.georeferenced:
        return grid
    x, width, _, y, _, height = grid.geotransform
    width, height = (float(f"{size:.11g}") for size in (width, height))
    x, y = round(x / width, 3) * width, round(y / height, 3) * height
    return Grid(grid.shape, (x, width, 0.0, y, 0.0, height), grid.crs)
