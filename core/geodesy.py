"""Metres on the ground of a geographic raster, row by row, from GeographicLib.

A degree of longitude is 111 km long at the equator and 56 km at 60°, so a pixel of a geographic
raster has another size in every row. GeographicLib's geodesics give the two radii of curvature
of the ellipsoid at a few latitudes; between these the radii are interpolated, as both are
smooth, nearly linear functions of the squared sine of the latitude.

References
----------
Karney, C. F. F. (2013), Algorithms for geodesics, J. Geodesy 87, 43-55.
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from demsmith.core.errors import InputError


class Ellipsoid(NamedTuple):
    """The figure of a planet: equatorial radius in metres, and flattening."""

    radius: float
    flattening: float


WGS84 = Ellipsoid(6378137.0, 1 / 298.257223563)

# Half the length of the probing geodesics [degrees]: long against GeographicLib's error of
# 15 nm, short against the curvature of meridians and parallels (relative error below 1e-9).
_PROBE_NORTH = 0.01
_PROBE_EAST = 0.0025
# Degree of the interpolating polynomials; the next term is below 1e-15 for the Earth.
_DEGREE = 7


@functools.lru_cache(maxsize=16)
def _radii(ellipsoid):
    """Interpolate the radii of curvature over the squared sine of latitude.

    Returns two polynomials: the meridian's radius and the prime vertical's [m].
    """
    from geographiclib.geodesic import Geodesic

    geodesic = Geodesic(*ellipsoid)

    def length(latitude_a, latitude_b, longitude):
        return geodesic.Inverse(latitude_a, 0.0, latitude_b, longitude, Geodesic.DISTANCE)["s12"]

    def meridian(squared_sine):
        latitudes = np.degrees(np.arcsin(np.sqrt(squared_sine)))
        arc = math.radians(2 * _PROBE_NORTH)
        return [length(at - _PROBE_NORTH, at + _PROBE_NORTH, 0.0) / arc for at in latitudes]

    def prime_vertical(squared_sine):
        latitudes = np.degrees(np.arcsin(np.sqrt(squared_sine)))
        arc = math.radians(2 * _PROBE_EAST)
        return [
            length(at, at, 2 * _PROBE_EAST) / (arc * math.cos(math.radians(at))) for at in latitudes
        ]

    interpolate = np.polynomial.Chebyshev.interpolate
    return (
        interpolate(meridian, _DEGREE, domain=[0, 1]),
        interpolate(prime_vertical, _DEGREE, domain=[0, 1]),
    )


def _clip_to_globe(edges):
    """Cut row edges [degrees] that reach beyond a pole; refuse rows wholly beyond it."""
    edges = np.asarray(edges, dtype=np.float64)
    clipped = np.clip(edges, -90.0, 90.0)
    beyond = np.flatnonzero(np.diff(clipped) == 0)
    if beyond.size:
        row = int(beyond[0])
        raise InputError(
            f"row {row} of the raster lies at latitude {edges[row : row + 2].mean():g}°, beyond "
            "the pole; its CRS is geographic, but its coordinates are no degrees: give it the "
            "right CRS or geotransform"
        )
    return clipped


def _across_rows(edges):
    """Latitudes [radians] and weights of a three-point Gauss rule in each row."""
    nodes, weights = np.polynomial.legendre.leggauss(3)
    south, north = np.radians(edges[:-1, None]), np.radians(edges[1:, None])
    return (south + north) / 2 + (north - south) / 2 * nodes, weights / 2


def pixel_size_m(edges, width, *, ellipsoid=WGS84):
    """Ground size of the pixels of each row of a geographic raster.

    Parameters
    ----------
    edges : array_like, shape (rows + 1,)
        Latitude of the rows' edges, north to south or south to north [degrees]. The part of a
        row that reaches beyond a pole is left out.
    width : float
        Extent of a pixel in longitude [degrees].
    ellipsoid : Ellipsoid
        Figure of the planet; the Earth's WGS 84 if not given.

    Returns
    -------
    dx, dy : ndarray of float64, shape (rows,)
        Length of a pixel along the parallel through the row's middle, and of its meridian arc,
        in metres; relative error below 1e-8.

    Raises
    ------
    InputError
        If a row lies wholly beyond a pole.

    Examples
    --------
    One arc-second at the equator:

    >>> dx, dy = pixel_size_m([1 / 7200, -1 / 7200], 1 / 3600)
    >>> print(f"{dx[0]:.3f} m by {dy[0]:.3f} m")
    30.922 m by 30.715 m
    """
    edges_on_globe = _clip_to_globe(edges)
    meridian, prime_vertical = _radii(Ellipsoid(*ellipsoid))
    middle = np.radians((edges_on_globe[:-1] + edges_on_globe[1:]) / 2)
    dx = prime_vertical(np.sin(middle) ** 2) * np.cos(middle) * math.radians(abs(width))
    latitudes, weights = _across_rows(edges_on_globe)
    # The whole pixel, not only its part on the globe: neighbours are this far apart.
    heights = np.radians(np.abs(np.diff(np.asarray(edges, dtype=np.float64))))
    dy = meridian(np.sin(latitudes) ** 2) @ weights * heights
    return dx, dy


def cell_area_m2(edges, width, *, ellipsoid=WGS84):
    """Area of one cell in each row of a geographic raster.

    Parameters and errors are those of `pixel_size_m`.

    Returns
    -------
    ndarray of float64, shape (rows,)
        Area on the ellipsoid between the row's parallels and the pixel's meridians [m²].

    Examples
    --------
    The 180 rows of a one-degree globe make up the Earth:

    >>> area = cell_area_m2(range(90, -91, -1), 1.0)
    >>> print(f"{360 * area.sum() / 1e12:.3f} million km²")
    510.066 million km²
    """
    edges = _clip_to_globe(edges)
    meridian, prime_vertical = _radii(Ellipsoid(*ellipsoid))
    latitudes, weights = _across_rows(edges)
    squared_sine = np.sin(latitudes) ** 2
    density = meridian(squared_sine) * prime_vertical(squared_sine) * np.cos(latitudes)
    return density @ weights * np.radians(np.abs(np.diff(edges))) * math.radians(abs(width))
