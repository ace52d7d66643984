"""A construction tree: one continuous elevation function, at points or on a whole grid."""

import numpy as np

from demsmith.core.parallel import run
from demsmith.core.progress import SILENT
from demsmith.core.trees.node import FULL, Bounds
from demsmith.core.trees.operators import THRESHOLD

_BLOCK = 128


class ConstructionTree:
    """The terrain that a node tells of: its elevation where its weight is 1/2 or more.

    Parameters
    ----------
    root : Node
        See `demsmith.core.trees.Node`.
    threshold : float
        Weight from which on there is terrain.

    Examples
    --------
    >>> import numpy as np
    >>> from demsmith.core.trees import Frame, RasterNode
    >>> node = RasterNode(np.array([[1.0, 2.0], [3.0, 4.0]]), frame=Frame((2, 2), 10.0, 10.0))
    >>> tree = ConstructionTree(node)
    >>> tree.elevation([5.0, 15.0, 25.0], 5.0)
    array([ 3.,  4., nan])
    >>> tree.grid([5.0, 15.0], [15.0, 5.0])
    array([[1., 2.],
           [3., 4.]], dtype=float32)
    """

    def __init__(self, root, *, threshold=THRESHOLD):
        self.root, self.threshold = root, threshold

    def bounds(self):
        """Give a rectangle outside of which there is no terrain."""
        return self.root.bounds()

    def lipschitz(self, bounds=None):
        """Bound the slope of the terrain within a rectangle, or everywhere; may be infinite."""
        return self.root.lipschitz(self.bounds() if bounds is None else bounds)

    def elevation(self, x, y, *, detail=FULL):
        """Give the elevation at points.

        Parameters
        ----------
        x, y : array_like of float
            Metres in the local frame.
        detail : Detail

        Returns
        -------
        ndarray of float64
            Not-a-number where there is no terrain.
        """
        joint = self.joint(x, y, detail=detail)
        return np.where(joint.weight >= self.threshold, joint.elevation, np.nan)

    def joint(self, x, y, *, detail=FULL):
        """Give the root's `Joint` at points: elevation, weight and gradients."""
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        return self.root.joint(x, y, detail=detail)

    def grid(self, x, y, *, detail=FULL, threads=None, progress=SILENT):
        """Evaluate the terrain on a regular grid, leaving out what does not reach a block of it.

        Parameters
        ----------
        x, y : 1-D array_like of float
            Coordinates of the columns and the rows, each in order.
        detail : Detail
        threads : int, optional
            Default: one for each core. The result does not depend on it.
        progress : Progress

        Returns
        -------
        (rows, columns) ndarray of float32
            Not-a-number where there is no terrain.
        """
        x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
        values = np.full((y.size, x.size), np.nan, np.float32)

        def block(row, column):
            here = slice(row, row + _BLOCK), slice(column, column + _BLOCK)
            part = _around(x[here[1]], y[here[0]])
            node = self.root.within(part)
            if node is not None:
                points = np.meshgrid(x[here[1]], y[here[0]])
                pruned = ConstructionTree(node, threshold=self.threshold)
                values[here] = pruned.elevation(*points, detail=detail)

        corners = [(row, column) for row in range(0, y.size, _BLOCK)
                   for column in range(0, x.size, _BLOCK)]  # fmt: skip
        run([lambda corner=corner: block(*corner) for corner in corners],
            threads=threads, progress=progress)  # fmt: skip
        return values


def _around(x, y):
    return Bounds(float(x.min()), float(y.min()), float(x.max()), float(y.max()))
