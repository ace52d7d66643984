"""The horizon that terrain makes, by sweeps over the whole raster towards one azimuth each.

A sweep takes one row (or column) after the other, beginning with the one nearest to the sun, along
lines that lean as rays do. The tangent point of each step of a line is the ground one step towards
the sun, the tangent point of that, or the tangent point of that one, and so on (Dozier & Frew
1990; Timonen & Westerholm 2010). So the work is proportional to the number of cells, however far
the horizon is. From each cell the tangent points of the two lines beside it are looked at on the
cell's own ray: the ground there is interpolated, and distance and direction follow the pixel size
of each row. Rays that cross columns often are looked at between the rows, too.

On 3″ tiles of three mountain ranges the horizon is on average within 0.06° of rays marched in
eighths of a cell over the bilinear surface, within 1.1° in 99 % of cells, and 99.6 % of shadows
agree at any altitude of the sun from 5° to 60°, whatever the azimuth. The shadow of a cliff oblique
to the rays is off by about a cell at most; along the raster's edge, where one of the two lines is
outside, by more.

The horizon between two azimuths may be interpolated: with the mean of the tangents at both ends of
a sector, shadows agree to 99 % with those of a sweep in its middle if the sector is 3° wide and the
sun 5° high, 5° wide and 10°, or 10° wide and 20° high. The nearest of both alone would need
sectors a third as wide.

References
----------
Dozier, J., and Frew, J. (1990), Rapid calculation of terrain parameters for radiation modeling
from digital elevation data, IEEE Trans. Geosci. Remote Sens. 28(5), 963-969.

Timonen, V., and Westerholm, J. (2010), Scalable height field self-shadowing, Computer Graphics
Forum 29(2), 723-731.
"""

import math
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, Span

EARTH_RADIUS = 6_371_008.8
"""Mean radius of the Earth [m]."""

REFRACTION = 0.13
"""Gauss's coefficient of the refraction of light near the ground."""

PAD = 2
"""Void columns on both sides of the rows that the kernel reads."""

# From so many columns a row on, rays are looked at between rows, too.
_SLANT = 0.25


class HorizonSweep:
    """A terrain, prepared for sweeps towards any azimuth.

    Parameters
    ----------
    z : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array, or None
        True where there is no elevation: there the horizon is NaN, and no shadow is cast.
    dx, dy : (H,) arrays
        Ground metres per pixel of each row (`Grid.pixel_size_m`).
    curvature : bool
        Whether the earth falls away from the horizontal, by ``d**2 / (2 * radius)`` at distance d.
    refraction : float
        Share of that by which light follows the earth's curvature; surveyors take 0.13.
    radius : float
        Of the earth [m].

    Raises
    ------
    InputError
        If arrays do not fit each other, or a number is out of range.
    """

    def __init__(
        self, z, void, dx, dy, *, curvature=True, refraction=REFRACTION, radius=EARTH_RADIUS
    ):
        z, void = checked(z, void)
        self.shape = z.shape
        self._dx, self._dy = metres(z.shape, (dx, dy))
        if not (math.isfinite(refraction) and refraction < 1):
            raise InputError(f"refraction is {refraction}; it must be less than 1")
        if not radius > 0:
            raise InputError(f"radius is {radius}; it must be positive")
        self._sag = np.float32((1 - refraction) / (2 * radius) if curvature else 0.0)
        self._by_rows = _single(z, void)
        self._by_columns = None

    def gradient(self, *, threads=None, progress=SILENT):
        """Give the rise per metre of the ground to the east and north (`relief.gradient`)."""
        from demsmith.core.relief.gradient import gradient

        z = self._by_rows[:, PAD:-PAD]
        return gradient(z, np.isnan(z), self._dx, self._dy, threads=threads, progress=progress)

    def tangent(self, azimuth, *, threads=None, progress=SILENT):
        """Give the tangent of the horizon's elevation towards one azimuth.

        Parameters
        ----------
        azimuth : float
            Degrees clockwise from the direction in which rows count down: 0 is towards the first
            row, 90 towards the last column. That is from grid north where the first row is the
            northern one; other rasters must be flipped first.
        threads : int, optional
            Default: one for each core. The result does not depend on it.
        progress : Progress

        Returns
        -------
        (H, W) float32 array
            At least 0, as nothing is known of the ground beyond the raster; NaN in voids.

        Raises
        ------
        InputError
            If the azimuth is not finite.
        Cancelled
            If ``progress`` asks to stop.
        """
        if not math.isfinite(azimuth):
            raise InputError(f"azimuth is {azimuth}; it must be a number of degrees")
        east, north = _direction(azimuth)
        ratio = self._dy / self._dx
        down = abs(east) * np.median(ratio) <= abs(north)
        if down:
            z, backwards = self._by_rows, north < 0
            course = _down_rows(self._dx, self._dy, east, north)
            course = (course[:, ::-1] if backwards else course), _straight(self.shape[1])
        else:
            if self._by_columns is None:
                self._by_columns = _padded(self._by_rows[:, PAD:-PAD].T)
            z, backwards = self._by_columns, east > 0
            course = _straight(self.shape[1]), _along_columns(self._dx, self._dy, east, north)
        out = np.empty(self.shape, np.float32)
        columns = self.shape[1]
        strides = (columns, 1) if down else (1, columns)
        _sweep_all(z, backwards, course, self._sag, out, strides, threads, progress)
        return out


