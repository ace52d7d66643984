"""Reading samples from a file of any kind: a table of numbers, or a vector layer."""

import os

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT
from demsmith.core.raster.table import is_table, read_table
from demsmith.core.raster.vector import read_features


def read_samples_file(
    path, *, layer=None, field=None, x=None, y=None, z=None, crs="", source_crs="", progress=SILENT
):
    """Read points and lines with elevations from a table or a vector layer.

    Which of the two it is, the extension tells (``.csv .tsv .txt .xyz .dat`` are tables).

    Parameters
    ----------
    path : str or path-like
        Table or vector file.
    layer, field
        As in `read_features`; a table has no layers, and its ``field`` is its ``z``.
    x, y, z
        As in `read_table`; only for tables.
    crs, source_crs, progress
        As in both.

    Returns
    -------
    Features

    Raises
    ------
    InputError
        As `read_features` and `read_table`, or if an option is of no use to this file.
    Cancelled
        If ``progress`` says so.
    """
    path = os.fspath(path)
    common = dict(crs=crs, source_crs=source_crs, progress=progress)
    if is_table(path):
        if layer is not None:
            raise InputError(f"'{path}' is a table, which has no layer '{layer}'")
        if None not in (field, z) and field != z:
            raise InputError(f"elevation of '{path}' asked from both '{field}' and '{z}'")
        return read_table(path, x=x, y=y, z=field if z is None else z, **common)
    if (x, y, z) != (None, None, None):
        raise InputError(
            f"'{path}' is no table, so its coordinates are no columns: "
            "the attribute that holds its elevations is its field"
        )
    return read_features(path, layer=layer, field=field, **common)
