"""Where the cells of a raster lie, and how large they are on the ground."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from demsmith.core import geodesy
from demsmith.core.errors import InputError
from demsmith.core.raster.crs import crs_units

NO_GEOTRANSFORM = (0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
"""GDAL's geotransform of a raster that has none: coordinates are columns and rows."""


class Shape(NamedTuple):
    """Number of rows and columns, as NumPy orders them."""

    rows: int
    columns: int


class XY(NamedTuple):
    """A place in the coordinates of a CRS: easting or longitude first."""

    x: Any
    y: Any


class PixelSize(NamedTuple):
    """Ground metres per pixel of each row: ``dx`` east-west, ``dy`` north-south."""

    dx: np.ndarray
    dy: np.ndarray


@dataclass(frozen=True)
class Grid:
    """The place of a raster's cells; immutable.

    Parameters
    ----------
    shape : (rows, columns)
        Its size in cells.
    geotransform : 6 floats
        GDAL's: x of the outer corner of cell (0, 0), pixel width, 0, y of that corner, 0,
        pixel height, which is negative where the first row is the northern one. If not given,
        columns and rows are the coordinates.
    crs : str
        WKT of the coordinate reference system, or anything else GDAL takes; empty if unknown,
        then the coordinates are taken as metres.

    Raises
    ------
    InputError
        If a side has no cell, a pixel no size, or the grid is rotated or sheared.

    Examples
    --------
    >>> grid = Grid((2, 3), (500.0, 10.0, 0.0, 900.0, 0.0, -10.0))
    >>> grid.xy(0, 2)
    XY(x=525.0, y=895.0)
    >>> grid.pixel_size_m().dy
    array([10., 10.])
    """

    shape: Shape
    geotransform: tuple = NO_GEOTRANSFORM
    crs: str = ""

    def __post_init__(self):
        """Check, and bring to plain types, what was given."""
        shape = Shape(*(int(side) for side in self.shape))
        if min(shape) < 1:
            raise InputError(f"the raster has no cells: {shape.rows} rows, {shape.columns} columns")
        geotransform = tuple(float(term) for term in self.geotransform)
        _check_geotransform(geotransform, shape)
        object.__setattr__(self, "shape", shape)
        object.__setattr__(self, "geotransform", geotransform)

    @classmethod
    def of_extent(cls, extent, resolution, crs=""):
        """Make the north-up grid whose cells cover an extent, from its north-western corner on.

        Parameters
        ----------
        extent : (xmin, ymin, xmax, ymax)
            In the coordinates of ``crs``. Where it is no whole number of cells, the grid reaches
            beyond its eastern and southern edges.
        resolution : float or (float, float)
            Width and height of a cell, in the same units.
        crs : str
            As in `Grid`.

        Raises
        ------
        InputError
            If the extent is empty or the resolution no positive number.

        Examples
        --------
        >>> Grid.of_extent((0, 0, 95, 30), 10).shape
        Shape(rows=3, columns=10)
        """
        xmin, ymin, xmax, ymax = (float(edge) for edge in extent)
        width, height = (float(side) for side in np.broadcast_to(resolution, 2))
        if not (math.isfinite(xmax - xmin) and math.isfinite(ymax - ymin)):
            raise InputError(f"the extent ({xmin}, {ymin}, {xmax}, {ymax}) is not finite")
        if xmin >= xmax or ymin >= ymax:
            raise InputError(
                f"the extent from ({xmin}, {ymin}) to ({xmax}, {ymax}) is empty: "
                "give xmin, ymin, xmax, ymax"
            )
        if not (0 < width < math.inf and 0 < height < math.inf):
            raise InputError(f"the resolution {width} × {height} must be positive")
        shape = Shape(_cells_covering(ymax - ymin, height), _cells_covering(xmax - xmin, width))
        return cls(shape, (xmin, width, 0.0, ymax, 0.0, -height), crs)

    @property
    def south_up(self):
        """Whether the first row is the southern one."""
        return self.geotransform[5] > 0 and self.georeferenced

    @property
    def georeferenced(self):
        """Whether the grid has a geotransform at all."""
        return self.geotransform != NO_GEOTRANSFORM

    def xy(self, row, column):
        """Give the centre of a cell, or of many given by arrays, in the coordinates of the CRS."""
        x_corner, width, _, y_corner, _, height = self.geotransform
        return XY(x_corner + (column + 0.5) * width, y_corner + (row + 0.5) * height)

    def part(self, rows, columns):
        """Give the grid of a window of this one.

        Parameters
        ----------
        rows, columns : slice

        Raises
        ------
        InputError
            If the window is empty or reaches beyond the grid.

        Examples
        --------
        >>> grid = Grid((9, 9), (500.0, 10.0, 0.0, 900.0, 0.0, -10.0))
        >>> grid.part(slice(2, 4), slice(1, 9)).xy(0, 0) == grid.xy(2, 1)
        True
        """
        inside = 0 <= rows.start < rows.stop <= self.shape.rows
        if not (inside and 0 <= columns.start < columns.stop <= self.shape.columns):
            raise InputError(
                f"rows {rows.start} to {rows.stop} and columns {columns.start} to {columns.stop} "
                f"are no part of {self.shape.rows} × {self.shape.columns} cells"
            )
        shape = Shape(rows.stop - rows.start, columns.stop - columns.start)
        if not self.georeferenced:
            return Grid(shape, self.geotransform, self.crs)
        x, width, row_shear, y, column_shear, height = self.geotransform
        corner = x + columns.start * width, y + rows.start * height
        geotransform = (corner[0], width, row_shear, corner[1], column_shear, height)
        return Grid(shape, geotransform, self.crs)

    def row_edges(self):
        """Return the y coordinates of the ``rows + 1`` edges of the rows, from the first row on."""
        _, _, _, y_corner, _, height = self.geotransform
        return y_corner + np.arange(self.shape.rows + 1) * height

    def pixel_size_m(self):
        """Ground metres per pixel in each row.

        Of a geographic CRS, along the parallel and the meridian of the CRS's ellipsoid, by
        GeographicLib; of a projected one, its linear unit; without CRS, metres are assumed, and
        without geotransform a pixel is one metre.

        Returns
        -------
        PixelSize
            ``dx`` and ``dy``, float64 arrays of length ``rows``, positive.

        Raises
        ------
        InputError
            If the CRS is no horizontal one, or a geographic raster reaches beyond the poles.
        """
        units = self._units()
        width, height = self._pixel_in(units)
        if units.geographic:
            return PixelSize(
                *geodesy.pixel_size_m(
                    self.row_edges() * units.unit, width, ellipsoid=units.ellipsoid
                )
            )
        rows = self.shape.rows
        return PixelSize(np.full(rows, width), np.full(rows, height))

    def cell_area_m2(self):
        """Ground area of one cell in each row.

        Returns
        -------
        ndarray of float64, shape (rows,)
            Square metres, on the ellipsoid where the CRS is geographic.

        Raises
        ------
        InputError
            As `pixel_size_m`.
        """
        units = self._units()
        width, height = self._pixel_in(units)
        if units.geographic:
            return geodesy.cell_area_m2(
                self.row_edges() * units.unit, width, ellipsoid=units.ellipsoid
            )
        return np.full(self.shape.rows, width * height)

    def _units(self):
        """Units of the coordinates; columns and rows have none, whatever the CRS."""
        return crs_units(self.crs if self.georeferenced else "")

    def _pixel_in(self, units):
        """Width and height of a pixel in the degrees or metres that ``units`` speaks of."""
        return abs(self.geotransform[1]) * units.unit, abs(self.geotransform[5]) * units.unit


