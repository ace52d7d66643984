"""MCMD as an engine of reconstruction: nothing to learn, no uncertainty, but fast."""

from typing import NamedTuple

import numpy as np

from demsmith.core.mcmd import relax_voids
from demsmith.core.progress import SILENT
from demsmith.core.voids.labelling import survey_rims
from demsmith.core.voids.sources import FILLED


class Choices(NamedTuple):
    """By void, how it was filled and the error to expect: see `demsmith.core.voids.accurate`."""

    method: np.ndarray
    error: np.ndarray


SOURCE_OF_METHOD = np.array([FILLED], np.uint8)


def learn(windows, *, threads=None, progress=SILENT):
    """Learn nothing."""


def margin(height, width):
    """Give the cells around a void's bounding box that its filling may depend on.

    The coarsest step is the largest power of two within the void's extent, a stencil reaches two
    steps, and points that near an array's edge are rounded in another order.

    Examples
    --------
    >>> margin(5, 9)
    18
    """
    return (2 << (max(height, width).bit_length() - 1)) + 2


def estimate(
    work, void, voids, selected, model, *, sigma=None, pixel_size=None, lattice=None, threads=None,
    progress=SILENT,
):  # fmt: skip
    """Fill voids in place: parameters as in `demsmith.core.voids.accurate.estimate`."""
    rims = survey_rims(work, void, voids, threads=threads)
    relax_voids(
        work, voids, selected, rims.mean[selected], pixel_size=pixel_size, lattice=lattice,
        threads=threads, progress=progress,
    )  # fmt: skip
    return Choices(np.zeros(selected.size, np.uint8), np.full(selected.size, np.nan))