def horizon_tangent(
    z, void, dx, dy, azimuth, *, curvature=True, refraction=REFRACTION, radius=EARTH_RADIUS,
    threads=None, progress=SILENT,
):  # fmt: skip
    """Give the tangent of the horizon's elevation seen from each cell towards one azimuth.

    Parameters are those of `HorizonSweep` and `HorizonSweep.tangent`, which see also for what is
    returned and raised.

    Examples
    --------
    Towards the east, a wall 30 m high stands 20 m off the first cell:

    >>> z = np.array([[0.0, 0.0, 30.0]] * 2)
    >>> print(horizon_tangent(z, None, [10, 10], [10, 10], 90.0)[0].round(3))
    [1.5 3.  0. ]
    """
    swept = HorizonSweep(z, void, dx, dy, curvature=curvature, refraction=refraction, radius=radius)
    return swept.tangent(azimuth, threads=threads, progress=progress)


def horizons(
    z, void, dx, dy, azimuths, *, curvature=True, refraction=REFRACTION, radius=EARTH_RADIUS,
    threads=None, progress=SILENT,
):  # fmt: skip
    """Give the tangent of the horizon's elevation towards many azimuths.

    Parameters are those of `horizon_tangent`, but for ``azimuths``, a sequence of N degrees.

    Returns
    -------
    (N, H, W) float32 array
    """
    swept = HorizonSweep(z, void, dx, dy, curvature=curvature, refraction=refraction, radius=radius)
    azimuths = np.atleast_1d(np.asarray(azimuths, np.float64))
    out = np.empty((azimuths.size, *swept.shape), np.float32)
    for n, azimuth in enumerate(azimuths):
        part = Span(progress, n / azimuths.size, (n + 1) / azimuths.size)
        out[n] = swept.tangent(azimuth, threads=threads, progress=part)
    return out


def _direction(azimuth):
    """Give the components of an azimuth to the east and north, exact along the axes."""
    angle = math.radians(azimuth % 360)
    return tuple(0.0 if abs(part) < 1e-12 else part for part in (math.sin(angle), math.cos(angle)))


def _down_rows(dx, dy, east, north):
    """Describe the rays of a sweep by rows, as the kernel wants it, (4, H)."""
    aside, metres = dy / dx * (east / abs(north)), dy / abs(north)
    toward = -1 if north > 0 else 1  # rows by which a step goes
    return np.array([aside, _growth(dy / dx, toward), metres, _growth(metres, toward)], np.float32)


def _along_columns(dx, dy, east, north):
    """Describe the rays of a sweep by columns, (4, H)."""
    aside, metres = dx / dy * (-north / abs(east)), dx / abs(east)
    return np.array([aside, _growth(dx / dy, aside), metres, _growth(metres, aside)], np.float32)


def _growth(quantity, rows):
    """Half the relative change of a quantity by row over so many rows."""
    if quantity.size == 1:
        return np.zeros(1)
    return np.gradient(quantity) / quantity * rows / 2


def _straight(size):
    return np.repeat(np.array([[1], [0], [1], [0]], np.float32), size, axis=1)


def _sweep_all(z, backwards, course, sag, out, strides, threads, progress):
    """Sweep every strip; strips lean as the rays do."""
    from demsmith.core.solar._sweep import LANES, sweep

    along, across = (np.ascontiguousarray(part) for part in course)
    aside = along[0].astype(np.float64) * np.median(across[0])
    lean = -np.concatenate([[0.0], np.cumsum((aside[1:] + aside[:-1]) / 2)])
    slanting = np.abs(aside).mean() > _SLANT
    width = z.shape[1] - 2 * PAD
    how = (lean, z, backwards, along, across, slanting, sag, out.reshape(-1), strides)
    # The outer lines of a strip are the next ones' too.
    starts = range(-math.ceil(lean.max()) - 2, width - math.floor(lean.min()) + 1, LANES - 2)
    parallel.run(
        [partial(sweep, start, *how) for start in starts], threads=threads, progress=progress
    )


def _single(z, void):
    """Give elevations as float32, NaN in voids, precise to less than a millimetre."""
    known = z[~void]
    middle = 0.0
    if known.size and z.dtype != np.float32:
        middle = (float(known.min()) + float(known.max())) / 2
    single = (z - middle).astype(np.float32) if middle else z.astype(np.float32)
    single[void] = np.nan
    return _padded(single)


def _padded(z):
    out = np.full((z.shape[0], z.shape[1] + 2 * PAD), np.nan, np.float32)
    out[:, PAD:-PAD] = z
    return out
