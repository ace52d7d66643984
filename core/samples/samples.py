"""What is known of the terrain: points, lines, contours, and cells of the grid itself."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.raster.nodata import HUGE

_LEVEL = 1e-3  # metres by which digits lost in a file may move a contour's vertices


@dataclass(frozen=True, eq=False)
class Samples:
    """Elevations at places; immutable.

    Parameters
    ----------
    points : (N, 3) array-like
        x, y in the coordinates of the grid's CRS, elevation [m].
    lines : iterable of (M, 3) array-likes
        Vertices of ridge and valley lines; the elevation is interpolated along them.
    contours : iterable of (M, 3) array-likes
        Vertices of contour lines, all of one elevation each.
    cells : (H, W) array, optional
        Elevations on the grid itself, such as of a thinned raster: NaN, or masked, where unknown.

    Raises
    ------
    InputError
        If an array has another shape, or a contour changes its elevation.

    Examples
    --------
    >>> samples = Samples(points=[(5, 5, 100)], contours=[[(0, 0, 80), (9, 0, 80), (9, 9, 80)]])
    >>> len(samples)
    4
    """

    points: np.ndarray = ()
    lines: tuple = ()
    contours: tuple = ()
    cells: np.ndarray | None = None

    def __post_init__(self):
        """Bring what was given to arrays, and check it."""
        points = _triples(self.points, "points") if len(self.points) else np.empty((0, 3))
        lines = tuple(_triples(line, f"line {i}") for i, line in enumerate(self.lines))
        contours = tuple(_triples(line, f"contour {i}") for i, line in enumerate(self.contours))
        for number, contour in enumerate(contours):
            _check_contour(contour, number)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "lines", lines)
        object.__setattr__(self, "contours", contours)
        if self.cells is not None:
            object.__setattr__(self, "cells", _cells(self.cells))

    def __len__(self):
        """Count points, vertices and known cells."""
        cells = 0 if self.cells is None else np.count_nonzero(np.isfinite(self.cells))
        return int(len(self.points) + sum(map(len, (*self.lines, *self.contours))) + cells)

    def __add__(self, other):
        """Put two sets of samples together; where both know a cell, the first is believed."""
        return Samples(
            np.concatenate([self.points, other.points]),
            self.lines + other.lines,
            self.contours + other.contours,
            _either(self.cells, other.cells),
        )

    def vertices(self):
        """Give points and vertices in one (N, 3) array."""
        return np.concatenate([self.points, *self.lines, *self.contours])

    def without(self, unwanted):
        """Give the same without the elevations of some `vertices`, told by an (N,) bool array."""
        vertices = self.vertices()
        vertices[unwanted, 2] = np.nan
        ends = np.cumsum([len(each) for each in (self.points, *self.lines, *self.contours)])
        points, *lines = np.split(vertices, ends[:-1])
        count = len(self.lines)
        return Samples(points, lines[:count], lines[count:], self.cells)


def usable(vertices):
    """Tell which rows of x, y and elevation are finite; elevations beyond 1e30 stand for none."""
    return np.isfinite(vertices).all(axis=1) & (abs(vertices[:, 2]) <= HUGE)


def _triples(values, name):
    try:
        array = np.asarray(values, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} holds something that is no number") from None
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{name} has shape {array.shape}; give rows of x, y, elevation")
    return array


def _either(cells, others):
    if cells is None or others is None:
        return others if cells is None else cells
    if cells.shape != others.shape:
        raise InputError(f"cells have shapes {cells.shape} and {others.shape}; a grid has one")
    return np.where(np.isfinite(cells), cells, others)


def _check_contour(contour, number):
    elevations = contour[np.isfinite(contour[:, 2]), 2]
    if elevations.size and np.ptp(elevations) > _LEVEL:
        raise InputError(
            f"contour {number} runs from {elevations.min():g} to {elevations.max():g} m; a contour "
            "has one elevation: give it as a line"
        )


def _cells(values):
    """Give known cells as a float array with NaN elsewhere, in the precision that holds them."""
    values, unknown = checked(values)
    exact = values.dtype.itemsize <= 2 or values.dtype == np.float32
    cells = np.array(values, np.float32 if exact else np.float64)
    cells[unknown] = np.nan
    return cells
