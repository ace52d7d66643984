"""Shadows that are known: of a wall and a pyramid, and by rays over any terrain."""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation, map_coordinates, maximum_filter, minimum_filter

CELL = 30.0
_SIDE = 301
_FINE = 0.05  # cells: how finely rays are followed


class Shape(NamedTuple):
    """A shape, as its elevation [m] over offsets from the middle [m]."""

    name: str
    height: float
    surface: object


SHAPES = (
    Shape("wall", 300.0, lambda x, y: _tent(y / CELL) * 300.0 * (abs(x) < 100 * CELL)),
    Shape("pyramid", 900.0, lambda x, y: _tent(np.maximum(abs(x), abs(y)) / 1500.0) * 900.0),
)


def elevations(shape):
    """Give a shape's elevations on its grid (side, side), float32."""
    return shape.surface(*_places()).astype(np.float32)


def known_shadow(shape, altitude, azimuth):
    """Follow the ray from every cell of the plain to the sun over the shape itself.

    Parameters
    ----------
    altitude, azimuth : float
        Of the sun: above the horizontal, and clockwise from grid north [degrees].

    Returns
    -------
    shadow : (side, side) bool array
    scored : (side, side) bool array
        Cells of the plain that are not within a cell of the shadow's edge, nor beside the shape.
    """
    x, y = _places()
    east, north = np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))
    rise = np.tan(np.radians(altitude))
    shadow = np.zeros(x.shape, bool)
    for distance in np.arange(0, shape.height / rise, _FINE * CELL):
        above = shape.surface(x + distance * east, y + distance * north) > distance * rise
        shadow |= above
    on_shape = binary_dilation(shape.surface(x, y) > 0, np.ones((3, 3)))
    at_edge = maximum_filter(shadow, 3) != minimum_filter(shadow, 3)
    plain = ~on_shape & ~at_edge
    plain[[0, -1]] = plain[:, [0, -1]] = False
    return shadow, plain


def shadow_by_rays(values, cell, rows, columns, altitude, azimuth):
    """Follow the rays from some cells to the sun over the bilinear surface between all cells.

    Parameters
    ----------
    values : (H, W) array
        Elevations [m], north up.
    cell : float
        Side of the square cells [m].
    rows, columns : (N,) int arrays
    altitude, azimuth : float
        As of `known_shadow`.

    Returns
    -------
    (N,) bool array
        Whether the terrain hides the sun, without curvature of the Earth.
    """
    east, north = np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))
    rise = np.tan(np.radians(altitude)) * cell
    start = values[rows, columns].astype(np.float64)
    shadow = np.zeros(start.shape, bool)
    reach = min((values.max() - start.min()) / rise, 1.5 * max(values.shape))
    for distance in np.arange(_FINE, reach, _FINE):
        left = np.flatnonzero(~shadow)
        places = rows[left] - distance * north, columns[left] + distance * east
        height = map_coordinates(values, places, order=1, cval=-1e4, output=np.float64)
        shadow[left] = height > start[left] + distance * rise
    return shadow


def _places():
    offset = (np.arange(_SIDE) - _SIDE // 2) * CELL
    return np.meshgrid(offset, -offset)


def _tent(distance):
    return np.clip(1 - abs(distance), 0, None)
