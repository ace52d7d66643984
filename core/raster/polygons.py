"""Outlines of voids as polygons: made along the cells' edges, and written as a vector layer."""

import os

import numpy as np

from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.raster._gdal import load, session
from demsmith.core.raster.layers import (
    as_columns,
    attributes,
    check_layer_output,
    fields_of,
    write_layer,
)
from demsmith.core.raster.outputs import whole_or_nothing

# Voids that are outlined at once, and cells of the smallest raster that holds these.
_MOST_VOIDS = 1000
_MOST_CELLS = 1 << 22


def polygons_of(voids, grid):
    """Outline each void along the edges of its cells.

    Parameters
    ----------
    voids : demsmith.core.voids.Voids
        Or anything else that has a length, ``runs`` and ``first_run``: no array of the raster's
        size is needed, so that voids of a whole mosaic can be outlined.
    grid : Grid
        The raster's, which the runs' rows and columns count in.

    Yields
    ------
    bytes
        A polygon, with a hole for each island of known ground, in the grid's coordinates, as
        well-known binary; one for each void, in their order.

    Raises
    ------
    DependencyError
        If GDAL's bindings are missing.

    Notes
    -----
    A void is 4-connected, so it is one polygon; where two of its cells share only a corner, its
    rings touch there.
    """
    for first, last, box in _groups(voids):
        yield from _outlines(voids, first, last, box, grid)


def write_polygons(path, voids, grid, columns, *, overwrite=False, progress=SILENT):
    """Write the outlines of voids with their attributes as GeoPackage or GeoJSON.

    Parameters
    ----------
    path : str or path-like
        A file ending in ``.gpkg`` or ``.geojson``. An existing file is replaced with all its
        layers.
    voids, grid
        As in `polygons_of`.
    columns : mapping of str to (V,) array
        The attributes by name, of integer, real, bool or text type; ``vars`` of a
        `demsmith.core.voids.VoidTable` gives them. NaN is written as no value.
    overwrite : bool
        Whether an existing file may be replaced.
    progress : Progress
        Told how much has been written.

    Returns
    -------
    str
        The path.

    Raises
    ------
    InputError
        As `demsmith.core.raster.layers.check_layer_output` and `as_columns`.
    OutputError
        If the file cannot be written there, or not to its end.
    Cancelled
        If ``progress`` says so; nothing is left behind.
    """
    path = os.fspath(path)
    check_layer_output(path, crs=grid.crs, overwrite=overwrite)
    columns = as_columns(columns, len(voids), "voids")
    with whole_or_nothing(path) as unfinished:
        write_layer(
            unfinished, load().ogr.wkbPolygon, fields_of(columns),
            _features(voids, grid, columns, progress), crs=grid.crs,
        )  # fmt: skip
        checkpoint(progress, 1.0)
    return path


def _groups(voids):
    """Yield first and past-the-last void of groups worth outlining at once, and their box.

    The box is first row, past the last row, first column and past the last column.
    """
    if not len(voids):
        return
    begins = voids.first_run[:-1]
    boxes = np.column_stack([
        voids.runs[begins, 0],
        voids.runs[voids.first_run[1:] - 1, 0] + 1,
        np.minimum.reduceat(voids.runs[:, 1], begins),
        np.maximum.reduceat(voids.runs[:, 2], begins),
    ]).tolist()  # fmt: skip
    first, box = 0, boxes[0]
    for void, (top, bottom, left, right) in enumerate(boxes):
        joint = [min(box[0], top), max(box[1], bottom), min(box[2], left), max(box[3], right)]
        cells = (joint[1] - joint[0]) * (joint[3] - joint[2])
        if void > first and (void - first == _MOST_VOIDS or cells > _MOST_CELLS):
            yield first, void, box
            first, joint = void, boxes[void]
        box = joint
    yield first, len(voids), box


def _outlines(voids, first, last, box, grid):
    """Polygonize the voids from ``first`` to before ``last`` in a raster of their box."""
    top, bottom, left, right = box
    numbers = np.zeros((bottom - top, right - left), np.int32)
    for number, void in enumerate(range(first, last), start=1):
        runs = voids.runs[voids.first_run[void] : voids.first_run[void + 1]] - (top, left, left)
        for row, begin, end in runs.tolist():
            numbers[row, begin:end] = number
    x, width, _, y, _, height = grid.geotransform
    corner = (x + left * width, width, 0, y + top * height, 0, height)
    polygons = [b""] * (last - first)
    for number, polygon in _polygonized(numbers, corner):
        polygons[number - 1] = polygon
    return polygons


def _polygonized(numbers, geotransform):
    """Give number and polygon of each 4-connected set of cells that hold a number but 0."""
    gdal, ogr = load().gdal, load().ogr
    height, width = numbers.shape
    with session() as heard:
        raster = gdal.GetDriverByName("MEM").Create("", width, height, 1, gdal.GDT_Int32)
        raster.SetGeoTransform(geotransform)
        band = raster.GetRasterBand(1)
        band.WriteRaster(0, 0, width, height, numbers.tobytes())
        # GDAL 3.11 put the vectors in memory under MEM too.
        driver = gdal.GetDriverByName("Memory") or gdal.GetDriverByName("MEM")
        outlines = driver.Create("", 0, 0, 0, gdal.GDT_Unknown)
        layer = outlines.CreateLayer("", None, ogr.wkbPolygon)
        layer.CreateField(ogr.FieldDefn("number", ogr.OFTInteger))
        heard.attempt(gdal.Polygonize, band, band, layer, 0)
        return [
            (feature.GetField(0), bytes(feature.GetGeometryRef().ExportToWkb()))
            for feature in layer
        ]


def _features(voids, grid, columns, progress):
    ogr = load().ogr
    outlines = zip(polygons_of(voids, grid), attributes(columns, len(voids)), strict=True)
    for void, (outline, values) in enumerate(outlines):
        if void % _MOST_VOIDS == 0:
            checkpoint(progress, void / len(voids))
        yield ogr.CreateGeometryFromWkb(outline), values
