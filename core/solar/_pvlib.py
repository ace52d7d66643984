"""pvlib, met in one place: imported late, and without loading what is not needed of it.

pvlib imports h5py, for a map of turbidity that is not used here. h5py's wheels bring an HDF5
library of their own, which does not load where QGIS's GDAL has loaded another one. So h5py is
loaded only when something of it is asked for.
"""

import importlib
import sys
from types import ModuleType


def load(name):
    """Import a module of pvlib, such as ``solarposition``."""
    if "pvlib" in sys.modules or "h5py" in sys.modules:
        return importlib.import_module(f"pvlib.{name}")
    sys.modules["h5py"] = _Later("h5py")
    try:
        return importlib.import_module(f"pvlib.{name}")
    finally:
        del sys.modules["h5py"]


class _Later(ModuleType):
    """Stands for a module that is imported when something of it is asked for."""

    def __getattr__(self, name):
        if name.startswith("__"):  # which whoever looks through all modules asks for
            raise AttributeError(name)
        return getattr(importlib.import_module(self.__name__), name)
