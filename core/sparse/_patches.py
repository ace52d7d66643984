"""Kernel that copies discs out of a raster."""

import numba
import numpy as np


@numba.njit(nogil=True, cache=True, error_model="numpy")
def gather_blocks(values, void, tops, lefts, disc, samples, means, valid, counts):
    """Copy blocks out of a raster, their means taken off; see `patches.Patches`.

    The mean is rounded to float32 before it is subtracted, so that mean and samples make the
    elevation again.
    """
    height, width = values.shape
    side_rows, side_columns = disc.shape
    for patch in range(tops.size):
        top, left = tops[patch], lefts[patch]
        first_column, end_column = max(0, -left), min(side_columns, width - left)
        total = 0.0
        count = 0
        for i in range(max(0, -top), min(side_rows, height - top)):
            at = i * side_columns
            for j in range(first_column, end_column):
                if disc[i, j] and not void[top + i, left + j]:
                    value = values[top + i, left + j]
                    samples[patch, at + j] = value
                    valid[patch, at + j] = True
                    total += value
                    count += 1
        counts[patch] = count
        if count:
            mean = np.float32(total / count)
            means[patch] = mean
            for k in range(disc.size):
                if valid[patch, k]:
                    samples[patch, k] -= mean
