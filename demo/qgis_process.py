"""Running a tool of this checkout through the real ``qgis_process``."""

import json
import os
import shutil
import subprocess
import sysconfig
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[1]


def find():
    """Give the path of ``qgis_process``, None where QGIS is not installed.

    Debian 12's wrapper hands its program a flag that it does not know, so that is called itself.
    """
    return shutil.which("qgis_process.bin") or shutil.which("qgis_process")


def run(algorithm, parameters, *, folder):
    """Run a tool of Demsmith and return its results.

    Parameters
    ----------
    algorithm : str
        Such as ``demsmith:fillvoids``.
    parameters : dict
        Its parameters by name.
    folder : path
        Where QGIS keeps its profile; the user's own is not touched.

    Raises
    ------
    RuntimeError
        With what ``qgis_process`` said, if it failed.
    """
    variables = environment(folder)
    _enable(variables)
    said = _call(
        variables, "--json", "run", algorithm,
        *(f"--{name}={value}" for name, value in parameters.items()),
    )  # fmt: skip
    return json.loads(said[said.index("{") :])["results"]


def environment(folder):
    """Give the environment variables of a QGIS that keeps all in ``folder``, with this checkout.

    Parameters
    ----------
    folder : path
        Made if it does not exist.

    Returns
    -------
    dict
    """
    folder = Path(folder).resolve()
    plugins, runtime = folder / "plugins", folder / "runtime"
    plugins.mkdir(parents=True, exist_ok=True)
    runtime.mkdir(mode=0o700, exist_ok=True)
    link = plugins / "demsmith"
    if link.is_symlink():
        link.unlink()
    link.symlink_to(CHECKOUT)
    return {
        **os.environ,
        "HOME": str(folder),
        "XDG_RUNTIME_DIR": str(runtime),
        "QGIS_CUSTOM_CONFIG_PATH": str(folder / "profile"),
        "QT_QPA_PLATFORM": "offscreen",
        "QGIS_PLUGINPATH": str(plugins),
        "PYTHONPATH": sysconfig.get_paths()["purelib"],
    }


def _enable(variables):
    try:
        _call(variables, "plugins", "enable", "demsmith")
    except RuntimeError as error:
        # A profile kept from an earlier run has it enabled, which QGIS counts as a failure.
        if "already enabled" not in str(error):
            raise


def _call(variables, *arguments):
    done = subprocess.run(
        [find(), *arguments], env=variables, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"qgis_process failed:\n{done.stdout}\n{done.stderr}")
    return done.stdout
