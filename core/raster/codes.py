"""The shortest text that names a CRS exactly."""

import re

from demsmith.core.raster._gdal import load, session
from demsmith.core.raster.crs import spatial_reference

_PLAIN = re.compile(r"EPSG:\d{1,9}$|[A-Z][A-Z_]*\s*\[")
_FORMAT = ["FORMAT=WKT2_2019"]
# Names and remarks may differ, nothing that moves a place.
_SAME = ["CRITERION=EQUIVALENT", "IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES"]


def crs_code(crs):
    """Give the code of a CRS, where that says all that its text does.

    Parameters
    ----------
    crs : str
        WKT, or anything else GDAL takes; empty if unknown.

    Returns
    -------
    str
        Such as ``EPSG:32631``, or WKT (2, of 2019) where it names no code of its own, or is not
        equivalent, heights included, to the CRS of that code.

    Raises
    ------
    InputError
        If the text is no CRS.

    Examples
    --------
    >>> crs_code("EPSG:4326"), crs_code("")
    ('EPSG:4326', '')
    """
    if not crs:
        return crs
    osr = load().osr
    with session() as heard:
        reference = spatial_reference(crs, heard)
        name, code = reference.GetAuthorityName(None), reference.GetAuthorityCode(None)
        if name == "EPSG" and code and code.isdecimal():
            coded = osr.SpatialReference()
            known = heard.attempt(coded.ImportFromEPSG, int(code)) == 0
            if known and reference.IsSame(coded, _SAME):
                return f"EPSG:{code}"
        return reference.ExportToWkt(_FORMAT)


def is_plain_crs(text):
    """Tell whether a text can be nothing but a code or WKT: GDAL takes names of files, too.

    Examples
    --------
    >>> is_plain_crs("EPSG:4326"), is_plain_crs("https://example.org/crs")
    (True, False)
    """
    return not text or bool(_PLAIN.match(text))
