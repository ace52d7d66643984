"""The fills that are compared: Demsmith's own, GDAL's and scikit-image's."""

import importlib.util
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import DependencyError, InputError
from demsmith.core.options import specifications
from demsmith.core.progress import checkpoint
from demsmith.core.raster.peer import gdal_fill
from demsmith.core.voids.labelling import find_voids
from demsmith.core.voids.options import FillOptions

LARGEST_BIHARMONIC = 50_000
"""Largest hole [cells] that scikit-image fills: its matrix takes seconds, which cannot be
interrupted, and a gigabyte for a few of that size."""

_BATCH_CELLS = 15_000  # that scikit-image fills between two looks at the progress
_BATCHES = 50  # each of them copies the raster


@dataclass(frozen=True)
class Trial:
    """Ground of which some is hidden.

    Attributes
    ----------
    values : (H, W) float array
        Elevations [m], NaN in voids.
    void : (H, W) bool array
        The cells to be filled, hidden ones and real voids.
    hidden : (H, W) bool array
        Those of them that will be scored.
    pixel_size : optional
        Ground metres per cell, see `demsmith.core.mcmd.lattice.metres`.
    threads : int or None
    """

    values: np.ndarray
    void: np.ndarray
    hidden: np.ndarray
    pixel_size: object = None
    threads: int | None = None


@dataclass(frozen=True)
class Estimate:
    """What a method made of a trial.

    Attributes
    ----------
    values : (H, W) float array
        Elevations [m], NaN where the method gave none.
    sigma : (H, W) float array or None
        Their standard error [m] as the method states it.
    seconds : float
        What the fill took.
    """

    values: np.ndarray
    sigma: np.ndarray | None
    seconds: float


@dataclass(frozen=True)
class Method:
    """A way to fill voids.

    Attributes
    ----------
    name : str
        What the user calls it.
    title : str
    fill : callable
        Takes a `Trial` and a `Progress`, gives an `Estimate`.
    module : str
        What it imports that Demsmith can do without; empty if there is none.
    library : str
        What that is called.
    """

    name: str
    title: str
    fill: Callable
    module: str = ""
    library: str = ""

    def available(self):
        """Tell whether its library is there."""
        return not self.module or importlib.util.find_spec(self.module) is not None


def _by_demsmith(method, trial, progress):
    from demsmith.core.voids.filling import fill_voids  # which may itself learn by validation

    begin = time.perf_counter()
    filled = fill_voids(
        trial.values, trial.void, method=method, pixel_size=trial.pixel_size,
        threads=trial.threads, progress=progress,
    )  # fmt: skip
    return Estimate(filled.values, getattr(filled, "sigma", None), time.perf_counter() - begin)


def _by_gdal(smoothings, trial, progress):
    checkpoint(progress, 0.0)
    values, seconds = gdal_fill(trial.values, trial.void, smoothings=smoothings)
    checkpoint(progress, 1.0)
    return Estimate(values, None, seconds)


def _by_biharmonic(trial, progress):
    """Fill by scikit-image's ``inpaint_biharmonic``, region by region, real voids left out.

    It is called for some regions at a time, so that it can be stopped, but with the whole raster,
    whose range is that of what it gives.
    """
    from skimage.restoration import inpaint_biharmonic

    regions, wanted = _regions(trial)
    low = trial.values[~trial.void].min()
    values = np.where(trial.void, low, trial.values).astype(np.float64)
    cells = int(regions.cells[wanted].sum())
    parts = min(cells // _BATCH_CELLS + 1, _BATCHES)
    seconds = 0.0
    for first, last in parallel.even_spans(regions.cells[wanted], parts):
        checkpoint(progress, first / wanted.size)
        chosen = np.zeros(len(regions) + 1, bool)
        chosen[wanted[first:last] + 1] = True
        mask = chosen[regions.labels] & trial.void
        begin = time.perf_counter()
        values = inpaint_biharmonic(values, mask, split_into_regions=True)
        seconds += time.perf_counter() - begin
    filled = np.zeros(len(regions) + 1, bool)
    filled[wanted + 1] = True
    values[trial.void & ~filled[regions.labels]] = np.nan
    checkpoint(progress, 1.0)
    return Estimate(values, None, seconds)


def _regions(trial):
    """Find the regions that scikit-image solves as one, voids that nearly touch; and which to do.

    Those are the ones with hidden cells, but for too large ones.
    """
    from scipy.ndimage import binary_dilation

    regions = find_voids(binary_dilation(trial.void))
    label = regions.labels
    hidden = np.bincount(label[trial.hidden], minlength=len(regions) + 1)[1:]
    void = np.bincount(label[trial.void], minlength=len(regions) + 1)[1:]
    return regions, np.flatnonzero((hidden > 0) & (void <= LARGEST_BIHARMONIC))


_DEMSMITH = next(spec for spec in specifications(FillOptions) if spec.name == "method").choices
METHODS = {
    method.name: method
    for method in (
        *(Method(name, f"Demsmith {name}", partial(_by_demsmith, name)) for name in _DEMSMITH),
        Method("gdal", "GDAL FillNodata", partial(_by_gdal, 0), "osgeo", "GDAL"),
        Method("gdal-smooth", "GDAL, 2 smoothings", partial(_by_gdal, 2), "osgeo", "GDAL"),
        Method("biharmonic", "scikit-image biharmonic", _by_biharmonic, "skimage", "scikit-image"),
    )
}
"""The methods that can be compared, by name."""


def chosen_methods(names=None):
    """Look up methods by name.

    Parameters
    ----------
    names : sequence of str, optional
        Default: all whose libraries are there.

    Returns
    -------
    tuple of Method
    tuple of Method
        Those left out for want of a library.

    Raises
    ------
    InputError
        If there is no such method, or one is named twice, or none.
    DependencyError
        If one that was named wants its library.
    """
    if names is None:
        there = tuple(method for method in METHODS.values() if method.available())
        return there, tuple(method for method in METHODS.values() if method not in there)
    if not names:
        raise InputError(f"no method is given; choose from {', '.join(METHODS)}")
    for name in names:
        if name not in METHODS:
            raise InputError(f"there is no method '{name}'; choose from {', '.join(METHODS)}")
        if not METHODS[name].available():
            raise DependencyError(
                f"method {name} needs {METHODS[name].library}; install it or leave the method out"
            )
    if len(set(names)) < len(names):
        raise InputError(f"a method is named twice: {', '.join(names)}")
    return tuple(METHODS[name] for name in names), ()
