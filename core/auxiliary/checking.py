"""Whether an auxiliary raster can be used at all: looked at before any work is done for it."""

import os

from demsmith.core.auxiliary.surface import open_auxiliary
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.raster import read, tile_paths
from demsmith.core.raster.opening import files_of


def check_auxiliary(path, grid, *, inputs=(), progress=SILENT):
    """Refuse an auxiliary raster that cannot be used.

    Parameters
    ----------
    path : path
        Of a raster, or of a folder of tiles.
    grid : Grid
        The target's.
    inputs : iterable of path
        The files of the target, which tell nothing of its voids.
    progress : Progress

    Returns
    -------
    list of str
        The auxiliary's files.

    Raises
    ------
    InputError
        If there is none, one is an input, cannot be opened or ends too early, or none of them
        overlaps the target; it names the auxiliary.
    Cancelled
        If ``progress`` asks to stop.
    """
    try:
        files = tile_paths(path)
        _refuse_inputs(files, inputs)
        resampler = open_auxiliary(files, grid, progress=progress)
        _refuse_unreadable(_tiles_beneath(resampler), progress)
    except InputError as error:
        raise InputError(f"auxiliary '{os.fspath(path)}' cannot be used: {error}") from None
    return files


def _refuse_inputs(files, inputs):
    states = [os.stat(name) for source in inputs for name in files_of(os.fspath(source))]
    taken = {(state.st_dev, state.st_ino) for state in states}
    for name in files:
        if os.path.exists(name) and (os.stat(name).st_dev, os.stat(name).st_ino) in taken:
            raise InputError(f"'{name}' is the input itself, which does not know its own voids")


def _tiles_beneath(resampler):
    beneath = resampler.beneath()
    tiles = resampler.source.overlapping(*beneath) if beneath else []
    if not tiles:
        raise InputError("it lies elsewhere, and does not overlap the input")
    return tiles


def _refuse_unreadable(tiles, progress):
    """Read the last row of each tile: a file that ends too early does not have it."""
    for number, tile in enumerate(tiles):
        checkpoint(progress, number / len(tiles))
        rows, columns = tile.grid.shape
        read(tile.path, window=(slice(rows - 1, rows), slice(0, columns)))
