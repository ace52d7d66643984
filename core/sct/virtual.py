"""The virtual raster (VRT) by which programs that use GDAL read an `.sct` file."""

import os

from demsmith.core.raster.derived import distrust_module, trust_module, write_derived_vrt

MODULE = "demsmith.core.sct.pixels"
"""The module that GDAL has to trust."""

_SIDE = 256


def virtual_path(path):
    """Name the virtual raster beside an `.sct` file."""
    return os.fspath(path) + ".vrt"


def write_virtual(path, sct, grid, meta):
    """Write the virtual raster of an `.sct` file.

    GDAL does not tell the function that computes the cells which VRT asks for them: so the VRT
    names the file by its whole path, and has to be written anew where that is moved.

    Parameters
    ----------
    path : str or path-like
        An existing file is replaced.
    sct : str or path-like
    grid : Grid
    meta : BandMeta

    Raises
    ------
    OutputError
        If it cannot be written there.
    """
    write_derived_vrt(
        path, grid=grid, meta=meta, function=f"{MODULE}.read",
        arguments={"file": os.path.abspath(sct)}, block=_SIDE,
    )  # fmt: skip


def trust():
    """Let GDAL in this process read virtual rasters of `.sct` files."""
    trust_module(MODULE)


def distrust():
    """Take back what `trust` did."""
    distrust_module(MODULE)
