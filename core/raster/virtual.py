"""A virtual raster (VRT) over tiles, so that they open as one."""

import os
import re

from demsmith.core.raster._gdal import load, session
from demsmith.core.raster.outputs import cannot_write, whole_or_nothing

_SOURCE = re.compile(r"<SourceFilename[^>]*>[^<]*?([^<>/\\]+)</SourceFilename>")


def write_vrt(path, tiles):
    """Write a VRT over rasters of one grid, which finds them beside itself.

    Parameters
    ----------
    path : str
        An existing file is replaced.
    tiles : list of str
        Paths in the same folder.

    Returns
    -------
    str or None
        If none was written: why. A VRT has one data type, and tiles may have several.

    Raises
    ------
    OutputError
        If it cannot be written there.
    """
    gdal = load().gdal
    with session() as heard, whole_or_nothing(path) as unfinished:
        dataset = heard.attempt(gdal.BuildVRT, unfinished, [os.path.abspath(t) for t in tiles])
        skipped = any("kipping" in warning for warning in heard.warnings)
        reason = heard.warnings[0] if skipped else heard.reason
        if dataset is None or skipped:
            dataset = None
            _forget(unfinished)
            return f"no '{path}' was written: {reason}"
        dataset = None  # closing writes it
        if heard.failures:
            raise cannot_write(path, heard.reason)
        _name_beside(unfinished, path)
    return None


def _name_beside(unfinished, path):
    """Have a VRT look for its files in its own folder, wherever that is moved."""
    try:
        with open(unfinished, encoding="utf-8") as file:
            text = file.read()
        with open(unfinished, "w", encoding="utf-8") as file:
            file.write(_SOURCE.sub(r'<SourceFilename relativeToVRT="1">\1</SourceFilename>', text))
    except OSError as error:
        raise cannot_write(path, error.strerror) from None


def _forget(unfinished):
    if os.path.exists(unfinished):
        os.remove(unfinished)
