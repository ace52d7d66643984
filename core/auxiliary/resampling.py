"""Any raster on the cells of another grid, whatever its CRS and resolution."""

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.raster.crs import reproject
from demsmith.core.raster.grid import Grid, Shape

_STEP = 16
"""Cells between places that are reprojected; in between they are interpolated. The Earth's
curvature over 16 cells of 90 m moves a place by 4 cm."""

_POINTS = 17
"""Cells along each side of a grid by which its reach in another CRS is found."""

_WIDEST = 4.0
"""Cells of the raster per target cell beyond which it is averaged in blocks first."""

_CELLS_AT_ONCE = 1 << 22
"""Of the raster, read for one strip of target cells."""


@dataclass(frozen=True)
class Resampler:
    """A raster seen through the cells of another grid.

    It is interpolated by cubic convolution (Keys 1981, "Cubic convolution interpolation for
    digital image processing"), and averaged where its cells are smaller than the grid's so that
    nothing aliases, in blocks first where they are much smaller. A cell's value depends
    on its absolute place only, not on the window it was asked for in.

    Attributes
    ----------
    source : object
        With ``grid``, a `Grid`, and ``read(rows, columns)``, which gives values [m] and void mask
        of a window, such as `demsmith.core.raster.TileSet`.
    grid : Grid
        The target's; it goes on beyond its edges.
    factor : float
        The values are multiplied by it, such as 0.3048 for feet.
    """

    source: Any
    grid: Grid
    factor: float = 1.0

    def window(self, row, column, shape, *, shift=(0.0, 0.0), progress=SILENT):
        """Resample the source for a window of the grid.

        Parameters
        ----------
        row, column : int
            The window's first cell; may lie outside of the grid.
        shape : (int, int)
            Rows and columns of the window.
        shift : (float, float)
            Rows and columns by which the grid's cells are moved before they are looked up.
        progress : Progress

        Returns
        -------
        values : (h, w) float64 array
            0 where unknown.
        void : (h, w) bool array

        Raises
        ------
        InputError
            If the source cannot be read, or only one of the two has a CRS.
        Cancelled
            If ``progress`` asks to stop.
        """
        values, void = np.zeros(shape), np.ones(shape, bool)
        if self._ratios is None:
            return values, void
        step = max(1, int(_CELLS_AT_ONCE / (self._ratios[0] * self._ratios[1] * shape[1])))
        # The shift comes last: rounded sums must not depend on where the window begins.
        columns = np.arange(column, column + shape[1]) + shift[1]
        for start in range(0, shape[0], step):
            checkpoint(progress, start / shape[0])
            strip = slice(start, min(start + step, shape[0]))
            rows = np.arange(row + strip.start, row + strip.stop) + shift[0]
            self._resample(self._locate(rows, columns), values[strip], void[strip])
        values *= self.factor
        return values, void

    def beneath(self):
        """Give the rows and columns of the source under the grid: slices, or None for none."""
        centres = [np.linspace(0, side - 1, _POINTS) for side in self.grid.shape]
        places = self._project(np.stack(np.meshgrid(*centres), axis=-1).reshape(-1, 2))
        cells = np.floor(places[np.isfinite(places).all(axis=1)] + 0.5)
        if not cells.size:
            return None
        low = np.maximum(cells.min(axis=0), 0).astype(int)
        high = np.minimum(cells.max(axis=0) + 1, self.source.grid.shape).astype(int)
        return tuple(map(slice, low.tolist(), high.tolist())) if (low < high).all() else None

    @functools.cached_property
    def _ratios(self):
        """Cells of the source per cell of the grid, by row and column; None if out of reach.

        In the middle of the grid, so that they are the same for all windows.
        """
        middle = np.array(self.grid.shape) / 2
        near = middle + np.array([[0, 0], [1, 0], [0, 1]])
        here, below, beside = self._project(near)
        ratios = np.hypot(below - here, beside - here)
        return tuple(ratios) if np.isfinite(ratios).all() and ratios.all() else None

    @functools.cached_property
    def _reduced(self):
        """The source, in blocks if its cells are much smaller than the grid's."""
        block = [int(ratio / 2) if ratio > _WIDEST else 1 for ratio in self._ratios]
        return self.source if max(block) == 1 else _Blocks(self.source, *block)

    def _resample(self, places, values, void):
        from demsmith.core.auxiliary._resampling import convolve_at

        source = self._reduced
        block = getattr(source, "block", (1, 1))
        places = (places + 0.5) / np.reshape(block, (2, 1, 1)) - 0.5
        ratios = [ratio / n for ratio, n in zip(self._ratios, block, strict=True)]
        # As wide a blur as a target cell's, less that of the raster's own cells.
        width = tuple(math.sqrt(max(ratio**2 - 1, 0.0)) for ratio in ratios)
        window = [
            _reach(place, size, math.ceil(each / 2) + 3)
            for place, size, each in zip(places, source.grid.shape, width, strict=True)
        ]
        if None in window:
            return
        rows, columns = window
        cells, unknown = source.read(rows, columns)
        convolve_at(
            cells, unknown, rows.start, columns.start, *source.grid.shape, places, width,
            values, void,
        )  # fmt: skip

    def _locate(self, rows, columns):
        """Give row and column in the source of cells of the grid: (2, h, w) array."""
        from demsmith.core.auxiliary._resampling import locate

        first = [math.floor(each[0] / _STEP) for each in (rows, columns)]
        nodes = [
            np.arange(start, math.floor(each[-1] / _STEP) + 2.0) * _STEP
            for start, each in zip(first, (rows, columns), strict=True)
        ]
        cells = np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1)
        there = self._project(cells.reshape(-1, 2)).reshape(cells.shape)
        places = np.empty((2, rows.size, columns.size))
        locate(np.moveaxis(there, -1, 0).copy(), *first, _STEP, rows, columns, places)
        return places

    def _project(self, cells):
        """Bring cells of the grid (N, 2), row first, to rows and columns of the source."""
        here, there = self.grid.crs, self.source.grid.crs
        if bool(here) != bool(there):
            raise InputError(
                f"the {'auxiliary' if here else 'raster'} has no CRS, so it is not known where "
                "they meet; give it one, for example with gdal_edit.py -a_srs"
            )
        xy = np.stack(self.grid.xy(cells[:, 0], cells[:, 1]), axis=1)
        if here:
            xy = reproject(xy, here, there)
        x, width, _, y, _, height = self.source.grid.geotransform
        return np.stack([(xy[:, 1] - y) / height, (xy[:, 0] - x) / width], axis=1) - 0.5


