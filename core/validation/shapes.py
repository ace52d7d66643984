"""Shapes of voids: those of real ones, cut out to be laid elsewhere, and compact blobs."""

import heapq
from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.validation.slope import slopes
from demsmith.core.voids.labelling import find_voids, survey_rims

RIM = (2, 4)
"""Distance [cells] from a void of the ring of cells whose mean slope is the void's.

Nearer ones have no slope beside a real void, which takes the 3 x 3 cells around.
"""


@dataclass(frozen=True)
class VoidShape:
    """The outline of a void, and how steep the ground around it is.

    Attributes
    ----------
    cells : (h, w) bool array
        True in the void; nothing of it beyond.
    slope : float
        Mean slope around it, rise by run; NaN if unknown, then any ground will do.
    """

    cells: np.ndarray
    slope: float = float("nan")

    @property
    def size(self):
        """Number of its cells."""
        return int(np.count_nonzero(self.cells))

    def turned(self, turn):
        """Give the shape after one of eight turns: quarters of a circle, from 4 on mirrored."""
        cells = np.rot90(self.cells, turn % 4)
        return VoidShape(np.fliplr(cells) if turn >= 4 else cells, self.slope)

    def grown(self, reach):
        """Give the cells within ``reach`` cells of the shape, with a frame of that width."""
        from scipy.ndimage import maximum_filter

        return maximum_filter(self._framed(reach), 2 * reach + 1)

    def rim(self):
        """Give the cells of the ring `RIM`, with a frame of its outer distance."""
        from scipy.ndimage import maximum_filter

        near, far = RIM
        framed = self._framed(far)
        return maximum_filter(framed, 2 * far + 1) & ~maximum_filter(framed, 2 * near - 1)

    def _framed(self, width):
        height, breadth = self.cells.shape
        out = np.zeros((height + 2 * width, breadth + 2 * width), bool)
        out[width : width + height, width : width + breadth] = self.cells
        return out


def void_shapes(void, values=None, *, pixel_size=None, progress=SILENT):
    """Cut out the shapes of the voids of a raster.

    Voids that touch the raster's edge are left out, for their shape is not known.

    Parameters
    ----------
    void : (H, W) bool array
    values : (H, W) array, optional
        Elevations [m], to know how steep the ground is on which each void lies; they are not read
        where ``void``.
    pixel_size : optional
        Ground metres per cell, see `demsmith.core.mcmd.lattice.metres`.
    progress : Progress

    Returns
    -------
    tuple of VoidShape

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> void = np.zeros((20, 20), bool)
    >>> void[8:10, 8:11] = void[0, :5] = True
    >>> shape, = void_shapes(void, np.fromfunction(lambda row, column: 3 * column, (20, 20)))
    >>> shape.cells.shape, shape.slope
    ((2, 3), 3.0)
    """
    voids = find_voids(void)
    slope = np.full(void.shape, np.nan, np.float32)
    if values is not None:
        slope = slopes(values, ~void, pixel_size=pixel_size)
    slope = np.pad(slope, RIM[1], constant_values=np.nan)
    inside = np.flatnonzero(~survey_rims(np.zeros(void.shape), void, voids).touches_edge)
    shapes = []
    for done, number in enumerate(inside):
        checkpoint(progress, done / inside.size)
        runs = voids.runs[voids.first_run[number] : voids.first_run[number + 1]]
        row, column = runs[:, 0].min(), runs[:, 1].min()
        box = np.s_[row : runs[:, 0].max() + 1, column : runs[:, 2].max()]
        shape = VoidShape(voids.labels[box] == number + 1)
        rim_rows, rim_columns = np.nonzero(shape.rim())
        shapes.append(
            VoidShape(shape.cells, mean_known(slope[row + rim_rows, column + rim_columns]))
        )
    return tuple(shapes)


def mean_known(slope):
    """Mean of the slopes that are no NaN, or NaN if all are."""
    known = slope[~np.isnan(slope)]
    return float(known.mean(dtype=np.float64)) if known.size else float("nan")


def blob(cells, rng):
    """Make a compact shape with a wavy outline, such as a lake's or a cloud's.

    From the middle it grows by the cell next to it where a cone plus smoothed noise is highest.

    Parameters
    ----------
    cells : int
        How many it has.
    rng : numpy.random.Generator

    Returns
    -------
    VoidShape
    """
    from scipy.ndimage import gaussian_filter

    if cells < 1:
        raise InputError(f"a hole of {cells} cells was asked for; it must have at least 1")
    radius = np.sqrt(cells / np.pi)
    reach = int(np.ceil(2 * radius)) + 1
    row, column = np.ogrid[-reach : reach + 1, -reach : reach + 1]
    noise = gaussian_filter(rng.standard_normal((2 * reach + 1,) * 2), 0.4 * radius)
    field = 0.35 * noise / (noise.std() or 1.0) - np.hypot(row, column) / radius
    return VoidShape(_trimmed(_grown_downhill(field, (reach, reach), cells)))


def _grown_downhill(field, start, cells):
    taken = np.zeros(field.shape, bool)
    met = np.zeros(field.shape, bool)
    met[start] = True
    front = [(-field[start], *start)]
    for _ in range(cells):
        _, row, column = heapq.heappop(front)
        taken[row, column] = True
        for beside in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
            if min(beside) >= 0 and max(beside) < len(field) and not met[beside]:
                met[beside] = True
                heapq.heappush(front, (-field[beside], *beside))
    return taken


def _trimmed(cells):
    rows, columns = (np.flatnonzero(cells.any(axis=axis)) for axis in (1, 0))
    return cells[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
