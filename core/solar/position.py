"""Where the sun is: its direction from the Earth, and its altitude and azimuth at a place.

By NREL's Solar Position Algorithm (Reda and Andreas 2004, "Solar position algorithm for solar
radiation applications", Solar Energy 76(5)) as in pvlib, good to 0.0003°. It is asked once for each
instant; the rest is turning one vector into the frame of each place.

Altitudes are the true, geometric ones of the sun's middle: the bending of light in the air, which
lifts the sun by 0.5° at the horizon and 0.1° at 10°, counts in the length of its path through the
air (`atmosphere`) alone. So it is in r.sun, and so the day is not lengthened.
"""

from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.solar import _pvlib

PARALLAX = 4.2635e-5
"""Equatorial radius of the Earth by the mean distance of the sun: by as much the sun is lower for
one on the ground than for the Earth's middle [rad at the horizon]."""

_FIRST, _LAST = np.datetime64("1700-01-01"), np.datetime64("2200-01-01")


@dataclass(frozen=True, eq=False)
class Sun:
    """The sun at some instants.

    Attributes
    ----------
    direction : (M, 3) float64 array
        Unit vectors from the Earth's middle to the sun, in the earth-fixed frame of
        `demsmith.core.raster.Places`.
    distance : (M,) float64 array
        In astronomical units.
    """

    direction: np.ndarray
    distance: np.ndarray

    @property
    def longitude(self):
        """Longitude over which the sun stands [degrees, -180 to 180]; there it is solar noon."""
        return np.degrees(np.arctan2(self.direction[:, 1], self.direction[:, 0]))


def sun_at(times):
    """Find the sun.

    Parameters
    ----------
    times : (M,) array of datetime64
        UTC.

    Returns
    -------
    Sun

    Raises
    ------
    InputError
        If a time is outside the years 1700 to 2199.
    """
    import pandas

    solarposition = _pvlib.load("solarposition")

    times = np.asarray(times, "datetime64[ms]")
    if times.size and (times.min() < _FIRST or times.max() >= _LAST):
        raise InputError("the sun's place is computed for the years 1700 to 2199 only")
    index = pandas.DatetimeIndex(times.astype("datetime64[ns]"), tz="UTC")
    # As seen where longitude 0° crosses the equator, up, east and north are the frame's axes.
    seen = solarposition.get_solarposition(index, 0.0, 0.0, method="nrel_numpy")
    distance = np.asarray(solarposition.nrel_earthsun_distance(index), np.float64)
    altitude, azimuth = (
        np.radians(seen[angle].to_numpy(np.float64)) for angle in ("elevation", "azimuth")
    )
    direction = np.stack(
        [
            np.sin(altitude) + PARALLAX / distance,  # from the Earth's middle, not its surface
            np.cos(altitude) * np.sin(azimuth),
            np.cos(altitude) * np.cos(azimuth),
        ],
        axis=1,
    )
    return Sun(direction / np.linalg.norm(direction, axis=1, keepdims=True), distance)


def altitude_azimuth(sun, frame):
    """Give the sun's altitude and azimuth at places.

    Parameters
    ----------
    sun : Sun
        At M instants.
    frame : (..., 3, 3) array
        East, north and up of places, as of `demsmith.core.raster.Places`.

    Returns
    -------
    altitude, azimuth : (M, ...) float64 arrays
        Degrees: true altitude above the horizontal, and azimuth clockwise from the frame's north,
        from 0 to 360.
    """
    east, north, up = np.moveaxis(np.tensordot(sun.direction, frame, axes=([1], [-1])), -1, 0)
    parallax = (PARALLAX / sun.distance).reshape((-1,) + (1,) * (up.ndim - 1))
    altitude = np.degrees(np.arctan2(up - parallax, np.hypot(east, north)))
    return altitude, np.degrees(np.arctan2(east, north)) % 360.0
