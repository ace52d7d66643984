"""Points and lines of a vector layer on the way to `Features`, whoever reads the layer."""

from typing import NamedTuple

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.raster._gdal import load, session
from demsmith.core.raster.features import ELEVATION_NAMES, Features, columns_named

_FEATURES_AT_ONCE = 5000
_SIMPLE = ("POINT", "LINESTRING", "LINEARRING")


class Parts(NamedTuple):
    """Points and lines end to end: their vertices, and of each part what tells them apart."""

    vertices: np.ndarray  # (V, 3) float64; z is NaN where the geometry has none
    lengths: np.ndarray  # (P,) vertices of each part
    is_point: np.ndarray  # (P,) bool
    values: np.ndarray  # (P,) float64: the attribute, NaN where it is no number


class ElevationField(NamedTuple):
    """The attribute that may hold elevations."""

    name: str  # as the layer spells it
    asked: bool  # whether the user named it
    rivals: tuple = ()  # others whose names tell the same


def elevation_field(names, readable, asked, source):
    """Find the attribute asked for, or the one whose name tells (`ELEVATION_NAMES`).

    Parameters
    ----------
    names : iterable of str
        All attributes of the layer.
    readable : iterable of str
        Those that hold numbers or text.
    asked : str or None
        In any case.
    source : str
        Path or name of the layer, for messages.

    Returns
    -------
    ElevationField or None

    Raises
    ------
    InputError
        If the one asked for is missing or not readable.
    """
    readable = list(readable)
    if asked is None:
        found = [readable[number] for number in columns_named(readable, ELEVATION_NAMES)]
        return ElevationField(found[0], False, tuple(found[1:])) if found else None
    for name in readable:
        if name.lower() == asked.lower():
            return ElevationField(name, True)
    if asked.lower() in [name.lower() for name in names]:
        raise InputError(_no_numbers(asked, source))
    listed = ", ".join(f"'{name}'" for name in names) or "none"
    raise InputError(f"'{source}' has no attribute '{asked}'; it has: {listed}")


def number_in(value):
    """Give the number an attribute is, or reads as with a point or a comma; NaN if it is none."""
    try:
        return float(value.replace(",", ".") if isinstance(value, str) else value)
    except (TypeError, ValueError):
        return np.nan


def read_parts(features, total, progress=SILENT):
    """Take features apart: multi-geometries are split, curves become lines, polygons rings.

    Parameters
    ----------
    features : iterable of (OGR geometry or None, float)
        Each with the value of its attribute, NaN if it has none.
    total : int
        How many come; 0 or less if unknown.
    progress : Progress

    Returns
    -------
    Parts

    Raises
    ------
    Cancelled
        If ``progress`` says so.
    """
    blocks, coordinates, table = [np.empty((0, 3))], [], []
    for number, (geometry, value) in enumerate(features, start=1):
        if geometry is not None:
            for is_point, has_z, vertices in _simple_parts(geometry):
                coordinates.extend(vertices)
                table.append((len(vertices), is_point, has_z, value))
        if number % _FEATURES_AT_ONCE == 0:
            blocks.append(np.array(coordinates).reshape(-1, 3))
            coordinates = []
            checkpoint(progress, min(number / total, 1.0) if total > 0 else 0.0)
    blocks.append(np.array(coordinates).reshape(-1, 3))
    vertices = np.concatenate(blocks)
    lengths, is_point, has_z, values = np.array(table, dtype=np.float64).reshape(-1, 4).T
    lengths = lengths.astype(np.int64)
    vertices[np.repeat(has_z == 0, lengths), 2] = np.nan
    return Parts(vertices, lengths, is_point != 0, values)


def read_wkb_parts(features, total, progress=SILENT):
    """Take features apart whose geometries are well-known binary; else as `read_parts`."""
    with session():
        from_wkb = load().ogr.CreateGeometryFromWkb
        return read_parts(((from_wkb(wkb), value) for wkb, value in features), total, progress)


