"""Tiles within a maximum error: cell by cell, from what is known around each cell.

Cells come row by row. Each is predicted from decoded neighbours (left and above) and, where there
is a tree below, from its surface all around: first by the raster's own least-squares weights,
then by weights that learn while they go (normalised least mean squares). What is left is rounded
to steps of ``2 e + 1`` units **around the prediction**, so that a good prediction costs next to
nothing and the error never passes ``e``; neighbours already carry their errors, so nothing adds
up. Step counts are coded by mixed contexts of how wrong the neighbours were, and how rough they
are.
"""

import math

import numpy as np

from demsmith.core.codec._coder import (
    DECISIONS_PER_SIZE,
    INPUTS,
    LEVELS,
    SIZE_STATES,
    SIZE_WEIGHT_SETS,
    code_adaptive,
    code_plain,
    code_size,
    coding_room,
    finish,
    kernel,
    memory,
    start,
)
from demsmith.core.codec._memory import half_octaves
from demsmith.core.codec.priors import primed

# Decoded neighbours that the prediction weighs, nearest first: rows up, columns right.
TAP_ROWS = np.array([0, -1, -1, -1, 0, -2, -2, -2, -1, -1, 0, -3, -2, -2, -3, -3, -1, -1])
TAP_COLUMNS = np.array([-1, 0, -1, 1, -2, 0, -1, 1, -2, 2, -3, 0, -2, 2, -1, 1, -3, 3])
TAPS = 18
FEATURES = TAPS + 5  # the taps, the tree's own value, and how the tree goes on to four sides
_ROOM = -(-FEATURES // 4) * 4
MARGIN = 3  # cells beyond the tile that taps reach

_SIGNS = SIZE_STATES
_LOWS = _SIGNS + 512
_PLAINS = _LOWS + 1024
STATES = _PLAINS + 512
DECISIONS_PER_CELL = DECISIONS_PER_SIZE + 24  # low bits, sign
NO_PLAIN = 1 << 31  # no value of a raster


@kernel
def code_tile(
    z, void, base, error, plain, fixed, coder, data, states, weights, opinions, at, surface,
    steps, misses, trust, moving, taps, offsets, decoding,
):  # fmt: skip
    """Code a tile, or decode it into ``z``; either way ``z`` ends as what decoding gives.

    Parameters
    ----------
    z : int32 (H, W)
    void : bool (H, W)
        Cells that are not coded; ``z`` is 0 there.
    base : float32 (H + 2, W + 2)
        The tree's surface, with a cell around.
    error : int
        Largest error in units.
    plain : int
        The value of most cells that are flat, such as the sea; `NO_PLAIN` if there is none. Cells
        within ``error`` of it become it where a neighbour has it, so that it stays flat.
    fixed : float32
        The raster's weights, from `fixed_weights`.
    coder, data, states, weights, opinions, at
        Of `_coder`.
    surface, steps, misses, trust, moving, taps, offsets
        Room, from `workspace`, as are those of `_coder`.
    """
    m = memory(coder, data, states, weights, opinions)
    places = at.ctypes.data
    start(m, decoding)
    height, width = z.shape
    step = 2 * error + 1
    stride = surface.shape[1]
    line = surface.reshape(surface.size)
    scale = np.float32(1.0) / np.float32(step)
    for row in range(height):
        _open_row(surface, steps, misses, row, width)
        for column in range(width):
            r, c = row + MARGIN, column + MARGIN
            if row == 0:
                for i in range(MARGIN):
                    for j in range(c, c + MARGIN + 1):
                        surface[i, j] = surface[r, c - 1]
            below = base[row + 1, column + 1]
            west, north = surface[r, c - 1], surface[r - 1, c]
            middle = (west + north) * np.float32(0.5)
            here = r * stride + c
            for i in range(TAPS):
                taps[i] = line[here + offsets[i]] - middle
            taps[TAPS] = -middle
            taps[TAPS + 1] = base[row + 1, column + 2] - below
            taps[TAPS + 2] = base[row + 1, column] - below
            taps[TAPS + 3] = base[row + 2, column + 1] - below
            taps[TAPS + 4] = base[row, column + 1] - below
            # Four sums each, side by side, in an order that no compiler may change.
            f0 = f1 = f2 = f3 = np.float32(0)
            m0 = m1 = m2 = m3 = np.float32(0)
            e0 = e1 = e2 = e3 = np.float32(0)
            for i in range(0, _ROOM, 4):
                t0, t1, t2, t3 = taps[i], taps[i + 1], taps[i + 2], taps[i + 3]
                f0 += fixed[i] * t0
                f1 += fixed[i + 1] * t1
                f2 += fixed[i + 2] * t2
                f3 += fixed[i + 3] * t3
                m0 += moving[i] * t0
                m1 += moving[i + 1] * t1
                m2 += moving[i + 2] * t2
                m3 += moving[i + 3] * t3
                e0 += t0 * t0
                e1 += t1 * t1
                e2 += t2 * t2
                e3 += t3 * t3
            by_fixed = (f0 + f1) + (f2 + f3)
            by_moving = by_fixed + ((m0 + m1) + (m2 + m3))
            if not abs(by_moving) < np.float32(1e15):  # of data that no raster makes
                by_moving = by_fixed
                for i in range(_ROOM):
                    moving[i] = 0
            energy = (e0 + e1) + (e2 + e3)
            wrong_fixed = trust[0, column] + trust[0, column + 1]
            wrong_moving = trust[1, column] + trust[1, column + 1]
            # Inverse squares of late errors: share of the moving prediction.
            share = wrong_fixed * wrong_fixed
            share = share / (share + wrong_moving * wrong_moving)
            guess = below + middle + by_fixed + share * (by_moving - by_fixed)
            if void[row, column]:
                surface[r, c] = middle
                steps[1, column + 2] = 0
                misses[1, column + 2] = np.float32(0)
                continue
            guess = min(max(guess, np.float32(-1.07e9)), np.float32(1.07e9))
            centre = np.int64(math.floor(guess + np.float32(0.5)))
            inner = row > 1 and 1 < column < width - 1
            if plain != NO_PLAIN:
                near = np.int64(0)
                if inner:
                    near = (
                        np.int64(z[row, column - 1] == plain)
                        + 2 * np.int64(z[row - 1, column] == plain)
                        + 4 * np.int64(z[row - 1, column - 1] == plain)
                        + 8 * np.int64(z[row - 1, column + 1] == plain)
                        + 16 * np.int64(z[row, column - 2] == plain)
                        + 32 * np.int64(z[row - 2, column] == plain)
                    )  # fmt: skip
                away = abs(guess - np.float32(plain)) * scale
                if near or away < np.float32(0.3):
                    slot = _PLAINS + near * 8 + half_octaves(away, 8)
                    joins = np.int64(abs(z[row, column] - plain) <= error)
                    if code_adaptive(m, slot, joins, decoding):
                        z[row, column] = plain
                        surface[r, c] = np.float32(plain) - below
                        steps[1, column + 2] = 0
                        misses[1, column + 2] = np.float32(0)
                        continue
            # Other levels: where six neighbours are the same, so will this be.
            flat = inner
            if flat:
                same = z[row, column - 1]
                flat = (
                    same == z[row - 1, column] and same == z[row - 1, column - 1]
                    and same == z[row - 1, column + 1] and same == z[row, column - 2]
                    and same == z[row - 2, column]
                )  # fmt: skip
                if flat:
                    centre = np.int64(same)
                    guess = np.float32(same)
            offset = guess - np.float32(centre)

            # Contexts: how wrong neighbours were, how rough the ground is, how undecided we are.
            a_west, a_north = abs(misses[1, column + 1]), abs(misses[0, column + 2])
            a_nw, a_ne = abs(misses[0, column + 1]), abs(misses[0, column + 3])
            a_ww = abs(misses[1, column])
            wrong = (2 * (a_west + a_north) + a_nw + a_ne + a_ww) * (scale / np.float32(7))
            level = half_octaves(4 * wrong, LEVELS)
            rough = (
                abs(west - surface[r - 1, c - 1])
                + abs(north - surface[r - 1, c - 1])
                + abs(surface[r - 1, c + 1] - north)
            )
            doubt = half_octaves(abs(by_moving - by_fixed) * scale * 4, 8)
            up = half_octaves((a_north + a_ne) * scale * 2, 12)
            left = half_octaves((a_west + a_ww) * scale * 2, 12)
            late = half_octaves((wrong_fixed + wrong_moving) * scale, 16)
            k_west, k_north = abs(steps[1, column + 1]), abs(steps[0, column + 2])
            k_ne = abs(steps[0, column + 3])
            bend = abs(taps[TAPS + 1] + taps[TAPS + 2]) + abs(taps[TAPS + 3] + taps[TAPS + 4])
            fine = min(int(abs(offset) * 8), 3) if error == 0 else 0
            low = min(level, 23)
            if flat:
                level = LEVELS - 1
            half_level = min((level + 1) // 2, 15)
            at[0] = level
            at[1] = level * 4 + fine
            at[2] = 216 if flat else min(k_west, 5) * 36 + min(k_north, 5) * 6 + min(k_ne, 5)
            at[3] = doubt * LEVELS + low
            at[4] = half_octaves(rough * scale, 10) * LEVELS + low
            at[5] = up * 12 + left
            at[6] = half_octaves(bend * scale * 4, 16) * 16 + half_level
            at[7] = late * 16 + half_level

            # The count of steps: its size without the lowest bits, those bits, its sign.
            distance = np.int64(z[row, column]) - centre
            count = (abs(distance) + error) // step
            drop = 0
            while not flat and wrong > np.float32(2 << drop) and drop < 20:
                drop += 1
            size = code_size(m, places, level, count >> drop, decoding)
            tail = count & ((1 << drop) - 1)
            if drop:
                slot = _LOWS + (min(drop, 15) * 8 + min(size, 7)) * 4
                top = code_adaptive(m, slot, tail >> (drop - 1), decoding)
                tail = top << (drop - 1) | code_plain(
                    m, tail & ((1 << (drop - 1)) - 1), drop - 1, decoding
                )
            count = (size << drop) | tail
            if count:
                lean = min(max(int((by_fixed - by_moving) * scale * 2 + 4), 0), 7)
                side = min(max(int((offset * (1 if error == 0 else scale) + 0.5) * 8), 0), 7)
                slot = _SIGNS + (lean * 8 + side) * 8 + min(drop, 3) * 2 + min(count - 1, 1)
                if code_adaptive(m, slot, np.int64(1) if distance < 0 else np.int64(0), decoding):
                    count = -count
            value = centre + count * step
            value = min(max(value, -(1 << 30)), 1 << 30)
            z[row, column] = value

            # What was learned.
            truth = np.float32(value) - below
            surface[r, c] = truth
            steps[1, column + 2] = min(max(count, -127), 127)
            misses[1, column + 2] = np.float32(value) - guess
            truth -= middle
            late = abs(truth - by_fixed)
            trust[0, column + 1] = trust[0, column + 1] * np.float32(0.6) + late + np.float32(0.05)
            late = abs(truth - by_moving)
            trust[1, column + 1] = trust[1, column + 1] * np.float32(0.6) + late + np.float32(0.05)
            rate = np.float32(0.002) * (truth - by_moving)
            rate /= energy / np.float32(FEATURES) + np.float32(step * step)
            for i in range(_ROOM):
                moving[i] += rate * taps[i]
    if not decoding:
        finish(m)


@kernel
def _open_row(surface, steps, misses, row, width):
    """Make what lies above and beside a row ready: beyond the tile its edges go on."""
    r = row + MARGIN
    if row > 0:
        for side in range(MARGIN):
            surface[r - 1, side] = surface[r - 1, MARGIN]
            surface[r - 1, MARGIN + width + side] = surface[r - 1, MARGIN + width - 1]
        start = surface[r - 1, MARGIN]
    else:
        start = np.float32(0)
        for i in range(MARGIN):
            for j in range(width + 2 * MARGIN):
                surface[i, j] = start
    for side in range(MARGIN):
        surface[r, side] = start
    for j in range(steps.shape[1]):
        steps[0, j] = steps[1, j]
        steps[1, j] = 0
        misses[0, j] = misses[1, j]
        misses[1, j] = np.float32(0)


def workspace(height, width):
    """Allocate what `code_tile` needs besides the tile and its data, as it begins."""
    return primed("residual", coding_room(STATES, INPUTS, SIZE_WEIGHT_SETS)) | dict(
        at=np.zeros(INPUTS, np.int64),
        surface=np.zeros((height + MARGIN, width + 2 * MARGIN), np.float32),
        steps=np.zeros((2, width + 4), np.int32),
        misses=np.zeros((2, width + 4), np.float32),
        trust=np.ones((2, width + 1), np.float32),
        moving=np.zeros(_ROOM, np.float32),
        taps=np.zeros(_ROOM, np.float32),
        offsets=TAP_ROWS * (width + 2 * MARGIN) + TAP_COLUMNS,
    )


def fixed_weights(weights):
    """Give the weights of all features as `code_tile` takes them."""
    return np.concatenate([weights, np.zeros(_ROOM - FEATURES)]).astype(np.float32)
