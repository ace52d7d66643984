"""An auxiliary raster made ready to fill from: opened, aligned, and its delta learned."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from demsmith.core.auxiliary.alignment import Alignment, align
from demsmith.core.auxiliary.resampling import Resampler
from demsmith.core.progress import SILENT, Span
from demsmith.core.raster.tileset import open_tiles

_OUTLIER, _LEAST_SPREAD = 10.0, 0.1
"""A delta beyond so many spreads is a fault of one of the two, and nothing to learn from; a
spread below this [m] is that of two copies of the same."""

_SHARES = np.array([0.01, 0.99, 0.0])
"""Of each of `demsmith.core.voids.accurate.ESTIMATORS`, for the covariance alone; where a void is
too large for it, the first has all."""


@dataclass(frozen=True)
class Surface:
    """An auxiliary raster, how it lies on the target, and what their difference is like.

    Attributes
    ----------
    resampler : Resampler
    alignment : Alignment
    model : object or None
        What the void engine learned from the delta; None if the auxiliary is refused.
    """

    resampler: Resampler
    alignment: Alignment
    model: Any = None


def open_auxiliary(paths, grid, *, unit=1.0, rules=None, progress=SILENT):
    """Open an auxiliary raster, or tiles of one, to be seen on a target's cells.

    Parameters
    ----------
    paths : sequence of str or path-like
        Anything `demsmith.read_raster` reads, of any CRS and resolution; several files must lie
        on one grid.
    grid : Grid
        The target's.
    unit : float
        Metres in the target's unit of height. An auxiliary that does not tell its own is thought
        to have the same.
    rules : demsmith.core.raster.CellRules, optional
        Which of the auxiliary's cells are voids.
    progress : Progress

    Returns
    -------
    Resampler

    Raises
    ------
    InputError
        If a file cannot be opened, has no georeference, or does not fit the others.
    """
    tiles = open_tiles(paths, rules=rules, progress=progress)
    return Resampler(tiles, grid, tiles.unit / unit if tiles.unit else 1.0)


def learn_surface(windows, resampler, *, engine, threads=None, progress=SILENT):
    """Align an auxiliary raster and learn what is left between it and the target.

    Parameters
    ----------
    windows : sequence of Window
        Training windows of the target, see `demsmith.core.voids.accurate`.
    resampler : Resampler
        From `open_auxiliary`.
    engine : module
        With ``learn`` and ``estimate``: `demsmith.core.voids.accurate`.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    Surface

    Raises
    ------
    InputError
        If the auxiliary cannot be read.
    Cancelled
        If ``progress`` asks to stop.
    """
    alignment = align(windows, resampler, threads=threads, progress=Span(progress, 0, 0.5))
    if not alignment.accepted:
        return Surface(resampler, alignment)
    deltas = [_delta(window, resampler, alignment) for window in windows]
    known = [window for window in deltas if not window.void.all()]
    model = engine.learn(known, threads=threads, progress=Span(progress, 0.5, 1))
    return Surface(resampler, alignment, _of_delta(model))


def _of_delta(model):
    """Have the delta filled by what is expected under its covariance, where trials speak for it.

    A blend's shares are drawn towards those that are usual for ground. But the delta has no ridges
    and valleys to go on: where the covariance alone did as well as the blend in artificial voids,
    it did better in all others of real pairs. Voids too large for it are left to MCMD.
    """
    _, learned, _, blend = model.rmse.T
    alone = model.tried.astype(bool) & (learned <= blend)
    better = np.divide(learned, blend, out=np.ones_like(blend), where=alone & (blend > 0))
    weights = np.where(alone[:, None], _SHARES, model.weights)
    return replace(model, weights=weights, scale=model.scale * better)


def _delta(window, resampler, alignment):
    """Give the training window of target less aligned auxiliary."""
    aligned, unknown = alignment.apply(resampler, window.row, window.column, window.void.shape)
    delta = window.values - aligned
    farthest = _OUTLIER * max(alignment.spread_after, _LEAST_SPREAD)
    void = window.void | unknown | (np.abs(delta) > farthest)
    return replace(window, values=np.where(void, 0.0, delta), void=void)
