"""Thinning an elevation array: a share of its cells is kept, exactly as they are."""

import math
from dataclasses import dataclass

import numpy as np

from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.options import options_from
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.thinning.detectors import random_scores, ridge_scores, sobel_scores
from demsmith.core.thinning.options import ThinOptions
from demsmith.core.thinning.selection import largest


@dataclass(frozen=True, eq=False)
class Thinned:
    """A thinned raster.

    Attributes
    ----------
    values : (H, W) masked array
        The input's values, masked but for the kept cells; `fill_voids` rebuilds a terrain from it.
    kept : (H, W) bool array
    cells_known, cells_kept : int
        Number of cells that had an elevation, and that were kept.
    """

    values: np.ma.MaskedArray
    kept: np.ndarray
    cells_known: int
    cells_kept: int

    @property
    def share(self):
        """Kept cells by known cells."""
        return self.cells_kept / self.cells_known


def thin(
    values, void=None, *, options=None, pixel_size=None, threads=None, progress=SILENT, **parameters
):
    """Thin an elevation array: keep a share of its known cells.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array, optional
        True where there is no elevation. Cells that are not finite are voids in any case, and
        those of a masked array where this is not given.
    options : ThinOptions, optional
        How many and which; its fields can as well be given as keywords of their own.
    pixel_size : float, (float, float) or (array, array), optional
        Ground metres per cell: both ways, or east-west and north-south, each one number or one by
        row. Default: 1.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress, optional

    Returns
    -------
    Thinned
        ``floor(share * known cells)`` cells are kept, but at least one. Where voids meet the
        ground, detectors see the smooth surface of `fill_voids`, and beyond the raster's edge its
        slopes going on, so that neither counts as a shape.

    Raises
    ------
    InputError
        If the arrays do not fit, nothing is known, or an option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    Of a cliff, both sides of its edge are kept:

    >>> cliff = np.where(np.arange(20) < 10, 0, 50) * np.ones((20, 1))
    >>> thinned = thin(cliff, share=0.1, detector="sobel")
    >>> thinned.cells_kept, thinned.kept[:, 9:11].all()
    (40, True)
    """
    options = options_from(ThinOptions, options, parameters, "thin")
    values, void = checked(values, void)
    sizes = metres(values.shape, pixel_size)
    known = ~void
    cells = int(np.count_nonzero(known))
    if not cells:
        raise InputError("every cell is a void; there is nothing to keep")
    scores = _scores(values, known, sizes, options, threads, Span(progress, 0, 0.7))
    count = max(1, math.floor(options.share * cells))
    kept = _keep(scores, known, count, options.seed, threads, Span(progress, 0.7, 1))
    return Thinned(np.ma.MaskedArray(values, ~kept), kept, cells, count)


def _scores(values, known, sizes, options, threads, progress):
    if options.detector == "random":
        return random_scores(values.shape, options.seed, threads=threads, progress=progress)
    elevation = _without_voids(values, known, sizes, threads, Span(progress, 0, 0.4))
    running = dict(threads=threads, progress=Span(progress, 0.4, 1))
    if options.detector == "sobel":
        return sobel_scores(elevation, sizes, **running)
    return ridge_scores(elevation, known, sizes, options.share, **running)


def _without_voids(values, known, sizes, threads, progress):
    """Give elevations everywhere, so that derivatives can be taken beside a void too."""
    if known.all():
        return values
    from demsmith.core.voids import fill_voids

    return fill_voids(
        values, ~known, method="mcmd", pixel_size=sizes, float_output=True, threads=threads,
        progress=progress,
    ).values  # fmt: skip


def _keep(scores, known, count, seed, threads, progress):
    """Keep the largest scores; ties go by chance, and if it ties as well, the first wins."""
    kept, tied, places = largest(scores, known, count, progress=Span(progress, 0, 0.4))
    if places < np.count_nonzero(tied):
        chance = random_scores(
            scores.shape, (seed, 1), threads=threads, progress=Span(progress, 0.4, 0.6)
        )
        lucky, tied, places = largest(chance, tied, places, progress=Span(progress, 0.6, 1))
        kept |= lucky
    kept.flat[np.flatnonzero(tied)[:places]] = True
    checkpoint(progress, 1)
    return kept
