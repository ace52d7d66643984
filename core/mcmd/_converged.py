"""Kernels of the bending energy of a whole raster and its least value by conjugate gradients.

All arrays are (H, W) float64 in C order, ``fixed`` is bool: cells whose value is held. The energy
is a sum of squares over the raster, in units of the row spacing: of second differences along rows
(weight ``b_x``), down columns (1) and across (``b_d``, one for each square of four cells); of first
differences (``t_x``, ``t_y``); and of the differences between neighbours' Laplacians
(``stiffness``). A difference that would reach beyond the raster is left out, so that planes cost
nothing, also at the edge.
"""

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def gradient(begin, end, z, fixed, weights, stiffness, out):
    """Write half the energy's gradient at the free cells of some rows; return its product with z.

    Parameters
    ----------
    begin, end : int
        Rows.
    z, out : (H, W) float64 arrays
    fixed : (H, W) bool array
        ``out`` is 0 there.
    weights : (H, 4) float64 array
        Of each row: ``b_x``, ``b_d`` of the squares between it and the next, ``t_x``, ``t_y``.
    stiffness : float

    Returns
    -------
    float
        Sum of ``z * out`` over the rows.
    """
    height, width = z.shape
    laplacians = np.zeros((3, width))
    fluxes = np.zeros((3, width))
    if stiffness > 0:
        for row in range(begin - 2, begin + 1):
            _laplacian(z, row, weights, laplacians[row % 3])
        _flux(laplacians, begin - 1, height, weights, fluxes[(begin - 1) % 3])
        _laplacian(z, begin + 1, weights, laplacians[(begin + 1) % 3])
        _flux(laplacians, begin, height, weights, fluxes[begin % 3])
    product = 0.0
    for row in range(begin, end):
        _bend(z, row, weights, out[row])
        if stiffness > 0:
            _laplacian(z, row + 2, weights, laplacians[(row + 2) % 3])
            _flux(laplacians, row + 1, height, weights, fluxes[(row + 1) % 3])
            _stiffen(fluxes, row, weights, stiffness, out[row])
        _hold(fixed[row], out[row])
        product += _dot(z[row], out[row])
    return product


@numba.njit(**_JIT)
def _hold(fixed, out):
    """Put 0 where cells are fixed."""
    for column in range(out.size):
        out[column] = 0.0 if fixed[column] else out[column]


@numba.njit(**_JIT)
def _dot(a, b):
    """Give the product of two rows: four sums, for one would wait for each addition's end."""
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    quads = a.size // 4 * 4
    for n in range(0, quads, 4):
        s0 += a[n] * b[n]
        s1 += a[n + 1] * b[n + 1]
        s2 += a[n + 2] * b[n + 2]
        s3 += a[n + 3] * b[n + 3]
    for n in range(quads, a.size):
        s0 += a[n] * b[n]
    return (s0 + s1) + (s2 + s3)


@numba.njit(**_JIT)
def _laplacian(z, row, weights, out):
    """Write the Laplacian of a row; 0 beyond the raster's inner cells, where there is none."""
    height, width = z.shape
    if row < 1 or row > height - 2:
        out[:] = 0.0
        return
    aspect = 0.5 * weights[row, 1]
    north, here, south = z[row - 1], z[row], z[row + 1]
    for column in range(1, width - 1):
        out[column] = (
            aspect * (here[column - 1] + here[column + 1])
            + (north[column] + south[column])
            - 2 * (aspect + 1) * here[column]
        )


@numba.njit(**_JIT)
def _flux(laplacians, row, height, weights, out):
    """Write by how much the Laplacians of a row's inner cells exceed their neighbours'."""
    width = out.size
    if row < 1 or row > height - 2:
        out[:] = 0.0
        return
    aspect = 0.5 * weights[row, 1]
    north, here, south = laplacians[(row - 1) % 3], laplacians[row % 3], laplacians[(row + 1) % 3]
    to_north = 1.0 if row > 1 else 0.0
    to_south = 1.0 if row < height - 2 else 0.0
    for column in range(1, width - 1):
        out[column] = (
            aspect * (2 * here[column] - here[column - 1] - here[column + 1])
            + (to_north + to_south) * here[column]
            - to_north * north[column]
            - to_south * south[column]
        )
    if width > 2:
        # The outermost cells have no Laplacian to compare with.
        out[1] += aspect * (here[0] - here[1])
        out[width - 2] += aspect * (here[width - 1] - here[width - 2])


