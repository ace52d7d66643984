"""The ground beside a raster, from other files in a folder."""

import math
import os
from dataclasses import dataclass, replace

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.raster import (
    CellRules,
    elevations,
    height_unit,
    open_tiles,
    shifted,
    tile_paths,
)
from demsmith.core.reconstruction.grounds import ArrayGround

REACH = 512
"""Cells of the ground beyond a raster's edges that its neighbours are asked for."""

_MOST_COMMON = 0.5
"""Share of a raster's cells of which a file that has more is no neighbour but another copy."""


@dataclass(frozen=True)
class Surroundings:
    """A raster within the ground around it.

    Attributes
    ----------
    ground : ArrayGround
    rows, columns : slice
        Where the raster lies in it.
    neighbours : tuple of str
        Paths of the files that gave ground.
    notes : tuple of str
        Why others, which look like neighbours, did not.
    """

    ground: ArrayGround
    rows: slice
    columns: slice
    neighbours: tuple = ()
    notes: tuple = ()


def alone(raster):
    """Give a raster as its own surroundings."""
    height, width = raster.grid.shape
    values = elevations(raster, _float_type(raster))
    values[raster.void] = 0  # as a tile set has it
    unit = height_unit(raster.meta, raster.grid.crs)
    ground = ArrayGround(values, raster.void, raster.grid, unit=unit)
    return Surroundings(ground, slice(0, height), slice(0, width))


def surroundings(raster, folder, *, rules=None, progress=SILENT):
    """Put a raster together with the ground that files of a folder have beside it.

    Parameters
    ----------
    raster : Raster
        Read from a file. Where it knows an elevation, that one holds.
    folder : path
    rules : CellRules, optional
        Which cells of the neighbours are voids; their first band is read.
    progress : Progress

    Returns
    -------
    Surroundings

    Raises
    ------
    InputError
        If the raster has no georeference, or the folder no rasters.
    """
    if not os.path.isdir(folder):
        raise InputError(f"'{os.fspath(folder)}' is no folder to look for neighbours in")
    if not raster.grid.georeferenced:
        raise InputError(f"'{raster.source}' has no georeference, so it has no neighbours")
    rules = replace(rules or CellRules(), band=1)
    paths, notes = _beside(raster.source, tile_paths(folder), rules, Span(progress, 0, 0.3))
    if not paths:
        notes.append(f"no neighbour of '{raster.source}' was found in '{os.fspath(folder)}'")
        return replace(alone(raster), notes=tuple(notes))
    tiles = open_tiles([raster.source, *paths], rules=rules)
    rows, columns = _around(tiles)
    others = replace(tiles, tiles=tiles.tiles[1:])
    values, void = others.read(rows, columns, progress=Span(progress, 0.3, 1))
    values = values.astype(np.promote_types(values.dtype, _float_type(raster)), copy=False)
    first = tiles.tiles[0]
    own = shifted((first.rows, first.columns), rows.start, columns.start)
    np.copyto(values[own], elevations(raster, values.dtype), where=~raster.void)
    void[own] &= raster.void
    ground = ArrayGround(
        values, void, tiles.grid.part(rows, columns), tiles.covered(rows, columns), tiles.unit
    )
    return Surroundings(ground, *own, tuple(paths), tuple(notes))


def _beside(source, candidates, rules, progress):
    """Choose the files that have ground beside the raster at ``source`` and share its grid."""
    chosen, notes = [], []
    for number, path in enumerate(candidates):
        checkpoint(progress, number / len(candidates))
        if os.path.samefile(path, source):
            continue
        try:
            tiles = open_tiles([source, path], rules=rules)
        except InputError as error:
            notes.append(f"not taken for a neighbour: {error}")
            continue
        own, other = tiles.tiles
        own_window = own.rows, own.columns
        if _cells(own.common(other.rows, other.columns)) > _MOST_COMMON * _cells(own_window):
            notes.append(f"not taken for a neighbour: '{path}' covers the raster itself")
        elif other in tiles.overlapping(*_around(tiles)):
            chosen.append(path)
    return chosen, notes


def _around(tiles):
    """Give the window of the first tile and of what may matter around it."""
    own = tiles.tiles[0]
    return tuple(
        slice(max(span.start - REACH, 0), min(span.stop + REACH, length))
        for span, length in zip((own.rows, own.columns), tiles.shape, strict=True)
    )


def _cells(window):
    return 0 if window is None else math.prod(span.stop - span.start for span in window)


def _float_type(raster):
    small = raster.meta.dtype.itemsize <= 2 or raster.meta.dtype == np.float32
    return np.dtype(np.float32 if small else np.float64)
