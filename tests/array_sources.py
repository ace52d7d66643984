"""Arrays that are read like the tiles of a raster."""

from types import SimpleNamespace

import numpy as np


def source(values, grid, void=None):
    """Stands for a tile set: an array on a grid, as `demsmith.core.auxiliary` reads it."""
    void = np.zeros(values.shape, bool) if void is None else void
    return SimpleNamespace(
        grid=grid, read=lambda rows, columns: (values[rows, columns], void[rows, columns])
    )
