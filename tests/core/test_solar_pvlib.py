"""pvlib without h5py, whose HDF5 library does not load beside that of QGIS's GDAL."""

import subprocess
import sys

SCRIPT = """
import sys
import pandas
from demsmith.core.solar import _pvlib
clearsky = _pvlib.load("clearsky")
assert not [name for name in sys.modules if name.startswith("h5py")]
assert not hasattr(clearsky.h5py, "__file__")
# Who needs it gets it.
june = pandas.DatetimeIndex(["2024-06-01"], tz="UTC")
assert 2 < clearsky.lookup_linke_turbidity(june, 46, 7).iloc[0] < 5
assert "h5py" in sys.modules
import h5py
assert h5py.version.hdf5_version
assert _pvlib.load("clearsky") is clearsky
"""


def test_h5py_is_loaded_when_it_is_needed_and_not_before():
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
