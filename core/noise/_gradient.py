"""Kernel of gradient noise: Perlin's, with its exact gradient, from a counter-based hash.

No table is shuffled and no function of the C library is called: a number is the same on every
machine, for it comes from integer hashes and correctly rounded sums and products alone.
"""

import math

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")
_DIRECTIONS = 256


def _unit_vectors():
    """Give unit vectors evenly round the circle, by Taylor's series on an eighth of it."""
    steps = np.arange(_DIRECTIONS)
    # Angles from the middle of each quadrant, -π/4 to π/4, then turned by whole quadrants.
    quadrant, rest = steps // (_DIRECTIONS // 4), steps % (_DIRECTIONS // 4)
    angle = (rest + 0.5) / (_DIRECTIONS // 4) * (np.pi / 2) - np.pi / 4
    cosine, sine, term = np.zeros_like(angle), np.zeros_like(angle), np.ones_like(angle)
    for order in range(20):
        part = cosine if order % 2 == 0 else sine
        part += term if order % 4 < 2 else -term
        term = term * angle / (order + 1)
    x = np.choose(quadrant, [cosine, -sine, -cosine, sine])
    y = np.choose(quadrant, [sine, cosine, -sine, -cosine])
    return np.stack([x, y], axis=1)


DIRECTIONS = _unit_vectors()


@numba.njit(inline="always", **_JIT)
def mix(x):
    """Scramble 64 bits: the finalizer of SplitMix64 (Steele, Lea and Flood 2014)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


@numba.njit(inline="always", **_JIT)
def _lattice_key(key, column, row):
    key = key ^ (np.uint64(column) * np.uint64(0xD1B54A32D192ED03))
    return mix(key + np.uint64(row) * np.uint64(0xABC98388FB8FAC03))


@numba.njit(inline="always", **_JIT)
def _corner(key, column, row, x, y):
    """Give the corner's ramp at the offset (x, y) from it, and the ramp's gradient."""
    direction = _lattice_key(key, column, row) >> np.uint64(56)
    gx, gy = DIRECTIONS[direction, 0], DIRECTIONS[direction, 1]
    return gx * x + gy * y, gx, gy


@numba.njit(**_JIT)
def key_of(seed):
    """Turn a seed into the key that `perlin_at` takes."""
    return mix(np.uint64(seed) + np.uint64(0x9E3779B97F4A7C15))


@numba.njit(**_JIT)
def perlin_at(key, x, y):
    """Give the noise in [-1, 1] at a point of the unit lattice, and its gradient."""
    column, row = math.floor(x), math.floor(y)
    u, v = x - column, y - row
    i, j = np.int64(column), np.int64(row)
    a, ax, ay = _corner(key, i, j, u, v)
    b, bx, by = _corner(key, i + 1, j, u - 1, v)
    c, cx, cy = _corner(key, i, j + 1, u, v - 1)
    d, dx, dy = _corner(key, i + 1, j + 1, u - 1, v - 1)
    fu, fv = u * u * u * (u * (u * 6 - 15) + 10), v * v * v * (v * (v * 6 - 15) + 10)
    du, dv = 30 * u * u * (u - 1) * (u - 1), 30 * v * v * (v - 1) * (v - 1)
    low, high = a + fu * (b - a), c + fu * (d - c)
    value = low + fv * (high - low)
    low_x, high_x = ax + fu * (bx - ax) + du * (b - a), cx + fu * (dx - cx) + du * (d - c)
    low_y, high_y = ay + fu * (by - ay), cy + fu * (dy - cy)
    gx = low_x + fv * (high_x - low_x)
    gy = low_y + fv * (high_y - low_y) + dv * (high - low)
    # The steepest ramps meet at √½ in the middle of a cell.
    return value * math.sqrt(2.0), gx * math.sqrt(2.0), gy * math.sqrt(2.0)


@numba.njit(**_JIT)
def fill_perlin(seed, x, y, start, stop, joint):
    """Fill columns of ``joint`` with plain noise on the unit lattice."""
    key = key_of(seed)
    for k in range(start, stop):
        if math.isfinite(x[k]) and math.isfinite(y[k]):
            joint[0, k], joint[1, k], joint[2, k] = perlin_at(key, x[k], y[k])
        else:
            joint[:, k] = np.nan
