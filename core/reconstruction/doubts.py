"""Which cells are to be filled: voids, and known cells that are not believed."""

import numpy as np

from demsmith.core.faults import REACH, find_outliers, find_untrusted_rims
from demsmith.core.progress import SILENT, Span
from demsmith.core.reconstruction.extents import scan


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
    runs : (N, 3) int32 array
        See `demsmith.core.reconstruction.extents.scan`.
    cells : int
        Cells of the chunk that belong to the ground.

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
    doubted = _doubted(values, void, covered, plan, pixel_size, threads, Span(progress, 0.3, 1))
    wanted = ((void & covered) | doubted)[inner]
    return scan(wanted, rows, columns), int(np.count_nonzero(covered[inner]))


def outliers_of(window, plan, *, threads=None):
    """Find the spikes and wells of a training window: (h, w) bool array."""
    if not plan.options.outliers:
        return np.zeros(window.void.shape, bool)
    return find_outliers(
        window.values, window.void, options=plan.options, model=plan.faults,
        pixel_size=(window.dx, window.dy), unit=plan.unit, threads=threads,
    )  # fmt: skip


def _doubted(values, void, covered, plan, pixel_size, threads, progress):
    """Find the known cells of a window that are not believed."""
    options = plan.options
    doubted = np.zeros(void.shape, bool)
    if options.outliers:
        doubted = find_outliers(
            values, void, options=options, model=plan.faults, pixel_size=pixel_size,
            unit=plan.unit, threads=threads, progress=Span(progress, 0, 0.7),
        )  # fmt: skip
    if options.noisy_rims or options.erode:
        holes = (void & covered) | doubted
        rims = find_untrusted_rims(
            values, void | doubted, options=options, model=plan.faults, threads=threads,
            progress=Span(progress, 0.7, 1),
        )  # fmt: skip
        # The edge of all tiles is no void's rim.
        doubted |= rims & _near(holes, max(options.erode, 1))
    return doubted


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
