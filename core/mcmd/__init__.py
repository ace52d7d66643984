"""Constrained midpoint displacement (MCMD; Belhadj 2007, AFRIGRAPH, pages 197 to 204)."""

from demsmith.core.mcmd.converged import converge
from demsmith.core.mcmd.displacement import Displacement, displacement_of
from demsmith.core.mcmd.lattice import Lattice
from demsmith.core.mcmd.map_files import MapFiles, read_maps
from demsmith.core.mcmd.maps import Maps
from demsmith.core.mcmd.options import McmdOptions
from demsmith.core.mcmd.passes import bottom_up, interpolate
from demsmith.core.mcmd.relaxed import displace, relax_voids

__all__ = [
    "Displacement",
    "Lattice",
    "MapFiles",
    "Maps",
    "McmdOptions",
    "bottom_up",
    "converge",
    "displace",
    "displacement_of",
    "interpolate",
    "read_maps",
    "relax_voids",
]
