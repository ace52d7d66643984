"""Reconstruction of a mosaic: tiles of one grid, filled as their merged raster would be."""

import contextlib
import os
import time
from dataclasses import asdict

import demsmith
from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.mosaic.layout import check_layout, layout_of, make_folder
from demsmith.core.mosaic.schedulers import DaskCluster, InThisProcess, Processes
from demsmith.core.mosaic.work import Work
from demsmith.core.mosaic.workplace import Workplace
from demsmith.core.options import validate
from demsmith.core.progress import SILENT, Span
from demsmith.core.reconstruction.options import ReconstructOptions
from demsmith.core.reconstruction.outputs import refuse_uncertainty
from demsmith.core.reconstruction.plan import check_auxiliaries


def reconstruct_mosaic(
    inputs, folder, *, options=None, auxiliaries=(), band=1, nodata=(), below=None, above=None,
    source_map=False, uncertainty=False, voids_layer=False, workers=None, scheduler=None,
    threads=None, overwrite=False, creation_options=(), progress=SILENT,
):  # fmt: skip
    """Reconstruct the voids of tiles, seam-free: each gets what their merged raster would hold.

    A run that was stopped, or killed, goes on where it was when it is started again with the same
    tiles, options and folder.

    Parameters
    ----------
    inputs : path or sequence of path
        Tiles, folders, patterns, lists or VRTs of them, see `demsmith.core.raster.tile_paths`.
        Where tiles overlap and disagree, the first one's elevation is written into all.
    folder : path
        Where the results go, each as GeoTIFF under its tile's name; made if missing. In it is
        also ``mosaic.vrt``, all of them as one raster, and the report ``mosaic.html`` with its
        numbers as ``mosaic.json``.
    options : ReconstructOptions, optional
    auxiliaries : sequence of path
        As in `demsmith.reconstruct_file`.
    band, nodata, below, above
        As in `demsmith.read_raster`, for every tile.
    source_map, uncertainty, voids_layer : bool
        Whether to write ``NAME_source.tif`` and ``NAME_uncertainty.tif`` for each tile, and
        ``voids.gpkg``; see `demsmith.reconstruct_file`.
    workers : int, optional
        Processes side by side; 0: none but this one. Default: one for each core. A program that
        calls this must do so under ``if __name__ == "__main__":``.
    scheduler : str, optional
        Address ``tcp://host:port`` of a Dask cluster to work on instead, whose machines see all
        files under the same paths.
    threads : int, optional
        Of each worker. Default: 1, or without workers one for each core.
    overwrite : bool
        Whether existing outputs may be replaced.
    creation_options : iterable of str
        GDAL's for GeoTIFF, ``KEY=VALUE``.
    progress : Progress

    Returns
    -------
    MosaicResult

    Raises
    ------
    InputError
        If a tile cannot be used or does not fit the others, nothing is known, or an option is
        out of range.
    OutputError
        If an output cannot be written.
    DemsmithError
        If workers die again and again of the same task.
    Cancelled
        If ``progress`` asks to stop.
    """
    begin = time.perf_counter()
    # A front end's subclass would not find its way into another process.
    options = ReconstructOptions(**asdict(options or ReconstructOptions()))
    validate(options)
    refuse_uncertainty(options, uncertainty)
    crew = _crew(workers, scheduler, threads)
    inputs = [inputs] if isinstance(inputs, (str, os.PathLike)) else inputs
    rules = raster.CellRules(band=band, nodata=tuple(nodata), below=below, above=above)
    tiles = raster.open_tiles(
        raster.tile_paths(*inputs), rules=rules, progress=Span(progress, 0, 0.03)
    )
    check_auxiliaries(auxiliaries, options, tiles.grid, inputs=[tile.path for tile in tiles.tiles])
    layout = layout_of(
        tiles, os.fspath(folder), source_map=source_map, uncertainty=uncertainty,
        voids_layer=voids_layer,
    )  # fmt: skip
    is_new = make_folder(layout.folder)
    place = Workplace(layout.folder, _fingerprint(layout, options, auxiliaries, creation_options))
    try:
        check_layout(layout, overwrite=overwrite or place.resumed)
        place.open()
        with crew:
            work = Work(layout, options, auxiliaries, tuple(creation_options), place, crew)
            result = work.do(begin, Span(progress, 0.03, 1))
    except Cancelled:
        raise Cancelled(
            f"cancelled; what is done is kept in '{layout.folder}': the same command goes on there"
        ) from None
    except InputError:
        place.remove()
        if is_new:
            with contextlib.suppress(OSError):
                os.rmdir(layout.folder)
        raise
    place.remove()
    return result


def _crew(workers, scheduler, threads):
    if scheduler is not None:
        if workers is not None:
            raise InputError("give workers or a scheduler, not both: a cluster has its own workers")
        return DaskCluster(scheduler)
    if workers is not None and workers < 0:
        raise InputError(f"workers is {workers}; it must be at least 0")
    if workers == 0:
        return InThisProcess(threads)
    return Processes(workers, threads or 1)


def _fingerprint(layout, options, auxiliaries, creation_options):
    """Give all that the outputs depend on."""
    return {
        "version": demsmith.__version__,
        "tiles": [_state(tile.path) for tile in layout.tiles.tiles],
        "rules": asdict(layout.tiles.rules),
        "options": asdict(options),
        "auxiliaries": [list(map(_state, raster.tile_paths(path))) for path in auxiliaries],
        "outputs": layout.outputs,
        "creation_options": list(creation_options),
    }


def _state(path):
    """Give what changes with a file: its place, size and time; a GDAL name is only a name."""
    try:
        at = os.stat(path)
    except OSError:
        return path
    return os.path.realpath(path), at.st_size, at.st_mtime_ns
