"""Where on the Earth a raster lies that does not tell it itself."""

import math
from dataclasses import replace

from demsmith.core.errors import InputError


def placed(grid, latitude=None, longitude=None):
    """Give a raster's grid, or if it has no place on the Earth one around a given place.

    Parameters
    ----------
    grid : Grid
        If it has a CRS and a geotransform, no place may be given.
    latitude, longitude : float, optional
        Of the middle of a grid whose coordinates are plain metres [degrees]. The first row of one
        that has no geotransform is the northern one. Longitude 0, where UTC is local time, if
        only the latitude is given.

    Returns
    -------
    Grid

    Raises
    ------
    InputError
        If there is no place, or two, or it is none on the Earth.

    Examples
    --------
    >>> from demsmith.core.raster import Grid
    >>> placed(Grid((20, 10)), latitude=46.5).xy(0, 0)
    XY(x=-4.5, y=9.5)
    """
    if latitude is None and longitude is not None:
        raise InputError("longitude is given without latitude")
    if grid.crs and grid.georeferenced:
        if latitude is not None:
            raise InputError("latitude is given, but the raster itself tells where it lies")
        return grid
    if latitude is None:
        raise InputError(
            "it does not tell where on the Earth it lies: give it a CRS and a geotransform "
            "(for example with gdal_edit.py -a_srs -a_ullr), or give the latitude of its middle"
        )
    longitude = 0.0 if longitude is None else longitude
    if not (abs(latitude) <= 90 and abs(longitude) <= 360):
        raise InputError(
            f"latitude {latitude:g}, longitude {longitude:g} is no place on the Earth: latitudes "
            "go from -90 to 90, longitudes from -180 to 180"
        )
    _, width, _, _, _, height = grid.geotransform
    height = height if grid.georeferenced else -height
    rows, columns = grid.shape
    crs = f"+proj=tmerc +lat_0={latitude!r} +lon_0={math.remainder(longitude, 360)!r}"
    corner = (-columns * width / 2, width, 0.0, -rows * height / 2, 0.0, height)
    return replace(grid, geotransform=corner, crs=f"{crs} +datum=WGS84 +units=m +type=crs")
