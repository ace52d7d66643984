"""Rasters on disk and in memory: reading, writing, and where their cells and voids are.

And points and lines, as samples of elevations: read and written.

The only package that meets GDAL, at first use: importing it needs none.
"""

from demsmith.core.raster.features import Features
from demsmith.core.raster.grid import XY, Grid, PixelSize, Shape
from demsmith.core.raster.outputs import (
    all_or_nothing,
    check_output,
    check_place,
    whole_or_nothing,
)
from demsmith.core.raster.points import write_points
from demsmith.core.raster.raster import BandMeta, Raster
from demsmith.core.raster.reading import read, read_grid
from demsmith.core.raster.samples_file import read_samples_file
from demsmith.core.raster.table import read_table
from demsmith.core.raster.vector import read_features
from demsmith.core.raster.writing import Written, write

read_raster = read
write_raster = write

__all__ = [
    "XY",
    "BandMeta",
    "Features",
    "Grid",
    "PixelSize",
    "Raster",
    "Shape",
    "Written",
    "all_or_nothing",
    "check_output",
    "check_place",
    "read",
    "read_features",
    "read_grid",
    "read_raster",
    "read_samples_file",
    "read_table",
    "whole_or_nothing",
    "write",
    "write_points",
    "write_raster",
]
