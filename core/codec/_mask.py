"""A tile's voids, cell by cell, from the ten decoded cells around each."""

import numpy as np

from demsmith.core.codec._coder import code_adaptive, finish, kernel, memory, start

STATES = 1024
_ROWS = np.array([0, 0, -1, -1, -1, -1, -1, -2, -2, -2])
_COLUMNS = np.array([-1, -2, 0, -1, 1, -2, 2, 0, -1, 1])


@kernel
def code_mask(mask, coder, data, states, weights, opinions, decoding):
    """Code a mask, or decode it into ``mask``, a uint8 array with 2 zeros around it."""
    m = memory(coder, data, states, weights, opinions)
    start(m, decoding)
    for row in range(2, mask.shape[0] - 2):
        for column in range(2, mask.shape[1] - 2):
            around = np.int64(0)
            for k in range(_ROWS.size):
                around = 2 * around + mask[row + _ROWS[k], column + _COLUMNS[k]]
            bit = np.int64(mask[row, column])
            mask[row, column] = code_adaptive(m, around, bit, decoding)
    if not decoding:
        finish(m)
