"""Elevation arrays as callers give them: checked, and their voids in one mask."""

import numpy as np

from demsmith.core.errors import InputError


def checked(values, void=None):
    """Give an elevation array and the mask of its voids.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
    void : (H, W) bool array, optional
        True where there is no elevation. Cells that are not finite are voids in any case, and
        those of a masked array where this is not given.

    Returns
    -------
    values : (H, W) ndarray
        The same memory where possible.
    void : (H, W) bool ndarray, contiguous

    Raises
    ------
    InputError
        If the array has not two dimensions, no cells or no real numbers, or the mask another
        shape.
    """
    masked = np.ma.getmaskarray(values) if isinstance(values, np.ma.MaskedArray) else False
    values = np.asarray(values)
    if values.ndim != 2 or 0 in values.shape:
        raise InputError(f"values has shape {values.shape}; give a 2-D array of elevations")
    if values.dtype.kind not in "iuf":
        raise InputError(f"values is of type {values.dtype}; give integers or real numbers")
    void = np.broadcast_to(masked, values.shape) if void is None else np.asarray(void)
    if void.shape != values.shape:
        raise InputError(f"void has shape {void.shape}, values {values.shape}")
    void = np.ascontiguousarray(void.astype(bool, copy=False))
    if values.dtype.kind == "f" and _hides_unknown(values, void):
        void = void | ~np.isfinite(values)
    return values, void


def _hides_unknown(values, void):
    """Tell whether a cell that is not finite is no void."""
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isfinite(values.sum()):  # a sum is finite only if all its terms are, and quick
            return False
    return bool(np.less(np.isfinite(values), ~void).any())
