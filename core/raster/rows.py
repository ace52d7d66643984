"""Writing a table without geometry, whole or not at all."""

import csv
import os

from demsmith.core.raster._gdal import load
from demsmith.core.raster.layers import check_layer_output, write_layer
from demsmith.core.raster.outputs import cannot_write, whole_or_nothing

_TEXT = ".csv"


def check_rows_output(path, *, inputs=(), overwrite=False):
    """Refuse a table that cannot be written, before any work is done for it.

    Parameters and errors are those of `demsmith.core.raster.layers.check_layer_output`; text,
    ``.csv``, is allowed too.
    """
    # Without coordinates, any format can tell their CRS.
    check_layer_output(path, crs="EPSG:4326", inputs=inputs, overwrite=overwrite, tables=(_TEXT,))


def write_rows(path, rows, *, overwrite=False):
    """Write a table as text, GeoPackage or GeoJSON, by the path's extension.

    Parameters
    ----------
    path : str or path-like
        A file ending in ``.csv``, ``.gpkg`` or ``.geojson``. An existing file is replaced with all
        its layers.
    rows : list of dict
        With the same keys, the columns' names; values are text or numbers, ``None`` for none.
    overwrite : bool
        Whether an existing file may be replaced.

    Returns
    -------
    str
        The path.

    Raises
    ------
    InputError
        As `check_rows_output`.
    OutputError
        If the file cannot be written there, or not to its end.
    """
    path = os.fspath(path)
    check_rows_output(path, overwrite=overwrite)
    with whole_or_nothing(path) as unfinished:
        if path.lower().endswith(_TEXT):
            _write_text(unfinished, rows)
        else:
            fields = [_field(name, [row[name] for row in rows]) for name in rows[0]]
            features = ((None, row.values()) for row in rows)
            write_layer(unfinished, load().ogr.wkbNone, fields, features)
    return path


def _write_text(path, rows):
    try:
        with open(path, "w", encoding="utf-8", newline="") as file:
            table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            table.writeheader()
            table.writerows(rows)
    except OSError as error:
        raise cannot_write(path, error.strerror) from None


def _field(name, values):
    """Describe a column by the type of its values."""
    ogr = load().ogr
    kinds = {type(value) for value in values if value is not None}
    if str in kinds:
        return ogr.FieldDefn(name, ogr.OFTString)
    return ogr.FieldDefn(name, ogr.OFTInteger64 if kinds == {int} else ogr.OFTReal)
