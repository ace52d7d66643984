"""Kernels for voids that are solved on a coarser grid first."""

import numba
import numpy as np

from demsmith.core.voids.accurate._locality import BLANK, GHOST, KNOWN, VOID

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def coarsen(z, state, factor):
    """Give means of blocks of ``factor`` cells along a side, and what each block is.

    A block with a cell of the void is of the void; one with a cell of another void says nothing.
    """
    high, wide = -(-z.shape[0] // factor), -(-z.shape[1] // factor)
    coarse, coarse_state = np.zeros((high, wide)), np.zeros((high, wide), np.uint8)
    for r in range(high):
        for c in range(wide):
            total, count, kind = 0.0, 0, KNOWN
            for y in range(r * factor, min((r + 1) * factor, z.shape[0])):
                for x in range(c * factor, min((c + 1) * factor, z.shape[1])):
                    if state[y, x] == VOID:
                        kind = VOID
                    elif state[y, x] != KNOWN and kind != VOID:
                        kind = BLANK
                    if state[y, x] == KNOWN or state[y, x] == VOID:  # others hold anything
                        total += z[y, x]
                        count += 1
            coarse[r, c] = total / max(count, 1)
            coarse_state[r, c] = kind
    return coarse, coarse_state


@numba.njit(**_JIT)
def draw_out(coarse, factor, z, state):
    """Give the void's cells the coarse surface, bilinear between the middles of its blocks."""
    high, wide = z.shape
    shift = 0.5 - 0.5 / factor
    for r in range(high):
        y = min(max(r / factor - shift, 0.0), coarse.shape[0] - 1.0)
        top = min(int(y), max(coarse.shape[0] - 2, 0))
        down = y - top
        below = min(top + 1, coarse.shape[0] - 1)
        for c in range(wide):
            if state[r, c] != VOID and state[r, c] != GHOST:
                continue
            x = min(max(c / factor - shift, 0.0), coarse.shape[1] - 1.0)
            left = min(int(x), max(coarse.shape[1] - 2, 0))
            across = x - left
            right = min(left + 1, coarse.shape[1] - 1)
            z[r, c] = (1 - down) * (
                (1 - across) * coarse[top, left] + across * coarse[top, right]
            ) + down * ((1 - across) * coarse[below, left] + across * coarse[below, right])


@numba.njit(**_JIT)
def collar(state, depth):
    """Copy the states, the void's cells further than ``depth`` from all others taken as known."""
    high, wide = state.shape
    away = np.empty((high, wide), np.int32)
    for r in range(high):
        for c in range(wide):
            away[r, c] = 0 if state[r, c] != VOID else depth + 1
            if r > 0:
                away[r, c] = min(away[r, c], away[r - 1, c] + 1)
            if c > 0:
                away[r, c] = min(away[r, c], away[r, c - 1] + 1)
    for r in range(high - 1, -1, -1):
        for c in range(wide - 1, -1, -1):
            if r + 1 < high:
                away[r, c] = min(away[r, c], away[r + 1, c] + 1)
            if c + 1 < wide:
                away[r, c] = min(away[r, c], away[r, c + 1] + 1)
    out = state.copy()
    for r in range(high):
        for c in range(wide):
            if away[r, c] > depth:
                out[r, c] = KNOWN
    return out
