"""Tiles of one grid: where each lies on it, and reading windows across them."""

import os
from dataclasses import dataclass, field

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.raster.crs import crs_units, same_crs
from demsmith.core.raster.grid import Grid
from demsmith.core.raster.nodata import metres_per_unit
from demsmith.core.raster.raster import BandMeta
from demsmith.core.raster.reading import read, read_header

_TOLERANCE = 0.1
"""Cells by which a tile's corner may lie beside the grid: programs write few digits."""


@dataclass(frozen=True)
class CellRules:
    """Which band of a file is read and which of its cells are voids, as in `read`."""

    band: int = 1
    nodata: tuple = ()
    below: float | None = None
    above: float | None = None

    def as_dict(self):
        """Give them as the keywords of `read`."""
        return dict(band=self.band, nodata=self.nodata, below=self.below, above=self.above)


@dataclass(frozen=True)
class Tile:
    """A raster file that covers a part of a larger grid.

    Attributes
    ----------
    path : str
    grid : Grid
        Its own.
    meta : BandMeta
    row, column : int
        Where its first cell lies in the tile set.
    """

    path: str
    grid: Grid
    meta: BandMeta
    row: int = 0
    column: int = 0

    @property
    def rows(self):
        """The tile set's rows that it covers, a slice."""
        return slice(self.row, self.row + self.grid.shape.rows)

    @property
    def columns(self):
        """The tile set's columns that it covers, a slice."""
        return slice(self.column, self.column + self.grid.shape.columns)

    def common(self, rows, columns):
        """Give what a window has in common with the tile: slices, or None if that is nothing."""
        common = _common(self.rows, rows), _common(self.columns, columns)
        return common if all(span.start < span.stop for span in common) else None


@dataclass(frozen=True)
class TileSet:
    """Tiles of one grid, read as if they were one raster.

    Where tiles overlap, the first that knows a cell gives its elevation. Cells of no tile are
    void. Goes between processes: it holds no open file.

    Attributes
    ----------
    tiles : tuple of Tile
    grid : Grid
        Covers them all.
    rules : CellRules
    """

    tiles: tuple
    grid: Grid
    rules: CellRules = field(default_factory=CellRules)

    @property
    def shape(self):
        """Rows and columns of the grid."""
        return self.grid.shape

    @property
    def dtype(self):
        """The float type that holds the elevations of every tile, or nearly."""
        return max(_float_type(tile.meta.dtype) for tile in self.tiles)

    @property
    def unit(self):
        """Metres in the unit of the elevations; None if no tile tells."""
        told = [height_unit(tile.meta, tile.grid.crs) for tile in self.tiles]
        return next((unit for unit in told if unit is not None), None)

    def read(self, rows, columns, *, progress=SILENT):
        """Read a window.

        Parameters
        ----------
        rows, columns : slice
            Of the grid.
        progress : Progress

        Returns
        -------
        values : (h, w) array of `dtype`
            Real elevations: scale and offset are applied. 0 where void.
        void : (h, w) bool array

        Raises
        ------
        InputError
            If a tile cannot be read.
        """
        shape = rows.stop - rows.start, columns.stop - columns.start
        values, void = np.zeros(shape, self.dtype), np.ones(shape, bool)
        tiles = self.overlapping(rows, columns)
        for number, tile in enumerate(tiles):
            checkpoint(progress, number / len(tiles))
            common = tile.common(rows, columns)
            inner = shifted(common, tile.row, tile.column)
            part = read(tile.path, **self.rules.as_dict(), window=inner)
            here = shifted(common, rows.start, columns.start)
            new = void[here] & ~part.void
            np.copyto(values[here], elevations(part, self.dtype), where=new)
            void[here] &= part.void
        return values, void

    def covered(self, rows, columns):
        """Tell which cells of a window belong to a tile: (h, w) bool array."""
        found = np.zeros((rows.stop - rows.start, columns.stop - columns.start), bool)
        for tile in self.overlapping(rows, columns):
            found[shifted(tile.common(rows, columns), rows.start, columns.start)] = True
        return found

    def overlapping(self, rows, columns):
        """List the tiles that have a cell in a window, in their order."""
        return [tile for tile in self.tiles if tile.common(rows, columns)]


def height_unit(meta, crs):
    """Give the metres in a band's unit of height, by the band or its CRS; None if neither tells.

    Examples
    --------
    >>> height_unit(BandMeta(unit="ft"), "EPSG:4326")
    0.3048
    """
    return metres_per_unit(meta.unit, crs_units(crs).vertical_unit)


def elevations(raster, dtype):
    """Give a raster's real elevations, scaled and offset, in a float type."""
    meta = raster.meta
    if (meta.scale, meta.offset) == (1, 0):
        return raster.values.astype(dtype)
    return meta.real(raster.values.astype(np.float64)).astype(dtype)