@numba.njit(**_JIT)
def _stiffen(fluxes, row, weights, stiffness, out):
    """Add a row of the gradient of the Laplacians' differences."""
    width = out.size
    aspect = 0.5 * weights[row, 1]
    north, here, south = fluxes[(row - 1) % 3], fluxes[row % 3], fluxes[(row + 1) % 3]
    for column in range(1, width - 1):
        out[column] += stiffness * (
            aspect * (here[column - 1] + here[column + 1])
            + (north[column] + south[column])
            - 2 * (aspect + 1) * here[column]
        )
    if width > 2:
        out[0] += stiffness * aspect * here[1]
        out[width - 1] += stiffness * aspect * here[width - 2]


@numba.njit(**_JIT)
def _bend(z, row, weights, out):
    """Write a row of the gradient of bending and stretching."""
    height, width = z.shape
    if row < 2 or row > height - 3 or width < 5:
        for column in range(width):
            out[column] = _bend_near_edge(z, row, column, weights)
        return
    b_x, b_d, t_x, t_y = weights[row, 0], weights[row, 1], weights[row, 2], weights[row, 3]
    b_dn, t_yn = weights[row - 1, 1], weights[row - 1, 3]
    centre = 6 * b_x + 6 + 2 * (b_d + b_dn) + 2 * t_x + t_y + t_yn
    side = -4 * b_x - b_d - b_dn - t_x
    up = -4 - 2 * b_dn - t_yn
    down = -4 - 2 * b_d - t_y
    north2, north, here = z[row - 2], z[row - 1], z[row]
    south, south2 = z[row + 1], z[row + 2]
    for column in range(2, width - 2):
        out[column] = (
            centre * here[column]
            + side * (here[column - 1] + here[column + 1])
            + b_x * (here[column - 2] + here[column + 2])
            + up * north[column]
            + down * south[column]
            + (north2[column] + south2[column])
            + b_dn * (north[column - 1] + north[column + 1])
            + b_d * (south[column - 1] + south[column + 1])
        )
    for column in (0, 1, width - 2, width - 1):
        out[column] = _bend_near_edge(z, row, column, weights)


@numba.njit(**_JIT)
def _bend_near_edge(z, row, column, weights):
    height, width = z.shape
    here = z[row, column]
    b_x, t_x = weights[row, 0], weights[row, 2]
    total = 0.0
    for way in (-1, 1):
        beside, beyond = column + way, column + 2 * way
        if 0 <= beside < width:
            total += t_x * (here - z[row, beside])
        if 0 <= beyond < width:
            total += b_x * (here - 2 * z[row, beside] + z[row, beyond])
        beside, beyond = row + way, row + 2 * way
        if 0 <= beside < height:
            between = min(row, beside)
            total += weights[between, 3] * (here - z[beside, column])
            for other in (column - 1, column + 1):
                if 0 <= other < width:
                    total += weights[between, 1] * (
                        here - z[beside, column] - z[row, other] + z[beside, other]
                    )
        if 0 <= beyond < height:
            total += here - 2 * z[beside, column] + z[beyond, column]
    if 0 < column < width - 1:
        total += 2 * b_x * (2 * here - z[row, column - 1] - z[row, column + 1])
    if 0 < row < height - 1:
        total += 2 * (2 * here - z[row - 1, column] - z[row + 1, column])
    return total


@numba.njit(**_JIT)
def advance(begin, end, z, residual, direction, bent, length, scale):
    """Go ``length`` along the direction and take it from the residual; rows ``begin`` to ``end``.

    ``bent`` is the gradient of the direction, ``scale`` each row's share of the residual that the
    next direction takes. Returns the sum of ``scale * residual**2``.
    """
    product = 0.0
    for row in range(begin, end):
        for column in range(z.shape[1]):
            z[row, column] += length * direction[row, column]
            residual[row, column] -= length * bent[row, column]
        product += scale[row] * _dot(residual[row], residual[row])
    return product


@numba.njit(**_JIT)
def turn(begin, end, direction, residual, share, scale):
    """Turn the direction to the residual, keeping a share of the old one."""
    for row in range(begin, end):
        for column in range(direction.shape[1]):
            direction[row, column] = (
                scale[row] * residual[row, column] + share * direction[row, column]
            )
    return 0.0
