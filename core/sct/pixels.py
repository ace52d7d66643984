"""What GDAL calls for the cells of a virtual raster over an `.sct` file.

The module to be trusted: ``GDAL_VRT_PYTHON_TRUSTED_MODULES=demsmith.core.sct.pixels``.
"""

import os
import threading

from demsmith.core.sct.file import open_sct
from demsmith.core.sct.scaling import resampled

_MOST_OPEN = 4

_open = {}
_lock = threading.Lock()


def read(
    in_ar, out_ar, xoff, yoff, xsize, ysize, raster_xsize, raster_ysize, buf_radius, gt, *, file,
    **_,
):  # fmt: skip
    """Fill GDAL's buffer with a window of a file, at the buffer's own resolution.

    Parameters
    ----------
    in_ar : list
        Empty: there are no sources.
    out_ar : ndarray
        The buffer.
    xoff, yoff, xsize, ysize : int
        The window.
    raster_xsize, raster_ysize, buf_radius, gt
        What else GDAL tells.
    file : bytes
        Path of the `.sct` file, as the VRT names it.

    Raises
    ------
    InputError
        If the file cannot be read; GDAL shows it as its own error.
    """
    sct = _opened(os.fsdecode(file))
    rows, columns = slice(yoff, yoff + ysize), slice(xoff, xoff + xsize)
    if out_ar.shape == (ysize, xsize):
        out_ar[:] = sct.read(rows, columns).values
        return
    values, void = resampled(sct, rows, columns, out_ar.shape)
    out_ar[:] = sct.marked(values, void)


def _opened(path):
    """Open a file, or find it open still; one that was replaced is opened anew."""
    try:
        status = os.stat(path)
        key = path, status.st_mtime_ns, status.st_size
    except OSError:
        key = path, 0, 0
    with _lock:
        sct = _open.pop(key, None) or open_sct(path)
        _open[key] = sct  # the latest is the last
        while len(_open) > _MOST_OPEN:
            del _open[next(iter(_open))]  # closed when the last read of another thread is done
    return sct
