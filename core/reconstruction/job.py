"""Reconstruction from file to file, as the command line and QGIS do it."""

import time
from dataclasses import dataclass, fields, replace

import numpy as np

import demsmith
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.options import validate
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.reconstruction.assembly import assemble
from demsmith.core.reconstruction.neighbours import alone, surroundings
from demsmith.core.reconstruction.options import ReconstructOptions
from demsmith.core.reconstruction.outputs import check_outputs, refuse_uncertainty, write_tile
from demsmith.core.reconstruction.parts import large_note
from demsmith.core.reconstruction.pipeline import reconstruct_ground
from demsmith.core.reconstruction.plan import check_auxiliaries
from demsmith.core.reconstruction.report import write_reports
from demsmith.core.reconstruction.table import tabulate
from demsmith.core.voids.accurate import UNCALIBRATED
from demsmith.core.voids.sources import LEFT, ORIGINAL, SOURCES
from demsmith.core.voids.table import VoidTable

_OUTPUTS = ("output", "source_map", "uncertainty", "voids_layer", "report")


@dataclass(frozen=True)
class ReconstructResult:
    """What a reconstruction did.

    Attributes
    ----------
    output, source_map, uncertainty, voids_layer, report : str or None
        Paths of what was written.
    seconds : float
    version : str
        Demsmith's.
    voids, cells, cells_void, cells_filled, cells_unfilled, largest_void : int
        Number of voids, of cells in all, in voids, filled (from neighbours too) and left, and of
        cells of the largest void.
    cells_by_source : dict
        Cells by the names of the source map's classes.
    cells_faulty : int
        Known cells that were not believed, and filled.
    auxiliaries : tuple of dict
        How each was aligned: see `demsmith.core.auxiliary.Alignment`.
    neighbours : tuple of str
        Paths of the files from which ground beside the raster was taken.
    warnings : tuple of str
        One sentence each.
    table : VoidTable
    """

    output: str
    source_map: str | None
    uncertainty: str | None
    voids_layer: str | None
    report: str | None
    seconds: float
    version: str
    voids: int
    cells: int
    cells_void: int
    cells_filled: int
    cells_unfilled: int
    largest_void: int
    cells_by_source: dict
    cells_faulty: int
    auxiliaries: tuple
    neighbours: tuple
    warnings: tuple
    table: VoidTable

    def as_dict(self):
        """Give everything but the table as a dict that JSON can hold."""
        return {
            field.name: getattr(self, field.name) for field in fields(self) if field.name != "table"
        }


def reconstruct_file(
    input, output, *, options=None, auxiliaries=(), neighbours=None, band=1, nodata=(),  # noqa: A002
    below=None, above=None, mask=None, source_map=None, uncertainty=None, voids_layer=None,
    report=None, threads=None, overwrite=False, creation_options=(), progress=SILENT,
):  # fmt: skip
    """Reconstruct the voids of a raster file.

    Everything asked for is written, or nothing is; the input is never changed.

    Parameters
    ----------
    input : path
        Anything `demsmith.read_raster` reads, which also explains ``band``, ``nodata``,
        ``below``, ``above`` and ``mask``.
    output : path
        GeoTIFF with the voids filled, in the input's data type unless
        ``options.float_output``.
    options : ReconstructOptions, optional
    auxiliaries : sequence of path
        Rasters to fill from where they do better, in the order of trust, of any CRS and
        resolution; of each also a folder of tiles.
    neighbours : path, optional
        Folder with rasters on the same grid: those that lie beside or overlap the input's edges
        give the ground beyond them.
    source_map : path, optional
        GeoTIFF of bytes: the codes of `demsmith.core.voids.sources`.
    uncertainty : path, optional
        GeoTIFF of the standard error to be expected in each filled cell, 0 in known ones, in the
        raster's unit; only the method auto knows it.
    voids_layer : path, optional
        GeoPackage or GeoJSON: the voids as polygons, with their size, relief, method and
        expected error.
    report : path, optional
        Page (.html, with the numbers beside it as .json) or numbers alone (.json).
    threads : int, optional
        Default: one for each core. The outputs do not depend on it.
    overwrite : bool
        Whether existing outputs may be replaced.
    creation_options : iterable of str
        GDAL's for GeoTIFF, ``KEY=VALUE``.
    progress : Progress

    Returns
    -------
    ReconstructResult

    Raises
    ------
    InputError
        If the input cannot be used, has nothing but voids, or an option is out of range.
    OutputError
        If an output cannot be written.
    Cancelled
        If ``progress`` asks to stop.
    """
    begin = time.perf_counter()
    options = options or ReconstructOptions()
    validate(options)
    refuse_uncertainty(options, uncertainty)
    grid = raster.read_header(input, band=band)[0]
    others = check_auxiliaries(auxiliaries, options, grid, inputs=[input])
    wanted = dict(
        output=output, source_map=source_map, uncertainty=uncertainty, voids_layer=voids_layer,
        report=report,
    )  # fmt: skip
    inputs = [path for path in (input, mask, *others) if path is not None]
    paths = check_outputs(wanted, inputs=inputs, overwrite=overwrite, crs=grid.crs)
    rules = raster.CellRules(band=band, nodata=nodata, below=below, above=above)
    own = raster.read(input, **rules.as_dict(), mask=mask, progress=Span(progress, 0, 0.05))
    around = alone(own)
    if neighbours is not None:
        around = surroundings(own, neighbours, rules=rules, progress=Span(progress, 0.05, 0.1))
    done, made = _reconstruct(own, around, options, auxiliaries, threads, Span(progress, 0.1, 0.85))
    result = _result(own, around, done, made, paths)
    with raster.all_or_nothing(paths) as part:
        write_tile(
            part, own, made, creation_options=creation_options, threads=threads,
            progress=Span(progress, 0.85, 0.97),
        )  # fmt: skip
        extents = done.extents.subset(done.voids)
        if voids_layer:
            raster.write_polygons(
                part["voids_layer"], extents, around.ground.grid, vars(result.table),
                progress=Span(progress, 0.97, 1),
            )  # fmt: skip
        result = replace(result, seconds=round(time.perf_counter() - begin, 3))
        if report:
            write_reports(part, result, options, own, made, _boxes(extents, around))
        checkpoint(progress, 1.0)
    return result


