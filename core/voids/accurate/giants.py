"""Voids too wide for a band: factored as a sparse matrix; the largest on a coarser grid first.

Far from known ground a surface of least bending is smooth, so there the coarser grid's is nearly as
good. Within a few coarse cells of the rim the void's own grid is solved anew, chunk by chunk,
between the known ground and the coarser surface: one cycle of the multigrid method (Briggs, Henson
and McCormick 2000, "A multigrid tutorial"), with a direct factor as its smoother.
"""

from concurrent.futures import ThreadPoolExecutor, wait

import numpy as np

from demsmith.core.progress import SILENT, Span, checkpoint

WIDEST = 128
"""Cells across the shorter side of the widest void whose matrix is factored as a band."""

# Cells of the largest void that is solved on its own grid: about two seconds, 100 MB.
_LARGEST = 40_000

_CHUNK = 96
_OVERLAP = 8
_PASSES = 2

# Cells over which structure is averaged in the collar, at most.
_COLLAR_SPREAD = 0.2 * WIDEST


def is_giant(high, wide):
    """Tell which voids are too wide, by the cells of their bounding boxes."""
    return np.minimum(high, wide) > WIDEST


def solve_giant(z, state, spread, strength, tension, stiffness, dx, dy, progress=SILENT):
    """Replace the estimates of a wide void's cells by the surface of least structured energy.

    Parameters
    ----------
    z : (h, w) float64 array
        Known elevations and first estimates; changed in place.
    state : (h, w) uint8 array
        See `demsmith.core.voids.accurate._locality`.
    spread, strength, tension, stiffness, dx, dy : float
        See `demsmith.core.voids.accurate._structured.solve_structured`.
    progress : Progress

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop.
    """
    from demsmith.core.voids.accurate._coarse import coarsen, collar, draw_out
    from demsmith.core.voids.accurate._locality import BLANK, KNOWN, VOID
    from demsmith.core.voids.accurate._structured import solve_structured

    rows, columns = np.nonzero(state == VOID)
    factor = 1
    while rows.size > _LARGEST * factor**2:
        factor *= 2
    coarse, coarse_state = coarsen(z, state, factor) if factor > 1 else (z, state)
    for done in range(_PASSES):
        _solve_sparse(
            coarse, coarse_state, max(spread / factor, 1.0), strength, tension / factor,
            stiffness, factor * dx, factor * dy,
            progress=Span(progress, 0.3 * done / _PASSES, 0.3 * (done + 1) / _PASSES),
        )  # fmt: skip
    if factor == 1:
        return
    draw_out(coarse, factor, z, state)
    near_rim = collar(state, 2 * factor + 2)
    chunks = [
        (row, column)
        for row in range(rows.min(), rows.max() + 1, _CHUNK)
        for column in range(columns.min(), columns.max() + 1, _CHUNK)
    ]
    solving = Span(progress, 0.3, 1)
    near_spread = min(spread, _COLLAR_SPREAD)
    reach = int(np.ceil(3 * near_spread)) + 3 + _OVERLAP
    for done, (row, column) in enumerate(chunks):
        checkpoint(solving, done / len(chunks))
        window = (
            slice(max(row - reach, 0), row + _CHUNK + reach),
            slice(max(column - reach, 0), column + _CHUNK + reach),
        )
        part = near_rim[window].copy()
        top, left = row - window[0].start, column - window[1].start
        outside = ~_inside(part.shape, top - _OVERLAP, left - _OVERLAP)
        part[outside & (part != BLANK)] = KNOWN
        if (part == VOID).any():
            surface = z[window].copy()  # in C order, as the kernel is compiled for
            solve_structured(surface, part, near_spread, strength, tension, stiffness, dx, dy)
            z[window] = surface
    checkpoint(progress, 1.0)


def _solve_sparse(z, state, *shape, progress):
    """Do what `solve_structured` does, with a sparse factor (SuperLU's) in place of a band."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    from demsmith.core.voids.accurate._structured import as_elements, equations

    def solution():
        rows, columns, values = as_elements(stencil, number)
        matrix = csc_array((values, (rows, columns)), shape=(right.size, right.size))
        # Symmetric and positive: the diagonal needs no search for pivots.
        return splu(
            matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        ).solve(right)  # fmt: skip

    checkpoint(progress, 0.0)
    number, stencil, right = equations(z, state, *shape)
    solved = _in_background(solution, progress)
    unknown = number >= 0
    z[unknown] = solved[number[unknown]]


def _in_background(task, progress):
    """Give a task's result; if ``progress`` asks to stop, do not wait for it."""
    helper = ThreadPoolExecutor(1)
    try:
        future = helper.submit(task)
        while not wait([future], timeout=0.1).done:
            checkpoint(progress, 0.5)
        return future.result()
    finally:
        helper.shutdown(wait=False)


def _inside(shape, top, left):
    """Mark a chunk and its overlap in a window."""
    inside = np.zeros(shape, bool)
    side = _CHUNK + 2 * _OVERLAP
    inside[max(top, 0) : top + side, max(left, 0) : left + side] = True
    return inside
