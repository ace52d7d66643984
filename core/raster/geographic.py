"""Where the cells of a raster are on the Earth, and which way its rows and columns run there."""

from dataclasses import dataclass, replace

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.raster.crs import crs_units, reproject

# To both sides of a cell's middle, to see which way x and y run [m]: long against the digits of a
# projection (below 0.01 mm), short against the bend of its lines.
_PROBE = 50.0
_WGS84 = "EPSG:4326"


@dataclass(frozen=True, eq=False)
class Places:
    """Places on the Earth and the raster's directions there.

    Attributes
    ----------
    latitude, longitude : (N,) float64 arrays
        Degrees on WGS 84, longitude from -180 to below 180 from Greenwich.
    frame : (N, 3, 3) float64 array
        Of each place three unit vectors at right angles, its rows: the grid's east (x grows),
        the grid's north (y grows) and up, in the earth-fixed frame whose axes point to longitude
        0° on the equator, 90° E on the equator, and the north pole. Unlike the direction of true
        north they go on evenly across the poles and the date line.
    """

    latitude: np.ndarray
    longitude: np.ndarray
    frame: np.ndarray

    @property
    def convergence(self):
        """Azimuth of the grid's north, clockwise from true north [degrees, -180 to 180]."""
        east, north, _ = _true_frame(self.latitude, self.longitude)
        grid_north = self.frame[:, 1]
        return np.degrees(
            np.arctan2((grid_north * east).sum(axis=1), (grid_north * north).sum(axis=1))
        )


def places_of(grid, rows, columns):
    """Find some cells of a raster on the Earth.

    Where the projection is not conformal, so that the grid's east and north are not at right
    angles on the ground, the frame is turned as far from the one as from the other.

    Parameters
    ----------
    grid : Grid
        With a CRS, geographic or projected, of any orientation.
    rows, columns : array_like of numbers
        Of cells; whole numbers are their middles. They broadcast against each other.

    Returns
    -------
    Places
        NaN where the CRS has no place on the Earth.

    Raises
    ------
    InputError
        If the raster has no georeference, its CRS cannot be understood, or it is of another planet.

    Examples
    --------
    West of a UTM zone's middle, grid north lies west of true north:

    >>> from demsmith.core.raster import Grid
    >>> grid = Grid((1, 1), (300000.0, 30.0, 0.0, 5500000.0, 0.0, -30.0), "EPSG:32632")
    >>> places = places_of(grid, 0, 0)
    >>> print(f"{places.latitude[0]:.3f} {places.longitude[0]:.3f} {places.convergence[0]:.3f}")
    49.619 6.231 -2.110
    """
    if not (grid.crs and grid.georeferenced):
        raise InputError(
            "the raster does not tell where on the Earth it lies: give it a CRS and a "
            "geotransform, for example with gdal_edit.py -a_srs -a_ullr"
        )
    units = crs_units(grid.crs)
    if not units.on_earth:
        raise InputError("the raster's CRS is not one of the Earth")
    rows, columns = np.broadcast_arrays(
        np.atleast_1d(np.asarray(rows, np.float64)), np.atleast_1d(np.asarray(columns, np.float64))
    )
    xy = np.stack([axis.ravel() for axis in grid.xy(rows, columns)], axis=1)
    if units.geographic:
        # Without GDAL where that can be, so that arrays in degrees can do without.
        longitude, latitude = (xy if grid.crs == _WGS84 else reproject(xy, grid.crs, _WGS84)).T
        return Places(latitude, wrapped(longitude), np.stack(_true_frame(latitude, longitude), 1))
    return _projected(xy, grid.crs, _PROBE / units.unit)


def north_up(grid):
    """Give a grid's cells with rows from north to south and columns from west to east.

    Parameters
    ----------
    grid : Grid
        One without a geotransform stays as it is: its first row is taken for the northern one.

    Returns
    -------
    order : (slice, slice)
        How the grid's rows and columns run in the other's, and those in the grid's: backwards or
        not.
    grid : Grid
        The same place.

    Examples
    --------
    >>> from demsmith.core.raster import Grid
    >>> order, turned = north_up(Grid((4, 3), (500.0, 10.0, 0.0, 900.0, 0.0, 10.0)))
    >>> order[0], turned.geotransform
    (slice(None, None, -1), (500.0, 10.0, 0.0, 940.0, 0.0, -10.0))
    """
    if not grid.georeferenced:
        return (slice(None), slice(None)), grid
    x, width, _, y, _, height = grid.geotransform
    rows, columns = grid.shape
    order = tuple(slice(None, None, -1 if back else None) for back in (height > 0, width < 0))
    corner = min(x, x + columns * width), max(y, y + rows * height)
    geotransform = (corner[0], abs(width), 0.0, corner[1], 0.0, -abs(height))
    return order, replace(grid, geotransform=geotransform)


def wrapped(degrees):
    """Bring angles to -180° up to below 180°.

    Examples
    --------
    >>> wrapped(np.array([190.0, -180.0, 540.0]))
    array([-170., -180., -180.])
    """
    return (degrees + 180.0) % 360.0 - 180.0


def _projected(xy, crs, step):
    probes = np.array([[0, 0], [step, 0], [-step, 0], [0, step], [0, -step]])
    around = reproject((xy + probes[:, None]).reshape(-1, 2), crs, _WGS84)
    longitude, latitude = around.reshape(5, -1, 2).transpose(2, 0, 1)
    middle, right, left, above, below = _positions(latitude, longitude)
    up = _true_frame(latitude[0], longitude[0])[2]
    along_x, along_y = _unit(_level(right - left, up)), _unit(_level(above - below, up))
    # A quarter turn brings x upon y where they are at right angles; else half-way between.
    turned = np.cross(up, along_x)
    north = _unit(_unit(turned) + along_y)
    places = Places(
        latitude[0], wrapped(longitude[0]), np.stack([np.cross(north, up), north, up], axis=1)
    )
    places.frame[~np.isfinite(middle).all(axis=1)] = np.nan
    return places


def _true_frame(latitude, longitude):
    """True east, north and up in the earth-fixed frame, each (..., 3)."""
    (sin_lat, sin_lon), (cos_lat, cos_lon) = (
        [f(np.radians(angle)) for angle in (latitude, longitude)] for f in (np.sin, np.cos)
    )
    east = np.stack([-sin_lon, cos_lon, np.zeros_like(sin_lon)], axis=-1)
    north = np.stack([-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat], axis=-1)
    up = np.stack([cos_lat * cos_lon, cos_lat * sin_lon, sin_lat], axis=-1)
    return east, north, up


def _positions(latitude, longitude):
    """Earth-fixed coordinates on the ellipsoid, in its equatorial radii."""
    from demsmith.core.geodesy import WGS84

    squared = WGS84.flattening * (2 - WGS84.flattening)
    up = _true_frame(latitude, longitude)[2]
    normal = 1 / np.sqrt(1 - squared * up[..., 2:] ** 2)
    return up * normal * np.array([1.0, 1.0, 1.0 - squared])


def _level(vectors, up):
    """The part of vectors along the ground."""
    return vectors - (vectors * up).sum(axis=1, keepdims=True) * up


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
