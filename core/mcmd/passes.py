"""MCMD's two passes over a whole raster: the paper's, and one weighted by distance.

First the bottom-up pass gives unknown ascendants the elevations of their known descendants, then
the top-down pass gives every unknown cell the mean of its ascendants, displaced at random
(Belhadj 2007, section 3). This is the reference; `demsmith.core.mcmd.relaxed` is more accurate.
"""

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.mcmd.displacement import Displacement
from demsmith.core.mcmd.lattice import Lattice
from demsmith.core.mcmd.maps import as_map
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, Span, checkpoint

_NOTHING_KNOWN = "no cell is known; MCMD needs at least one elevation, or displacements"


def bottom_up(values, known, *, variant="paper", l_bu=0.0, progress=SILENT, **surroundings):
    """Run the bottom-up pass (MDBU, Algorithm 1) alone.

    Parameters
    ----------
    values : (H, W) array
        Elevations [m]; only known cells are read.
    known : (H, W) bool array
    variant : {"paper", "weighted"}
        ``paper`` takes plain means over all children active in a generation; ``weighted`` goes
        from the finest level up and weights children by their inverse squared distance, so that
        near ground counts more than far.
    l_bu : float or (H, W) array
        Curve of the interpolation function; a map's is that of the ascendant.
    **surroundings
        ``scheme``, ``datum``, ``d_max``, ``pixel_size``, ``lattice``, ``threads`` as in
        `interpolate`.

    Returns
    -------
    values, known : (H, W) float64 and bool arrays
        The raster after the pass.

    Examples
    --------
    The paper's figure 7: two known cells end with ten.

    >>> known = np.zeros((5, 5), bool)
    >>> known[2, 1] = known[1, 3] = True
    >>> int(bottom_up(np.where(known, 7.0, 0.0), known)[1].sum())
    10
    """
    if not known.any():
        raise InputError(_NOTHING_KNOWN)
    pass_ = _Passes(values, known, **surroundings)
    pass_.bottom_up(variant, l_bu, progress)
    return pass_.raster()


def interpolate(
    values, known, *, variant="paper", l=0.0, l_bu=0.0, displacement=None,  # noqa: E741
    progress=SILENT, **surroundings,
):  # fmt: skip
    """Give every unknown cell an elevation: bottom-up pass, then top-down pass.

    Known cells keep their elevations. Cells of the lattice beyond the raster are unknown ones.

    Parameters
    ----------
    values : (H, W) array
        Elevations [m]; only known cells are read.
    known : (H, W) bool array
        At least one must be True, unless there are displacements: then terrain is made from them
        alone, about the datum or 0.
    variant : {"paper", "weighted"}
        Bottom-up pass, see `bottom_up`.
    l, l_bu : float or (H, W) array
        Curves of the top-down and bottom-up interpolation functions (equation 2); a map's is that
        of the cell that receives an elevation.
    displacement : Displacement, optional
        Noise of the top-down pass; default: none.
    scheme : {"auto", "triangle-edge", "diamond-square"}
        Which cells are a cell's ascendants. The centre of a triangle-edge square lies on its main
        diagonal. ``auto`` is triangle-edge where anything is known, else diamond-square.
    datum : float, optional
        Elevation [m] above which the curves act; default: the lowest known cell.
    d_max : float, optional
        Distance [m] at which the curves end; default: the raster's diagonal.
    pixel_size : optional
        Ground metres per cell, see `demsmith.core.mcmd.lattice.metres`.
    lattice : Lattice, optional
        Default: the smallest that begins at the raster's first cell.
    threads : int, optional
    progress : Progress

    Returns
    -------
    (H, W) float64 array

    Raises
    ------
    InputError
        If no cell is known, the datum is above a known cell, or a map is of another shape.
    Cancelled
        If ``progress`` asks to stop.
    """
    pass_ = _Passes(values, known, **surroundings)
    if known.any():
        pass_.bottom_up(variant, l_bu, Span(progress, 0, 0.5))
        pass_.fix_corners()
    elif displacement is None:
        raise InputError(_NOTHING_KNOWN)
    else:
        pass_.displace_corners(displacement)
    pass_.top_down(l, displacement, Span(progress, 0.5, 1))
    return pass_.raster()[0]


