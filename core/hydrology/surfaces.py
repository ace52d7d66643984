"""Elevations as the kernels of drainage take them."""

import numpy as np

from demsmith.core.elevations import checked
from demsmith.core.errors import InputError

# Up to here every integer is a float32.
_EXACT = 1 << 24


def surface(z, void=None):
    """Give elevations as a contiguous float32 or float64 array, and the mask of the voids.

    Parameters
    ----------
    z : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array, optional
        True where there is none; cells that are not finite are voids in any case.

    Returns
    -------
    z : (H, W) float32 or float64 array
        The same memory where it has such a type; integers become float32 where that is exact.
    void : (H, W) bool array

    Raises
    ------
    InputError
        If the array has not two dimensions, no cells or no real numbers, or the mask another
        shape.

    Examples
    --------
    >>> surface(np.array([[1, 2]]))[0].dtype, surface(np.array([[1, 2**30]]))[0].dtype
    (dtype('float32'), dtype('float64'))
    """
    z, void = checked(z, void)
    return np.ascontiguousarray(z, dtype=_floating(z)), void


def _floating(z):
    if z.dtype.kind == "f":
        return np.float32 if z.dtype.itemsize <= 4 else np.float64
    if z.dtype.itemsize <= 2 or max(-int(z.min()), int(z.max())) <= _EXACT:
        return np.float32
    return np.float64


def by_row(metres, name, rows):
    """Give ground metres per cell as (H,) float64; refuse what is no positive length."""
    metres = np.ascontiguousarray(metres, dtype=np.float64)
    if metres.shape != (rows,):
        raise InputError(
            f"{name} has shape {metres.shape}; give one length for each of {rows} rows"
        )
    if not (metres > 0).all() or not np.isfinite(metres).all():
        raise InputError(f"{name} must be positive and finite in every row")
    return metres
