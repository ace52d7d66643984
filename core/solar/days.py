"""Solar days: when the sun passes a place's meridian, and the instants of a day around it."""

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.solar.position import sun_at

_HOUR = 3.6e6  # milliseconds


def solar_noons(days, longitude):
    """Find when the sun passes the meridian of a place.

    Parameters
    ----------
    days : sequence of datetime.date
        In the local mean time of the place.
    longitude : float
        Degrees, from -180 to 180: it tells on which side of the date line the days are counted.

    Returns
    -------
    (M,) array of datetime64[ms]
        UTC, good to a second.

    Examples
    --------
    Early in November the sun is a quarter of an hour ahead of the clock:

    >>> import datetime
    >>> solar_noons([datetime.date(2024, 11, 3)], 0.0)[0].item().time().isoformat("minutes")
    '11:43'
    """
    mean_noon = (12 - longitude / 15) * _HOUR
    guess = np.array(days, "datetime64[ms]") + np.timedelta64(round(mean_noon), "ms")
    ahead = (sun_at(guess).longitude - longitude + 180) % 360 - 180
    return guess + np.round(ahead / 15 * _HOUR).astype("timedelta64[ms]")


def instants_of(days, longitude, step):
    """List the middles of the time steps of solar days, each of 24 h around its solar noon.

    Parameters
    ----------
    days, longitude
        As of `solar_noons`.
    step : float
        Hours; made shorter if needed so that a whole number of steps make 24 h.

    Returns
    -------
    instants : (days * steps,) array of datetime64[ms]
        UTC.
    step : float
        Hours.

    Raises
    ------
    InputError
        If there is no day.
    """
    if len(days) == 0:
        raise InputError("give one day at least")
    count = int(np.ceil(24 / step - 1e-9))
    offsets = np.round(((np.arange(count) + 0.5) * 24 / count - 12) * _HOUR)
    noons = solar_noons(days, longitude)
    return (noons[:, None] + offsets.astype("timedelta64[ms]")).ravel(), 24 / count
