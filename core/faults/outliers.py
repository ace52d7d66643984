"""Spikes, wells and noisy rims: known cells that are not to be believed."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.elevations import checked
from demsmith.core.faults.options import FaultOptions
from demsmith.core.options import options_from
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, checkpoint

REACH = 9
"""Whether a cell is an outlier depends on the ground within so many cells of it."""

_BLOCK_ROWS = 128
# Metres up per metre across: no rock in the sea is as steep on all sides as 68 degrees.
_STEEPEST_ROCK = 2.5
# Of the rim cells beyond, a later release of a tile changed nine in ten.
_NOISY = 5.0


@dataclass(frozen=True)
class FaultModel:
    """What is usual on a raster or mosaic.

    Attributes
    ----------
    roughness : float
        The upper quartile of how far cells lie from the middle of their opposite neighbours, in
        the unit of the elevations; level ground does not count. 0 if nothing else is known.
    """

    roughness: float


def learn_faults(windows, *, progress=SILENT):
    """Learn what is usual on a raster or mosaic from windows of it.

    Parameters
    ----------
    windows : iterable
        Each with ``values``, an (h, w) array, and ``void``, an (h, w) bool array.
    progress : Progress

    Returns
    -------
    FaultModel

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop.
    """
    from demsmith.core.faults._outliers import UPPER_QUARTER

    windows = list(windows)
    found = [np.empty(0, np.float32)]
    for done, window in enumerate(windows):
        checkpoint(progress, done / len(windows))
        found.append(_misfits(*checked(window.values, window.void)))
    found = np.concatenate(found)
    checkpoint(progress, 1.0)
    return FaultModel(float(np.quantile(found, UPPER_QUARTER)) if found.size else 0.0)


def find_outliers(
    values,
    void=None,
    *,
    options=None,
    model=None,
    pixel_size=None,
    unit=1.0,
    threads=None,
    progress=SILENT,
    **parameters,
):
    """Find the spikes and wells of an elevation array.

    A cell is one if it, or a cluster of up to three by three cells it is in, stands above (or lies
    below) the ground on all sides: along each of the eight rays from the cell there is a step down
    to the line on which the ground outside goes on, and the smallest of these steps exceeds
    ``outlier_factor`` times the roughness and ``outlier_height``. The roughness is that of the
    15 × 15 cells around, without the cluster, drawn towards the model's. Slopes, ridges, cliffs
    and shores have no such step on all sides, and summits have a small one.

    A cell most of whose known neighbours stay, and are in the median less than a third of that step
    away from it, is none: the ends of valleys and ridges between voids are such cells.

    Beside voids, rays step over one void cell; with fewer than eight rays ``outlier_factor`` grows
    by √(8 / rays), and cells with ground on fewer than five are not judged: a raster's corners are
    not. Where the rays end level, as in water, every pit is a well, and what rises is a rock unless
    it is steeper on all sides than 2.5 metres up per metre across.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations.
    void : (H, W) bool array, optional
        True where there is no elevation. Cells that are not finite are voids in any case.
    options : FaultOptions, optional
        Its fields can as well be given as keywords of their own.
    model : FaultModel, optional
        What is usual; a tile of a mosaic is given the mosaic's. Default: learned from ``values``.
    pixel_size : float, (float, float) or (array, array), optional
        Ground metres per cell: both ways, or east-west and north-south, each one number or one by
        row. Default: 1.
    unit : float
        Metres in the unit of the elevations.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress, optional

    Returns
    -------
    (H, W) bool array
        True at outliers. It depends on the model and on the cells within `REACH`.

    Raises
    ------
    InputError
        If the arrays do not fit, or an option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> z = np.add.outer(np.arange(40.0), 2 * np.arange(40.0))
    >>> z[20, 20] += 50
    >>> np.argwhere(find_outliers(z))
    array([[20, 20]])
    """
    from demsmith.core.faults._outliers import keep_those_among_their_like, mark_outliers

    options = options_from(FaultOptions, options, parameters, "find_outliers()")
    values, void = checked(values, void)
    rock = _STEEPEST_ROCK * np.minimum(*metres(values.shape, pixel_size)) / unit
    model = _Window(values, void).model() if model is None else model
    mask = np.zeros(values.shape, bool)
    factor, least = float(options.outlier_factor), options.outlier_height / unit
    _by_rows(
        mark_outliers, values, void, model.roughness, factor, least, rock, mask,
        threads=threads, progress=progress,
    )  # fmt: skip
    keep_those_among_their_like(values, void, np.argwhere(mask), mask)
    return mask


def find_untrusted_rims(
    values, void, *, options=None, model=None, threads=None, progress=SILENT, **parameters
):
    """Find the known cells beside voids that are not to be believed.

    With ``erode`` these are all cells within so many of a void, diagonally too. With
    ``noisy_rims`` they are those that touch a void, be it by a corner, and lie farther from the
    middle of their opposite neighbours (the median over the pairs that are known) than five times
    the roughness around, as `find_outliers` takes it. Water is level, so its shores stay.

    Parameters are those of `find_outliers`.

    Returns
    -------
    (H, W) bool array
        It depends on the model and on the cells within `REACH`, or ``erode`` if that is more.

    Raises
    ------
    InputError
        If the arrays do not fit, or an option is out of range.
    Cancelled
        If ``progress`` asks to stop.
    """
    from demsmith.core.faults._outliers import mark_noisy

    options = options_from(FaultOptions, options, parameters, "find_untrusted_rims()")
    values, void = checked(values, void)
    mask = _beside(void, options.erode)
    if options.noisy_rims and void.any():
        model = _Window(values, void).model() if model is None else model
        noisy = np.zeros(values.shape, bool)
        rim = _beside(void, 1)
        _by_rows(
            mark_noisy, values, void, model.roughness, _NOISY, rim, noisy,
            threads=threads, progress=progress,
        )  # fmt: skip
        mask |= noisy
    checkpoint(progress, 1.0)
    return mask


@dataclass(frozen=True)
class _Window:
    values: np.ndarray
    void: np.ndarray

    def model(self):
        return learn_faults([self])


def _misfits(values, void):
    from demsmith.core.faults._outliers import sample_misfits

    out = np.empty(values.size, np.float32)
    return out[: sample_misfits(values, void, out)]


def _by_rows(kernel, values, void, *more, threads, progress):
    rows = values.shape[0]
    parallel.run(
        [
            partial(kernel, values, void, begin, min(begin + _BLOCK_ROWS, rows), *more)
            for begin in range(0, rows, _BLOCK_ROWS)
        ],
        threads=threads,
        progress=progress,
    )


def _beside(void, cells):
    """Give the known cells within so many cells of a void."""
    from scipy.ndimage import maximum_filter

    if cells == 0:
        return np.zeros(void.shape, bool)
    return maximum_filter(void, size=2 * cells + 1, mode="constant", cval=False) & ~void
