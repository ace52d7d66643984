"""Drainage: where water flows, and how much ground lies above each cell."""

from demsmith.core.hydrology.breaching import breach_depressions
from demsmith.core.hydrology.depressions import fill_depressions
from demsmith.core.hydrology.directions import d8_directions
from demsmith.core.hydrology.drainage import Drainage, drainage_area
from demsmith.core.hydrology.flats import resolve_flats
from demsmith.core.hydrology.job import DrainageResult, drainage_file
from demsmith.core.hydrology.options import DrainageOptions
from demsmith.core.hydrology.outputs import Outputs
from demsmith.core.hydrology.streams import Streams, find_streams

__all__ = [
    "Drainage",
    "DrainageOptions",
    "DrainageResult",
    "Outputs",
    "Streams",
    "breach_depressions",
    "d8_directions",
    "drainage_area",
    "drainage_file",
    "fill_depressions",
    "find_streams",
    "resolve_flats",
]
