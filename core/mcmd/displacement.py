"""How strong the random displacements are, and where."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from demsmith.core.mcmd.maps import as_map


class Noise(NamedTuple):
    """A `Displacement` as its kernels read it: parameters as arrays, of one cell if one number."""

    strength: Any
    h: Any
    r_t: Any
    seed: int
    levels: int


@dataclass(frozen=True)
class Displacement:
    """The noise of equation 1, made precise (Belhadj 2007, section 3.1).

    The displacement of a midpoint of level ``r`` (1 is the lattice's first) is
    ``(u + r_t) * strength * 2**(-r * 2 * h)`` with ``u`` uniform in [-1, 1). Strength, ``h`` and
    ``r_t`` are numbers, or (H, W) maps in which the midpoint finds its own.

    Attributes
    ----------
    strength : float or array
        ``r_s`` times the reference relief [m].
    h : float or array
        The paper's H.
    r_t : float or array
        Shift, in units of the strength.
    seed : int
    levels : int
        Levels of the lattice.
    """

    strength: Any
    h: Any
    r_t: Any
    seed: int
    levels: int

    def noise(self, shape):
        """Make of it what the kernels read, for a raster of ``shape``."""
        maps = (as_map(each, shape) for each in (self.strength, self.h, self.r_t))
        return Noise(*maps, self.seed, self.levels)


def displacement_of(options, by_cell, values, known, lattice):
    """Make the displacement that options and maps ask for.

    Parameters
    ----------
    options : McmdOptions
    by_cell : Maps
        Laid over the options, see `demsmith.core.mcmd.Maps.over`.
    values : (H, W) array
    known : (H, W) bool array
        Where their range is the reference relief, unless the options give one.
    lattice : Lattice

    Returns
    -------
    Displacement or None
        None if the strength is 0 everywhere.
    """
    if not np.any(by_cell.r_s):
        return None
    relief = options.relief
    if relief is None:
        ground = values[known]
        relief = float(ground.max()) - float(ground.min())
    return Displacement(by_cell.r_s * relief, by_cell.h, by_cell.r_t, options.seed, lattice.levels)
