"""Which files a mosaic is made of: a folder, a list, a pattern, a VRT."""

import glob
import os
import re

from demsmith.core.errors import InputError
from demsmith.core.raster.opening import opened

_EXTENSIONS = (
    ".hgt", ".tif", ".tiff", ".dt0", ".dt1", ".dt2", ".asc", ".bil", ".flt", ".img", ".zip",
)  # fmt: skip
_SOURCE = re.compile(r"<SourceFilename[^>]*>([^<]*)</SourceFilename>")


def tile_paths(*inputs):
    """List the raster files that are meant.

    Parameters
    ----------
    inputs : str or path-like
        Each a raster file; a folder, of which those files are taken whose names end as elevations
        do (.hgt, .tif, .dt1, .zip, ...); a pattern such as ``tiles/N4*.hgt``; a text file (.txt)
        with a path in each line; or a VRT, whose files are taken.

    Returns
    -------
    list of str
        In the order given, those of a folder or pattern by name; each once.

    Raises
    ------
    InputError
        If there is no such file, or a folder, list or VRT names none.
    """
    found = {}
    for name in map(os.fspath, inputs):
        paths = _meant(name)
        if not paths:
            raise InputError(f"'{name}' holds no elevation rasters ({', '.join(_EXTENSIONS)})")
        for path in paths:
            found.setdefault(os.path.realpath(path), path)
    return list(found.values())


def _meant(name):
    if os.path.isdir(name):
        return _in_folder(name)
    if name.lower().endswith(".txt"):
        return _in_list(name)
    if name.lower().endswith(".vrt"):
        return _in_vrt(name)
    if not os.path.exists(name) and glob.has_magic(name):
        return sorted(path for path in glob.glob(name) if _looks_like_a_raster(path))
    return [name]


def _in_folder(folder):
    try:
        names = sorted(os.listdir(folder))
    except OSError as error:
        raise InputError(f"folder '{folder}' cannot be read: {error.strerror}") from None
    paths = [os.path.join(folder, name) for name in names if not name.startswith(".")]
    return [path for path in paths if _looks_like_a_raster(path)]


def _looks_like_a_raster(path):
    return path.lower().endswith(_EXTENSIONS) and os.path.isfile(path)


def _in_list(name):
    try:
        with open(name, encoding="utf-8") as file:
            lines = [line.strip() for line in file]
    except OSError as error:
        raise InputError(f"list '{name}' cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"list '{name}' is no text: give a path in each line") from None
    folder = os.path.dirname(name)
    return [os.path.join(folder, line) for line in lines if line and not line.startswith("#")]


def _in_vrt(name):
    with opened(name) as (_, holder):
        text = "".join(holder[0].GetMetadata("xml:VRT") or [])
        listed = [path for path in holder[0].GetFileList() or [] if path != name]
    named = len(set(_SOURCE.findall(text)))
    if named > len(listed):
        raise InputError(
            f"'{name}' names {named} files, of which {named - len(listed)} are missing"
        )
    return listed