def to_features(parts, field, source, *, crs="", notes=()):
    """Give parts their elevations and sort them into points and lines.

    Elevations come from ``field`` if it was asked for; else from the geometries' z; else, or
    where every z is 0, from ``field``. What has no finite elevation or place is left out.

    Parameters
    ----------
    parts : Parts
        With NaN as x and y of vertices that ``crs`` does not reach.
    field : ElevationField or None
        That ``parts.values`` is of.
    source : str
        Path or name of the layer, for messages and notes.
    crs : str
    notes : iterable of str
        What is to be told besides.

    Returns
    -------
    Features

    Raises
    ------
    InputError
        If nothing has an elevation.
    """
    parts, elevation_notes = _with_elevations(parts, field, source)
    points, lines, left_out = _split(parts)
    if not len(points) and not lines:
        raise InputError(
            f"'{source}' has no point or line to be used: {'; '.join(left_out) or 'it is empty'}. "
            "Elevations are the z of its geometries, or an attribute, to be named"
        )
    notes = (*notes, *elevation_notes, *left_out)
    return Features(points, lines, crs, tuple(f"'{source}': {note}" for note in notes))


def _no_numbers(name, source):
    return f"attribute '{name}' of '{source}' holds no numbers"


def _simple_parts(geometry):
    """Yield whether a point, whether with z, and the (x, y, z) of each part of a geometry."""
    kind = geometry.GetGeometryName()
    if kind in _SIMPLE:
        if not geometry.IsEmpty():
            yield kind == "POINT", bool(geometry.Is3D()), geometry.GetPoints(3)
    elif geometry.HasCurveGeometry():
        yield from _simple_parts(geometry.GetLinearGeometry())
    else:
        for number in range(geometry.GetGeometryCount()):
            yield from _simple_parts(geometry.GetGeometryRef(number))


def _with_elevations(parts, field, source):
    """Fill in the vertices' z from the attribute, where it goes first or they have none."""
    if field is None or not len(parts.values):
        return parts, []
    values = np.repeat(parts.values, parts.lengths)
    z = parts.vertices[:, 2].copy()
    measured = np.isfinite(z)
    flat = measured.any() and not z[measured].any()
    if field.asked:
        if not np.isfinite(values).any():
            raise InputError(_no_numbers(field.name, source))
        taken = np.ones(len(z), bool)
    else:
        taken = np.isfinite(values) & (flat | ~measured)
    z[taken] = values[taken]
    notes = [_taken_note(field, flat)] if taken.any() and not field.asked else []
    return parts._replace(vertices=np.column_stack([parts.vertices[:, :2], z])), notes


def _taken_note(field, flat):
    note = f"elevations were taken from attribute '{field.name}'"
    if flat:
        note += ", as every z of its geometries is 0"
    if field.rivals:
        listed = ", ".join(f"'{name}'" for name in field.rivals)
        note += f" (and not from {listed})"
    return note


def _split(parts):
    """Part points from lines, leaving out what is not finite; notes count that."""
    count = len(parts.lengths)
    if not count:
        return np.empty((0, 3)), (), []
    starts = np.cumsum(parts.lengths) - parts.lengths
    finite = np.logical_and.reduceat(np.isfinite(parts.vertices), starts, axis=0)
    placed, known = finite[:, :2].all(axis=1), finite[:, 2]
    usable = placed & known
    points = parts.vertices[starts[usable & parts.is_point]]
    lines = tuple(
        parts.vertices[starts[number] : starts[number] + parts.lengths[number]]
        for number in np.flatnonzero(usable & ~parts.is_point & (parts.lengths > 1))
    )
    notes = []
    if not known.all():
        notes.append(_left_out(known, "have no elevation"))
    if not placed.all():
        notes.append(_left_out(placed, "lie where the CRS asked for does not reach"))
    return points, lines, notes


def _left_out(kept, why):
    missing = len(kept) - np.count_nonzero(kept)
    return f"{missing} of {len(kept)} points and lines {why} and were left out"
