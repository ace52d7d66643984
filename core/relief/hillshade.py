"""Hillshade: how much light falls on ground."""

import math

import numpy as np

from demsmith.core.options import validate
from demsmith.core.progress import SILENT
from demsmith.core.relief.gradient import from_gradient
from demsmith.core.relief.options import ReliefOptions

_OWN = ReliefOptions()
_FOUR_LIGHTS = (225.0, 270.0, 315.0, 360.0)


def hillshade(
    values, void=None, *, azimuth=_OWN.azimuth, altitude=_OWN.altitude,
    exaggeration=_OWN.exaggeration, multidirectional=_OWN.multidirectional, method=_OWN.method,
    pixel_size=None, south_up=False, threads=None, progress=SILENT,
):  # fmt: skip
    """Tell how much light falls on the ground, without shadows that are cast.

    Parameters
    ----------
    values, void, method, pixel_size, threads, progress
        As of `demsmith.slope`.
    azimuth : float
        Where the light comes from, degrees clockwise from the grid's north.
    altitude : float
        Of the light above the horizon [degrees].
    exaggeration : float
        Elevations count so many times.
    multidirectional : bool
        Take four lights, from 225° to 360°, instead of the one at ``azimuth``. Each is weighted by
        the squared cosine of the angle between it and the aspect, as by gdaldem and QGIS, so that
        ridges show whichever way they run; after Mark 1992, "Multidirectional, oblique-weighted,
        shaded-relief image of the Island of Hawaii", USGS Open-File Report 92-422, which weights
        by the squared sine and loses those along its middle light.
    south_up : bool
        Whether the first row is the southern one.

    Returns
    -------
    (H, W) float32 array
        Cosine of the angle between the light and the ground's normal, 0 (away from the light) to
        1; NaN in voids.

    Raises
    ------
    InputError
        If the arrays do not fit or an option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    Level ground under a light 30° high:

    >>> print(hillshade([[7, 7], [7, 7]], altitude=30))
    [[0.5 0.5]
     [0.5 0.5]]
    """
    validate(
        ReliefOptions(
            azimuth=azimuth,
            altitude=altitude,
            exaggeration=exaggeration,
            multidirectional=multidirectional,
            method=method,
        )
    )

    def shade(east, north):
        east, north = east * np.float32(exaggeration), north * np.float32(exaggeration)
        if multidirectional:
            return _light_of_four(east, north, altitude)
        return light(east, north, azimuth=azimuth, altitude=altitude)

    return from_gradient(
        shade, values, void, pixel_size=pixel_size, method=method, south_up=south_up,
        threads=threads, progress=progress,
    )  # fmt: skip


def light(east, north, *, azimuth, altitude):
    """Give the cosine of the angle between a light and the ground's normal, 0 where it is negative.

    Parameters
    ----------
    east, north : arrays
        The ground's rise by run.
    azimuth, altitude : float
        Of the light, degrees clockwise from north and above the horizon.

    Returns
    -------
    array of the type of ``east``
    """
    up = 1 / np.sqrt(1 + east * east + north * north)
    return _lit(east, north, up, azimuth, altitude)


def _lit(east, north, up, azimuth, altitude):
    azimuth, altitude = math.radians(azimuth), math.radians(altitude)
    toward_east = math.sin(azimuth) * math.cos(altitude)
    toward_north = math.cos(azimuth) * math.cos(altitude)
    cosine = (math.sin(altitude) - toward_east * east - toward_north * north) * up
    return np.clip(cosine, 0, 1, out=cosine)


def _light_of_four(east, north, altitude):
    """Mix four lights, each by the squared cosine of the angle to the aspect; they sum to 2."""
    squared = east * east + north * north
    up = 1 / np.sqrt(1 + squared)
    total = np.zeros_like(up)
    for azimuth in _FOUR_LIGHTS:
        angle = math.radians(azimuth)
        toward = east * math.sin(angle) + north * math.cos(angle)
        total += toward * toward * _lit(east, north, up, azimuth, altitude)
    level = squared == 0
    np.divide(total, 2 * squared, out=total, where=~level)
    # Level ground has no aspect; all lights are the same to it.
    total[level] = math.sin(math.radians(altitude))
    return total
