"""The table of the voids of a reconstruction."""

import numpy as np

from demsmith.core.auxiliary import NOT_ASKED, VERDICTS
from demsmith.core.reconstruction.extents import runs_of
from demsmith.core.voids.sizes import SIZE_CLASSES, size_class
from demsmith.core.voids.sources import SOURCE_NAMES, WATER, auxiliary_code
from demsmith.core.voids.table import VoidTable

_HELD = "Nearly all of its rim is level water."


def tabulate(plan, extents, voids, patches, grid, *, corner=(0, 0)):
    """Make the table of some voids.

    Parameters
    ----------
    plan : Plan
    extents : VoidExtents
    voids : (M,) int64 array
        Their numbers, ascending.
    patches : iterable of Patch
        Of them and of no others.
    grid : Grid
        The ground's.
    corner : (int, int)
        The cell of the ground from which the table counts rows and columns.

    Returns
    -------
    VoidTable
    """
    column = _Columns(voids, patches)
    first = extents.first_cells[voids].astype(np.int64)
    centre = grid.xy(first[:, 0], first[:, 1])
    runs = runs_of(extents, voids)
    run_area = (runs[:, 2] - runs[:, 1]) * grid.cell_area_m2()[runs[:, 0]]
    void_of_run = np.repeat(np.arange(voids.size), np.diff(extents.first_run)[voids])
    low, high = column.of("rim_low", np.nan), column.of("rim_high", np.nan)
    filled, codes = column.of("filled", False), column.of("codes", 0)
    unknown = np.full(voids.size, np.nan)
    return VoidTable(
        id=np.arange(1, voids.size + 1), row=first[:, 0] - corner[0],
        column=first[:, 1] - corner[1], x=centre.x, y=centre.y, cells=extents.cells[voids],
        area_m2=np.bincount(void_of_run, run_area, voids.size),
        rim_low=low, rim_mean=column.of("rim_mean", np.nan), rim_high=high, rim_relief=high - low,
        touches_edge=column.of("touches_edge", False), filled=filled,
        roughness_h=unknown, roughness=unknown,
        method=np.where(filled, np.array(SOURCE_NAMES)[codes], ""),
        expected_error=column.of("errors", np.nan),
        reason=_reasons(plan, extents.cells[voids], codes, filled, column),
    )  # fmt: skip


def _reasons(plan, cells, codes, filled, column):
    """Say why each void was filled as it was."""
    by_size = np.array(
        ["" if plan.model is None else plan.model.reason(k) for k in range(len(SIZE_CLASSES))]
    )
    interpolated = filled & (codes != WATER) & (codes < auxiliary_code(1))
    reasons = np.where(interpolated, by_size[size_class(cells)], "").astype(object)
    verdicts = np.array(VERDICTS)
    for k in reversed(range(len(plan.surfaces))):  # each before what is told already
        verdict = column.of("verdicts", NOT_ASKED, k)
        told = np.char.add(f"auxiliary {k + 1}: ", verdicts[verdict])
        reasons = np.where(verdict == NOT_ASKED, reasons, told.astype(object) + " " + reasons)
    reasons = np.where(filled & (codes == WATER), _HELD, reasons)
    return np.char.strip(reasons.astype(str))


class _Columns:
    """Gathers what patches know of each void, in the order of the voids."""

    def __init__(self, voids, patches):
        self._size = voids.size
        self._patches = [(np.searchsorted(voids, patch.voids), patch) for patch in patches]

    def of(self, name, otherwise, which=None):
        """Give a column; ``which`` of several that have the same name."""
        out = np.full(self._size, otherwise)
        for place, patch in self._patches:
            values = getattr(patch, name)
            out[place] = values if which is None else values[:, which]
        return out
