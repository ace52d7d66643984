"""Vector layers on disk: their points and lines, with elevations."""

import contextlib
import os

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span
from demsmith.core.raster import archive
from demsmith.core.raster._gdal import load, session
from demsmith.core.raster.features import in_crs
from demsmith.core.raster.opening import check_there
from demsmith.core.raster.parts import elevation_field, number_in, read_parts, to_features


def read_features(path, *, layer=None, field=None, crs="", source_crs="", progress=SILENT):
    """Read the points and lines of a vector layer, with their elevations.

    Multi-geometries are split, curves become lines, polygons give their rings. Elevations come
    from ``field`` if given; else from the geometries' z; else, or where every z is 0, from the
    attribute whose name tells (the first of `ELEVATION_NAMES`). What has no finite elevation is
    left out and counted in the notes.

    Parameters
    ----------
    path : str or path-like
        Anything OGR opens, zipped or not.
    layer : str
        Name of the layer; the first one with geometries if not given.
    field : str
        Attribute that holds the elevations, as numbers or as text that reads as numbers.
    crs : str
        CRS to reproject to; the layer's own is kept if not given. Elevations stay as they are.
    source_crs : str
        CRS of the coordinates, where the layer tells none.
    progress : Progress
        Told how much has been read.

    Returns
    -------
    Features

    Raises
    ------
    InputError
        If the file is missing, damaged, a raster, or has no such layer or attribute; if no
        feature has an elevation.
    Cancelled
        If ``progress`` says so.
    """
    path = os.fspath(path)
    with _opened(path) as (heard, holder):
        chosen, notes = _choose_layer(holder[0], layer, path)
        own_crs = _crs_of(chosen) or source_crs
        try:
            attribute = elevation_field(*_fields_of(chosen), field, path)
            parts = read_parts(
                _geometries(chosen, attribute, heard),
                chosen.GetFeatureCount(0),  # -1 where counting would mean reading
                Span(progress, 0.0, 0.8),
            )
        finally:
            chosen = None
        if heard.failures:
            raise InputError(f"'{path}' is damaged or truncated: {heard.reason}")
    vertices, crs, crs_notes = in_crs(
        parts.vertices, source=own_crs, target=crs, progress=Span(progress, 0.8, 1.0)
    )
    parts = parts._replace(vertices=vertices)
    return to_features(parts, attribute, path, crs=crs, notes=(*notes, *crs_notes))


@contextlib.contextmanager
def _opened(path):
    """Open a vector file; yields the GDAL session and a list holding the dataset.

    Whoever takes a layer or feature out must let go of it before the context ends.
    """
    check_there(path)
    name = f"/vsizip/{{{path}}}" if archive.is_zip(path) else path
    with session() as heard:
        gdal = load().gdal
        dataset = heard.attempt(gdal.OpenEx, name, gdal.OF_VECTOR | gdal.OF_VERBOSE_ERROR)
        if dataset is None or dataset.GetLayerCount() == 0:
            raise InputError(_why_not(path, name, dataset, heard))
        holder = [dataset]
        del dataset
        try:
            yield heard, holder
        finally:
            holder.clear()


def _why_not(path, name, dataset, heard):
    reason = heard.reason
    gdal = load().gdal
    if heard.attempt(gdal.OpenEx, name, gdal.OF_RASTER) is not None:
        return f"'{path}' is a raster, where a vector layer is needed: points or lines"
    if dataset is not None:
        return f"'{path}' has no layer"
    if os.path.isdir(path):
        return f"'{path}' is a folder, not a vector layer"
    if not heard.failures or "not recognized as" in reason:
        return (
            f"'{path}' is no vector layer in a format that OGR knows, or its beginning is damaged; "
            "tables of points must end in .csv, .tsv, .txt, .xyz or .dat"
        )
    return f"'{path}' cannot be opened, truncated or damaged: {reason}"


def _choose_layer(dataset, name, path):
    """Return the layer of this name, or the first with geometries, and notes on the choice."""
    layers = [dataset.GetLayer(number) for number in range(dataset.GetLayerCount())]
    names = [layer.GetName() for layer in layers]
    listed = ", ".join(f"'{other}'" for other in names)
    if name is not None:
        if name not in names:
            raise InputError(f"'{path}' has no layer '{name}', but {listed}")
        return layers[names.index(name)], []
    no_geometry = load().ogr.wkbNone
    spatial = [layer for layer in layers if layer.GetGeomType() != no_geometry]
    if not spatial:
        raise InputError(f"'{path}' has no geometries, only attributes")
    if len(spatial) == 1:
        return spatial[0], []
    chosen = spatial[0]
    return chosen, [f"it has the layers {listed}; '{chosen.GetName()}' was read, as none was named"]


def _crs_of(layer):
    """WKT of the layer's CRS; empty where it has none, or one that says nothing."""
    reference = layer.GetSpatialRef()
    # GeoPackage's "no CRS" is a CRS of this name in some versions of GDAL.
    if reference is None or reference.IsLocal() or reference.GetName().startswith("Undefined"):
        return ""
    return reference.ExportToWkt(["FORMAT=WKT2_2019"])


def _fields_of(layer):
    """Names of all attributes, and of those that hold numbers or text."""
    ogr = load().ogr
    definition = layer.GetLayerDefn()
    fields = [definition.GetFieldDefn(number) for number in range(definition.GetFieldCount())]
    kinds = (ogr.OFTInteger, ogr.OFTInteger64, ogr.OFTReal, ogr.OFTString)
    readable = [each.GetName() for each in fields if each.GetType() in kinds]
    return [each.GetName() for each in fields], readable


def _geometries(layer, field, heard):
    """Yield the geometry of each feature, and its attribute as a number."""
    if layer.TestCapability(load().ogr.OLCIgnoreFields):
        heard.attempt(layer.SetIgnoredFields, _unneeded(layer, field))
    index = -1 if field is None else layer.GetLayerDefn().GetFieldIndex(field.name)
    while (feature := heard.attempt(layer.GetNextFeature)) is not None:
        yield feature.GetGeometryRef(), number_in(None if index < 0 else feature.GetField(index))


def _unneeded(layer, field):
    """Names of the attributes that need not be read."""
    return [name for name in _fields_of(layer)[0] if field is None or name != field.name]