def elevations_m(raster):
    """Give a raster's elevations in metres, taken for metres if neither band nor CRS tells.

    Returns
    -------
    (rows, columns) array
        float32 where that holds what the band's data type can, else float64. Voids hold anything.

    Examples
    --------
    >>> from demsmith.core.raster import Grid, Raster
    >>> feet = BandMeta(np.dtype(np.int16), unit="ft")
    >>> values = np.array([[1000, 2000]], np.int16)
    >>> elevations_m(Raster(values, values < 0, Grid((1, 2)), feet))
    array([[304.8, 609.6]], dtype=float32)
    """
    dtype = _float_type(raster.meta.dtype)
    unit = height_unit(raster.meta, raster.grid.crs)
    if unit in (None, 1.0):
        return elevations(raster, dtype)
    return (elevations(raster, np.float64) * unit).astype(dtype, copy=False)


def _float_type(dtype):
    """Give the float type that holds another one's values, or nearly."""
    small = dtype == np.float32 or dtype.itemsize <= 2
    return np.dtype(np.float32 if small else np.float64)


def open_tiles(paths, *, rules=None, progress=SILENT):
    """Find out how tiles lie on one grid.

    Parameters
    ----------
    paths : sequence of str or path-like
        In the order in which they are asked for a cell that several cover.
    rules : CellRules, optional
    progress : Progress

    Returns
    -------
    TileSet

    Raises
    ------
    InputError
        If there is none, one cannot be opened or has no georeference, or they differ in CRS,
        resolution, unit, or by a part of a cell; it names the file.
    """
    rules = rules or CellRules()
    tiles = []
    for number, path in enumerate(paths):
        checkpoint(progress, number / len(paths))
        grid, meta = read_header(path, band=rules.band)
        tile = Tile(os.fspath(path), grid, meta)
        tiles.append(_placed(tile, (tiles or [tile])[0]))
    if not tiles:
        raise InputError("there are no tiles")
    return _gathered(tiles, rules)


def _placed(tile, first):
    """Give the tile its place relative to the first one."""
    if not tile.grid.georeferenced:
        raise InputError(f"'{tile.path}' has no georeference, so its place among tiles is unknown")
    if not same_crs(tile.grid.crs, first.grid.crs):
        raise InputError(
            f"'{tile.path}' has another CRS than '{first.path}': reproject it to that one's grid, "
            "for example with gdalwarp"
        )
    _refuse_other_unit(tile, first)
    x, width, _, y, _, height = tile.grid.geotransform
    x0, width0, _, y0, _, height0 = first.grid.geotransform
    slip = abs(width / width0 - 1) * tile.grid.shape.columns
    slip = max(slip, abs(height / height0 - 1) * tile.grid.shape.rows)
    if slip > _TOLERANCE:
        raise InputError(
            f"'{tile.path}' has cells of {abs(width):.10g} × {abs(height):.10g}, '{first.path}' "
            f"of {abs(width0):.10g} × {abs(height0):.10g}: bring it to that resolution, for "
            "example with gdalwarp, or keep it apart"
        )
    row, column = (y - y0) / height0, (x - x0) / width0
    beside = max(abs(row - round(row)), abs(column - round(column)))
    if beside > _TOLERANCE:
        raise InputError(
            f"'{tile.path}' lies {beside:.2g} of a cell beside the grid of '{first.path}': bring "
            "it to that grid, for example with gdalwarp"
        )
    return Tile(tile.path, tile.grid, tile.meta, round(row), round(column))


def _refuse_other_unit(tile, first):
    units = [metres_per_unit(each.meta.unit) for each in (tile, first)]
    if None not in units and units[0] != units[1]:
        raise InputError(
            f"'{tile.path}' holds elevations in {tile.meta.unit}, '{first.path}' in "
            f"{first.meta.unit}: convert it"
        )


def _gathered(tiles, rules):
    """Make the tile set whose grid begins with the northernmost row and westernmost column."""
    top, left = min(tile.row for tile in tiles), min(tile.column for tile in tiles)
    bottom = max(tile.rows.stop for tile in tiles)
    right = max(tile.columns.stop for tile in tiles)
    x, width, _, y, _, height = tiles[0].grid.geotransform
    geotransform = (x + left * width, width, 0.0, y + top * height, 0.0, height)
    grid = Grid((bottom - top, right - left), geotransform, tiles[0].grid.crs)
    return TileSet(
        tuple(
            Tile(tile.path, tile.grid, tile.meta, tile.row - top, tile.column - left)
            for tile in tiles
        ),
        grid,
        rules,
    )


def _common(span, other):
    return slice(max(span.start, other.start), min(span.stop, other.stop))


def shifted(window, row, column):
    """Count a window's rows and columns from another cell."""
    rows, columns = window
    return (
        slice(rows.start - row, rows.stop - row),
        slice(columns.start - column, columns.stop - column),
    )
