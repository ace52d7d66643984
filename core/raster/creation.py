"""How GeoTIFFs are stored: tiled and compressed, unless the user says otherwise."""

import functools

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.raster._gdal import load

_WITH_PREDICTOR = ("LZW", "DEFLATE", "ZSTD")


def creation_options(dtype, given=(), *, threads=None):
    """Creation options for a band of this type, those ``given`` taking precedence.

    Parameters
    ----------
    dtype : numpy.dtype
        Data type of the band.
    given : iterable of str
        The user's, each ``KEY=VALUE``.
    threads : int or None
        Threads that compress; all cores if not given. The bytes written do not depend on it.

    Returns
    -------
    list of str

    Raises
    ------
    InputError
        If one given is not of the form ``KEY=VALUE``.

    Examples
    --------
    >>> creation_options(np.int16, ["compress=LZW"])[:3]
    ['TILED=YES', 'COMPRESS=LZW', 'PREDICTOR=2']
    """
    wanted = _parse(given)
    options = {"TILED": "YES", "COMPRESS": wanted.get("COMPRESS") or _best_compression()}
    # NBITS packs values to fewer bits, where differences of neighbours mean nothing.
    if options["COMPRESS"].upper() in _WITH_PREDICTOR and "NBITS" not in wanted:
        dtype = np.dtype(dtype)
        if dtype.kind == "f":
            options["PREDICTOR"] = "3"
        elif dtype.itemsize <= 4:
            options["PREDICTOR"] = "2"
    if options["COMPRESS"].upper() == "ZSTD":
        options["ZSTD_LEVEL"] = "3"  # GDAL's 9 takes four times as long to save 2 %
    options["BIGTIFF"] = "IF_SAFER"
    options["NUM_THREADS"] = "ALL_CPUS" if threads is None else str(threads)
    options.update(wanted)
    return [f"{key}={value}" for key, value in options.items()]


def _parse(given):
    if isinstance(given, str):
        given = [given]
    wanted = {}
    for option in given:
        key, equals, value = str(option).partition("=")
        if not equals or not key.strip():
            raise InputError(f"creation option '{option}' must have the form KEY=VALUE")
        wanted[key.strip().upper()] = value.strip()
    return wanted


@functools.cache
def _best_compression():
    known = load().gdal.GetDriverByName("GTiff").GetMetadataItem("DMD_CREATIONOPTIONLIST") or ""
    return "ZSTD" if "<Value>ZSTD</Value>" in known else "DEFLATE"
