"""The ground size of a raster's cells, as callers may give it."""

import numpy as np

from demsmith.core.errors import InputError


def metres(shape, pixel_size):
    """Give ``(dx, dy)`` per row as float64 arrays from what a caller gave.

    Parameters
    ----------
    shape : (int, int)
    pixel_size : None, float, (float, float) or two arrays of length H
        Ground metres per cell: both ways, east-west and north-south, or these by row;
        None means 1.

    Raises
    ------
    InputError
        If it is not positive and finite, or of the wrong length.
    """
    sizes = 1.0 if pixel_size is None else pixel_size
    pair = tuple(sizes) if np.iterable(sizes) else (sizes, sizes)
    if len(pair) != 2:
        raise InputError(f"pixel_size has {len(pair)} parts; give (east-west, north-south)")
    out = []
    for size in pair:
        size = np.asarray(size, np.float64)
        if size.ndim and size.shape != (shape[0],):
            raise InputError(f"pixel_size by row has shape {size.shape} for {shape[0]} rows")
        if not np.all(np.isfinite(size)) or np.any(size <= 0):
            raise InputError("pixel_size must be positive and finite")
        out.append(np.broadcast_to(size, (shape[0],)).copy())
    return tuple(out)
