"""Writing lines with attributes as a vector layer, whole or not at all."""

import os
import struct

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.raster._gdal import load
from demsmith.core.raster.layers import (
    as_columns,
    attributes,
    check_layer_output,
    fields_of,
    write_layer,
)
from demsmith.core.raster.outputs import whole_or_nothing

_LINES_AT_ONCE = 1000
_LITTLE_ENDIAN, _LINE_STRING = 1, 2


def write_lines(path, xy, first_vertex, columns, *, crs="", overwrite=False, progress=SILENT):
    """Write lines with their attributes as GeoPackage or GeoJSON.

    Parameters
    ----------
    path : str or path-like
        A file ending in ``.gpkg`` or ``.geojson``. An existing file is replaced with all its
        layers.
    xy : array_like, shape (N, 2)
        Vertices of all lines, one line after the other; easting or longitude first.
    first_vertex : array_like of int, shape (L + 1,)
        Where in ``xy`` each line begins, and N at last; two vertices or more make a line.
    columns : mapping of str to (L,) array
        The attributes by name, of integer, real, bool or text type. NaN is written as no value.
    crs : str
        WKT, or anything else GDAL takes.
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
        As `demsmith.core.raster.layers.check_layer_output` and `as_columns`, or if a line has
        fewer than two vertices.
    OutputError
        If the file cannot be written there, or not to its end.
    Cancelled
        If ``progress`` says so; nothing is left behind.
    """
    path = os.fspath(path)
    check_layer_output(path, crs=crs, overwrite=overwrite)
    first_vertex = np.asarray(first_vertex)
    if np.any(np.diff(first_vertex) < 2):
        raise InputError("a line needs two vertices or more")
    columns = as_columns(columns, len(first_vertex) - 1, "lines")
    with whole_or_nothing(path) as unfinished:
        write_layer(
            unfinished, load().ogr.wkbLineString, fields_of(columns),
            _features(np.asarray(xy, "<f8"), first_vertex.tolist(), columns, progress), crs=crs,
        )  # fmt: skip
        checkpoint(progress, 1.0)
    return path


def _features(xy, first_vertex, columns, progress):
    ogr = load().ogr
    count = len(first_vertex) - 1
    for line, values in enumerate(attributes(columns, count)):
        if line % _LINES_AT_ONCE == 0:
            checkpoint(progress, line / count)
        vertices = xy[first_vertex[line] : first_vertex[line + 1]]
        head = struct.pack("<BII", _LITTLE_ENDIAN, _LINE_STRING, len(vertices))
        yield ogr.CreateGeometryFromWkb(head + vertices.tobytes()), values
