"""The clear sky: how much of the sun's light comes through the air, directly and from the sky.

Three models, each by the sun's true altitude and the elevation of the ground. Both parts are told
as shares of the light above the atmosphere, on a plane facing the sun:

- ``linke``: the clear sky of the European Solar Radiation Atlas as r.sun uses it: Rigollier, Bauer
  and Wald 2000, "On the clear sky model of the ESRA", Solar Energy 68(1); Hofierka and Šúri 2002,
  "The solar radiation model for Open source GIS", equations 6 to 23; with the optical thickness of
  Kasten 1996 (Solar Energy 56(3)) and the air mass of Kasten and Young 1989 (Applied Optics 28).
- ``ineichen``: Ineichen and Perez 2002, "A new airmass independent formulation for the Linke
  turbidity coefficient", Solar Energy 73(3), by pvlib.
- ``none``: no air.
"""

from dataclasses import dataclass

import numpy as np

from demsmith.core.solar import _pvlib

# Light above the atmosphere at the mean distance of the sun [W/m²]: what each model was made with,
# and without air the value measured since (Gueymard 2018, "A reevaluation of the solar constant").
_CONSTANTS = {"linke": 1367.0, "ineichen": 1364.0, "none": 1361.1}

_SINES = 1024  # steps of the sine of the altitude, 0.06° at the horizon
_LEVEL = 200.0  # step of elevation [m]


@dataclass(frozen=True, eq=False)
class SkyTable:
    """A clear sky in a table, to be read by linear interpolation.

    Attributes
    ----------
    beam, diffuse : (S, L) float32 arrays
        As of `clear_sky`, at S sines of the sun's altitude, evenly from 0 to 1, and L elevations.
    lowest, level : float
        First elevation and the step to the next [m].
    constant : float
        Light above the atmosphere at the mean distance of the sun [W/m²].
    """

    beam: np.ndarray
    diffuse: np.ndarray
    lowest: float
    level: float
    constant: float


def clear_sky(model, sine, elevation, linke):
    """Give the shares of light that come through the air.

    Parameters
    ----------
    model : str
        ``linke``, ``ineichen`` or ``none``.
    sine : array_like
        Sine of the sun's true altitude, from 0 to 1.
    elevation : array_like
        Metres above the sea; they broadcast.
    linke : float
        Linke turbidity, for an air mass of 2.

    Returns
    -------
    beam : ndarray of float64
        Direct light on a plane facing the sun, by the light above the atmosphere.
    diffuse : ndarray of float64
        Light of the sky on a level plane, by the light above the atmosphere on a plane facing the
        sun.

    Examples
    --------
    >>> beam, diffuse = clear_sky("linke", np.sin(np.radians([10, 60])), 500.0, 3.0)
    >>> print(beam.round(2), diffuse.round(2))
    [0.36 0.71] [0.03 0.08]
    """
    sine, elevation = np.broadcast_arrays(
        np.asarray(sine, np.float64), np.asarray(elevation, np.float64)
    )
    if model == "none":
        return np.ones(sine.shape), np.zeros(sine.shape)
    return (_ineichen if model == "ineichen" else _linke)(sine, elevation, linke)


def sky_table(model, linke, lowest, highest):
    """Tabulate a clear sky for ground between two elevations.

    Parameters
    ----------
    model, linke
        As of `clear_sky`.
    lowest, highest : float
        Metres.

    Returns
    -------
    SkyTable
    """
    steps = max(1, int(np.ceil((highest - lowest) / _LEVEL)))
    level = max((highest - lowest) / steps, 1.0)
    sines = np.linspace(0, 1, _SINES + 1)[:, None]
    beam, diffuse = clear_sky(model, sines, lowest + level * np.arange(steps + 1), linke)
    return SkyTable(
        beam.astype(np.float32), diffuse.astype(np.float32), float(lowest), level, _CONSTANTS[model]
    )


def _linke(sine, elevation, linke):
    """Hofierka and Šúri 2002: beam by equations 6 to 10, diffuse by 17 to 22."""
    mass = _relative_air_mass(_apparent(np.arcsin(sine))) * np.exp(-elevation / 8434.5)
    beam = np.exp(-0.8662 * linke * mass * _rayleigh_thickness(mass))
    zenith = -0.015843 + 0.030543 * linke + 0.0003797 * linke**2
    level = 0.26463 - 0.061581 * linke + 0.0031408 * linke**2
    level = max(level, 0.0022 / zenith)
    slope = 2.0402 + 0.018945 * linke - 0.011161 * linke**2
    bend = -1.3025 + 0.039231 * linke + 0.0085079 * linke**2
    return beam, np.maximum(zenith * (level + slope * sine + bend * sine**2), 0.0)


def _ineichen(sine, elevation, linke):
    atmosphere, clearsky = (_pvlib.load(name) for name in ("atmosphere", "clearsky"))

    zenith = 90 - np.degrees(_apparent(np.arcsin(sine)))
    mass = atmosphere.get_relative_airmass(zenith) * atmosphere.alt2pres(elevation) / 101325.0
    sky = clearsky.ineichen(zenith, mass, linke, elevation, dni_extra=1.0)
    return np.asarray(sky["dni"]), np.maximum(sky["dhi"], 0.0)


def _apparent(altitude):
    """Altitude with refraction [rad] (Hofierka and Šúri 2002, equation 8)."""
    return altitude + 0.061359 * (0.1594 + 1.123 * altitude + 0.065656 * altitude**2) / (
        1 + 28.9344 * altitude + 277.3971 * altitude**2
    )


def _relative_air_mass(apparent):
    """By Kasten and Young 1989, as Hofierka and Šúri 2002, equation 7."""
    return 1 / (np.sin(apparent) + 0.50572 * (np.degrees(apparent) + 6.07995) ** -1.6364)


def _rayleigh_thickness(mass):
    """By Kasten 1996, as Hofierka and Šúri 2002, equations 9 and 10."""
    thin = 6.6296 + 1.7513 * mass - 0.1202 * mass**2 + 0.0065 * mass**3 - 0.00013 * mass**4
    return 1 / np.where(mass <= 20, thin, 10.4 + 0.718 * mass)
