"""Rasters on disk and in memory: reading, writing, and where their cells and voids are.

And points and lines, as samples of elevations, read and written; lines, and outlines of voids,
written.

The only package that meets GDAL, at first use: importing it needs none.
"""

from demsmith.core.raster.features import Features
from demsmith.core.raster.geographic import Places, north_up, places_of
from demsmith.core.raster.grid import XY, Grid, PixelSize, Shape
from demsmith.core.raster.lines import write_lines
from demsmith.core.raster.outputs import (
    all_or_nothing,
    check_output,
    check_outputs,
    check_place,
    whole_or_nothing,
)
from demsmith.core.raster.points import write_points
from demsmith.core.raster.polygons import polygons_of, write_polygons
from demsmith.core.raster.raster import BandMeta, Raster
from demsmith.core.raster.reading import read, read_grid, read_header
from demsmith.core.raster.rows import check_rows_output, write_rows
from demsmith.core.raster.samples_file import read_samples_file
from demsmith.core.raster.table import read_table
from demsmith.core.raster.tile_paths import tile_paths
from demsmith.core.raster.tileset import (
    CellRules,
    Tile,
    TileSet,
    elevations,
    elevations_m,
    height_unit,
    open_tiles,
    shifted,
)
from demsmith.core.raster.vector import read_features
from demsmith.core.raster.virtual import write_vrt
from demsmith.core.raster.writing import Written, write, write_bands

read_raster = read
write_raster = write

__all__ = [
    "XY",
    "BandMeta",
    "CellRules",
    "Features",
    "Grid",
    "PixelSize",
    "Places",
    "Raster",
    "Shape",
    "Tile",
    "TileSet",
    "Written",
    "all_or_nothing",
    "check_output",
    "check_outputs",
    "check_place",
    "check_rows_output",
    "elevations",
    "elevations_m",
    "height_unit",
    "north_up",
    "open_tiles",
    "places_of",
    "polygons_of",
    "read",
    "read_features",
    "read_grid",
    "read_header",
    "read_raster",
    "read_samples_file",
    "read_table",
    "shifted",
    "tile_paths",
    "whole_or_nothing",
    "write",
    "write_bands",
    "write_lines",
    "write_points",
    "write_polygons",
    "write_raster",
    "write_rows",
    "write_vrt",
]
