"""A virtual raster (VRT) whose cells a Python function computes when they are asked for.

GDAL calls the function, in a module that the user has named as trusted, with the window and the
size of the buffer that it wants: so any program that uses GDAL reads what Demsmith decodes.
"""

import html
import os

from demsmith.core.raster._gdal import gdal_type, load, session
from demsmith.core.raster.outputs import cannot_write, whole_or_nothing
from demsmith.core.raster.writing import _describe, _describe_band

TRUSTED = "GDAL_VRT_PYTHON_TRUSTED_MODULES"
"""GDAL's option, or environment variable, that lists modules by commas."""

_BAND = "<VRTRasterBand "
_FUNCTION_END = "</PixelFunctionType>"


def write_derived_vrt(path, *, grid, meta, function, arguments, block):
    """Write a VRT of one band whose cells a Python function gives.

    Parameters
    ----------
    path : str or path-like
        An existing file is replaced.
    grid : Grid
    meta : BandMeta
        Its data type, nodata tag and all else that the VRT tells of the band.
    function : str
        Its full name, ``package.module.function``; see GDAL's documentation of derived bands with
        pixel functions in Python.
    arguments : dict of str to str
        Further keywords it is called with; it gets them as UTF-8 bytes.
    block : int
        Cells along the sides of the squares in which GDAL asks for all of it.

    Raises
    ------
    OutputError
        If it cannot be written there.
    """
    gdal = load().gdal
    path = os.fspath(path)
    kind, _ = gdal_type(meta.dtype)
    options = [
        "subclass=VRTDerivedRasterBand", f"PixelFunctionType={function}",
        "PixelFunctionLanguage=Python",
    ]  # fmt: skip
    with session() as heard, whole_or_nothing(path) as unfinished:
        rows, columns = grid.shape
        dataset = gdal.GetDriverByName("VRT").Create(unfinished, columns, rows, 0)
        heard.attempt(dataset.AddBand, kind, options)
        heard.attempt(_describe, dataset, grid, meta)
        heard.attempt(_describe_band, dataset.GetRasterBand(1), meta.nodata, meta)
        dataset = None  # closing writes it
        if heard.failures:
            raise cannot_write(path, heard.reason)
        _complete(unfinished, path, arguments, block)


def trust_module(name):
    """Let GDAL, in this process, call the functions of a module for virtual rasters.

    What the user has set is kept: where all modules or none are trusted, it stays so.
    """
    gdal = load().gdal
    trusted = (gdal.GetConfigOption(TRUSTED) or "").split(",")
    if name not in trusted:
        gdal.SetConfigOption(TRUSTED, ",".join(filter(None, [*trusted, name])))


def distrust_module(name):
    """Take back what `trust_module` did."""
    gdal = load().gdal
    trusted = (gdal.GetConfigOption(TRUSTED) or "").split(",")
    left = [each for each in trusted if each and each != name]
    gdal.SetConfigOption(TRUSTED, ",".join(left) or None)


def _complete(unfinished, path, arguments, block):
    """Add what GDAL's own writing leaves out before version 3.7."""
    words = " ".join(f'{key}="{html.escape(value)}"' for key, value in arguments.items())
    try:
        with open(unfinished, encoding="utf-8") as file:
            text = file.read()
        sides = f'blockXSize="{block}" blockYSize="{block}" '
        text = text.replace(_BAND, _BAND + sides, 1)
        text = text.replace(
            _FUNCTION_END, f"{_FUNCTION_END}\n    <PixelFunctionArguments {words}/>", 1
        )
        with open(unfinished, "w", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        raise cannot_write(path, error.strerror) from None
