"""Reconstruction of an elevation array."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.options import options_from
from demsmith.core.progress import SILENT, Span
from demsmith.core.raster import BandMeta, Grid, Raster
from demsmith.core.reconstruction.assembly import assemble
from demsmith.core.reconstruction.neighbours import alone
from demsmith.core.reconstruction.options import ReconstructOptions
from demsmith.core.reconstruction.pipeline import reconstruct_ground
from demsmith.core.reconstruction.plan import check_auxiliaries
from demsmith.core.reconstruction.table import tabulate
from demsmith.core.voids.table import VoidTable


@dataclass(frozen=True)
class Reconstruction:
    """A reconstructed array.

    Attributes
    ----------
    values : (H, W) array
        Elevations, in the data type of the input unless floating point was asked for.
    left : (H, W) bool array
        Voids that were left as they were.
    sources : (H, W) uint8 array
        Where each cell comes from: codes of `demsmith.core.voids.sources`.
    sigma : (H, W) float32 array
        Standard error [m] to be expected: 0 in known cells, NaN where it is not known.
    table : VoidTable
        One row per void.
    """

    values: np.ndarray
    left: np.ndarray
    sources: np.ndarray
    sigma: np.ndarray
    table: VoidTable


def reconstruct(
    values, void=None, *, grid=None, options=None, auxiliaries=(), threads=None, progress=SILENT,
    **parameters,
):  # fmt: skip
    """Reconstruct the voids of an elevation array.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array, optional
        True where there is no elevation. Cells that are not finite are voids in any case, and
        those of a masked array where this is not given.
    grid : Grid, optional
        Where the cells lie. Default: cells of one metre.
    options : ReconstructOptions, optional
        Its fields can as well be given as keywords of their own.
    auxiliaries : sequence of path
        Rasters to fill from where they do better, in the order of trust, of any CRS and
        resolution; of each also a folder of tiles. They need a ``grid`` with a CRS.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress, optional

    Returns
    -------
    Reconstruction

    Raises
    ------
    InputError
        If the arrays do not fit, nothing is known, or an option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> z = np.add.outer(np.arange(9.0), 2 * np.arange(9.0))
    >>> holed = z.copy()
    >>> holed[3:6, 4:6] = np.nan
    >>> done = reconstruct(holed)
    >>> bool(abs(done.values - z).max() < 0.2), int((done.sources > 0).sum())
    (True, 6)
    """
    options = options_from(ReconstructOptions, options, parameters, "reconstruct")
    values, void = checked(values, void)
    grid = grid or Grid(values.shape)
    if tuple(grid.shape) != values.shape:
        raise InputError(f"the grid has {tuple(grid.shape)} cells, values {values.shape}")
    check_auxiliaries(auxiliaries, options, grid)
    raster = Raster(values, void, grid, BandMeta(dtype=values.dtype))
    around = alone(raster)
    done = reconstruct_ground(
        around.ground, options, auxiliaries=auxiliaries, threads=threads,
        progress=Span(progress, 0, 0.9),
    )  # fmt: skip
    made = assemble(
        raster, around.ground, around.rows, around.columns, done.patches,
        outliers=done.outliers, float_output=options.float_output, progress=Span(progress, 0.9, 1),
    )  # fmt: skip
    table = tabulate(done.plan, done.extents, done.voids, done.patches, grid)
    return Reconstruction(made.values, made.left, made.sources, made.sigma, table)
