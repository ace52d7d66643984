"""What a worker does for a mosaic: look at its ground, find voids, fill some, write a tile."""

import os
from dataclasses import dataclass

import numpy as np

from demsmith.core import raster
from demsmith.core.mosaic.views import save_view, view_of
from demsmith.core.mosaic.workplace import load, save, save_facts
from demsmith.core.progress import SILENT, Span
from demsmith.core.raster.outputs import settle
from demsmith.core.reconstruction.assembly import assemble
from demsmith.core.reconstruction.doubts import void_runs
from demsmith.core.reconstruction.filling import fill_part
from demsmith.core.reconstruction.outputs import write_tile
from demsmith.core.reconstruction.patches import Patch
from demsmith.core.reconstruction.training import count_voids


def survey(tiles, rows, columns, path, *, threads=None, progress=SILENT):
    """Count the void cells of a chunk by blocks and save the counts."""
    row, column, counts = count_voids(tiles, rows, columns, progress=progress)
    save(path, row=row, column=column, counts=counts)


def scan(tiles, plan, rows, columns, path, *, threads=None, progress=SILENT):
    """Find the void cells of a chunk and save their runs."""
    found = void_runs(tiles, plan, rows, columns, threads=threads, progress=progress)
    save(path, **found._asdict())


def fill(tiles, plan, part, path, *, threads=None, progress=SILENT):
    """Fill the voids of a part and save the patch."""
    save(path, **vars(fill_part(tiles, plan, part, threads=threads, progress=progress)))


def load_patch(path):
    """Give the patch that `fill` saved."""
    return Patch(**load(path))


@dataclass(frozen=True)
class TileOutputs:
    """Where a tile's outputs go.

    Attributes
    ----------
    paths : dict
        Final paths by name: ``output``, and ``source_map`` and ``uncertainty`` where wanted.
    unfinished : str
        Folder for them until they are whole.
    creation_options : tuple of str
    """

    paths: dict
    unfinished: str
    creation_options: tuple = ()


def write(tiles, tile, patches, outliers, options, outputs, path, *, threads=None, progress=SILENT):
    """Put a tile together, write it, and save what is to be told of it.

    Parameters
    ----------
    tiles : TileSet
    tile : Tile
    patches : list of str
        Paths of those that may have cells in it.
    outliers : (K, 2) int array
        Rows and columns of the spikes and wells among these cells.
    options : ReconstructOptions
    outputs : TileOutputs
    path : str
        Where to save.
    threads, progress
    """
    own = raster.read(tile.path, **tiles.rules.as_dict(), progress=Span(progress, 0, 0.1))
    made = assemble(
        own, tiles, tile.rows, tile.columns, map(load_patch, patches),
        outliers=outliers, float_output=options.float_output, progress=Span(progress, 0.1, 0.5),
    )  # fmt: skip
    os.makedirs(outputs.unfinished, exist_ok=True)
    unfinished = {
        name: os.path.join(outputs.unfinished, os.path.basename(final))
        for name, final in outputs.paths.items()
    }
    write_tile(
        unfinished, own, made, creation_options=outputs.creation_options, threads=threads,
        progress=Span(progress, 0.5, 1),
    )  # fmt: skip
    settle(outputs.unfinished, list(outputs.paths.values()))
    save_view(path, view_of(made, own, tile, tiles.shape))
    counts = np.bincount(made.sources.ravel(), minlength=256).tolist()
    told = dict(
        replaced=made.replaced, notes=list(own.notes), faulty=made.removed.counts(),
        removed=made.removed.rows(own.grid),
    )  # fmt: skip
    save_facts(path, {"input": tile.path, **outputs.paths, "counts": counts, **told})
