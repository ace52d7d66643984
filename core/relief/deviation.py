"""How far ground is from the mean of what is around it."""

from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.options import validate
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT
from demsmith.core.relief.gradient import float_type
from demsmith.core.relief.options import ReliefOptions

_OWN = ReliefOptions()
# Side of a tile: small, so that the running sums it needs stay in the processor's cache.
_TILE = 256


def mean_deviation(
    values, void=None, *, radius=_OWN.radius, pixel_size=None, threads=None, progress=SILENT
):
    """Tell how rugged the ground is: its deviation from the mean within a radius.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array, optional
        True where there is no elevation. Cells that are not finite are voids in any case, and
        those of a masked array where this is not given.
    radius : float
        Ground metres. A cell counts if its centre is not farther away: in geographic rasters, an
        ellipse of cells that changes from row to row.
    pixel_size : float, (float, float) or (array, array), optional
        Ground metres per cell: both ways, or east-west and north-south, each one number or one by
        row, as `Grid.pixel_size_m` gives. Default: 1.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress, optional

    Returns
    -------
    (H, W) float32 array
        Root mean square deviation of the known cells from their mean [m], 0 or more; NaN in
        voids. Beyond the raster's edge there is nothing to count.

    Raises
    ------
    InputError
        If the arrays do not fit, or the radius is smaller than a cell or out of range.
    Cancelled
        If ``progress`` asks to stop.

    Notes
    -----
    The time grows with the radius in rows, not with the number of cells within it: each row of the
    disc is the difference of two running sums.

    Examples
    --------
    >>> print(mean_deviation([[0, 3, 0, 3]], radius=1))
    [[1.5       1.4142135 1.4142135 1.5      ]]
    """
    _, deviation = _moments(values, void, radius, pixel_size, threads, progress)
    return deviation


def topographic_position(
    values, void=None, *, radius=_OWN.radius, pixel_size=None, threads=None, progress=SILENT
):
    """Tell how far the ground lies above the mean within a radius: ridges from valleys.

    After Weiss 2001, "Topographic position and landforms analysis", with a disc that includes the
    cell.

    Parameters and errors are those of `mean_deviation`.

    Returns
    -------
    (H, W) float32 array
        Elevation less the mean of the known cells [m]; NaN in voids.

    Examples
    --------
    >>> print(topographic_position([[0, 3, 0]], radius=1))
    [[-1.5  2.  -1.5]]
    """
    position, _ = _moments(values, void, radius, pixel_size, threads, progress)
    return position


def _moments(values, void, radius, pixel_size, threads, progress):
    """Give how far each cell lies above the mean around it, and the deviation from that mean."""
    validate(ReliefOptions(radius=radius))
    z, void = checked(values, void)
    dx, dy = metres(z.shape, pixel_size)
    if radius < min(dx.min(), dy.min()):
        raise InputError(
            f"radius is {radius:g} m, less than a cell of {dx.min():.4g} × {dy.min():.4g} m; "
            "give a larger one"
        )
    north = np.cumsum(dy) - dy / 2
    made = np.empty(z.shape, np.float32), np.empty(z.shape, np.float32)

    def work(rows, columns):
        top = np.searchsorted(north, north[rows.start] - radius) - 1
        bottom = np.searchsorted(north, north[rows.stop - 1] + radius) + 1
        block = slice(max(int(top), 0), min(int(bottom), z.shape[0]))
        reach = _reach(radius, dx, north, rows, block)
        farthest = int(reach.max())
        side = slice(max(columns.start - farthest, 0), min(columns.stop + farthest, z.shape[1]))
        _moments_of_tile(
            z[block, side], void[block, side], rows.start - block.start,
            columns.start - side.start, reach, *(out[rows, columns] for out in made),
        )  # fmt: skip

    # As wide as the discs, lest most of the work is the running sums of what is around.
    wide = max(_TILE, min(int(radius / dx.min()), z.shape[1]))
    tiles = [
        (slice(top, min(top + _TILE, z.shape[0])), slice(left, min(left + wide, z.shape[1])))
        for top in range(0, z.shape[0], _TILE)
        for left in range(0, z.shape[1], wide)
    ]
    parallel.run(
        [partial(work, *tile) for tile in tiles], threads=threads, progress=progress
    )  # fmt: skip
    return made


def _moments_of_tile(z, void, row, column, reach, position, deviation):
    """Write the moments of a tile, given with what is around it."""
    from demsmith.core.relief._moments import moments_around

    z = np.ascontiguousarray(z, float_type(z.dtype))
    own = np.s_[row : row + position.shape[0], column : column + position.shape[1]]
    base = (
        float(np.mean(z[own], where=~void[own], dtype=np.float64)) if not void[own].all() else 0.0
    )
    mean = np.empty_like(position)
    moments_around(z, np.ascontiguousarray(void), base, row, column, reach, mean, deviation)
    np.subtract(z[own] - base, mean, out=position, casting="same_kind")


def _reach(radius, dx, north, rows, block):
    """Count the cells to either side, in the rows of a block, that discs around some rows cover.

    Returns
    -------
    (rows, block) int64 array
        -1 where the disc does not reach a row.
    """
    apart = north[rows, None] - north[None, block]
    width = (dx[rows, None] + dx[None, block]) / 2
    # A cell that lies just on the circle counts, whatever the rounding.
    squared = radius**2 * (1 + 1e-9) - apart**2
    return np.where(squared >= 0, np.sqrt(np.maximum(squared, 0)) // width, -1).astype(np.int64)
