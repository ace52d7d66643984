"""Kernel of a lattice of discs, each a mean and some atoms, blended by Wyvill's weights."""

import math

import numba

from demsmith.core.noise._sums import fade, sum_at
from demsmith.core.trees._bicubic import bicubic_at

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(inline="always", **_JIT)
def _sampled_at(samples, layer, u, v, share):
    """Give a sampled atom at a place of the disc of radius 1, and its slopes along both axes."""
    _, rows, columns = samples.shape
    value, by_v, by_u = bicubic_at(
        samples, layer, (v + 1) * (0.5 * rows) - 0.5, (u + 1) * (0.5 * columns) - 0.5
    )
    return share * value, share * by_u * (0.5 * columns), share * by_v * (0.5 * rows)


@numba.njit(**_JIT)
def fill_joint(
    rows, columns, start, stop, lattice, means, present, indices, coefficients, most_atoms,
    kinds, samples, families, seeds, amplitudes, wavelengths, offsets, norms, resolution, joint,
):  # fmt: skip
    """Fill columns of ``joint``: sum of weights, blend, and the slopes of the blend and the sum.

    Parameters
    ----------
    rows, columns : (points,) float64 arrays
        Places in cells from the raster's upper left corner.
    lattice : tuple
        Rows and columns of discs, centre of the first, step and radius along each.
    means, present : (n,) arrays
    indices, coefficients : (n, s) arrays
    kinds : (N,) int64 array
        Of each atom: its index in ``samples``, or −1 − its index among the functions.
    families, seeds, amplitudes, wavelengths, offsets, norms : arrays
        Functions, what is taken off them, and what they are then divided by.
    resolution : float
        Distance between places looked at, in radii.
    joint : (6, points) float64 array
        Weight, elevation, slopes of the elevation along columns and rows, and of the weight.
    """
    share = fade(2.0, resolution)
    n_rows, n_columns, row_0, column_0, step_v, step_u, radius_v, radius_u = lattice
    for k in range(start, stop):
        r, c = rows[k], columns[k]
        total, total_x, total_y = 0.0, 0.0, 0.0
        part, part_x, part_y = 0.0, 0.0, 0.0
        first_i = max(math.ceil((r - radius_v - row_0) / step_v), 0)
        first_j = max(math.ceil((c - radius_u - column_0) / step_u), 0)
        last_i = min(math.floor((r + radius_v - row_0) / step_v), n_rows - 1)
        last_j = min(math.floor((c + radius_u - column_0) / step_u), n_columns - 1)
        for i in range(first_i, last_i + 1):
            v = (r - row_0 - i * step_v) / radius_v
            for j in range(first_j, last_j + 1):
                u = (c - column_0 - j * step_u) / radius_u
                q = 1 - (u * u + v * v)
                n = i * n_columns + j
                if q <= 0 or not present[n]:
                    continue
                f, f_u, f_v = means[n], 0.0, 0.0
                for a in range(most_atoms):
                    x = coefficients[n, a]
                    if x == 0:
                        continue
                    kind = kinds[indices[n, a]]
                    if kind >= 0:
                        d, d_u, d_v = _sampled_at(samples, kind, u, v, share)
                    else:
                        kind = -1 - kind
                        d, d_u, d_v = sum_at(
                            families, seeds, amplitudes, wavelengths, kind, u, v, resolution
                        )
                        x /= norms[kind]
                        d -= offsets[kind]
                    f += x * d
                    f_u += x * d_u
                    f_v += x * d_v
                weight, slope = q * q * q, -6 * q * q
                w_x, w_y = slope * u / radius_u, slope * v / radius_v
                total += weight
                total_x += w_x
                total_y += w_y
                part += weight * f
                part_x += weight * f_u / radius_u + w_x * f
                part_y += weight * f_v / radius_v + w_y * f
        joint[:, k] = 0.0
        if total > 0:
            f = part / total
            joint[0, k], joint[1, k] = total, f
            joint[2, k] = (part_x - f * total_x) / total
            joint[3, k] = (part_y - f * total_y) / total
            joint[4, k], joint[5, k] = total_x, total_y