class _Passes:
    """A lattice around a raster, and the passes over it."""

    def __init__(
        self, values, known, *, scheme="auto", datum=None, d_max=None, pixel_size=None,
        lattice=None, threads=None,
    ):  # fmt: skip
        self.shape = values.shape
        self.threads = threads
        self.triangle = scheme == "triangle-edge" or (scheme == "auto" and bool(known.any()))
        self.lattice = lattice or Lattice.covering(values.shape)
        self.origin = self.lattice.row, self.lattice.column
        row, column = -self.lattice.row, -self.lattice.column
        self.window = (slice(row, row + values.shape[0]), slice(column, column + values.shape[1]))
        lowest = float(values[known].min()) if known.any() else None
        self.datum = float(datum if datum is not None else lowest or 0)
        if lowest is not None and self.datum > lowest:
            raise InputError(f"datum {self.datum:g} m is above the lowest known cell {lowest:g} m")
        side = self.lattice.side
        if row < 0 or column < 0 or side < row + values.shape[0] or side < column + values.shape[1]:
            raise InputError(f"{self.lattice} does not cover a raster of shape {values.shape}")
        self.known = np.zeros((side, side), bool)
        self.known[self.window] = known
        self.z = np.zeros((side, side))
        self.z[self.window] = np.where(known, values, 0) - self.datum
        dx, dy = metres(values.shape, pixel_size)
        if d_max is None:
            d_max = float(np.hypot((values.shape[1] - 1) * dx.max(), dy.sum() - dy[0]))
        self.d_max = d_max or 1.0
        rows = np.clip(np.arange(side) - row, 0, values.shape[0] - 1)
        self.dx, self.dy = dx[rows], dy[rows]

    def raster(self):
        """Give the raster's elevations and which of them are known."""
        return self.z[self.window] + self.datum, self.known[self.window].copy()

    def bottom_up(self, variant, l_bu, progress):
        l_bu = as_map(l_bu, self.shape)
        if variant == "paper":
            self._bottom_up_paper(l_bu, progress)
        else:
            self._bottom_up_weighted(l_bu, progress)

    def _bottom_up_paper(self, l_bu, progress):
        from demsmith.core.mcmd._passes import bottom_up_generation, points_of

        sums = np.zeros(self.z.shape)
        counts = np.zeros(self.z.shape, np.int16)
        active = points_of(self.known)
        generation = 0
        while active.size:
            checkpoint(progress, generation / (generation + self.lattice.levels + 1))
            active = bottom_up_generation(
                self.z, self.known, active, sums, counts, self.triangle, l_bu,
                *self.origin, self.d_max, self.dx, self.dy,
            )  # fmt: skip
            generation += 1

    def _bottom_up_weighted(self, l_bu, progress):
        from demsmith.core.mcmd._passes import lift_level

        for level in range(self.lattice.levels):
            # Each level has a quarter of the finer one's work, so it ends at 1 - 1/4, 1 - 1/16, ...
            part = Span(progress, 1 - 0.25**level, 1 - 0.25 ** (level + 1))
            for centres, half in ((False, part),) if self.triangle else _halves(part):
                self._over_rows(
                    lift_level, level, centres, half, self.triangle, l_bu,
                    *self.origin, self.d_max, self.dx, self.dy,
                )  # fmt: skip

    def fix_corners(self):
        """Give the lattice's corners, which descend from nothing, their nearest elevations."""
        from demsmith.core.mcmd._passes import nearest_known

        last = self.lattice.side - 1
        corners = [(i, j) for i in (0, last) for j in (0, last) if not self.known[i, j]]
        found = [nearest_known(self.z, self.known, i, j, self.dx, self.dy) for i, j in corners]
        for corner, elevation in zip(corners, found, strict=True):
            self.z[corner] = elevation

    def displace_corners(self, displacement):
        """Give the lattice's corners random elevations about the datum: nothing is known."""
        from demsmith.core.mcmd._displacement import displacement as displaced

        noise = displacement.noise(self.shape)
        row, column = self.origin
        for i in (0, self.lattice.side - 1):
            for j in (0, self.lattice.side - 1):
                self.z[i, j] = displaced(noise, 0, i + row, j + column, i, j)
                self.known[i, j] = True

    def top_down(self, l, displacement, progress):  # noqa: E741
        from demsmith.core.mcmd._passes import descend_level

        levels = self.lattice.levels
        noise = (displacement or Displacement(0, 0, 0, 0, levels)).noise(self.shape)
        l = as_map(l, self.shape)  # noqa: E741
        for level in range(levels - 1, -1, -1):
            part = Span(progress, 0.25 ** (level + 1), 0.25**level)
            for centres, half in _halves(part):
                self._over_rows(
                    descend_level, level, centres, half, self.triangle, l,
                    *self.origin, self.d_max, self.dx, self.dy, noise, noise.levels - level,
                )  # fmt: skip

    def _over_rows(self, kernel, level, centres, progress, *parameters):
        """Run a kernel over one level's rows, in threads where that pays."""
        step = 1 << level
        rows = (self.lattice.side - 1) // step + 1
        # A pass reads what it does not write, so rows are independent; blocks of 4 M cells.
        blocks = max(1, rows * self.lattice.side // step // 1_000_000)
        spans = [(rows * n // blocks, rows * (n + 1) // blocks) for n in range(blocks)]
        parallel.run(
            [
                lambda begin=begin, end=end: kernel(
                    self.z, self.known, step, centres, begin, end, *parameters
                )
                for begin, end in spans
            ],
            threads=self.threads,
            progress=progress,
        )


def _halves(progress):
    """Give the centres' part of a level's progress, then that of the other midpoints."""
    return (True, Span(progress, 0, 1 / 3)), (False, Span(progress, 1 / 3, 1))
