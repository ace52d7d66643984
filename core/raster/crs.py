"""What a coordinate reference system says of lengths and heights."""

import functools
from dataclasses import dataclass

from demsmith.core.errors import InputError
from demsmith.core.geodesy import WGS84, Ellipsoid
from demsmith.core.raster._gdal import load, session

# Known without GDAL, so that arrays in degrees can be worked on where it is missing.
_PLAIN_WGS84 = ("EPSG:4326", "OGC:CRS84")


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
        reference = load().osr.SpatialReference()
        if heard.attempt(reference.SetFromUserInput, crs) != 0:
            raise InputError(f"the CRS cannot be understood ({heard.reason}): {crs[:80]}")
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


def _degrees(radians):
    """Degrees in an angular unit; 1 exactly for the degree, whatever its digits."""
    degrees = radians * 57.29577951308232
    return 1.0 if abs(degrees - 1) < 1e-9 else degrees


def _ellipsoid(reference):
    inverse_flattening = reference.GetInvFlattening()
    return Ellipsoid(
        reference.GetSemiMajor(), 1 / inverse_flattening if inverse_flattening else 0.0
    )
