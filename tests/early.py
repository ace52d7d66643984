"""Pytest plugin that is loaded before all others: gives the run a home of its own, and finds QGIS.

pytest-qgis starts QGIS while it is loaded, long before any conftest, and aborts the process where
Qt has no screen; so what it needs is set here, at import. Where Python has no QGIS, pytest-qgis is
blocked and `tests/qgis` is one skipped test that says why.
"""

import atexit
import importlib
import os
import shutil
import sys
import tempfile
from pathlib import Path

import pytest

PROCESSING = "/usr/share/qgis/python/plugins"
QGIS_TESTS = Path(__file__).parent / "qgis"


def _isolate():
    """Point everything that would read or write the user's own files to a folder that goes away."""
    home = Path(tempfile.mkdtemp(prefix="demsmith-tests-"))
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    runtime = home / "run"
    runtime.mkdir(mode=0o700)
    for name in list(os.environ):
        if name.startswith("XDG_"):
            del os.environ[name]
    os.environ |= {
        "HOME": str(home),
        "XDG_RUNTIME_DIR": str(runtime),
        "QT_QPA_PLATFORM": "offscreen",
        "PYTHONNOUSERSITE": "1",
    }


def _missing_qgis():
    """Tell why QGIS cannot be used; empty if it can."""
    try:
        importlib.import_module("osgeo.gdal")
        importlib.import_module("qgis.core")
    except ImportError as error:
        return f"this Python has no QGIS ({error}); `make env` as root installs it"
    return ""


_isolate()
if Path(PROCESSING).is_dir():
    sys.path.append(PROCESSING)
MISSING_QGIS = _missing_qgis()


def pytest_addoption(parser, pluginmanager):
    if MISSING_QGIS:
        pluginmanager.set_blocked("pytest_qgis")


def pytest_configure(config):
    # Tests side by side are told of a terminal of 80 columns that they do not have.
    for name in ("COLUMNS", "LINES"):
        os.environ.pop(name, None)
    from hypothesis import settings

    # The first example of a kernel compiles it, and a busy machine is slow: no time limits. The
    # same examples in every run, so that a failure is the change's and can be repeated.
    settings.register_profile("house", deadline=None, derandomize=True)
    settings.load_profile("house")


@pytest.hookimpl(tryfirst=True)
def pytest_collect_directory(path, parent):
    if MISSING_QGIS and path == QGIS_TESTS:
        return _WithoutQgis.from_parent(parent, name=path.name)
    return None


class _WithoutQgis(pytest.Collector):
    def collect(self):
        pytest.skip(MISSING_QGIS)
