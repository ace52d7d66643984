"""Opening a raster file: anything GDAL knows, and a clear word where it does not."""

import contextlib
import os
import re

from demsmith.core.errors import InputError
from demsmith.core.raster import archive, hgt
from demsmith.core.raster._gdal import load, session

_CONFIG = {
    # Keep the vertical part of a CRS, which GDAL hides in older GeoTIFFs.
    "GTIFF_REPORT_COMPD_CS": "YES",
    # A thread of GDAL's own would print its failures, out of our session's hearing.
    "GDAL_NUM_THREADS": "1",
}


@contextlib.contextmanager
def opened(path):
    """Open the raster at ``path``; yields the `Session` and a list holding the dataset.

    The dataset is in a list so that it can be closed when the context ends: whoever takes it
    or its bands out must let go of them before.

    Raises
    ------
    InputError
        If there is no such file, or it is no raster, or a damaged one.
    """
    with session(**_CONFIG) as heard, _openable(path) as name:
        gdal = load().gdal
        dataset = heard.attempt(gdal.OpenEx, name, gdal.OF_RASTER | gdal.OF_VERBOSE_ERROR)
        if dataset is None:
            raise InputError(_why_not(path, heard))
        _refuse_short_envi(dataset, path)
        holder = [dataset]
        del dataset
        try:
            yield heard, holder
        finally:
            holder.clear()


def choose_band(dataset, band, path):
    """Return a band by its number, from 1 on.

    Raises
    ------
    InputError
        If the file does not have it; where it holds several rasters, they are listed.
    """
    count = dataset.RasterCount
    if count == 0:
        inner = [name for name, _ in dataset.GetSubDatasets()]
        if inner:
            raise InputError(
                f"'{path}' holds several rasters: give one of them: {', '.join(inner)}"
            )
        raise InputError(f"'{path}' has no raster band")
    if isinstance(band, bool) or int(band) != band or not 1 <= band <= count:
        raise InputError(f"band {band} asked, '{path}' has {count}")
    return dataset.GetRasterBand(int(band))


def files_of(path):
    """All files a raster is made of, as far as they are on disk: sidecars, sources of a VRT."""
    try:
        with opened(path) as (_, holder):
            listed = holder[0].GetFileList() or []
    except InputError:
        listed = []
    return [name for name in (path, *listed) if os.path.exists(name)]


@contextlib.contextmanager
def _openable(path):
    """Yield the name by which GDAL opens ``path``."""
    check_there(path)
    if archive.is_zip(path):
        with archive.openable(path) as name:
            yield name
    elif hgt.is_hgt(path):
        with hgt.openable(path, path) as name:
            yield name
    else:
        yield path


def check_there(path):
    """Refuse a path at which there is nothing, or an empty file.

    Raises
    ------
    InputError
        Unless the path means something to GDAL only.
    """
    if _is_virtual(path):
        return
    if not os.path.exists(path):
        raise InputError(f"'{path}' does not exist")
    if os.path.isfile(path) and os.path.getsize(path) == 0:
        raise InputError(f"'{path}' is empty")


def _is_virtual(path):
    """Whether a path means something to GDAL only: a /vsi file, ``DRIVER:...``, VRT text."""
    return bool(re.match(r"/vsi|[A-Za-z][A-Za-z0-9_]+:|\s*<", path)) and not os.path.exists(path)


def _refuse_short_envi(dataset, path):
    """Refuse an ENVI file that is too short; GDAL would fill it up with zeros."""
    header = dataset.GetMetadata("ENVI") or {}
    if dataset.GetDriver().ShortName != "ENVI" or header.get("file_compression", "0") != "0":
        return
    gdal = load().gdal
    status = gdal.VSIStatL(dataset.GetDescription())
    cell = gdal.GetDataTypeSize(dataset.GetRasterBand(1).DataType) // 8
    cells = dataset.RasterXSize * dataset.RasterYSize * dataset.RasterCount
    needed = int(header.get("header_offset", 0)) + cells * cell
    if status is not None and status.size < needed:
        raise InputError(
            f"'{path}' is truncated: its header speaks of {needed} bytes, it has {status.size}"
        )


def _why_not(path, heard):
    if os.path.isdir(path):
        return f"'{path}' is a folder, not a raster"
    if not heard.failures or "not recognized as" in heard.reason:
        return f"'{path}' is not a raster in a format that GDAL knows, or its beginning is damaged"
    return f"'{path}' cannot be opened, truncated or damaged: {heard.reason}"
