"""Rasters on disk and in memory: reading, writing, and where their cells and voids are.

The only package that meets GDAL, at first use: importing it needs none.
"""

from demsmith.core.raster.grid import XY, Grid, PixelSize, Shape
from demsmith.core.raster.outputs import check_output, check_place, whole_or_nothing
from demsmith.core.raster.raster import BandMeta, Raster
from demsmith.core.raster.reading import read
from demsmith.core.raster.writing import Written, write

read_raster = read
write_raster = write

__all__ = [
    "XY",
    "BandMeta",
    "Grid",
    "PixelSize",
    "Raster",
    "Shape",
    "Written",
    "check_output",
    "check_place",
    "read",
    "read_raster",
    "whole_or_nothing",
    "write",
    "write_raster",
]
