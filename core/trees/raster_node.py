"""A raster as a node: the bicubic surface through its cells' centres."""

import math
import threading

import numpy as np

from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.trees.bicubic import bicubic_limits
from demsmith.core.trees.node import FULL, NOTHING, Joint, JointNode, Limits


class RasterNode(JointNode):
    """The bicubic surface of a raster, once continuously differentiable.

    It passes through the cells' values at their centres. The weight is 1 in cells with a value and
    0 in voids and outside the raster. Beside a void, the surface is interpolated as if the void
    had the value of its nearest cell; beyond the outermost centres, it is as if these went on.

    Asked for less detail than the cells carry, it is the surface of the raster halved as often as
    the resolution says, by means of 2 × 2 cells, and between halvings in between.

    Parameters
    ----------
    values : (H, W) array
    void : (H, W) bool array, optional
        Cells without a value; those that are not finite are void in any case.
    frame : Frame
        Where the cells lie.

    Raises
    ------
    InputError
        If shapes differ or there is no cell with a value.
    """

    def __init__(self, values, void=None, *, frame):
        values, void = checked(values, void)
        if tuple(frame.shape) != values.shape:
            raise InputError(f"the frame is of {tuple(frame.shape)} cells, values {values.shape}")
        if void.all():
            raise InputError("every cell is a void")
        self.frame, self._void = frame, void
        self._levels = [(_with_rims(values, void), void)]
        self._halving = threading.Lock()

    def bounds(self):
        """Give the raster's extent."""
        return self.frame.bounds()

    def joint(self, x, y, *, detail=FULL):
        """Give elevation and weight with their gradients."""
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        row, column = self.frame.place(x.ravel(), y.ravel())
        fine = max(self.frame.dx, self.frame.dy)
        most = math.log2(max(self.frame.shape)) if max(self.frame.shape) > 1 else 0.0
        level = min(max(math.log2(detail.resolution / fine), 0), most) if detail.resolution else 0.0
        below, share = int(level), level - int(level)
        surface = self._surface(below, row, column)
        if share:
            surface = (1 - share) * surface + share * self._surface(below + 1, row, column)
        # Which cells have a value is told by the finest level alone.
        weight = surface[3] if not level else self._surface(0, row, column)[3]
        there = weight > 0
        value, by_row, by_column = (np.where(there, line, 0.0) for line in surface[:3])
        parts = value, weight, by_column / self.frame.dx, -by_row / self.frame.dy
        flat = np.zeros(x.shape)
        return Joint(*(part.reshape(x.shape) for part in parts), flat, flat)

    def limits(self, bounds):
        """Bound elevation, weight and slopes, in full detail, from the cells round a rectangle.

        The weight jumps at the rims of voids and of the raster: its slope is infinite where such
        a rim is in the rectangle.
        """
        rows, columns = self._cells(bounds)
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return NOTHING
        void = self._void[rows, columns]
        if void.all():
            return NOTHING
        whole = not void.any() and self.frame.bounds().holds(bounds)
        near = tuple(slice(max(side.start - 2, 0), side.stop + 2) for side in (rows, columns))
        low, high, by_row, by_column = bicubic_limits(self._levels[0][0][near])
        return Limits(
            float(low), float(high),
            float(np.hypot(by_row / self.frame.dy, by_column / self.frame.dx)),
            float(whole), 1.0, 0.0 if whole else np.inf,
        )  # fmt: skip

    def _cells(self, bounds):
        """Give the rows and columns of the cells that a rectangle touches."""
        top, left = self.frame.place(bounds.xmin, bounds.ymax)
        bottom, right = self.frame.place(bounds.xmax, bounds.ymin)
        spans = []
        for first, last, side in ((top, bottom, 0), (left, right, 1)):
            stop = min(math.floor(last + 0.5) + 1, self.frame.shape[side])
            spans.append(slice(max(math.floor(first + 0.5), 0), stop))
        return spans

    def _surface(self, level, row, column):
        """Give value, slopes by row and column of this raster, and weight, of a halved raster."""
        from demsmith.core.trees._bicubic import fill_joint

        with self._halving:
            while len(self._levels) <= level:
                self._levels.append(_halved(*self._levels[-1]))
        samples, void = self._levels[level]
        size = 2.0**level
        surface = np.empty((4, row.size))
        there = (row + 0.5) / size - 0.5, (column + 0.5) / size - 0.5
        fill_joint(samples[None], void, *there, surface)
        surface[1:3] /= size
        return surface


def _with_rims(values, void):
    """Give the values as float32 or float64, with voids that have those of their nearest cell."""
    kind = np.float64 if values.dtype.kind == "f" and values.dtype.itemsize > 4 else np.float32
    if values.dtype.kind != "f" and values.dtype.itemsize > 2:
        kind = np.float64
    if not void.any():
        return np.ascontiguousarray(values, kind)
    from scipy.ndimage import distance_transform_edt

    row, column = distance_transform_edt(void, return_distances=False, return_indices=True)
    return np.ascontiguousarray(values[row, column], kind)


def _halved(samples, void):
    """Give the means of 2 × 2 cells that are no voids; the last row or column may be alone."""
    rows, columns = samples.shape
    pad = ((0, rows % 2), (0, columns % 2))
    shape = ((rows + 1) // 2, 2, (columns + 1) // 2, 2)
    known = np.pad(~void, pad, constant_values=False).reshape(shape)
    filled = np.pad(samples, pad, mode="edge").astype(np.float64).reshape(shape)
    count = known.sum(axis=(1, 3))
    mean = (filled * known).sum(axis=(1, 3)) / np.maximum(count, 1)
    alone = filled.mean(axis=(1, 3))
    return np.where(count > 0, mean, alone).astype(samples.dtype), np.zeros(count.shape, bool)
