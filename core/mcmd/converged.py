"""The surface of least energy through known cells: relaxation carried to its end.

The relaxed variant stops after a few sweeps, which is enough for small voids. Where known cells are
scattered, the gaps between them are all alike and a few sweeps leave the surface taut in each. Here
conjugate gradients (Hestenes and Stiefel 1952) go on from there to the least energy, which besides
bending and tension holds the gradient of the Laplacian: ground measured by radar is smooth
over a few cells, and a surface of least bending alone has a kink in its curvature at every known
cell (Mitasova and Mitas 1993, "Interpolation by regularized spline with tension", Mathematical
Geology 25, for the same reason).
"""

from functools import partial
from itertools import pairwise

import numpy as np

from demsmith.core import parallel
from demsmith.core.mcmd.relaxed import TENSION_CELLS
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, Span, checkpoint

STIFFNESS_CELLS = 0.7
_BLOCK_ROWS = 64

# Steps at most, and the share of the first residual at which to stop. Stiffness makes the energy's
# numerical condition worse, so the surface is first brought near by bending alone.
_BENDING = 150, 1e-2
_STIFF = 250, 5e-3


def converge(
    values, known, *, pixel_size=None, tension=None, stiffness=None, threads=None, progress=SILENT
):
    """Bring a surface to its least energy.

    Parameters
    ----------
    values : (H, W) array
        Elevations [m] from which to begin, such as the relaxed variant's; none may be NaN.
    known : (H, W) bool array
        Cells that keep theirs.
    pixel_size : optional
        Ground metres per cell, see `demsmith.core.mcmd.lattice.metres`.
    tension : float, optional
        Distance [m] over which bending gives way to stretching; default: 12 rows.
    stiffness : float, optional
        Distance [m] below which curvature is smooth; default: 0.7 rows; 0: it need not be.
    threads : int, optional
        The result does not depend on it.
    progress : Progress

    Returns
    -------
    (H, W) float64 array

    Raises
    ------
    InputError
        If the pixel size is not usable.
    Cancelled
        If ``progress`` asks to stop.
    """
    z = np.array(values, np.float64, order="C")
    energy = _Energy(known, pixel_size, tension, stiffness, threads)
    energy.descend(z, 0.0, *_BENDING, Span(progress, 0, 0.3))
    if energy.stiffness > 0:
        energy.descend(z, energy.stiffness, *_STIFF, Span(progress, 0.3, 1))
    return z


class _Energy:
    """The energy of surfaces over a raster, and the steps over its rows, in threads."""

    def __init__(self, known, pixel_size, tension, stiffness, threads):
        dx, dy = metres(known.shape, pixel_size)
        self.aspect = (dy / dx) ** 2
        self.pull = (dy / tension if tension else 1 / TENSION_CELLS) ** 2 * np.ones_like(dy)
        self.weights = np.stack(
            [self.aspect**2, 2 * self.aspect, self.pull * self.aspect, self.pull], axis=1
        )
        cells = STIFFNESS_CELLS if stiffness is None else stiffness / float(dy.mean())
        self.stiffness = cells**2
        self.known = np.ascontiguousarray(known)
        self.threads = threads
        # The same blocks for any number of threads, so that sums are the same.
        edges = [*range(0, known.shape[0], _BLOCK_ROWS), known.shape[0]]
        self.blocks = list(pairwise(edges))

    def descend(self, z, stiffness, most_steps, tolerance, progress):
        """Change the cells that are not known, by conjugate gradients."""
        scale = self._scale(stiffness)
        bent, residual = np.empty_like(z), np.empty_like(z)
        self._gradient(z, stiffness, residual)
        np.negative(residual, out=residual)
        direction = scale[:, None] * residual
        first = size = float((direction * residual).sum())
        done = 0.0
        for step in range(most_steps):
            if size <= tolerance**2 * first:
                break
            done = max(done, step / most_steps, _fallen(size, first, tolerance))
            checkpoint(progress, done)
            length = size / self._gradient(direction, stiffness, bent)
            last, size = size, self._advance(z, residual, direction, bent, length, scale)
            self._turn(direction, residual, size / last, scale)
        checkpoint(progress, 1.0)

    def _scale(self, stiffness):
        """Give what a cell's residual is multiplied by: Jacobi's preconditioner, by row."""
        aspect = self.aspect
        bend = 6 * aspect**2 + 6 + 8 * aspect + 2 * self.pull * (1 + aspect)
        stiff = 20 * aspect**3 + 36 * aspect**2 + 36 * aspect + 20
        return 1 / (bend + stiffness * stiff)

    def _gradient(self, z, stiffness, out):
        from demsmith.core.mcmd._converged import gradient

        return self._sum(gradient, z, self.known, self.weights, stiffness, out)

    def _advance(self, z, residual, direction, bent, length, scale):
        from demsmith.core.mcmd._converged import advance

        return self._sum(advance, z, residual, direction, bent, length, scale)

    def _turn(self, direction, residual, share, scale):
        from demsmith.core.mcmd._converged import turn

        self._sum(turn, direction, residual, share, scale)

    def _sum(self, kernel, *arrays):
        """Call a kernel for every block of rows and add up what it returns, in their order."""
        parts = np.zeros(len(self.blocks))

        def one(number):
            parts[number] = kernel(*self.blocks[number], *arrays)

        parallel.run([partial(one, number) for number in range(parts.size)], threads=self.threads)
        return float(parts.sum())


def _fallen(size, first, tolerance):
    """Tell how much of the way to the tolerance the residual has fallen, on its log scale."""
    return float(np.clip(np.log(first / size) / -2 / np.log(tolerance), 0, 1))
