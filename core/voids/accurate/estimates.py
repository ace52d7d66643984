"""All estimators' surfaces of some voids, cell by cell."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.progress import SILENT, Muted
from demsmith.core.voids.accurate.giants import is_giant, solve_giant
from demsmith.core.voids.accurate.model import LARGEST_LEARNED

TENSION_CELLS = 12.0
STIFFNESS_CELLS = 0.7

_WIDE = 30  # cells from which tension grows with the width, and size up to which it does
_WIDEST = 15_000

# Structure is averaged over a share of a void's width; the metric's exponent grows with its size.
_SPREAD, _LEAST_SPREAD = 0.2, 1.5
_STRENGTH = np.log([300, 1500]), (0.6, 0.85)
_BLUR_REACH = 3  # spreads
_RIM = 3  # cells beyond the blur's reach that its box and a gradient take


@dataclass(frozen=True)
class Estimates:
    """Surfaces and what their error may be told by, of M cells of N voids.

    Attributes
    ----------
    cells : (M,) int64 array
        Flat indices of the cells, void by void.
    first : (N + 1,) int64 array
        Where each void begins.
    surfaces : (3, M) float64 array
        Elevations by each of `demsmith.core.voids.accurate.model.ESTIMATORS`.
    distance : (M,) float64 array
        To known ground, in rows.
    roughness, steepness, deviation : (N,) float64 arrays
        Root mean squares of the Laplacian [m by row²] and the slope [m by row], and standard
        deviation of the elevation [m] of the ground around each void.
    """

    cells: np.ndarray
    first: np.ndarray
    surfaces: np.ndarray
    distance: np.ndarray
    roughness: np.ndarray
    steepness: np.ndarray
    deviation: np.ndarray

    @property
    def void_of(self):
        """Which of the N voids each cell belongs to."""
        return np.repeat(np.arange(self.first.size - 1), np.diff(self.first))


def margin(high, wide):
    """Give the cells around a void's bounding box on which its filling may depend.

    Parameters
    ----------
    high, wide : int
        Cells of the void's bounding box.

    Examples
    --------
    >>> margin(5, 9)
    18
    """
    start = (2 << (max(high, wide).bit_length() - 1)) + 2  # the coarsest stencil of MCMD
    return max(start, _looked_at(high * wide))


def _looked_at(cells):
    """Give the margin within which a void of so many cells is estimated."""
    return np.ceil(_BLUR_REACH * _spread(cells)).astype(np.int64) + _RIM


def _spread(cells):
    return np.maximum(_LEAST_SPREAD, _SPREAD * np.sqrt(cells))


def estimate_surfaces(
    work, void, voids, selected, covariance, *, dx, dy, tension, threads=None, progress=SILENT
):
    """Estimate voids by every estimator.

    Parameters
    ----------
    work : (H, W) float32 or float64 array
        Elevations [m]; voids hold MCMD's surface. It is not changed.
    void : (H, W) bool array
    voids : Voids
    selected : (N,) int array
        Numbers of the voids to estimate.
    covariance : Covariance or None
        None: the learned surface is not wanted.
    dx, dy : (H,) arrays
        Ground metres per cell.
    tension : (N,) array
        Distance [rows] over which bending gives way to stretching; from 900 to 15,000 cells it
        grows with the void's width, for which larger ones have too little rim.
    threads : int, optional
    progress : Progress

    Returns
    -------
    Estimates

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop.
    """
    from demsmith.core.voids.accurate._voids import estimate_voids

    selected = np.asarray(selected, np.int64)
    size = voids.cells[selected]
    cells, first = cells_of(voids, selected, work.shape[1])
    out = Estimates(
        cells, first, np.empty((3, cells.size)), np.empty(cells.size), *np.empty((3, selected.size))
    )
    middle = work_rows(voids, selected)
    dx, dy = np.asarray(dx)[middle], np.asarray(dy)[middle]
    no_weights = np.zeros((size.size, 1, 1))
    by_void = (
        _looked_at(size), (size <= LARGEST_LEARNED) & (covariance is not None), _spread(size),
        np.interp(np.log(size), *_STRENGTH), covariance.at(dx, dy) if covariance else no_weights,
    )  # fmt: skip
    lengths = (
        tension * np.where(size > _WIDEST, 1.0, np.maximum(np.sqrt(size) / _WIDE, 1.0)),
        np.full(dy.size, STIFFNESS_CELLS), dx, dy, first[:-1],
    )  # fmt: skip

    def estimate(chosen):
        relief = np.empty((3, chosen.size))
        estimate_voids(
            work, void, voids.runs, voids.first_run, selected[chosen],
            *(each[chosen] for each in by_void), covariance.noise if covariance else 0.0,
            *(each[chosen] for each in lengths), out.surfaces, out.distance, *relief,
        )  # fmt: skip
        out.roughness[chosen], out.steepness[chosen], out.deviation[chosen] = relief

    def estimate_giant(k):
        margins, _, spreads, strengths, _ = by_void
        out.roughness[k], out.steepness[k], out.deviation[k] = _estimate_giant(
            work, void, voids, selected[k], margins[k],
            tuple(each[k] for each in (spreads, strengths, *lengths)), out, Muted(progress),
        )  # fmt: skip

    small, giants = _by_width(voids, selected)
    effort = size**1.5 + 100.0
    parts = max(4 * parallel.thread_count(threads), int(effort[small].sum() / 1e5))
    chosen = [small[begin:end] for begin, end in parallel.even_spans(effort[small], parts)]
    parallel.run(
        [partial(estimate_giant, k) for k in giants] + [partial(estimate, each) for each in chosen],
        weights=[*effort[giants], *(effort[each].sum() for each in chosen)],
        threads=threads, progress=progress,
    )  # fmt: skip
    return out


def _by_width(voids, selected):
    """Part voids into those solved as they are and those too wide for it, the largest first."""
    high, wide = np.empty((2, selected.size), np.int64)
    for k, number in enumerate(selected):
        runs = voids.runs[voids.first_run[number] : voids.first_run[number + 1]]
        high[k] = runs[-1, 0] - runs[0, 0] + 1
        wide[k] = runs[:, 2].max() - runs[:, 1].min()
    giant = is_giant(high, wide)
    giants = np.flatnonzero(giant)
    return np.flatnonzero(~giant), giants[np.argsort(-voids.cells[selected[giants]], kind="stable")]


def _estimate_giant(work, void, voids, number, margin, shape, out, progress):
    from demsmith.core.voids.accurate._voids import put, survey_void

    spread, strength, tension, stiffness, dx, dy, first = shape
    where = voids.runs, voids.first_run[number], voids.first_run[number + 1]
    z, state, datum, top, left, relief = survey_void(
        work, void, *where, margin, dx, dy, first, out.surfaces, out.distance
    )
    solve_giant(z, state, spread, strength, tension, stiffness, dx, dy, progress)
    put(z, datum, *where, top, left, out.surfaces[2], first)
    return relief


def cells_of(voids, selected, columns):
    """List the flat indices of the cells of some voids, and where each void begins."""
    first = np.concatenate([[0], np.cumsum(voids.cells[selected])])
    begins, ends = voids.first_run[selected], voids.first_run[selected + 1]
    counts = ends - begins
    shift = np.repeat(begins - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts)
    runs = voids.runs[np.arange(counts.sum()) + shift].astype(np.int64)
    lengths = runs[:, 2] - runs[:, 1]
    starts = runs[:, 0] * columns + runs[:, 1] - np.cumsum(lengths) + lengths
    return np.repeat(starts, lengths) + np.arange(lengths.sum()), first


def work_rows(voids, selected):
    """Give the row at the middle of each void's height."""
    top = voids.runs[voids.first_run[selected], 0]
    bottom = voids.runs[voids.first_run[selected + 1] - 1, 0]
    return (top + bottom) // 2