class _Blocks:
    """A source in blocks of cells, each averaged; read like the source itself."""

    def __init__(self, source, high, wide):
        self._source, self.block = source, (high, wide)
        rows, columns = source.grid.shape
        x, width, _, y, _, height = source.grid.geotransform
        self.grid = Grid(
            Shape(-(-rows // high), -(-columns // wide)),
            (x, width * wide, 0.0, y, 0.0, height * high),
            source.grid.crs,
        )

    def read(self, rows, columns):
        from demsmith.core.auxiliary._resampling import average_blocks

        (high, wide), whole = self.block, self._source.grid.shape
        out = np.empty((rows.stop - rows.start, columns.stop - columns.start))
        unknown = np.empty(out.shape, bool)
        step = max(1, _CELLS_AT_ONCE // (high * wide * out.shape[1]))
        left = slice(columns.start * wide, min(columns.stop * wide, whole.columns))
        for start in range(0, out.shape[0], step):
            strip = slice(start, min(start + step, out.shape[0]))
            top = (rows.start + strip.start) * high
            bottom = min((rows.start + strip.stop) * high, whole.rows)
            values, void = self._source.read(slice(top, bottom), left)
            average_blocks(values, void, high, wide, out[strip], unknown[strip])
        return out, unknown


def _reach(places, size, margin):
    """Give the slice of a source's rows (or columns) needed around places; None if none is."""
    finite = places[np.isfinite(places)]
    if not finite.size:
        return None
    low = max(math.floor(finite.min()) - margin, 0)
    high = min(math.ceil(finite.max()) + margin + 1, size)
    return slice(low, high) if low < high else None
