"""Kernels of the gradient: differences of the 3 x 3 cells around each."""

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def differentiate(z, void, start, stop, per_east, per_down, horn, east, down):
    """Write the gradient of some rows of a block.

    Parameters
    ----------
    z, void : (h, w) arrays of float32 or float64, and bool
        Rows ``start`` to ``stop``, and those next to them where the raster has such.
    start, stop : int
    per_east, per_down : (h,) arrays of the type of z
        Cells per ground metre of each row.
    horn : bool
        Whether the neighbouring rows and columns count too.
    east, down : (stop - start, w) float32 arrays
        Rise per metre along a row, and from row to row; NaN in voids.
    """
    h, w = z.shape
    near = np.zeros(w, np.uint8)  # voids among the cell and those above and below it
    for r in range(start, stop):
        out = r - start
        if r == 0 or r == h - 1 or w < 3:
            for c in range(w):
                east[out, c], down[out, c] = _with_care(z, void, r, c, per_east, per_down, horn)
            continue
        if horn:
            _horn(z, r, per_east, per_down, east[out], down[out])
        else:
            _zevenbergen_thorne(z, r, per_east, per_down, east[out], down[out])
        found = np.uint8(0)
        for c in range(w):
            near[c] = np.uint8(void[r - 1, c]) | np.uint8(void[r, c]) | np.uint8(void[r + 1, c])
            found |= near[c]
        for c in range(0, w, 1 if found else w - 1):
            if c == 0 or c == w - 1 or near[c - 1] or near[c] or near[c + 1]:
                east[out, c], down[out, c] = _with_care(z, void, r, c, per_east, per_down, horn)


@numba.njit(**_JIT)
def _horn(z, r, per_east, per_down, east, down):
    """Write all of a row but its ends; none of its cells is at an edge or beside a void."""
    above, here, below = per_east[r - 1] / 8, per_east[r] / 4, per_east[r + 1] / 8
    per = per_down[r] / 8
    for c in range(1, z.shape[1] - 1):
        # Grouped so that a mirrored raster gives the mirrored result to the last bit.
        east[c] = (
            (z[r - 1, c + 1] - z[r - 1, c - 1]) * above
            + (z[r + 1, c + 1] - z[r + 1, c - 1]) * below
        ) + (z[r, c + 1] - z[r, c - 1]) * here
        down[c] = (
            (
                (z[r + 1, c - 1] - z[r - 1, c - 1])
                + (z[r + 1, c + 1] - z[r - 1, c + 1])
            )
            + (z[r + 1, c] - z[r - 1, c]) * 2
        ) * per  # fmt: skip


@numba.njit(**_JIT)
def _zevenbergen_thorne(z, r, per_east, per_down, east, down):
    """Write the same of the four nearest neighbours alone."""
    across, per = per_east[r] / 2, per_down[r] / 2
    for c in range(1, z.shape[1] - 1):
        east[c] = (z[r, c + 1] - z[r, c - 1]) * across
        down[c] = (z[r + 1, c] - z[r - 1, c]) * per


@numba.njit(**_JIT)
def _with_care(z, void, r, c, per_east, per_down, horn):
    """Give the gradient of a cell that may be a void, or at an edge, or beside a void."""
    if void[r, c]:
        return np.nan, np.nan
    above, below, left, right = np.nan, np.nan, np.nan, np.nan
    if horn and r > 0:
        above = _along_row(z, void, r - 1, c) * per_east[r - 1]
    if horn and r + 1 < z.shape[0]:
        below = _along_row(z, void, r + 1, c) * per_east[r + 1]
    if horn and c > 0:
        left = _along_column(z, void, r, c - 1)
    if horn and c + 1 < z.shape[1]:
        right = _along_column(z, void, r, c + 1)
    east = _combined(above, _along_row(z, void, r, c) * per_east[r], below)
    down = _combined(left, _along_column(z, void, r, c), right) * per_down[r]
    return east, down


@numba.njit(**_JIT)
def _along_row(z, void, r, c):
    """Give the rise per cell along a row."""
    before, after = max(c - 1, 0), min(c + 1, z.shape[1] - 1)
    return _difference(
        z[r, before], z[r, c], z[r, after],
        before < c and not void[r, before], not void[r, c], after > c and not void[r, after],
    )  # fmt: skip


@numba.njit(**_JIT)
def _along_column(z, void, r, c):
    """Give the rise per cell from row to row."""
    before, after = max(r - 1, 0), min(r + 1, z.shape[0] - 1)
    return _difference(
        z[before, c], z[r, c], z[after, c],
        before < r and not void[before, c], not void[r, c], after > r and not void[after, c],
    )  # fmt: skip


@numba.njit(**_JIT)
def _difference(before, here, after, has_before, has_here, has_after):
    """Give the rise per cell of three in a line, central or one-sided; NaN if fewer than two."""
    if has_before and has_after:
        return (np.float64(after) - np.float64(before)) / 2
    if has_here and has_before:
        return np.float64(here) - np.float64(before)
    if has_here and has_after:
        return np.float64(after) - np.float64(here)
    return np.nan


@numba.njit(**_JIT)
def _combined(before, here, after):
    """Weigh the line through the cell twice and its neighbours once, or what there is of them."""
    sides = before + after
    if not np.isnan(here):
        # One side alone would pull the derivative away from the cell.
        return here if np.isnan(sides) else (sides + 2 * here) / 4
    if not np.isnan(sides):
        return sides / 2
    if not np.isnan(before):
        return before
    return 0.0 if np.isnan(after) else after
