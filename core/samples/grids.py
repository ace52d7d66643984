"""Which grid is made, where the user leaves it open."""

import math
import os
from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.raster.crs import crs_units
from demsmith.core.raster.grid import Grid
from demsmith.core.samples.samples import usable

_BYTES_PER_CELL = 64  # what the variants take at most, the lattice around the grid included
_MEMORY_UNKNOWN = 16 << 30


def extent_of(grid):
    """Give the outer edges of a grid: xmin, ymin, xmax, ymax."""
    x_corner, width, _, y_corner, _, height = grid.geotransform
    x = sorted((x_corner, x_corner + grid.shape.columns * width))
    y = sorted((y_corner, y_corner + grid.shape.rows * height))
    return x[0], y[0], x[1], y[1]


@dataclass(frozen=True)
class GridWish:
    """What a user said of the grid to make.

    Attributes
    ----------
    like : Grid or None
        The grid itself; nothing else may be given then.
    extent : (xmin, ymin, xmax, ymax) or None
        In the coordinates of the CRS.
    resolution : float, (float, float) or None
        Width and height of a cell, in the same units.
    crs : str
        Empty if not told.

    Raises
    ------
    InputError
        If something is given besides ``like``, or the extent is not four numbers.
    """

    like: Grid | None = None
    extent: tuple | None = None
    resolution: float | tuple | None = None
    crs: str = ""

    def __post_init__(self):
        """Check that what was given can be meant together."""
        placed = self.extent is not None or self.resolution is not None or self.crs
        if self.like is not None and placed:
            raise InputError("the grid is another raster's: leave out extent, resolution and CRS")
        if self.extent is not None and len(self.extent) != 4:
            raise InputError(
                f"the extent has {len(self.extent)} numbers; give xmin, ymin, xmax, ymax"
            )
        if self.crs:
            crs_units(self.crs)  # refuses what is no CRS

    @property
    def target(self):
        """The CRS to bring samples to; empty if theirs decides."""
        return self.crs if self.like is None else self.like.crs

    def decide(self, sources, crs, sketch=None):
        """Choose the grid.

        The one that was asked for; else by extent and resolution, where a sketch gives the
        resolution if need be, and the samples the extent, widened to multiples of the resolution;
        else, where neither was told, that of the first raster among the sources, or one cell for
        each pixel of a sketch.

        Parameters
        ----------
        sources : list of Source
        crs : str
            The sources' common one.
        sketch : (h, w) array, optional

        Returns
        -------
        Grid

        Raises
        ------
        InputError
            If too little was told, or the grid would be larger than the memory.
        """
        if self.like is not None:
            return self.like
        if self.extent is None and self.resolution is None:
            grids = [each.thinned.grid for each in sources if each.thinned is not None]
            if grids and not self.crs:
                return grids[0]
            if sketch is not None and not sources:
                return Grid(sketch.shape)
        return self._by_resolution(sources, crs, sketch)

    def _by_resolution(self, sources, crs, sketch):
        if self.extent is None and not sources:
            raise InputError(
                "nothing tells which ground is meant: give an extent and a resolution, "
                "or a raster whose grid to take"
            )
        extent = _bounds(sources, crs) if self.extent is None else self.extent
        if self.resolution is not None:
            resolution = _pair(self.resolution)
        elif self.extent is not None and sketch is not None:
            resolution = _pixel_size(extent, sketch)
        else:
            raise InputError(_resolution_missing(extent, sources, crs))
        _refuse_coarse(extent, resolution, crs)
        if self.extent is None:
            extent = _widened(extent, resolution)
        _refuse_giant(extent, resolution)
        return Grid.of_extent(extent, resolution, crs)


def _bounds(sources, crs):
    """Give the extent of the samples, as far as they are finite."""
    vertices = np.concatenate([source.scattered(crs).vertices() for source in sources])
    xy = vertices[usable(vertices), :2]
    if not xy.size:
        raise InputError("no sample has finite coordinates and elevation")
    return (*xy.min(axis=0), *xy.max(axis=0))


def _pixel_size(extent, sketch):
    xmin, ymin, xmax, ymax = extent
    rows, columns = sketch.shape
    return (xmax - xmin) / columns, (ymax - ymin) / rows


def _pair(resolution):
    sides = tuple(float(side) for side in np.atleast_1d(resolution))
    if len(sides) not in (1, 2):
        raise InputError(f"the resolution has {len(sides)} parts; give a width and a height")
    if not all(0 < side < math.inf for side in sides):
        raise InputError(f"the resolution {_shown(sides)} must be positive")
    return sides * 2 if len(sides) == 1 else sides


def _shown(sides):
    return " × ".join(f"{side:.10g}" for side in sides)


def _widened(extent, resolution):
    xmin, ymin, xmax, ymax = extent
    width, height = resolution
    left, bottom = math.floor(xmin / width) * width, math.floor(ymin / height) * height
    right, top = math.ceil(xmax / width) * width, math.ceil(ymax / height) * height
    return left, bottom, max(right, left + width), max(top, bottom + height)


def _resolution_missing(extent, sources, crs):
    unit = "degrees" if crs_units(crs).geographic else "units of the CRS"
    said = f"the size of the cells is not known: give a resolution (in {unit})"
    count = sum(len(source.scattered(crs)) for source in sources)
    xmin, ymin, xmax, ymax = extent
    spacing = math.sqrt((xmax - xmin) * (ymax - ymin) / max(count, 1))
    if not 0 < spacing < math.inf or not count:
        return said
    digit = 10.0 ** math.floor(math.log10(spacing / 2))
    return (
        f"{said}; the samples are about {spacing:.3g} apart, so for example "
        f"{math.floor(spacing / 2 / digit) * digit:.6g}"
    )


def _refuse_coarse(extent, resolution, crs):
    """Refuse cells wider than the extent, such as metres given where degrees are meant."""
    xmin, ymin, xmax, ymax = extent
    if 0 < xmax - xmin < resolution[0] and 0 < ymax - ymin < resolution[1]:
        unit = " degrees" if crs_units(crs).geographic else ""
        raise InputError(
            f"the resolution {_shown(resolution)}{unit} is coarser than the whole extent "
            f"{_shown((xmax - xmin, ymax - ymin))}{unit}"
        )


def _refuse_giant(extent, resolution):
    """Refuse what the machine's memory cannot hold, before it is tried."""
    columns, rows = (extent[2] - extent[0]) / resolution[0], (extent[3] - extent[1]) / resolution[1]
    needed, there = columns * rows * _BYTES_PER_CELL, _memory()
    if columns > 0 and rows > 0 and needed > there:
        raise InputError(
            f"a grid of {rows:.0f} × {columns:.0f} cells takes about {needed / 2**30:.0f} GB of "
            f"memory, there are {there / 2**30:.0f}: give a coarser resolution or a smaller extent"
        )


def _memory():
    """Bytes of memory that the machine has."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # Windows has no sysconf
        return _MEMORY_UNKNOWN
