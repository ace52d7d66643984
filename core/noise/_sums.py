"""Kernels of sums of noises of several wavelengths, one sum or many at many points."""

import numba
import numpy as np

from demsmith.core.noise._gradient import DIRECTIONS, key_of, mix, perlin_at

_JIT = dict(nogil=True, cache=True, error_model="numpy")

PERLIN, RIDGED, MULTIFRACTAL = 0, 1, 2
GAIN = 2.0
"""How strongly an octave of a multifractal is kept down by the one before (Musgrave 1994)."""


@numba.njit(inline="always", **_JIT)
def _frame(key):
    """Give a term's own rotation and shift, so that sums do not share their lattice's nodes."""
    turn = DIRECTIONS[mix(key ^ np.uint64(0x243F6A8885A308D3)) >> np.uint64(56)]
    shift_x = np.float64(mix(key ^ np.uint64(0x13198A2E03707344)) >> np.uint64(40)) * 2.0**-24
    shift_y = np.float64(mix(key ^ np.uint64(0xA4093822299F31D0)) >> np.uint64(40)) * 2.0**-24
    return turn[0], turn[1], shift_x, shift_y


@numba.njit(inline="always", **_JIT)
def fade(wavelength, resolution):
    """Give the share of an octave that cells of this size carry: 0 up to 2 cells, 1 from 4 on."""
    if resolution <= 0:
        return 1.0
    t = min(max(0.5 * wavelength / resolution - 1, 0.0), 1.0)
    rest = 1 - (1 - t) * (1 - t)
    return rest * rest * rest


@numba.njit(**_JIT)
def sum_at(families, seeds, amplitudes, wavelengths, n, x, y, resolution):
    """Give the ``n``-th sum of noises at a point, and its gradient."""
    family, seed = families[n], np.uint64(seeds[n])
    value, gradient_x, gradient_y = 0.0, 0.0, 0.0
    weight, weight_x, weight_y = 1.0, 0.0, 0.0
    for term in range(amplitudes.shape[1]):
        amplitude = amplitudes[n, term]
        if amplitude == 0:
            continue
        key = key_of(seed ^ (np.uint64(term) << np.uint64(48)))
        cosine, sine, shift_x, shift_y = _frame(key)
        frequency = 1 / wavelengths[n, term]
        px = (cosine * x + sine * y) * frequency + shift_x
        py = (cosine * y - sine * x) * frequency + shift_y
        noise, nx, ny = perlin_at(key, px, py)
        gx, gy = (cosine * nx - sine * ny) * frequency, (sine * nx + cosine * ny) * frequency
        if family != PERLIN:
            side = 1.0 if noise >= 0 else -1.0
            noise, gx, gy = 1 - side * noise, -side * gx, -side * gy
        if family == MULTIFRACTAL:
            square = noise * noise
            gx = 2 * noise * gx * weight + square * weight_x
            gy = 2 * noise * gy * weight + square * weight_y
            noise = square * weight
            weight, weight_x, weight_y = GAIN * noise, GAIN * gx, GAIN * gy
            if weight >= 1:
                weight, weight_x, weight_y = 1.0, 0.0, 0.0
        amplitude *= fade(wavelengths[n, term], resolution)
        value += amplitude * noise
        gradient_x += amplitude * gx
        gradient_y += amplitude * gy
    return value, gradient_x, gradient_y


@numba.njit(**_JIT)
def fill_values(families, seeds, amplitudes, wavelengths, x, y, resolution, start, stop, values):
    """Fill rows ``start`` to ``stop`` of ``values``, one for each sum, a column for each point."""
    for n in range(start, stop):
        for k in range(x.size):
            value, _, _ = sum_at(
                families, seeds, amplitudes, wavelengths, n, x[k], y[k], resolution
            )
            values[n, k] = value


@numba.njit(**_JIT)
def fill_joint(families, seeds, amplitudes, wavelengths, n, x, y, resolution, start, stop, joint):
    """Fill columns of ``joint``: value, gradient in x, gradient in y of the ``n``-th sum."""
    for k in range(start, stop):
        joint[0, k], joint[1, k], joint[2, k] = sum_at(
            families, seeds, amplitudes, wavelengths, n, x[k], y[k], resolution
        )
