"""Kernel that hands out rows of a raster as if something lay around it and in its voids."""

import numba


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pad_row(z, void, row, around, padded):
    """Copy row ``row`` of ``z`` to ``padded[1:-1]``; voids and cells off the raster get ``around``.

    So the loop over a row's cells needs no test whether a neighbour exists.
    """
    height, width = z.shape
    if row < 0 or row >= height:
        padded[:] = around
        return
    padded[0] = padded[width + 1] = around
    for column in range(width):
        padded[column + 1] = around if void[row, column] else z[row, column]
