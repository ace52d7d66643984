"""How strong the random displacements are at each level."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Displacement:
    """The noise of equation 1, made precise (Belhadj 2007, section 3.1).

    The displacement of a midpoint of level ``r`` (1 is the lattice's first) is
    ``(u + r_t) * strength * 2**(-r * 2 * h)`` with ``u`` uniform in [-1, 1).

    Attributes
    ----------
    strength : float
        ``r_s`` times the reference relief [m].
    h : float
        The paper's H.
    r_t : float
        Shift, in units of the strength.
    seed : int
    levels : int
        Levels of the lattice.
    """

    strength: float
    h: float
    r_t: float
    seed: int
    levels: int

    def by_level(self):
        """Give the largest displacement at steps 1, 2, 4, … [m].

        Examples
        --------
        >>> Displacement(strength=100, h=0.5, r_t=0, seed=0, levels=3).by_level()
        array([12.5, 25. , 50. ])
        """
        return self.strength * 2.0 ** (-2 * self.h * np.arange(self.levels, 0, -1))
