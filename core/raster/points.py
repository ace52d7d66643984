"""Writing points with elevations as a vector layer or a table, whole or not at all."""

import os

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.raster._gdal import load
from demsmith.core.raster.layers import check_layer_output, write_layer
from demsmith.core.raster.outputs import cannot_write, whole_or_nothing

_POINTS_AT_ONCE = 10_000
_TABLE = ".csv"


def check_points_output(path, *, crs="", inputs=(), overwrite=False):
    """Refuse an output of points that cannot be written, before any work is done for it.

    Parameters and errors are those of `demsmith.core.raster.layers.check_layer_output`; a table,
    ``.csv``, is allowed too.
    """
    check_layer_output(path, crs=crs, inputs=inputs, overwrite=overwrite, tables=(_TABLE,))


def write_points(path, x, y, z, *, crs="", field="z", overwrite=False, progress=SILENT):
    """Write points with elevations as GeoPackage, GeoJSON or table, by the path's extension.

    A layer's points have the elevation as their z and as an attribute, and no spatial index; a
    table has a header.

    Parameters
    ----------
    path : str or path-like
        A file ending in ``.gpkg``, ``.geojson`` or ``.csv``. An existing file is replaced with
        all its layers.
    x, y, z : array_like, shape (N,)
        Coordinates, easting or longitude first, and elevations; finite.
    crs : str
        WKT, or anything else GDAL takes; a table does not tell it.
    field : str
        Name of the attribute, or column, of the elevation.
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
        As `check_points_output`, or if the arrays differ in length or hold no finite numbers.
    OutputError
        If the file cannot be written there, or not to its end.
    Cancelled
        If ``progress`` says so; nothing is left behind.
    """
    path = os.fspath(path)
    check_points_output(path, crs=crs, overwrite=overwrite)
    columns = [np.ravel(column) for column in (x, y, z)]
    if len({len(column) for column in columns}) > 1:
        raise InputError("x, y and z of the points must be as many")
    if not all(np.isfinite(column).all() for column in columns):
        raise InputError("the points hold coordinates or elevations that are no finite numbers")
    with whole_or_nothing(path) as unfinished:
        if path.lower().endswith(_TABLE):
            _write_table(unfinished, columns, field, progress)
        else:
            ogr = load().ogr
            write_layer(
                unfinished, ogr.wkbPoint25D, [ogr.FieldDefn(field, ogr.OFTReal)],
                _features(columns, progress), crs=crs,
            )  # fmt: skip
        checkpoint(progress, 1.0)
    return path


def _blocks(columns, progress):
    """Yield the points a block at a time, as arrays."""
    count = len(columns[0])
    for start in range(0, count, _POINTS_AT_ONCE):
        checkpoint(progress, start / count)
        block = slice(start, start + _POINTS_AT_ONCE)
        yield [column[block] for column in columns]


def _write_table(path, columns, field, progress):
    """Write each number with as many digits as tell it from its neighbours in its type."""
    try:
        with open(path, "w", encoding="utf-8", newline="\n") as file:
            file.write(f"x,y,{field}\n")
            for block in _blocks(columns, progress):
                texts = [np.asarray(column).astype(str).tolist() for column in block]
                file.writelines(f"{x},{y},{z}\n" for x, y, z in zip(*texts, strict=True))
    except OSError as error:
        raise cannot_write(path, error.strerror) from None


def _features(columns, progress):
    ogr = load().ogr
    point = ogr.Geometry(ogr.wkbPoint25D)
    for block in _blocks(columns, progress):
        for x, y, z in zip(*(column.tolist() for column in block), strict=True):
            point.SetPoint(0, x, y, z)
            yield point, (z,)
