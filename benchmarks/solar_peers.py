"""Sunlight by other programs: GRASS's r.sun and SAGA's potential incoming solar radiation."""

import os
import re
import resource
import subprocess
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from demsmith.core import raster

_NODATA = -9999.0
_R_SUN_NAMES = {
    "total": "glob_rad",
    "beam": "beam_rad",
    "diffuse": "diff_rad",
    "reflected": "refl_rad",
    "hours": "insol_time",
}


class Timed(NamedTuple):
    """Results of a program by name, and what they cost."""

    layers: dict
    seconds: float
    cpu_seconds: float


class Grass:
    """A DEM in a GRASS project of its own, and r.sun on it; close it after use."""

    def __init__(self, values, grid):
        self._folder = tempfile.TemporaryDirectory()
        self.folder = Path(self._folder.name)
        _write(self.folder / "in.tif", values, grid)
        _run(self.folder, "grass", "-e", "-c", "in.tif", "project")
        # Slope and aspect by Horn's formula, as ours; -e: at the edges, too.
        self._exec(
            "r.in.gdal -o --q input=in.tif output=dem && g.region raster=dem && "
            "r.slope.aspect -e --q elevation=dem slope=slope aspect=aspect"
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._folder.cleanup()

    def day(self, day, declination, *, wanted=("total", "beam"), nprocs=2):
        """Sum up a day by r.sun's defaults: steps of 0.5 h, Linke 3, albedo 0.2 [Wh/m²]."""
        return self._r_sun(wanted, f"day={day} declination={declination:.9f} nprocs={nprocs}")

    def instant(self, day, declination, hour):
        """Give r.sun's beam irradiance [W/m²] where it is ``hour`` o'clock by the Sun itself.

        That is everywhere. (With a civil time, r.sun 8.2's shadows lie in a wrong direction, the
        more so the farther from Greenwich.)
        """
        return self._r_sun(("beam",), f"day={day} declination={declination:.9f} time={hour:.9f}")

    def _r_sun(self, wanted, options):
        outputs = " ".join(f"{_R_SUN_NAMES[name]}={name}" for name in wanted)
        layers = "elevation=dem slope=slope aspect=aspect"
        begin, spent = time.perf_counter(), _children_seconds()
        self._exec(f"r.sun --q --o {layers} {options} {outputs}")
        seconds, cpu = time.perf_counter() - begin, _children_seconds() - spent
        made = {}
        for name in wanted:
            self._exec(f"r.out.gdal --q --o -c -f input={name} output={name}.tif type=Float32")
            made[name] = _read(self.folder / f"{name}.tif")
        return Timed(made, seconds, cpu)

    def _exec(self, command):
        _run(self.folder, "grass", "project/PERMANENT", "--exec", "sh", "-c", command)


def saga_day(values, grid, date, latitude):
    """Sum up a day by SAGA, its lumped atmosphere, steps of 0.5 h [kWh/m²].

    SAGA counts slopes in the units of the grid: only a projected one makes sense.
    """
    with tempfile.TemporaryDirectory() as folder:
        _write(Path(folder) / "in.tif", values, grid)
        begin, spent = time.perf_counter(), _children_seconds()
        _run(
            folder, "saga_cmd", "--cores=2", "ta_lighting", "2", "-GRD_DEM=in.tif",
            "-GRD_DIRECT=direct.sdat", "-GRD_DIFFUS=diffuse.sdat", "-PERIOD=1", f"-DAY={date}",
            "-HOUR_STEP=0.5", "-LOCATION=0", f"-LATITUDE={latitude:.6f}", "-SHADOW=0",
        )  # fmt: skip
        seconds, cpu = time.perf_counter() - begin, _children_seconds() - spent
        layers = {name: _read(Path(folder) / f"{name}.sdat") for name in ("direct", "diffuse")}
        return Timed(layers, seconds, cpu)


def versions():
    """Name the programs with their versions."""
    found = (
        re.search(r"\d+\.\d+\.\d+", _run(".", program, "--version"))
        for program in ("grass", "saga_cmd")
    )
    return ", ".join(
        f"{title} {version.group() if version else '?'}"
        for title, version in zip(("GRASS", "SAGA"), found, strict=True)
    )


def _write(path, values, grid):
    void = ~np.isfinite(values)
    meta = raster.BandMeta(np.dtype(np.float32), nodata=_NODATA)
    raster.write(path, values, like=raster.Raster(values, void, grid, meta), void=void)


def _read(path):
    made = raster.read(path)
    return np.where(made.void, np.nan, made.values)


def _children_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _run(folder, *command):
    environment = {
        **os.environ,
        "GRASS_PYTHON": "/usr/bin/python3",
        "GRASS_MESSAGE_FORMAT": "plain",
    }
    done = subprocess.run(
        list(command), cwd=folder, capture_output=True, text=True, check=False, env=environment
    )
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr[-2000:] or done.stdout[-2000:]}")
    return done.stdout + done.stderr
