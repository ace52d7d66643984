"""Filling voids by the blend of estimators that a model trusts."""

from typing import NamedTuple

import numpy as np

from demsmith.core.mcmd import relax_voids
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, Span
from demsmith.core.voids import sources
from demsmith.core.voids.accurate.blending import blend, shares_of, sigma_of, tensions_of
from demsmith.core.voids.accurate.estimates import estimate_surfaces
from demsmith.core.voids.labelling import survey_rims

BLEND = 3
"""The method of a void none of whose estimators has three quarters; below it, that estimator's."""

SOURCE_OF_METHOD = np.array(
    [sources.FILLED, sources.COVARIANCE, sources.STRUCTURED, sources.BLEND], np.uint8
)
"""What a source map says of each method."""

_MOSTLY = 0.75


class Choices(NamedTuple):
    """How each void was filled.

    Attributes
    ----------
    method : (N,) uint8 array
        Number of the estimator with most to say, or `BLEND`.
    error : (N,) float64 array
        Root mean square of the error [m] to be expected.
    shares : (N, 3) float64 array
        Of each of `demsmith.core.voids.accurate.ESTIMATORS`.
    """

    method: np.ndarray
    error: np.ndarray
    shares: np.ndarray


def estimate(
    work, void, voids, selected, model, *, sigma=None, pixel_size=None, tension=None, lattice=None,
    threads=None, progress=SILENT,
):  # fmt: skip
    """Fill voids in place.

    A void's surface depends on the model, the lattice and the known ground within `margin` cells
    of its bounding box: on no other void, nor on the number of threads. It leaves the range of the
    void's rim by no more than the rim's own relief and what the mean slope of the ground around
    would climb on the way from the rim; within a level rim it is level.

    Parameters
    ----------
    work : (H, W) float32 or float64 array, C order
        Elevations [m]; the cells of the selected voids are overwritten.
    void : (H, W) bool array
    voids : Voids
        Those of ``void``.
    selected : (N,) int array
        Numbers of the voids to fill.
    model : Model
    sigma : (H, W) float32 array, optional
        Receives the standard error [m] to be expected in the cells that are filled.
    pixel_size : optional
        Ground metres per cell, see `demsmith.core.mcmd.lattice.metres`.
    tension : float, optional
        Distance [m] over which bending gives way to stretching in MCMD; default: 12 rows.
    lattice : Lattice, optional
        MCMD's. Default: one that begins at the raster's first cell.
    threads : int, optional
    progress : Progress

    Returns
    -------
    Choices

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop; ``work`` is then half filled.
    """
    selected = np.asarray(selected, np.int64)
    if not selected.size:
        return Choices(np.empty(0, np.uint8), np.empty(0), np.empty((0, BLEND)))
    dx, dy = metres(work.shape, pixel_size)
    rims = survey_rims(work, void, voids, threads=threads, progress=Span(progress, 0, 0.02))
    relax_voids(
        work, voids, selected, rims.mean[selected], pixel_size=(dx, dy), tension=tension,
        lattice=lattice, threads=threads, progress=Span(progress, 0.02, 0.1),
    )  # fmt: skip
    found = estimate_surfaces(
        work, void, voids, selected, model.covariance, dx=dx, dy=dy,
        tension=tensions_of(model.tension, voids.cells[selected]), threads=threads,
        progress=Span(progress, 0.1, 1),
    )  # fmt: skip
    size, void_of = voids.cells[selected], found.void_of
    at_edge = rims.touches_edge[selected]
    shares = shares_of(model.weights, model.at_edge, size, at_edge)
    rows, columns = np.divmod(found.cells, work.shape[1])
    surface = blend(found.surfaces, shares, void_of)
    work[rows, columns] = np.clip(surface, *_limits(found, rims, selected))
    error = sigma_of(model, found, size, at_edge)
    if sigma is not None:
        sigma[rows, columns] = error
    most = shares.argmax(axis=1)
    return Choices(
        np.where(shares.max(axis=1) >= _MOSTLY, most, BLEND).astype(np.uint8),
        np.sqrt(np.bincount(void_of, error**2, selected.size) / size),
        shares,
    )


def _limits(found, rims, selected):
    """Give the lowest and highest elevation that each cell may have."""
    void_of = found.void_of
    relief = (rims.high - rims.low)[selected]
    slope = np.where(relief > 0, found.steepness, 0.0)  # within a level rim lies water
    beyond = relief[void_of] + slope[void_of] * found.distance
    return rims.low[selected][void_of] - beyond, rims.high[selected][void_of] + beyond
