"""The gradient of ground in rise by run, from which slope, aspect and shading come."""

from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT
from demsmith.core.relief.options import METHODS
from demsmith.core.strips import strips

# Small enough for a processor's cache to hold what is made of them on the way.
_CHUNK_CELLS = 1 << 15


def gradient(z, void, dx, dy, *, method="horn", south_up=False, threads=None, progress=SILENT):
    """Give the rise per metre toward the east and the north of every cell.

    Derivatives are central differences: by ``horn`` of the three rows or columns around the cell,
    weighted 1-2-1 (Horn 1981, "Hill shading and the reflectance map", Proc. IEEE 69(1)), which
    suits rough ground, by ``zevenbergen-thorne`` of the cell's own alone (Zevenbergen and Thorne
    1987, "Quantitative analysis of land surface topography", Earth Surf. Process. Landforms 12),
    which suits smooth ground.

    At the raster's edge and beside voids a difference takes the cells that there are: one-sided
    between neighbours where one of a pair is missing. A row or column beside the cell whose
    counterpart is missing is left out, so that the derivative stays the cell's own; at a straight
    edge that is what ``gdaldem -compute_edges`` does. So a plane has its own gradient in every
    cell, up to the edge of voids of any shape. A cell that has no neighbour along one direction
    among the 3 x 3 is level in that direction.

    Parameters
    ----------
    z : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array
        True where there is no elevation; what ``z`` holds there does not matter.
    dx, dy : (H,) float64 arrays
        Ground metres per cell of each row, east-west and north-south.
    method : str
        ``horn`` or ``zevenbergen-thorne``.
    south_up : bool
        Whether the first row is the southern one.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    east, north : (H, W) float32 arrays
        dz/d(east) and dz/d(north) in the grid's own frame: columns run east, and rows south unless
        ``south_up``. NaN in voids.

    Raises
    ------
    InputError
        If there is no such method.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    Ground that rises 1 m from column to column, 10 m apart, and falls 2 m from row to row:

    >>> z = np.arange(4.0) - 2 * np.arange(3.0)[:, None]
    >>> east, north = gradient(z, np.zeros(z.shape, bool), np.full(3, 10.0), np.full(3, 10.0))
    >>> print(east[0, 0], north[0, 0])
    0.1 0.2
    """
    east, north = np.empty(z.shape, np.float32), np.empty(z.shape, np.float32)

    def work(rows):
        _gradient_of_rows(z, void, (dx, dy), rows, method, south_up, (east[rows], north[rows]))

    _by_strips(work, z.shape, threads, progress)
    return east, north


def from_gradient(
    function, values, void, *, pixel_size, method, south_up=False, threads=None, progress=SILENT
):
    """Compute something of the gradient of every cell, without keeping the gradient.

    Parameters
    ----------
    function : callable
        Takes the rises by run toward east and north of some rows, (h, W) float32 arrays; gives a
        number for each cell.
    values, void
        As `demsmith.core.elevations.checked` takes them.
    pixel_size
        As `demsmith.core.mcmd.lattice.metres` takes it.
    method, south_up, threads, progress
        As of `gradient`.

    Returns
    -------
    (H, W) float32 array
    """
    z, void = checked(values, void)
    sizes = metres(z.shape, pixel_size)
    result = np.empty(z.shape, np.float32)

    step = max(1, _CHUNK_CELLS // z.shape[1])

    def work(strip):
        for start in range(strip.start, strip.stop, step):
            rows = slice(start, min(start + step, strip.stop))
            out = np.empty((2, rows.stop - rows.start, z.shape[1]), np.float32)
            _gradient_of_rows(z, void, sizes, rows, method, south_up, out)
            result[rows] = function(*out)

    _by_strips(work, z.shape, threads, progress)
    return result


def _by_strips(work, shape, threads, progress):
    parallel.run(
        [partial(work, rows) for rows in strips(shape)], threads=threads, progress=progress
    )


def _gradient_of_rows(z, void, sizes, rows, method, south_up, out):
    """Write the gradient of some rows of a raster to ``out``, two arrays."""
    from demsmith.core.relief._gradient import differentiate

    if method not in METHODS:
        raise InputError(f"method is {method!r}; choose one of {', '.join(METHODS)}")
    block = slice(max(rows.start - 1, 0), min(rows.stop + 1, z.shape[0]))
    kind = float_type(z.dtype)
    per_east, per_down = ((1 / size[block]).astype(kind) for size in sizes)
    differentiate(
        np.ascontiguousarray(z[block], kind), np.ascontiguousarray(void[block]),
        rows.start - block.start, rows.stop - block.start, per_east, per_down, method == "horn",
        *out,
    )  # fmt: skip
    if not south_up:
        np.negative(out[1], out=out[1])


def float_type(dtype):
    """Give the float type, of 32 or 64 bits, that holds all values of a type; 64 if none does."""
    return np.float32 if np.can_cast(dtype, np.float32, "safe") else np.float64
