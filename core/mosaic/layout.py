"""The files of a mosaic: which tiles it has, and what is written for each."""

import itertools
import os
from dataclasses import dataclass

import numpy as np

from demsmith.core import raster
from demsmith.core.errors import InputError, OutputError
from demsmith.core.raster.layers import check_layer_output

LARGEST_TILE = 50_000_000
"""Cells of the largest tile that is put together in the memory of a worker."""

_LARGEST_CHUNK = 3600
_SUMMARIES = {"vrt": "mosaic.vrt", "report": "mosaic.html", "numbers": "mosaic.json"}


@dataclass(frozen=True)
class Layout:
    """What a mosaic is made of and what it makes.

    Attributes
    ----------
    folder : str
        Where all outputs go.
    tiles : TileSet
    outputs : tuple of dict
        For each tile, paths by name: ``output``, and ``source_map`` and ``uncertainty`` where
        wanted.
    summaries : dict
        Paths by name of what is written of all together.
    """

    folder: str
    tiles: raster.TileSet
    outputs: tuple
    summaries: dict


def layout_of(tiles, folder, *, source_map=False, uncertainty=False, voids_layer=False):
    """Name the outputs of a mosaic.

    Parameters
    ----------
    tiles : TileSet
    folder : str
        Where they go.
    source_map, uncertainty, voids_layer : bool
        Whether these are wanted.

    Returns
    -------
    Layout

    Raises
    ------
    InputError
        If two tiles have the same name, a tile is too large, or the folder holds one of them.
    """
    outputs, taken = [], {}
    for tile in tiles.tiles:
        _refuse_too_large(tile)
        if os.path.realpath(os.path.dirname(os.path.abspath(tile.path))) == os.path.realpath(
            folder
        ):
            raise InputError(f"'{tile.path}' is in the output folder; give another one")
        stem = stem_of(tile.path)
        names = {"output": f"{stem}.tif"}
        if source_map:
            names["source_map"] = f"{stem}_source.tif"
        if uncertainty:
            names["uncertainty"] = f"{stem}_uncertainty.tif"
        for name in names.values():
            other = taken.setdefault(name.lower(), tile.path)
            if other != tile.path:
                raise InputError(
                    f"'{tile.path}' and '{other}' would both be written as '{name}'; rename one"
                )
        outputs.append({key: os.path.join(folder, name) for key, name in names.items()})
    summaries = {**_SUMMARIES, **({"voids_layer": "voids.gpkg"} if voids_layer else {})}
    return Layout(
        folder, tiles, tuple(outputs),
        {key: os.path.join(folder, name) for key, name in summaries.items()},
    )  # fmt: skip


def stem_of(path):
    """Give a tile's name without what tells its format.

    Examples
    --------
    >>> stem_of("tiles/N42E001.SRTMGL1.hgt.zip")
    'N42E001.SRTMGL1'
    """
    stem, extension = os.path.splitext(os.path.basename(path))
    return os.path.splitext(stem)[0] if extension.lower() == ".zip" and "." in stem else stem


def check_layout(layout, *, overwrite):
    """Refuse outputs that cannot be written.

    Raises
    ------
    OutputError
        If the folder is not writable, or a file exists and may not be overwritten.
    """
    inputs = []  # none of them is in the output folder
    for paths in layout.outputs:
        for path in paths.values():
            raster.check_output(path, inputs=inputs, overwrite=overwrite)
    for name, path in layout.summaries.items():
        if name == "voids_layer":
            check_layer_output(path, crs=layout.tiles.grid.crs, overwrite=overwrite)
        else:
            raster.check_place(path, overwrite=overwrite)


def make_folder(folder):
    """Make the output folder; tell whether it is new.

    Raises
    ------
    OutputError
        If it cannot be made, or is a file.
    """
    if os.path.isdir(folder):
        return False
    try:
        os.makedirs(folder)
    except OSError as error:
        raise OutputError(f"cannot make the output folder '{folder}': {error.strerror}") from None
    return True


def chunk_side(tiles):
    """Give the rows and columns of the chunks in which a tile set is worked on: about a tile.

    So each chunk needs few tiles. What is computed does not depend on it.
    """
    rows = _spacing([tile.row for tile in tiles.tiles], [t.grid.shape.rows for t in tiles.tiles])
    columns = _spacing(
        [tile.column for tile in tiles.tiles], [t.grid.shape.columns for t in tiles.tiles]
    )
    return rows, columns


def chunks_of(tiles, side):
    """List the chunks that have a cell of a tile: pairs of slices, in order."""
    touched = set()
    for tile in tiles.tiles:
        down = range(tile.rows.start // side[0], (tile.rows.stop - 1) // side[0] + 1)
        right = range(tile.columns.start // side[1], (tile.columns.stop - 1) // side[1] + 1)
        touched.update(itertools.product(down, right))
    return [
        tuple(
            slice(at * step, min((at + 1) * step, length))
            for at, step, length in zip(chunk, side, tiles.shape, strict=True)
        )
        for chunk in sorted(touched)
    ]


def _spacing(begins, lengths):
    """Give the commonest distance of one tile from the next; of one tile alone, its length."""
    steps = np.diff(np.unique(begins))
    step = int(np.median(steps)) if steps.size else max(lengths)
    return int(np.clip(step, min(max(lengths) // 2, 256), _LARGEST_CHUNK))


def _refuse_too_large(tile):
    rows, columns = tile.grid.shape
    if rows * columns > LARGEST_TILE:
        raise InputError(
            f"'{tile.path}' has {rows} × {columns} cells, more than {LARGEST_TILE} for a tile: "
            "cut it into tiles, for example with gdal_retile.py"
        )
