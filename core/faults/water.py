"""Water beside voids: the sea and lakes go on at their level, and no bank lies below them."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.elevations import checked
from demsmith.core.faults.options import FaultOptions
from demsmith.core.options import options_from
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT

WATER_REACH = 64
"""What is water at a void depends on the ground within so many cells of its bounding box."""

_TOLERANCE = 1.0  # metres: SRTM's water is level, its shores are whole metres
_SHARE = 0.9  # of a rim: a void in a lake may touch a little of its shore
_PART_CELLS = 100_000


@dataclass(frozen=True)
class Water:
    """The water beside each void: arrays of length V.

    Attributes
    ----------
    level : float64
        Elevation of the water, NaN where there is none.
    floor : float64
        How low the void may be filled, NaN where there is no water: the water's level, or, where
        more than a tenth of the rim lies below that, the lowest elevation of the rim.
    whole : bool
        Whether all of the void is water.
    """

    level: np.ndarray
    floor: np.ndarray
    whole: np.ndarray


def find_water(
    values, void, voids, *, options=None, pixel_size=None, unit=1.0, threads=None,
    progress=SILENT, **parameters,
):  # fmt: skip
    """Find out which voids lie in water or beside it.

    Water is level ground: side-connected known cells of exactly the same elevation that are
    together at least ``water_area``, or 4096 cells. It is looked at as far as `WATER_REACH` from a
    void's bounding box. If waters of several levels touch a void, that of the longest shore counts.
    A void is water as a whole if nine tenths of its rim, the known cells that share a side with
    it, are within a metre of the level.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations.
    void : (H, W) bool array
    voids : demsmith.core.voids.Voids
        As `demsmith.core.voids.find_voids` found them in ``void``.
    options : FaultOptions, optional
        Its fields can as well be given as keywords of their own; ``water_area`` is read.
    pixel_size : float, (float, float) or (array, array), optional
        Ground metres per cell, see `demsmith.core.voids.fill_voids`.
    unit : float
        Metres in the unit of the elevations.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    Water

    Raises
    ------
    InputError
        If the arrays do not fit, or an option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> from demsmith.core.voids import find_voids
    >>> z = np.full((60, 60), 7.0)
    >>> void = np.zeros(z.shape, bool)
    >>> void[20:30, 20:24] = True
    >>> find_water(z, void, find_voids(void), pixel_size=90.0).level
    array([7.])
    """
    from demsmith.core.faults._water import survey_water

    options = options_from(FaultOptions, options, parameters, "find_water()")
    values, void = checked(values, void)
    cell_area = np.multiply(*metres(values.shape, pixel_size))
    level, floor = np.empty(len(voids)), np.empty(len(voids))
    whole = np.empty(len(voids), bool)
    _by_voids(
        voids, survey_water, values, void, voids.runs, voids.first_run, cell_area,
        float(options.water_area), _TOLERANCE / unit, _SHARE, level, floor, whole,
        threads=threads, progress=progress,
    )  # fmt: skip
    return Water(level, floor, whole)


def hold_water(work, voids, water, *, threads=None, progress=SILENT):
    """Hold filled voids at the level of the water in them, in place.

    A void that is all water gets its level. Of another that touches water, what was filled at or
    below the water's level becomes water; if much of its rim lies lower, as below a dam, it is
    only kept from lying below the lowest of its rim.

    Parameters
    ----------
    work : (H, W) float array
        Elevations, filled; voids that all are water need not be.
    voids : demsmith.core.voids.Voids
    water : Water
        Of these voids, as `find_water` found it.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    (H, W) bool array
        The void cells that are water now.

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop; ``work`` is then changed in part.
    """
    from demsmith.core.faults._water import hold

    mask = np.zeros(work.shape, bool)
    _by_voids(
        voids, hold, work, voids.runs, voids.first_run, water.level, water.floor, water.whole, mask,
        threads=threads, progress=progress,
    )  # fmt: skip
    return mask


def _by_voids(voids, kernel, *more, threads, progress):
    parts = int(voids.cells.sum()) // _PART_CELLS + 1
    parallel.run(
        [
            partial(kernel, begin, end, *more)
            for begin, end in parallel.even_spans(voids.cells, parts)
        ],
        threads=threads,
        progress=progress,
    )
