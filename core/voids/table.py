"""The table of a raster's voids: where each lies, its size, and the ground around it."""

from dataclasses import dataclass, fields

import numpy as np

from demsmith.core.voids.roughness import Roughness
from demsmith.core.voids.sizes import SIZE_CLASSES, size_class
from demsmith.core.voids.sources import SOURCE_NAMES


@dataclass(frozen=True)
class VoidTable:
    """One row per void, as arrays of the same length.

    Attributes
    ----------
    id : int64
        From 1, in the order of the voids' first cells.
    row, column : int64
        The void's first cell: the leftmost of its first row.
    x, y : float64
        That cell's centre in the coordinates of the raster's CRS.
    cells : int64
    area_m2 : float64
        Ground area [m²].
    rim_low, rim_mean, rim_high : float64
        Lowest, mean and highest known cell that shares a side with the void, in the raster's
        unit; NaN if there is none.
    rim_relief : float64
        Highest less lowest.
    touches_edge : bool
        Whether the void reaches the raster's edge.
    filled : bool
    roughness_h, roughness : float64
        Exponent H of the natural roughness that was added, and its largest displacement at the
        finest level in the raster's unit; NaN if none was asked for.
    method : text
        By what it was filled, as a source map's legend says it; empty if it was left.
    expected_error : float64
        Root mean square error to be expected, in the raster's unit; NaN if that is not known.
    reason : text
        Why it was filled so; empty if nothing was learned for it.
    """

    id: np.ndarray
    row: np.ndarray
    column: np.ndarray
    x: np.ndarray
    y: np.ndarray
    cells: np.ndarray
    area_m2: np.ndarray
    rim_low: np.ndarray
    rim_mean: np.ndarray
    rim_high: np.ndarray
    rim_relief: np.ndarray
    touches_edge: np.ndarray
    filled: np.ndarray
    roughness_h: np.ndarray
    roughness: np.ndarray
    method: np.ndarray
    expected_error: np.ndarray
    reason: np.ndarray

    def __len__(self):
        return self.id.size

    def rows(self):
        """Yield each void as a dict of plain numbers; NaN becomes None."""
        names = [field.name for field in fields(self)]
        for values in zip(*(getattr(self, name).tolist() for name in names), strict=True):
            yield {
                name: None if value != value else value
                for name, value in zip(names, values, strict=True)
            }


def tabulate(filled, grid, meta):
    """Make the table of a filled raster's voids.

    Parameters
    ----------
    filled : demsmith.core.voids.Filled
    grid : demsmith.core.raster.Grid
    meta : demsmith.core.raster.BandMeta
        Tells what the stored values mean.

    Returns
    -------
    VoidTable
    """
    voids = filled.voids
    count = len(voids)
    first = voids.runs[voids.first_run[:-1]] if count else np.empty((0, 3), np.int32)
    row, column = first[:, 0].astype(np.int64), first[:, 1].astype(np.int64)
    centre = grid.xy(row, column)
    run_area = (voids.runs[:, 2] - voids.runs[:, 1]) * grid.cell_area_m2()[voids.runs[:, 0]]
    void_of_run = np.repeat(np.arange(count), np.diff(voids.first_run))
    ends = meta.real(np.stack([filled.rims.low, filled.rims.high]))
    low, high = ends.min(axis=0), ends.max(axis=0)
    is_filled = np.zeros(count, bool)
    is_filled[filled.selected] = True
    method, reason = np.full(count, "", object), np.full(count, "", object)
    method[filled.selected] = np.array(SOURCE_NAMES, object)[filled.source_by_void()]
    error = np.full(count, np.nan)
    if filled.choices is not None:
        error[filled.selected] = filled.choices.error * abs(meta.scale)
    if filled.model is not None:
        reasons = np.array([filled.model.reason(k) for k in range(len(SIZE_CLASSES))], object)
        reason[filled.selected] = reasons[size_class(voids.cells[filled.selected])]
    rough = filled.roughness or Roughness(np.full(count, np.nan), np.full(count, np.nan))
    return VoidTable(
        id=np.arange(1, count + 1), row=row, column=column, x=centre.x, y=centre.y,
        cells=voids.cells, area_m2=np.bincount(void_of_run, run_area, count),
        rim_low=low, rim_mean=meta.real(filled.rims.mean), rim_high=high, rim_relief=high - low,
        touches_edge=filled.rims.touches_edge, filled=is_filled,
        roughness_h=rough.h, roughness=rough.amplitude * abs(meta.scale),
        method=method.astype(str), expected_error=error, reason=reason.astype(str),
    )  # fmt: skip
