"""One level of the CDF 9/7 wavelet (Cohen, Daubechies & Feauveau 1992) by lifting, both ways.

The lifting steps are those of Daubechies & Sweldens 1998, scaled so that all four bands have
about unit norm: one quantisation step then costs the same error in each. Beyond an end the signal
is mirrored about its last sample. Every sample is made by the same float32 operations in the same
order whatever window it is made in.
"""

import numba
import numpy as np

_STEPS = np.array([-1.586134342, -0.05298011854, 0.8829110762, 0.4435068522], np.float32)
_LOW = np.float32(1.149604398)
_HIGH = np.float32(1 / 1.149604398)
_LONE = np.float32(2**0.5)  # a single sample is its own smooth part, with the same gain

SUPPORT = 4  # samples at either side that one made by `inverse` depends on

_kernel = numba.njit(nogil=True, cache=True, error_model="numpy")


@_kernel
def _lift_rows(z, first, weight):
    """Add ``weight`` times both neighbour rows to every other row, from ``first`` on."""
    rows, columns = z.shape
    for row in range(first, rows, 2):
        above = row - 1 if row > 0 else row + 1
        below = row + 1 if row + 1 < rows else row - 1
        for column in range(columns):
            z[row, column] += weight * (z[above, column] + z[below, column])


@_kernel
def _lift_columns(z, first, weight):
    """Add ``weight`` times both neighbour columns to every other column, from ``first`` on."""
    rows, columns = z.shape
    for row in range(rows):
        if first == 0:
            z[row, 0] += weight * (z[row, 1] + z[row, 1])
        for column in range(2 - first, columns - 1, 2):
            z[row, column] += weight * (z[row, column - 1] + z[row, column + 1])
        if (columns - 1) % 2 == first and columns > 1 and columns - 1 > 0:
            z[row, columns - 1] += weight * (z[row, columns - 2] + z[row, columns - 2])


@_kernel
def forward(z):
    """Split a surface into its bands.

    Parameters
    ----------
    z : float32 (H, W)
        Overwritten.

    Returns
    -------
    low, across, down, both : float32
        Smooth part, and details across columns, across rows and both ways: rows ⌈H/2⌉, ⌈H/2⌉,
        ⌊H/2⌋, ⌊H/2⌋, and columns likewise.
    """
    rows, columns = z.shape
    for k in range(4):
        if columns > 1:
            _lift_columns(z, 1 - k % 2, _STEPS[k])
    for k in range(4):
        if rows > 1:
            _lift_rows(z, 1 - k % 2, _STEPS[k])
    low = np.empty(((rows + 1) // 2, (columns + 1) // 2), np.float32)
    across = np.empty(((rows + 1) // 2, columns // 2), np.float32)
    down = np.empty((rows // 2, (columns + 1) // 2), np.float32)
    both = np.empty((rows // 2, columns // 2), np.float32)
    low_row, low_column = _LOW if rows > 1 else _LONE, _LOW if columns > 1 else _LONE
    for row in range(rows):
        for column in range(columns):
            value = z[row, column] * (_HIGH if row % 2 else low_row)
            value *= _HIGH if column % 2 else low_column
            if row % 2:
                if column % 2:
                    both[row // 2, column // 2] = value
                else:
                    down[row // 2, column // 2] = value
            elif column % 2:
                across[row // 2, column // 2] = value
            else:
                low[row // 2, column // 2] = value
    return low, across, down, both


@_kernel
def inverse(low, across, down, both):
    """Join bands to the surface that `forward` splits into them.

    The bands may be windows of larger ones, beginning at the same even sample: then the outermost
    `SUPPORT` samples are wrong at the sides where they were cut.
    """
    rows, columns = low.shape[0] + down.shape[0], low.shape[1] + across.shape[1]
    z = np.empty((rows, columns), np.float32)
    low_row = _HIGH if rows > 1 else 1 / _LONE
    low_column = _HIGH if columns > 1 else 1 / _LONE
    for row in range(rows):
        for column in range(columns):
            if row % 2:
                if column % 2:
                    value = both[row // 2, column // 2]
                else:
                    value = down[row // 2, column // 2]
            elif column % 2:
                value = across[row // 2, column // 2]
            else:
                value = low[row // 2, column // 2]
            value *= _LOW if row % 2 else low_row
            z[row, column] = value * (_LOW if column % 2 else low_column)
    for k in range(3, -1, -1):
        if rows > 1:
            _lift_rows(z, 1 - k % 2, -_STEPS[k])
    for k in range(3, -1, -1):
        if columns > 1:
            _lift_columns(z, 1 - k % 2, -_STEPS[k])
    return z
