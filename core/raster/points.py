"""Writing points with elevations as a vector layer or a table, whole or not at all."""

import os

import numpy as np

from demsmith.core.errors import InputError, OutputError
from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.raster._gdal import load, session
from demsmith.core.raster.crs import spatial_reference
from demsmith.core.raster.outputs import cannot_write, check_place, whole_or_nothing

_POINTS_AT_ONCE = 10_000
_DRIVERS = {".gpkg": "GPKG", ".geojson": "GeoJSON"}
_LAYER_OPTIONS = {
    # All digits, where the default for degrees is seven.
    "GeoJSON": ["COORDINATE_PRECISION=17", "SIGNIFICANT_FIGURES=17"],
    # The index would take longer than all else, on closing, where cancelling is not heard.
    "GPKG": ["SPATIAL_INDEX=NO"],
}
_EXTENSIONS = (*_DRIVERS, ".csv")


def check_points_output(path, *, crs="", inputs=(), overwrite=False):
    """Refuse an output of points that cannot be written, before any work is done for it.

    Parameters
    ----------
    path, crs, overwrite
        As in `write_points`.
    inputs : iterable of str or path-like
        Files that are read and may not be overwritten.

    Raises
    ------
    InputError
        If the extension is none of ``.gpkg``, ``.geojson``, ``.csv``, the file is an input, or
        the format cannot tell the CRS.
    OutputError
        If the folder is missing or not writable, or the file exists.
    """
    path = os.fspath(path)
    extension = os.path.splitext(path)[1].lower()
    if extension == ".shp":
        raise InputError(
            f"'{path}': a shapefile is several files, which cannot be written whole or not at "
            "all; end its name in .gpkg"
        )
    if extension not in _EXTENSIONS:
        raise InputError(f"output '{path}' must end in one of {', '.join(_EXTENSIONS)}")
    check_place(path, inputs=inputs, overwrite=overwrite)
    if os.path.exists(path + "-wal"):
        raise OutputError(f"'{path}' is open in another program: close it there first")
    if extension == ".geojson":
        _refuse_nameless_crs(crs, path)


def _refuse_nameless_crs(crs, path):
    """GeoJSON names its CRS by authority and code; where it has none, WGS 84 is understood."""
    with session() as heard:
        if crs and spatial_reference(crs, heard).GetAuthorityCode(None) is not None:
            return
    raise InputError(
        f"'{path}': GeoJSON cannot tell a CRS without an EPSG code; write .gpkg or .csv"
    )


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
    write = _write_table if path.lower().endswith(".csv") else _write_layer
    with whole_or_nothing(path) as unfinished:
        write(unfinished, columns, crs, field, progress)
        checkpoint(progress, 1.0)
    return path


def _blocks(columns, progress):
    """Yield the points a block at a time, as lists of plain numbers."""
    count = len(columns[0])
    for start in range(0, count, _POINTS_AT_ONCE):
        checkpoint(progress, start / count)
        block = slice(start, start + _POINTS_AT_ONCE)
        yield [column[block] for column in columns]


def _write_table(path, columns, crs, field, progress):
    """Write each number with as many digits as tell it from its neighbours in its type."""
    try:
        with open(path, "w", encoding="utf-8", newline="\n") as file:
            file.write(f"x,y,{field}\n")
            for block in _blocks(columns, progress):
                texts = [np.asarray(column).astype(str).tolist() for column in block]
                file.writelines(f"{x},{y},{z}\n" for x, y, z in zip(*texts, strict=True))
    except OSError as error:
        raise cannot_write(path, error.strerror) from None


def _write_layer(path, columns, crs, field, progress):
    gdal, ogr = load().gdal, load().ogr
    with session(OGR_SQLITE_SYNCHRONOUS="OFF") as heard:
        driver = gdal.GetDriverByName(_DRIVERS[os.path.splitext(path)[1].lower()])
        dataset = heard.attempt(driver.Create, path, 0, 0, 0, gdal.GDT_Unknown)
        try:
            if dataset is not None:
                reference = spatial_reference(crs, heard) if crs else None
                name = os.path.splitext(os.path.basename(path))[0]
                layer = heard.attempt(
                    dataset.CreateLayer, name, reference, ogr.wkbPoint25D,
                    _LAYER_OPTIONS[driver.ShortName],
                )  # fmt: skip
                _fill_layer(dataset, layer, columns, field, heard, progress)
        finally:
            layer = dataset = None
        # The closed dataset has written its last bytes: now a full disk is known.
        if heard.failures:
            raise cannot_write(path, heard.reason)


def _fill_layer(dataset, layer, columns, field, heard, progress):
    """Write all points, in one transaction where the format has such."""
    ogr = load().ogr
    if layer is None or heard.attempt(layer.CreateField, ogr.FieldDefn(field, ogr.OFTReal)) != 0:
        return
    transactions = dataset.TestCapability(ogr.ODsCTransactions)
    if transactions:
        heard.attempt(dataset.StartTransaction)
    feature = ogr.Feature(layer.GetLayerDefn())
    point = ogr.Geometry(ogr.wkbPoint25D)
    try:
        for block in _blocks(columns, progress):
            for x, y, z in zip(*(column.tolist() for column in block), strict=True):
                point.SetPoint(0, x, y, z)
                feature.SetFID(-1)
                feature.SetGeometry(point)
                feature.SetField(0, z)
                heard.attempt(layer.CreateFeature, feature)
            if heard.failures:
                return
        if transactions:
            heard.attempt(dataset.CommitTransaction)
    finally:
        # An exception's traceback would keep the file open, and have it written to later.
        feature = layer = dataset = None
