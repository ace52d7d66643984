"""D8: each cell drains to the neighbour in the direction of steepest descent."""

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.hydrology.surfaces import by_row, surface
from demsmith.core.progress import SILENT
from demsmith.core.strips import strips

VOID_CODE = 247
"""Code of a void, as in pyflwdir."""


def d8_directions(filled, flat, void, dx, dy, *, threads=None, progress=SILENT):
    """Tell to which of its eight neighbours each cell drains.

    That is the one of steepest descent (O'Callaghan and Mark 1984): drop by distance in ground
    metres. Of equally steep ones it is the first in the order of the codes. On a flat, ``flat``
    takes the place of the elevation.

    Parameters
    ----------
    filled : (H, W) float32 or float64 array
        Elevations [m]; best without depressions, as `fill_depressions` gives them.
    flat : (H, W) array of unsigned integers, or None
        What `resolve_flats` made of ``filled``; None leaves the flats without direction.
    void : (H, W) bool array
        True where there is no elevation.
    dx, dy : (H,) arrays
        Ground metres per cell of each row, along the row and across.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    (H, W) uint8 array
        ESRI's codes: 1 east (next column), 2 south-east, 4 south (next row), 8 south-west,
        16 west, 32 north-west, 64 north, 128 north-east; 0 for an outlet (a cell at the raster's
        edge or beside a void that has no lower neighbour) or a sink; 247 for a void.

    Raises
    ------
    InputError
        If the arrays do not fit.
    Cancelled
        If ``progress`` asks to stop.

    References
    ----------
    O'Callaghan, J. F. and Mark, D. M. (1984), The extraction of drainage networks from digital
    elevation data, Computer Vision, Graphics, and Image Processing 28, 323-344.

    Examples
    --------
    A drop of 3 over the side is steeper than one of 4 over the corner:

    >>> z = np.array([[9, 9, 9], [9, 5, 2], [9, 9, 1.0]])
    >>> d8_directions(z, None, np.zeros((3, 3), bool), np.ones(3), np.ones(3))
    array([[  2,   2,   4],
           [  1,   1,   4],
           [128,   1,   0]], dtype=uint8)
    """
    from demsmith.core.hydrology._directions import steepest

    filled, void = surface(filled, void)
    dx, dy = by_row(dx, "dx", len(filled)), by_row(dy, "dy", len(filled))
    if flat is None:
        flat = np.zeros(filled.shape, np.uint16)
    if flat.shape != filled.shape:
        raise InputError(f"flat has shape {flat.shape}, the elevations {filled.shape}")
    codes = np.empty(filled.shape, np.uint8)
    parallel.run(
        [
            lambda rows=rows: steepest(filled, flat, void, dx, dy, rows.start, rows.stop, codes)
            for rows in strips(filled.shape)
        ],
        threads=threads,
        progress=progress,
    )
    return codes
