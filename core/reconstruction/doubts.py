"""Which cells are to be filled: voids, and known cells that are not believed."""

from typing import NamedTuple

import numpy as np

from demsmith.core.faults import REACH, find_outliers, find_untrusted_rims
from demsmith.core.progress import SILENT, Span
from demsmith.core.reconstruction.extents import scan


class FoundVoids(NamedTuple):
    """What is to be filled of a chunk.

    Attributes
    ----------
    runs : (N, 3) int32 array
        Its cells, see `demsmith.core.reconstruction.extents.scan`.
    cells : int
        Cells of the chunk that belong to the ground.
    outliers : (K, 2) int32 array
        Rows and columns of the spikes and wells among those to fill.
    """

    runs: np.ndarray
    cells: int
    outliers: np.ndarray


def void_runs(ground, plan, rows, columns, *, threads=None, progress=SILENT):
    """Find the cells of a chunk that are to be filled.

    Parameters
    ----------
    ground : Ground
    plan : Plan
    rows, columns : slice
        The chunk.
    threads : int, optional
    progress : Progress

    Returns
    -------
    FoundVoids

    Raises
    ------
    InputError
        If the ground cannot be read.
    Cancelled
        If ``progress`` asks to stop.
    """
    around = tuple(
        _widened(span, _reach(plan.options), length)
        for span, length in zip((rows, columns), ground.shape, strict=True)
    )
    inner = tuple(
        slice(span.start - wide.start, span.stop - wide.start)
        for span, wide in zip((rows, columns), around, strict=True)
    )
    values, void = ground.read(*around, progress=Span(progress, 0, 0.3))
    covered = ground.covered(*around)
    pixel_size = tuple(size[around[0]] for size in plan.pixel_size)
    doubting = Span(progress, 0.3, 1)
    outliers, rims = _doubted(values, void, covered, plan, pixel_size, threads, doubting)
    wanted = ((void & covered) | outliers | rims)[inner]
    corner = np.array([rows.start, columns.start])
    places = (np.argwhere(outliers[inner]) + corner).astype(np.int32)
    return FoundVoids(scan(wanted, rows, columns), int(np.count_nonzero(covered[inner])), places)


def outliers_of(window, plan, *, threads=None):
    """Find the spikes and wells of a training window: (h, w) bool array."""
    if not plan.options.outliers:
        return np.zeros(window.void.shape, bool)
    return find_outliers(
        window.values, window.void, options=plan.options, model=plan.faults,
        pixel_size=(window.dx, window.dy), unit=plan.unit, threads=threads,
    )  # fmt: skip


def _doubted(values, void, covered, plan, pixel_size, threads, progress):
    """Find the known cells of a window that are not believed: outliers, and others at rims."""
    options = plan.options
    outliers, rims = np.zeros((2, *void.shape), bool)
    if options.outliers:
        outliers = find_outliers(
            values, void, options=options, model=plan.faults, pixel_size=pixel_size,
            unit=plan.unit, threads=threads, progress=Span(progress, 0, 0.7),
        )  # fmt: skip
    if options.noisy_rims or options.erode:
        holes = (void & covered) | outliers
        rims = find_untrusted_rims(
            values, void | outliers, options=options, model=plan.faults, threads=threads,
            progress=Span(progress, 0.7, 1),
        )  # fmt: skip
        # The edge of all tiles is no void's rim.
        rims &= _near(holes, max(options.erode, 1))
    return outliers, rims


def _reach(options):
    """Give how far around a cell lies what decides whether it is believed."""
    if options.noisy_rims or options.erode:
        return REACH + max(REACH, options.erode)
    return REACH if options.outliers else 0


def _near(mask, cells):
    from scipy.ndimage import maximum_filter

    return maximum_filter(mask, size=2 * cells + 1, mode="constant", cval=False)


def _widened(span, by, length):
    return slice(max(span.start - by, 0), min(span.stop + by, length))
