"""SRTM's .hgt tiles: bare big-endian numbers, whose place and size only name and length tell.

GDAL opens a tile only by a name of the form ``N42E001.hgt`` and calls any other file, and a
truncated one, an unknown format. Here the place is looked for anywhere in the name, and the
length is checked first.
"""

import contextlib
import os
import re
import uuid

from demsmith.core.errors import InputError
from demsmith.core.raster._gdal import load

# Rows and columns of the tiles there are: 3", 1", and 1" by 2" as north of 50°.
_SIZES = {2 * rows * columns: (rows, columns) for rows, columns in
          ((1201, 1201), (3601, 3601), (3601, 1801))}  # fmt: skip
_PLACE = re.compile(r"(?<![A-Za-z])([NS]\d{2}[EW]\d{3})(?!\d)", re.IGNORECASE)


def is_hgt(path):
    """Whether a path's extension says that it is an .hgt tile."""
    return path.lower().endswith(".hgt")


def tile_name(*paths):
    """Give the name GDAL needs, from the first path whose file name tells the tile's place.

    Returns
    -------
    str or None

    Examples
    --------
    >>> tile_name("unpacked/srtm_n42e001_v3.hgt")
    'N42E001.hgt'
    """
    for path in paths:
        found = _PLACE.search(os.path.basename(path))
        if found:
            return found[1].upper() + ".hgt"
    return None


def check_size(size, shown):
    """Refuse a file of ``size`` bytes that is no whole tile; ``shown`` names it to the user."""
    if size in _SIZES:
        return
    sizes = ", ".join(
        f"{length} ({rows} × {columns} cells)" for length, (rows, columns) in _SIZES.items()
    )
    larger = [length for length in _SIZES if length > size]
    if larger:
        raise InputError(
            f"'{shown}' is truncated: an .hgt tile has {sizes} bytes, this file has {size}; "
            "get it again"
        )
    raise InputError(f"'{shown}' is no .hgt tile: one has {sizes} bytes, this file has {size}")


@contextlib.contextmanager
def openable(path, shown):
    """Yield a name by which GDAL opens the tile at ``path``.

    Raises
    ------
    InputError
        If it is truncated, or its name does not tell its place.
    """
    status = load().gdal.VSIStatL(path)
    if status is None or status.IsDirectory():
        yield path  # opening it will say what is wrong
        return
    check_size(status.size, shown)
    name = tile_name(path)
    if name is None:
        raise InputError(nameless(shown))
    if os.path.basename(path).upper() == name.upper():
        yield path
        return
    with in_memory(_contents(path, status.size, shown), name) as memory:
        yield memory


def nameless(shown):
    """Say that a tile's place is unknown."""
    return (
        f"'{shown}' does not tell where it lies: an .hgt tile's place is only in its name; "
        "rename it after its south-west corner, like N42E001.hgt"
    )


@contextlib.contextmanager
def in_memory(data, name):
    """Yield the name of a file in GDAL's memory with these bytes and this base name."""
    gdal = load().gdal
    folder = f"/vsimem/demsmith-{uuid.uuid4().hex}"
    gdal.FileFromMemBuffer(f"{folder}/{name}", data)
    try:
        yield f"{folder}/{name}"
    finally:
        gdal.RmdirRecursive(folder)


def _contents(path, size, shown):
    gdal = load().gdal
    file = gdal.VSIFOpenL(path, "rb")
    data = gdal.VSIFReadL(1, size, file) if file is not None else None
    if file is not None:
        gdal.VSIFCloseL(file)
    if data is None or len(data) != size:
        raise InputError(f"'{shown}' cannot be read to its end: truncated or damaged; get it again")
    return bytes(data)
