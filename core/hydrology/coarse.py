"""The maximum of each block of cells: what a coarse raster needs to keep the main streams."""

import numpy as np

from demsmith.core.progress import SILENT, checkpoint

_CELLS_AT_ONCE = 1 << 22


def block_maxima(values, factor, *, progress=SILENT):
    """Give the largest value of each block of ``factor`` × ``factor`` cells.

    Parameters
    ----------
    values : (H, W) float array
        NaN where there is none.
    factor : int
    progress : Progress

    Returns
    -------
    (ceil(H / factor), ceil(W / factor)) float array
        The last blocks of a row or column may hold fewer cells; NaN where all of a block's are.

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> block_maxima(np.array([[1, 5, 2], [0, 3, np.nan], [4, 4, 9.0]]), 2)
    array([[5., 2.],
           [4., 9.]])
    """
    rows, columns = values.shape
    begins = np.arange(0, columns, factor)
    maxima = np.empty((-(-rows // factor), begins.size), values.dtype)
    for block in range(len(maxima)):
        if block % max(1, _CELLS_AT_ONCE // (factor * columns)) == 0:
            checkpoint(progress, block / len(maxima))
        highest = np.fmax.reduce(values[block * factor : (block + 1) * factor])
        maxima[block] = np.fmax.reduceat(highest, begins)
    return maxima
