"""Inverse procedural modelling: terrain as parameters of functions, evaluated at any resolution."""

from demsmith.core.procedural.file import PlacedTerrain, read_terrain, write_terrain
from demsmith.core.procedural.job import ProceduralizeResult, proceduralize_file
from demsmith.core.procedural.options import OutputOptions, ProceduralizeOptions
from demsmith.core.procedural.selection import select
from demsmith.core.procedural.terrain import ProceduralTerrain, proceduralize

__all__ = [
    "OutputOptions",
    "PlacedTerrain",
    "ProceduralTerrain",
    "ProceduralizeOptions",
    "ProceduralizeResult",
    "proceduralize",
    "proceduralize_file",
    "read_terrain",
    "select",
    "write_terrain",
]
