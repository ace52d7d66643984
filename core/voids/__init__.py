"""Voids: finding them, filling them, and telling what was done."""

from demsmith.core.voids.filling import Filled, fill_voids
from demsmith.core.voids.job import FillResult, fill_file
from demsmith.core.voids.labelling import Rims, Voids, find_voids, survey_rims
from demsmith.core.voids.options import FillOptions
from demsmith.core.voids.sources import FILLED, LEFT, ORIGINAL
from demsmith.core.voids.table import VoidTable

__all__ = [
    "FILLED",
    "LEFT",
    "ORIGINAL",
    "Filled",
    "FillOptions",
    "FillResult",
    "Rims",
    "VoidTable",
    "Voids",
    "fill_file",
    "fill_voids",
    "find_voids",
    "survey_rims",
]
