"""Constrained midpoint displacement (MCMD; Belhadj 2007, AFRIGRAPH, pages 197 to 204)."""

from demsmith.core.mcmd.displacement import Displacement
from demsmith.core.mcmd.lattice import Lattice
from demsmith.core.mcmd.options import McmdOptions
from demsmith.core.mcmd.passes import bottom_up, interpolate
from demsmith.core.mcmd.relaxed import relax_voids

__all__ = ["Displacement", "Lattice", "McmdOptions", "bottom_up", "interpolate", "relax_voids"]
