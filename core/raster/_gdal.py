"""GDAL, met in one place: imported late, kept quiet, its failures collected.

GDAL tells of failures through a printed message, a return value or an exception, as the
process it runs in has chosen. Inside a `session` it does the same everywhere: nothing is
printed, nothing is raised, and the messages are in the session. What the process has chosen
stays as it is.
"""

import contextlib
import functools
from types import SimpleNamespace

import numpy as np

from demsmith.core.errors import DependencyError


@functools.cache
def load():
    """Import GDAL's bindings; a namespace with ``gdal``, ``ogr`` and ``osr``.

    Raises
    ------
    DependencyError
        If they are missing.
    """
    try:
        from osgeo import gdal, ogr, osr
    except ImportError as error:
        raise DependencyError(
            f"GDAL's Python bindings are missing ({error}): on Debian or Ubuntu install "
            "python3-gdal and make the environment with "
            "/usr/bin/python3 -m venv --system-site-packages; elsewhere run inside QGIS's Python"
        ) from None
    return SimpleNamespace(gdal=gdal, ogr=ogr, osr=osr)


class Session:
    """What GDAL said since the session began."""

    def __init__(self, gdal):
        self._gdal = gdal
        self.failures = []
        self.warnings = []

    def _hear(self, level, number, message):
        if level >= self._gdal.CE_Failure:
            self.failures.append(" ".join(message.split()))
        elif level == self._gdal.CE_Warning:
            self.warnings.append(" ".join(message.split()))

    def attempt(self, call, *args, **options):
        """Call a GDAL function; ``None`` if it raised, as it does where exceptions are on."""
        try:
            return call(*args, **options)
        except RuntimeError as error:
            self.failures.append(" ".join(str(error).split()))
            return None

    @property
    def reason(self):
        """The first failure, as the rest mostly follows from it."""
        return self.failures[0] if self.failures else "GDAL does not say why"


@contextlib.contextmanager
def session(**config):
    """Run GDAL quietly, with these configuration options, for the current thread only.

    Yields the `Session` that collects its messages. Datasets must be closed inside.
    """
    osgeo = load()
    gdal = osgeo.gdal
    heard = Session(gdal)
    with contextlib.ExitStack() as stack:
        for module in (gdal, osgeo.ogr, osgeo.osr):
            # From GDAL 3.7 on the choice is per thread; before, `attempt` copes with both.
            if hasattr(module, "ExceptionMgr"):
                stack.enter_context(module.ExceptionMgr(useExceptions=False))
        gdal.PushErrorHandler(heard._hear)
        stack.callback(gdal.PopErrorHandler)
        for key, value in config.items():
            stack.callback(
                gdal.SetThreadLocalConfigOption, key, gdal.GetThreadLocalConfigOption(key)
            )
            gdal.SetThreadLocalConfigOption(key, value)
        yield heard


# GDAL's names of the data types; Int8 came with 3.7, Float16 with 3.11.
_NUMPY_TYPES = {
    "Byte": np.uint8,
    "Int8": np.int8,
    "UInt16": np.uint16,
    "Int16": np.int16,
    "UInt32": np.uint32,
    "Int32": np.int32,
    "UInt64": np.uint64,
    "Int64": np.int64,
    "Float16": np.float32,
    "Float32": np.float32,
    "Float64": np.float64,
}


def numpy_type(band):
    """NumPy data type in which a band's values are read; ``None`` for complex numbers."""
    gdal = load().gdal
    name = gdal.GetDataTypeName(band.DataType)
    if name == "Byte" and band.GetMetadataItem("PIXELTYPE", "IMAGE_STRUCTURE") == "SIGNEDBYTE":
        return np.dtype(np.int8)
    return np.dtype(_NUMPY_TYPES[name]) if name in _NUMPY_TYPES else None


def gdal_type(dtype):
    """GDAL's data type for a NumPy one, and creation options it needs.

    Raises
    ------
    KeyError
        If GDAL has none.
    """
    gdal = load().gdal
    dtype = np.dtype(dtype)
    if dtype == np.int8 and not hasattr(gdal, "GDT_Int8"):
        return gdal.GDT_Byte, ["PIXELTYPE=SIGNEDBYTE"]
    names = {np.dtype(kind): name for name, kind in _NUMPY_TYPES.items() if name != "Float16"}
    return gdal.GetDataTypeByName(names[dtype]), []
