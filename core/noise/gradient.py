"""One noise at many points: Perlin's, and its ridged twin."""

from typing import NamedTuple

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.parallel import run
from demsmith.core.progress import SILENT

PERLIN_LIPSCHITZ = 2.93
"""Bound of the slope of `perlin` on its unit lattice, whatever gradients its corners have.

In the middle of a cell, where it is reached: ``4 √2 |(1/4 − 15/32, 15/32)| = 2.926``.
"""

_BLOCK = 1 << 16


class NoiseJoint(NamedTuple):
    """A noise and its gradient at points.

    Attributes
    ----------
    value, gradient_x, gradient_y : ndarray of float64
    """

    value: np.ndarray
    gradient_x: np.ndarray
    gradient_y: np.ndarray


def perlin(x, y, *, seed=0, with_gradient=False, threads=None, progress=SILENT):
    """Give Perlin's gradient noise on the unit lattice.

    Parameters
    ----------
    x, y : array_like of float
        Points; the noise is nought at whole numbers. Not-a-number gives not-a-number.
    seed : int
        Which noise of all; any whole number of 64 bits.
    with_gradient : bool
        Give the gradient too.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    ndarray of float64, or NoiseJoint
        Between −1 and 1, of the shape that ``x`` and ``y`` have together. Twice continuously
        differentiable; the gradient is exact.

    References
    ----------
    K. Perlin, *Improving noise*, SIGGRAPH 2002; its permutation table is replaced by an integer
    hash of seed, column and row, and its twelve directions by 256.

    Examples
    --------
    >>> import numpy as np
    >>> perlin(np.array([3.0, 7.0]), 5.0)
    array([0., 0.])
    >>> bool(perlin(0.3, 0.7, seed=1) == perlin(0.3, 0.7, seed=1))
    True
    """
    from demsmith.core.noise._gradient import fill_perlin

    x, y, shape = points(x, y)
    joint = np.empty((3, x.size))
    key = np.uint64(seed % 2**64)
    in_blocks(lambda a, b: fill_perlin(key, x, y, a, b, joint), x.size, threads, progress)
    return given(joint, shape, with_gradient)


def ridged(x, y, *, seed=0, with_gradient=False, threads=None, progress=SILENT):
    """Give ridged noise on the unit lattice: one less the magnitude of Perlin's.

    Its crests, where Perlin's noise is nought, are sharp.

    Parameters
    ----------
    x, y, seed, with_gradient, threads, progress
        As in `perlin`.

    Returns
    -------
    ndarray of float64, or NoiseJoint
        Between 0 and 1. Continuous; on a crest the gradient is that of one of its sides.

    References
    ----------
    F. K. Musgrave in Ebert et al., *Texturing and Modeling*, 1994.

    Examples
    --------
    >>> float(ridged(4, 2))
    1.0
    """
    value, gradient_x, gradient_y = perlin(
        x, y, seed=seed, with_gradient=True, threads=threads, progress=progress
    )
    side = np.where(value >= 0, 1.0, -1.0)
    value = 1 - side * value
    return NoiseJoint(value, -side * gradient_x, -side * gradient_y) if with_gradient else value


def points(x, y):
    """Give the coordinates of points as flat float64 arrays, and their common shape.

    Raises
    ------
    InputError
        If the two do not go together.
    """
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    try:
        shape = np.broadcast_shapes(x.shape, y.shape)
    except ValueError:
        raise InputError("x and y are of shapes that do not go together") from None
    # Copies: what NumPy broadcasts may not be written to, which kernels take for another type.
    return *(np.array(np.broadcast_to(each, shape)).ravel() for each in (x, y)), shape


def in_blocks(kernel, count, threads, progress):
    """Call ``kernel(start, stop)`` for every block of ``count`` points, in threads."""
    starts = range(0, count, _BLOCK)
    run([lambda a=a: kernel(a, min(a + _BLOCK, count)) for a in starts],
        threads=threads, progress=progress)  # fmt: skip


def given(joint, shape, with_gradient):
    """Give what was asked for of the rows value, gradient in x and in y."""
    if with_gradient:
        return NoiseJoint(*(row.reshape(shape) for row in joint))
    return joint[0].reshape(shape)
