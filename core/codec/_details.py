"""One band of a tile's wavelet coefficients, coded by what lies around, above and beside.

Coefficients come row by row. How likely one is to be large is told by its decoded neighbours in
the band, by its parent and the parent's neighbours in the coarser band, and by the same place in
the bands of its own level that came before. Blocks of 8 × 8 zeros take one decision.
"""

import numba
import numpy as np

from demsmith.core.codec._coder import (
    DECISIONS_PER_SIZE,
    LEVELS,
    SIZE_STATES,
    code_adaptive,
    code_size,
    kernel,
    memory,
)
from demsmith.core.codec._memory import half_octaves

PAD = 2  # zeros around a band
_SIGNS = SIZE_STATES
_BLOCKS = _SIGNS + 128
STATES = _BLOCKS + 64
DECISIONS_PER_CELL = DECISIONS_PER_SIZE + 2  # sign, block
_BLOCK = 8


@kernel
def code_band(
    band, parent, first, second, kind, depth, coder, data, states, weights, opinions, at, decoding
):
    """Code a band, or decode it into ``band``, which then begins as zeros.

    Parameters
    ----------
    band, parent, first, second : int32
        Step counts of the band, of the coarser band of its kind, and of the bands of its level
        that came before (or of nothing), each with `PAD` zeros around.
    kind, depth : int
        0 to 2: details across columns, rows, both; 0 to 7: level from the finest on.
    coder, data, states, weights, opinions, at
        Of `_coder`, begun and finished by the caller.
    """
    m = memory(coder, data, states, weights, opinions)
    places = at.ctypes.data
    height, width = band.shape[0] - 2 * PAD, band.shape[1] - 2 * PAD
    across = (width + _BLOCK - 1) // _BLOCK
    filled = np.zeros(across + 2, np.uint8)
    for row in range(height):
        if row % _BLOCK == 0:
            corner = np.int64(0)
            for block in range(across):
                above = np.int64(filled[block + 1])
                some = np.int64(0)
                if not decoding:
                    some = _any(band, row, block)
                heir = _any_parent(parent, row, block)
                slot = _BLOCKS + ((kind * 2 + heir) * 2 + above) * 4
                slot += 2 * np.int64(filled[block]) + corner
                corner = above
                filled[block + 1] = code_adaptive(m, slot, some, decoding)
        r = row + PAD
        up = min(row // 2, parent.shape[0] - 2 * PAD - 1) + PAD
        for column in range(width):
            if not filled[column // _BLOCK + 1]:
                continue
            c = column + PAD
            west, north = abs(band[r, c - 1]), abs(band[r - 1, c])
            nw, ne = abs(band[r - 1, c - 1]), abs(band[r - 1, c + 1])
            ww, nn = abs(band[r, c - 2]), abs(band[r - 2, c])
            near = 2 * (west + north) + nw + ne + ww + nn
            left = min(column // 2, parent.shape[1] - 2 * PAD - 1) + PAD
            heir = 2 * abs(parent[up, left]) + abs(parent[up - 1, left]) + abs(parent[up + 1, left])
            heir += abs(parent[up, left - 1]) + abs(parent[up, left + 1])
            beside = 2 * (abs(first[r, c]) + abs(second[r, c])) + abs(first[r, c + 1])
            beside += abs(first[r + 1, c]) + abs(second[r, c + 1]) + abs(second[r + 1, c])
            beside += abs(first[r, c - 1]) + abs(first[r - 1, c])
            beside += abs(second[r, c - 1]) + abs(second[r - 1, c])
            l_near = half_octaves(np.float32(near) * np.float32(0.5), 20)
            l_heir = half_octaves(np.float32(heir) * np.float32(0.5), 16)
            l_beside = half_octaves(np.float32(beside) * np.float32(0.5), 16)
            l_all = half_octaves(np.float32(2 * near + heir + beside) * np.float32(0.25), LEVELS)
            at[0] = l_near * 3 + kind
            at[1] = (min(west, 3) * 16 + min(north, 3) * 4 + min(ne, 3)) * 3 + kind
            at[2] = l_near // 2 * 16 + l_heir
            at[3] = l_near // 2 * 16 + l_beside
            at[4] = l_heir * 16 + l_beside
            at[5] = l_near * 8 + depth
            at[6] = l_all * 3 + kind
            at[7] = (min(nw, 2) * 9 + min(nn, 2) * 3 + min(ww, 2)) * 8 + min(l_all // 3, 7)
            value = np.int64(band[r, c])
            size = code_size(m, places, l_all, abs(value), decoding)
            if size:
                slot = _sign(band[r, c - 1]) * 9 + _sign(band[r - 1, c]) * 3
                slot = _SIGNS + (slot + _sign(parent[up, left])) * 3 + kind
                if code_adaptive(m, slot, np.int64(1) if value < 0 else np.int64(0), decoding):
                    size = -size
            band[r, c] = min(max(size, -(1 << 30)), 1 << 30)


@kernel
def _any(band, row, block):
    """Tell whether a block of the band has anything but zeros."""
    height, width = band.shape[0] - 2 * PAD, band.shape[1] - 2 * PAD
    for r in range(row, min(row + _BLOCK, height)):
        for c in range(block * _BLOCK, min(block * _BLOCK + _BLOCK, width)):
            if band[r + PAD, c + PAD]:
                return 1
    return 0


@kernel
def _any_parent(parent, row, block):
    """Tell whether the parents of a block have anything but zeros."""
    height, width = parent.shape[0] - 2 * PAD, parent.shape[1] - 2 * PAD
    half = _BLOCK // 2
    for r in range(row // 2, min(row // 2 + half, height)):
        for c in range(block * half, min(block * half + half, width)):
            if parent[r + PAD, c + PAD]:
                return 1
    return 0


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def _sign(value):
    """Give 0 for zero, 1 for positive, 2 for negative."""
    return 0 if value == 0 else (1 if value > 0 else 2)
