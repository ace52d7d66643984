"""Small views of tiles, for the picture of a mosaic in its report."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.mosaic.workplace import load, save

_LONGEST = 1200
"""Cells of the longer side of a view of the whole mosaic."""


@dataclass(frozen=True)
class View:
    """Every so-manieth cell of a tile.

    Attributes
    ----------
    row, column : int
        Where its first cell lies in the view of the whole mosaic.
    values, sigma : (h, w) float32 arrays
        Real elevations and their uncertainty.
    sources : (h, w) uint8 array
    """

    row: int
    column: int
    values: np.ndarray
    sigma: np.ndarray
    sources: np.ndarray


def view_step(shape):
    """Give the step from one cell to the next in the view of a mosaic of this shape."""
    return -(-max(shape) // _LONGEST)


def view_of(made, own, tile, shape):
    """Take the view of a tile.

    Parameters
    ----------
    made : Assembled
    own : Raster
        The tile as it was read.
    tile : Tile
    shape : (int, int)
        Of the whole mosaic.

    Returns
    -------
    View
    """
    step = view_step(shape)
    row, column = -(-tile.row // step), -(-tile.column // step)
    part = slice(row * step - tile.row, None, step), slice(column * step - tile.column, None, step)
    values = own.meta.real(made.values[part].astype(np.float32)).astype(np.float32)
    values[made.left[part]] = np.nan
    return View(row, column, values, made.sigma[part], made.sources[part])


def save_view(result, view):
    """Save a view beside the result of writing the tile."""
    save(_path(result), **vars(view))


def load_view(result):
    """Give the view that was saved beside a result."""
    saved = load(_path(result))
    return View(int(saved.pop("row")), int(saved.pop("column")), **saved)


def _path(result):
    return result + ".view.npz"
