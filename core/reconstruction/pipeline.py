"""Reconstruction of ground in memory: plan, find the voids, fill them part by part."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span
from demsmith.core.reconstruction.doubts import void_runs
from demsmith.core.reconstruction.extents import VoidExtents, chunks, connect
from demsmith.core.reconstruction.filling import fill_part
from demsmith.core.reconstruction.parts import parts_of, too_large
from demsmith.core.reconstruction.plan import Plan, make_plan
from demsmith.core.reconstruction.training import count_voids, gathered_counts

_SIDE = (8192, 8192)
"""Rows and columns of the chunks in which ground in memory is worked on."""


@dataclass(frozen=True)
class Reconstructed:
    """What the voids of a ground were filled with.

    Attributes
    ----------
    plan : Plan
    extents : VoidExtents
    voids : (M,) int64 array
        The numbers of those that were to be filled.
    patches : tuple of Patch
    large : (N,) int64 array
        Those that were left because they need more ground in memory than can be promised.
    outliers : (K, 2) int32 array
        Rows and columns of the spikes and wells that are voids now.
    """

    plan: Plan
    extents: VoidExtents
    voids: np.ndarray
    patches: tuple
    large: np.ndarray
    outliers: np.ndarray


def reconstruct_ground(
    ground, options, *, auxiliaries=(), target=None, side=_SIDE, threads=None, progress=SILENT
):
    """Fill the voids of a ground.

    Parameters
    ----------
    ground : Ground
    options : ReconstructOptions
    auxiliaries : sequence of path
        Rasters, or folders of tiles, to fill from, in the order of trust.
    target : (slice, slice), optional
        Rows and columns; only voids that have a cell there are filled. Default: all.
    side : (int, int)
        Rows and columns of the chunks in which the work is done. The result does not depend on
        it.
    threads : int, optional
        Default: one for each core. Neither on these.
    progress : Progress

    Returns
    -------
    Reconstructed

    Raises
    ------
    InputError
        If nothing is known.
    Cancelled
        If ``progress`` asks to stop.
    """
    cut = chunks(ground.shape, side)
    counts = gathered_counts(ground.shape, [count_voids(ground, *each) for each in cut], cut)
    plan = make_plan(
        ground, counts, options, auxiliaries=auxiliaries, threads=threads,
        progress=Span(progress, 0, 0.3),
    )  # fmt: skip
    found = [
        void_runs(ground, plan, *chunk, threads=threads, progress=part)
        for chunk, part in zip(cut, _shared(Span(progress, 0.3, 0.38), len(cut)), strict=True)
    ]
    extents = joined(found, progress=Span(progress, 0.38, 0.4))
    voids = np.arange(len(extents)) if target is None else extents.meeting(*target)
    parts, large = divided(ground, plan, extents, voids, side)
    filling = _shared(Span(progress, 0.4, 1), len(parts))
    patches = [
        fill_part(ground, plan, part, threads=threads, progress=progress)
        for part, progress in zip(parts, filling, strict=True)
    ]
    outliers = np.concatenate([each.outliers for each in found])
    return Reconstructed(plan, extents, voids, tuple(patches), large, outliers)


def _shared(progress, count):
    """Cut a progress into as many even parts."""
    return [Span(progress, number / count, (number + 1) / count) for number in range(count)]


def divided(ground, plan, extents, voids, side):
    """Cut the filling of voids into parts; tell which voids are too large for it.

    Returns
    -------
    parts : list of Part
    large : (M,) int64 array
    """
    large = too_large(extents, voids, ground.shape, plan.margin)
    return parts_of(extents, voids[~large], ground.shape, side, plan.margin), voids[large]


def joined(found, *, progress=SILENT):
    """Join what `void_runs` found in every chunk.

    Parameters
    ----------
    found : list of FoundVoids
    progress : Progress

    Returns
    -------
    VoidExtents

    Raises
    ------
    InputError
        If nothing is known.
    """
    extents = connect([each.runs for each in found], progress=progress)
    if extents.cells.sum() == sum(each.cells for each in found):
        raise InputError("every cell is a void; there is nothing to fill from")
    return extents