def check_same_grid(grid, wanted, *, what, whose, tolerance):
    """Refuse a grid that is not another one; without georeference, its shape must do.

    Parameters
    ----------
    grid, wanted : Grid
    what, whose : str
        Whose these are, for messages.
    tolerance : float
        Pixels by which corners may lie apart.

    Raises
    ------
    InputError
        If they differ in shape or place.
    """
    if grid.shape != wanted.shape:
        raise InputError(
            f"{what} has {grid.shape.rows} × {grid.shape.columns} cells, "
            f"{whose} {wanted.shape.rows} × {wanted.shape.columns}"
        )
    if not (grid.georeferenced and wanted.georeferenced):
        return
    _, width, _, _, _, height = wanted.geotransform
    for row, column in ((0, 0), (wanted.shape.rows - 1, wanted.shape.columns - 1)):
        here, there = grid.xy(row, column), wanted.xy(row, column)
        apart = abs((here.x - there.x) / width), abs((here.y - there.y) / height)
        if max(apart) > tolerance:
            raise InputError(
                f"{what} lies elsewhere than {whose}; bring it to that grid, "
                "for example with gdalwarp"
            )


def _cells_covering(length, side):
    """Count cells; what is beyond a whole number by rounding only makes none of its own."""
    return max(1, math.ceil(length / side - 1e-6))


def _check_geotransform(geotransform, shape):
    _, width, row_shear, _, column_shear, height = geotransform
    if not all(math.isfinite(term) for term in geotransform) or width == 0 or height == 0:
        raise InputError(
            f"its geotransform {geotransform} gives its pixels no size: set a right one, "
            "for example with gdal_edit.py -a_ullr"
        )
    # Digits lost in a file may leave a trace of rotation; a hundredth of a pixel is none.
    tolerance_x, tolerance_y = 0.01 * abs(width), 0.01 * abs(height)
    if abs(row_shear) * shape.rows > tolerance_x or abs(column_shear) * shape.columns > tolerance_y:
        raise InputError(
            "it is rotated or sheared, so that rows do not run east-west: straighten it first, "
            "for example with gdalwarp"
        )
