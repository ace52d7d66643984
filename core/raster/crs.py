"""What a coordinate reference system says of lengths and heights, and ways from one to another."""

import functools
from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.geodesy import WGS84, Ellipsoid
from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.raster._gdal import load, session

# Known without GDAL, so that arrays in degrees can be worked on where it is missing.
_PLAIN_WGS84 = ("EPSG:4326", "OGC:CRS84")
_PLACES_AT_ONCE = 100_000


@dataclass(frozen=True)
class CrsUnits:
    """The units of a CRS.

    Attributes
    ----------
    geographic : bool
        Whether its coordinates are angles.
    unit : float
        One unit of its horizontal axes: in degrees if geographic, else in metres.
    ellipsoid : Ellipsoid
        Figure of its planet.
    vertical_unit : float or None
        One unit of its heights in metres, where it tells.
    mercator : bool
        Whether its map is Mercator's, whose scale grows away from the equator.
    """

    geographic: bool = False
    unit: float = 1.0
    ellipsoid: Ellipsoid = WGS84
    vertical_unit: float | None = None
    mercator: bool = False

    @property
    def on_earth(self):
        """Whether the ellipsoid is one of the Earth."""
        return 6.3e6 < self.ellipsoid.radius < 6.4e6


@functools.lru_cache(maxsize=64)
def crs_units(crs):
    """Read the units of a CRS.

    Parameters
    ----------
    crs : str
        WKT, or anything else GDAL takes (``EPSG:32631``). Empty: metres are assumed.
        ``EPSG:4326`` is understood without GDAL.

    Returns
    -------
    CrsUnits

    Raises
    ------
    InputError
        If the text is no CRS, or one without horizontal axes.
    """
    if not crs:
        return CrsUnits()
    if crs.upper() in _PLAIN_WGS84:
        return CrsUnits(geographic=True)
    with session() as heard:
        reference = spatial_reference(crs, heard)
        if reference.IsGeocentric():
            raise InputError("the CRS is geocentric; reproject the raster to a map first")
        geographic = bool(reference.IsGeographic())
        vertical = bool(reference.IsVertical())
        return CrsUnits(
            geographic=geographic,
            unit=(
                _degrees(reference.GetAngularUnits()) if geographic else reference.GetLinearUnits()
            ),
            ellipsoid=_ellipsoid(reference),
            vertical_unit=reference.GetTargetLinearUnits("VERT_CS") if vertical else None,
            mercator=(reference.GetAttrValue("PROJECTION") or "").startswith("Mercator")
            or "Pseudo-Mercator" in reference.GetName(),
        )


def same_crs(crs, other):
    """Tell whether two CRS place cells alike, whatever they say of heights.

    Parameters
    ----------
    crs, other : str
        As in `crs_units`; empty if unknown.

    Examples
    --------
    >>> same_crs("EPSG:32631", "EPSG:32631"), same_crs("EPSG:32631", "")
    (True, False)
    """
    if crs == other or not (crs and other):
        return crs == other
    with session() as heard:
        references = spatial_reference(crs, heard), spatial_reference(other, heard)
        for reference in references:
            reference.StripVertical()
        return bool(references[0].IsSame(references[1], ["CRITERION=EQUIVALENT"]))


def reproject(xy, source, target, *, progress=SILENT):
    """Bring places from one CRS to another.

    Parameters
    ----------
    xy : ndarray of float64, shape (N, 2)
        Easting or longitude first, whatever order the CRS itself prescribes.
    source, target : str
        WKT, or anything else GDAL takes.
    progress : Progress
        Told how many are done.

    Returns
    -------
    ndarray of float64, shape (N, 2)
        NaN for places that the target CRS does not reach.

    Raises
    ------
    InputError
        If a CRS cannot be understood, or there is no way from one to the other.
    Cancelled
        If ``progress`` says so.
    """
    osr = load().osr
    with session() as heard:
        there = spatial_reference(target, heard)
        here = spatial_reference(source, heard)
        if here.IsSame(there):
            return xy
        way = heard.attempt(osr.CoordinateTransformation, here, there)
        if way is None or heard.failures:
            raise InputError(f"cannot reproject from its CRS to the one asked: {heard.reason}")
        moved = np.empty_like(xy)
        for start in range(0, len(xy), _PLACES_AT_ONCE):
            checkpoint(progress, start / len(xy))
            block = slice(start, start + _PLACES_AT_ONCE)
            moved[block] = _transformed(way, xy[block].tolist(), heard)
        moved[~np.isfinite(moved).all(axis=1)] = np.nan
        return moved


def _transformed(way, places, heard):
    """Bring some places along; infinite or NaN where that cannot be."""
    moved = heard.attempt(way.TransformPoints, places)
    if moved is None:  # where exceptions are on, one place out of reach stops them all
        nowhere = (np.nan, np.nan)
        moved = [heard.attempt(way.TransformPoint, *place) or nowhere for place in places]
    return [place[:2] for place in moved]


def spatial_reference(crs, heard):
    """Make GDAL's object of a CRS, easting or longitude first, inside a GDAL session.

    Raises
    ------
    InputError
        If the text is no CRS.
    """
    osr = load().osr
    reference = osr.SpatialReference()
    if heard.attempt(reference.SetFromUserInput, crs) != 0:
        raise InputError(f"the CRS cannot be understood ({heard.reason}): {crs[:80]}")
    reference.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    return reference


def _degrees(radians):
    """Degrees in an angular unit; 1 exactly for the degree, whatever its digits."""
    degrees = radians * 57.29577951308232
    return 1.0 if abs(degrees - 1) < 1e-9 else degrees


def _ellipsoid(reference):
    inverse_flattening = reference.GetInvFlattening()
    return Ellipsoid(
        reference.GetSemiMajor(), 1 / inverse_flattening if inverse_flattening else 0.0
    )
