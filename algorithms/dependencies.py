"""Which libraries are missing or too old, and the command that installs them.

This file has to run where Demsmith itself cannot: it is written for Python 3.9 and imports
neither the core nor the libraries it looks for.
"""

import os
import re
import sys
from importlib import metadata

from qgis.core import QgsApplication
from qgis.PyQt.QtCore import QCoreApplication

OLDEST_PYTHON = (3, 11)
OLDEST_NUMPY = "1.26"
REQUIREMENTS = ("numpy>=" + OLDEST_NUMPY, "numba>=0.59", "geographiclib>=2.0", "scipy>=1.11")
# What some tools need: compression, tuning, images, sunlight, validation. Without them the others
# still work.
EXTRAS = ("msgpack>=1.0", "nlopt>=2.7", "openimageio>=3.0", "pvlib>=0.11", "scikit-image>=0.22")


def _tr(text):
    return QCoreApplication.translate("Demsmith", text)


def python_suffices():
    """Tell whether this QGIS's Python is new enough for Demsmith."""
    return sys.version_info >= OLDEST_PYTHON


def profile_folder():
    """Name the folder of the user's profile where the plugin qpip installs libraries.

    Returns
    -------
    str
        ``<profile>/python/dependencies/<Python version>``; it need not exist.
    """
    version = "{}.{}".format(*sys.version_info[:2])
    return os.path.join(
        os.path.normpath(QgsApplication.qgisSettingsDirPath()), "python", "dependencies", version
    )


def use_profile_folder():
    """Let Python import from the profile's folder: qpip does so in the QGIS window only."""
    folder = profile_folder()
    if os.path.isdir(folder) and folder not in sys.path:
        sys.path.insert(0, folder)


def wanting():
    """List the libraries that are missing or too old.

    Returns
    -------
    list of str
        What pip would have to install, as ``numba>=0.59``.
    """
    missing = []
    for requirement in REQUIREMENTS:
        name, oldest = requirement.split(">=")
        if _numbers(_installed(name)) < _numbers(oldest):
            missing.append(requirement)
    return missing


def problem():
    """Say in words what keeps Demsmith from working here, and the command that helps.

    Returns
    -------
    str
        Empty if nothing does.
    """
    if not python_suffices():
        return _tr(
            "Demsmith needs Python {} or newer and this QGIS brings Python {}. "
            "Please use a newer QGIS, or the command line of Demsmith."
        ).format(".".join(map(str, OLDEST_PYTHON)), "{}.{}".format(*sys.version_info[:2]))
    missing = wanting()
    if not missing:
        return ""
    return _tr(
        "Demsmith needs {}. Install with the plugin QPIP, or run this in a terminal "
        "and restart QGIS: {}"
    ).format(", ".join(missing), install_command(missing))


def install_command(requirements):
    """Give the command that installs libraries into the user's profile.

    Left alone, pip would put the newest NumPy beside them, for which QGIS's GDAL may not be
    built: so the NumPy that QGIS has is named in the command, or the first one of its kind that
    is new enough.

    Parameters
    ----------
    requirements : iterable of str
        As from `wanting`.
    """
    others = [each for each in requirements if not each.startswith("numpy")]
    return '"{}" -m pip install --upgrade --target "{}" {}'.format(
        _python(), profile_folder(), " ".join(f'"{each}"' for each in [*others, _numpy()])
    )


def _numpy():
    """Name the NumPy that goes with this QGIS."""
    installed = _installed("numpy")
    if _numbers(installed) >= _numbers(OLDEST_NUMPY):
        return "numpy==" + installed
    if installed:
        return f"numpy>={OLDEST_NUMPY},<2"
    return "numpy>=" + OLDEST_NUMPY


def _installed(name):
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""


def _numbers(version):
    return [int(number) for number in re.findall(r"\d+", version)[:3]]


def _python():
    """Name Python's own program: inside QGIS on Windows and macOS, `sys.executable` is QGIS."""
    if os.path.basename(sys.executable).lower().startswith("python"):
        return sys.executable
    for name in ("python.exe", os.path.join("bin", "python3")):
        path = os.path.join(sys.exec_prefix, name)
        if os.path.exists(path):
            return path
    return "python3"
