"""How much of its sky the terrain leaves to each cell: the sky-view factor.

The factor is the share that reaches a surface of the light of an evenly bright sky, 1 under the
open sky. A surface sees no sky below its horizon, and none behind itself.

References
----------
Dozier, J., and Frew, J. (1990), Rapid calculation of terrain parameters for radiation modeling
from digital elevation data, IEEE Trans. Geosci. Remote Sens. 28(5), 963-969, equation 7b.
"""

import math
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span
from demsmith.core.solar.horizon import EARTH_RADIUS, REFRACTION, HorizonSweep

_BLOCK_CELLS = 1 << 15  # what is made of them on the way stays in a processor's cache


def sky_view_factor(
    z, void, dx, dy, *, azimuths=32, tilted=True, curvature=True, refraction=REFRACTION,
    radius=EARTH_RADIUS, threads=None, progress=SILENT,
):  # fmt: skip
    """Give the sky-view factor of each cell.

    Parameters
    ----------
    z, void, dx, dy, curvature, refraction, radius
        As for `horizon_tangent`.
    azimuths : int
        In how many directions, evenly around, the horizon is looked for.
    tilted : bool
        Whether of the terrain's own surface in each cell, by its gradient (Horn 1981), or else of
        a level surface there. An endless slope of angle b has ``(1 + cos b) / 2`` of its own.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    (H, W) float32 array
        0 to 1; NaN in voids.

    Raises
    ------
    InputError
        If arrays do not fit each other, or a number is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    The middle of a crater whose rim stands 45° high sees half of the sky's light:

    >>> row, column = np.mgrid[:101, :101] - 50
    >>> crater = 40.0 * (np.hypot(row, column) >= 40)
    >>> metres = np.ones(101)
    >>> print(sky_view_factor(crater, None, metres, metres, tilted=False)[50, 50].round(1))
    0.5
    """
    if azimuths < 1:
        raise InputError(f"azimuths is {azimuths}; it must be at least 1")
    sweep = HorizonSweep(z, void, dx, dy, curvature=curvature, refraction=refraction, radius=radius)
    rise = sweep.gradient(threads=threads, progress=Span(progress, 0, 0.02)) if tilted else None
    total = np.zeros(sweep.shape, np.float32)
    for n in range(azimuths):
        azimuth = 360.0 * n / azimuths
        part = Span(progress, 0.02 + 0.98 * n / azimuths, 0.02 + 0.98 * (n + 1) / azimuths)
        tangent = sweep.tangent(azimuth, threads=threads, progress=Span(part, 0, 0.75))
        _add_all(total, tangent, rise, azimuth, threads, Span(part, 0.75, 1))
    total /= np.float32(azimuths)
    return total


def _add_all(total, tangent, rise, azimuth, threads, progress):
    """Add what is seen towards one azimuth, by blocks of rows."""
    rows, columns = total.shape
    step = max(1, _BLOCK_CELLS // columns)
    blocks = [slice(row, row + step) for row in range(0, rows, step)]
    add = _add_level if rise is None else partial(_add_tilted, rise, math.radians(azimuth))
    parallel.run(
        [partial(add, block, total, tangent) for block in blocks], threads=threads,
        progress=progress,
    )  # fmt: skip


def _add_level(block, total, tangent):
    """Add the share of a level surface: the squared cosine of the horizon's elevation."""
    total[block] += 1 / (1 + tangent[block] ** 2)


def _add_tilted(rise, azimuth, block, total, tangent):
    """Add the share of a tilted surface (Dozier and Frew 1990, equation 7b)."""
    east, north = (part[block] for part in rise)
    own = np.float32(math.sin(azimuth)) * east + np.float32(math.cos(azimuth)) * north
    high = np.maximum(tangent[block], own)  # the surface hides what is behind it
    share = 1 / (1 + high * high)
    # Angle from the zenith down to the horizon, less its sine times its cosine.
    wedge = np.arctan2(np.float32(1), high) - high * share
    total[block] += (share - own * wedge) / np.sqrt(1 + east * east + north * north)