def _reconstruct(own, around, options, auxiliaries, threads, progress):
    if own.void.all() and not around.neighbours:
        raise InputError(f"'{own.source}': every cell is a void; there is nothing to fill from")
    window = around.rows, around.columns
    done = reconstruct_ground(
        around.ground, options, auxiliaries=auxiliaries, target=window, threads=threads,
        progress=Span(progress, 0, 0.9),
    )  # fmt: skip
    made = assemble(
        own, around.ground, *window, done.patches, outliers=done.outliers,
        float_output=options.float_output, progress=Span(progress, 0.9, 1),
    )  # fmt: skip
    return done, made


def _result(own, around, done, made, paths):
    table = tabulate(
        done.plan, done.extents, done.voids, done.patches, around.ground.grid,
        corner=(around.rows.start, around.columns.start),
    )  # fmt: skip
    counts = np.bincount(made.sources.ravel(), minlength=256)
    void = own.values.size - counts[ORIGINAL]
    return ReconstructResult(
        **{name: paths.get(name) for name in _OUTPUTS},
        seconds=0.0,
        version=demsmith.__version__,
        voids=len(table),
        cells=own.values.size,
        cells_void=int(void),
        cells_filled=int(void - counts[LEFT]),
        cells_unfilled=int(counts[LEFT]),
        largest_void=int(table.cells.max(initial=0)),
        cells_by_source={
            source.name: int(counts[source.code]) for source in SOURCES if counts[source.code]
        },
        cells_faulty=made.removed.row.size,
        auxiliaries=tuple(done.plan.alignments()),
        neighbours=around.neighbours,
        warnings=tuple(_warnings(own, around, done, paths.get("uncertainty"))),
        table=table,
    )


def _warnings(own, around, done, uncertainty):
    yield from own.notes
    yield from around.notes
    if not own.void.any():
        yield f"'{own.source}' has no voids; its elevations are written as they are"
    if uncertainty and not done.plan.model.calibrated:
        yield f"'{own.source}': {UNCALIBRATED}"
    for each in done.plan.alignments():
        if not each["accepted"]:
            yield f"auxiliary '{each['path']}' is not used: {each['reason']}"
    if done.large.size:
        yield large_note(done.extents.cells[done.large])


def _boxes(extents, around):
    """Give the voids' boxes in the raster's rows and columns, as far as they lie in it."""
    corner = around.rows.start, around.columns.start
    ends = around.rows.stop, around.columns.stop
    spans = (extents.top, extents.bottom), (extents.left, extents.right)
    return np.stack(
        [
            np.clip(edge, low, high) - low
            for span, low, high in zip(spans, corner, ends, strict=True)
            for edge in span
        ],
        axis=1,
    )
