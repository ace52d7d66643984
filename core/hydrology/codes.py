"""What the codes of flow directions and of flags mean, and their colours."""

from typing import NamedTuple

from demsmith.core.hydrology.directions import VOID_CODE


class Code(NamedTuple):
    """One class of a raster of codes.

    Attributes
    ----------
    code : int
        What the raster's cells hold, 0 to 255.
    name : str
    color : (int, int, int, int)
        Red, green, blue and alpha, 0 to 255.
    """

    code: int
    name: str
    color: tuple


DIRECTIONS = (
    Code(0, "outlet or sink", (20, 20, 20, 255)),
    Code(1, "east", (240, 210, 70, 255)),
    Code(2, "south-east", (238, 153, 62, 255)),
    Code(4, "south", (212, 82, 72, 255)),
    Code(8, "south-west", (176, 74, 140, 255)),
    Code(16, "west", (104, 84, 172, 255)),
    Code(32, "north-west", (62, 122, 196, 255)),
    Code(64, "north", (60, 170, 176, 255)),
    Code(128, "north-east", (142, 198, 92, 255)),
)
"""ESRI's codes of D8, in hues around the compass."""

NO_DIRECTION = VOID_CODE
"""What a raster of directions holds at voids."""

EDGE, FILLED, CHANGED = 1, 2, 4
"""A catchment touches the raster's edge or a void; holds filled cells; holds cells that the
treatment of depressions changed."""

FLAGS = (
    Code(0, "whole catchment, as surveyed", (214, 234, 214, 255)),
    Code(EDGE, "touches edge or void", (250, 196, 96, 255)),
    Code(FILLED, "holds filled cells", (222, 130, 190, 255)),
    Code(EDGE | FILLED, "edge or void; filled cells", (204, 76, 94, 255)),
    Code(CHANGED, "depressions changed", (158, 196, 230, 255)),
    Code(EDGE | CHANGED, "edge or void; depressions changed", (176, 148, 92, 255)),
    Code(FILLED | CHANGED, "filled cells; depressions changed", (132, 104, 180, 255)),
    Code(EDGE | FILLED | CHANGED, "all three", (92, 52, 60, 255)),
)
"""Sums of the flags of a catchment."""

NO_FLAG = 255
"""What a raster of flags holds at voids."""


def colors(codes):
    """Give red, green, blue and alpha, 0 to 255, by code."""
    return {each.code: each.color for each in codes}
