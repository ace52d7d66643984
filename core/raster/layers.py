"""Writing vector layers, whole or not at all: what points, lines and polygons share."""

import os

import numpy as np

from demsmith.core.errors import InputError, OutputError
from demsmith.core.raster._gdal import load, session
from demsmith.core.raster.crs import spatial_reference
from demsmith.core.raster.outputs import cannot_write, check_place

_DRIVERS = {".gpkg": "GPKG", ".geojson": "GeoJSON"}
_LAYER_OPTIONS = {
    # All digits, where the default for degrees is seven.
    "GeoJSON": ["COORDINATE_PRECISION=17", "SIGNIFICANT_FIGURES=17"],
    # The index would take longer than all else, on closing, where cancelling is not heard.
    "GPKG": ["SPATIAL_INDEX=NO"],
}


def check_layer_output(path, *, crs="", inputs=(), overwrite=False, tables=()):
    """Refuse an output of features that cannot be written, before any work is done for it.

    Parameters
    ----------
    path : str or path-like
        Where a layer is to be written.
    crs : str
        WKT, or anything else GDAL takes.
    inputs : iterable of str or path-like
        Files that are read and may not be overwritten.
    overwrite : bool
        Whether an existing file may be replaced.
    tables : tuple of str
        Extensions that are allowed besides those of layers.

    Raises
    ------
    InputError
        If the extension is none of ``.gpkg``, ``.geojson`` and ``tables``, the file is an input,
        or the format cannot tell the CRS.
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
    extensions = (*_DRIVERS, *tables)
    if extension not in extensions:
        raise InputError(f"output '{path}' must end in one of {', '.join(extensions)}")
    check_place(path, inputs=inputs, overwrite=overwrite)
    if os.path.exists(path + "-wal"):
        raise OutputError(f"'{path}' is open in another program: close it there first")
    if extension == ".geojson":
        _refuse_nameless_crs(crs, path, extensions)


def _refuse_nameless_crs(crs, path, extensions):
    """GeoJSON names its CRS by authority and code; where it has none, WGS 84 is understood."""
    with session() as heard:
        if crs and spatial_reference(crs, heard).GetAuthorityCode(None) is not None:
            return
    others = " or ".join(extension for extension in extensions if extension != ".geojson")
    raise InputError(f"'{path}': GeoJSON cannot tell a CRS without an EPSG code; write {others}")


def as_columns(columns, count, what):
    """Give attributes as arrays by name, each with a value for every feature.

    Parameters
    ----------
    columns : mapping of str to array_like, shape (count,)
        Of integer, real, bool or text type.
    count : int
        Number of features.
    what : str
        Their name in the plural, for messages.

    Raises
    ------
    InputError
        If a column has another length.
    """
    columns = {name: np.asarray(column) for name, column in columns.items()}
    for name, column in columns.items():
        if column.shape != (count,):
            raise InputError(f"attribute '{name}' must have a value for each of {count} {what}")
    return columns


def fields_of(columns):
    """Describe attributes, as `as_columns` gives them, by the types of their arrays."""
    return [_field(name, column.dtype.kind) for name, column in columns.items()]


def _field(name, kind):
    ogr = load().ogr
    kinds = {"b": ogr.OFTInteger, "i": ogr.OFTInteger64, "u": ogr.OFTInteger64, "f": ogr.OFTReal}
    field = ogr.FieldDefn(name, kinds.get(kind, ogr.OFTString))
    if kind == "b":
        field.SetSubType(ogr.OFSTBoolean)
    return field


def attributes(columns, count):
    """Yield the attributes of each of ``count`` features as a list, ``None`` for NaN."""
    columns = [column.tolist() for column in columns.values()]
    for feature in range(count):
        values = (column[feature] for column in columns)
        # NaN is the only value that is not itself.
        yield [value if value == value else None for value in values]


def write_layer(path, geometry_type, fields, features, *, crs=""):
    """Write features to a new file, whose format its extension tells.

    Parameters
    ----------
    path : str
        From `whole_or_nothing`, for a name that `check_layer_output` accepts.
    geometry_type : int
        OGR's ``wkb...``.
    fields : iterable of ogr.FieldDefn
    features : iterable of (ogr.Geometry, iterable)
        Each feature's geometry and the values of all its fields, ``None`` for none; one geometry
        may be yielded anew with other coordinates.
    crs : str
        As in `check_layer_output`.

    Raises
    ------
    OutputError
        If the file cannot be written there, or not to its end.
    """
    gdal = load().gdal
    with session(OGR_SQLITE_SYNCHRONOUS="OFF") as heard:
        driver = gdal.GetDriverByName(_DRIVERS[os.path.splitext(path)[1].lower()])
        dataset = heard.attempt(driver.Create, path, 0, 0, 0, gdal.GDT_Unknown)
        try:
            if dataset is not None:
                reference = spatial_reference(crs, heard) if crs else None
                name = os.path.splitext(os.path.basename(path))[0]
                layer = heard.attempt(
                    dataset.CreateLayer, name, reference, geometry_type,
                    _LAYER_OPTIONS[driver.ShortName],
                )  # fmt: skip
                _fill_layer(dataset, layer, fields, features, heard)
        finally:
            layer = dataset = None
        # The closed dataset has written its last bytes: now a full disk is known.
        if heard.failures:
            raise cannot_write(path, heard.reason)


def _fill_layer(dataset, layer, fields, features, heard):
    """Write all features, in one transaction where the format has such."""
    ogr = load().ogr
    if layer is None:
        return
    for field in fields:
        if heard.attempt(layer.CreateField, field) != 0:
            return
    transactions = dataset.TestCapability(ogr.ODsCTransactions)
    if transactions:
        heard.attempt(dataset.StartTransaction)
    feature = ogr.Feature(layer.GetLayerDefn())
    try:
        for geometry, values in features:
            feature.SetFID(-1)
            feature.SetGeometry(geometry)
            for number, value in enumerate(values):
                feature.SetField(number, value)
            heard.attempt(layer.CreateFeature, feature)
            if heard.failures:
                return
        if transactions:
            heard.attempt(dataset.CommitTransaction)
    finally:
        # An exception's traceback would keep the file open, and have it written to later.
        feature = layer = dataset = None
