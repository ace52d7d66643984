"""Validation of fills of a raster file, as the command line and QGIS do it."""

import os
import time
from dataclasses import dataclass, fields

import numpy as np

import demsmith
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.options import validate as check
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.validation.methods import chosen_methods
from demsmith.core.validation.options import ValidateOptions
from demsmith.core.validation.shapes import void_shapes
from demsmith.core.validation.validation import validate

_PAGES = (".html", ".htm")


@dataclass(frozen=True)
class ValidateResult:
    """What a validation found.

    Attributes
    ----------
    output, report, error_map : str or None
        Paths of what was written: the table of errors, the report, the raster of errors.
    seconds : float
    version : str
        Demsmith's.
    cells, cells_void, cells_hidden, holes : int
        Number of cells in all, in real voids, and hidden in artificial ones; and of those voids,
        all masks taken together.
    shapes_from : str
        Whose shapes the artificial voids have: ``"own"``, ``"other"`` or ``"mixture"``.
    best : str
        The method of the least RMSE over all artificial voids.
    rmse : float
        Its RMSE, in the band's unit.
    warnings : tuple of str
        One sentence each.
    scores : tuple of MethodScore
    """

    output: str | None
    report: str | None
    error_map: str | None
    seconds: float
    version: str
    cells: int
    cells_void: int
    cells_hidden: int
    holes: int
    shapes_from: str
    best: str
    rmse: float
    warnings: tuple
    scores: tuple

    def as_dict(self):
        """Give everything as a dict that JSON can hold."""
        flat = {each.name: getattr(self, each.name) for each in fields(self)}
        return flat | {"scores": [score.as_dict() for score in self.scores]}

    def rows(self):
        """Yield the errors of each method and size class as a dict of plain values."""
        for score in self.scores:
            for error in score.errors:
                yield {
                    "method": score.method, "size": error.name, **error.as_dict(),
                    "seconds": score.seconds,
                }  # fmt: skip


def validate_file(
    input, *, output=None, methods=None, voids_from=None, options=None, report=None,  # noqa: A002
    error_map=None, band=1, nodata=(), below=None, above=None, mask=None, threads=None,
    overwrite=False, creation_options=(), progress=SILENT,
):  # fmt: skip
    """Tell how wrong fills of a raster file are, by void size.

    Known ground is hidden in artificial voids and filled by each method. Everything asked for is
    written, or nothing is; the input is never changed.

    Parameters
    ----------
    input : path
        Anything `demsmith.read_raster` reads, which also explains ``band``, ``nodata``,
        ``below``, ``above`` and ``mask``.
    output : path, optional
        Table of the errors by method and size class: ``.csv``, or without geometry ``.gpkg``.
    methods : sequence of str, optional
        Names in `demsmith.core.validation.METHODS`. Default: all whose libraries are there.
    voids_from : path, optional
        Raster whose voids' shapes the artificial ones have, read as ``input`` is but for ``mask``.
        Default: the input itself or, if no void lies inside it, a mixture as of the SRTM.
    options : ValidateOptions, optional
    report : path, optional
        Page with charts and tables, ``.html``, or its numbers, ``.json``.
    error_map : path, optional
        GeoTIFF of filled less true elevation by the first method, where a mask hides known
        ground; elsewhere nodata.
    threads : int, optional
        Default: one for each core. The errors do not depend on it.
    overwrite : bool
        Whether existing outputs may be replaced.
    creation_options : iterable of str
        GDAL's for GeoTIFF, ``KEY=VALUE``.
    progress : Progress

    Returns
    -------
    ValidateResult

    Raises
    ------
    InputError
        If an input cannot be used, too little ground is known, there is no such method, or an
        option is out of range.
    OutputError
        If an output cannot be written.
    DependencyError
        If a method that is named wants its library.
    Cancelled
        If ``progress`` asks to stop.
    """
    begin = time.perf_counter()
    options = options or ValidateOptions()
    check(options)
    chosen_methods(methods)
    inputs = [path for path in (input, mask, voids_from) if path is not None]
    paths = _checked_outputs(inputs, output, report, error_map, overwrite)
    reading = dict(nodata=nodata, below=below, above=above)
    source = raster.read(input, band=band, mask=mask, progress=Span(progress, 0, 0.05), **reading)
    shapes, notes = None, source.notes
    if voids_from is not None:
        shapes, more = _shapes_of(voids_from, reading, Span(progress, 0.05, 0.1))
        notes += more
    found = _validate(source, shapes, methods, options, threads, Span(progress, 0.1, 0.95))
    result = _result(source, found, paths, notes, round(time.perf_counter() - begin, 3))
    with raster.all_or_nothing(paths) as part:
        if output:
            raster.write_rows(part["output"], list(result.rows()))
        if report:
            _write_report(
                part["report"], result=result, options=options, source=os.fspath(input),
                voids_from=voids_from and os.fspath(voids_from), band=band,
                unit=source.meta.unit or "m",
            )  # fmt: skip
        if error_map:
            raster.write(
                part["error_map"], found.error, void=np.isnan(found.error), dtype="float32",
                like=source, same_quantity=False, description=f"error of {found.scores[0].method}",
                threads=threads, creation_options=creation_options,
                progress=Span(progress, 0.95, 1),
            )  # fmt: skip
        checkpoint(progress, 1.0)
    return result


def _checked_outputs(inputs, output, report, error_map, overwrite):
    checks = dict(inputs=inputs, overwrite=overwrite)
    if output:
        raster.check_rows_output(output, **checks)
    if report:
        if not os.fspath(report).lower().endswith((*_PAGES, ".json")):
            raise InputError(f"report '{os.fspath(report)}' must end in .html or .json")
        raster.check_place(report, **checks)
    if error_map:
        raster.check_output(error_map, **checks)
    paths = {"output": output, "report": report, "error_map": error_map}
    paths = {name: os.fspath(path) if path else None for name, path in paths.items()}
    named = [os.path.realpath(path) for path in paths.values() if path]
    if len(set(named)) < len(named):
        raise InputError("table, report and error map must be different files")
    return paths


def _shapes_of(path, reading, progress):
    """Give the shapes of a raster's voids, and what reading it had to say."""
    other = raster.read(path, progress=Span(progress, 0, 0.5), **reading)
    shapes = void_shapes(
        other.void, _real(other), pixel_size=other.grid.pixel_size_m(),
        progress=Span(progress, 0.5, 1),
    )  # fmt: skip
    if not shapes:
        raise InputError(
            f"no void lies inside '{path}', so there are no shapes to take; name another raster, "
            "or none for a mixture as of the SRTM"
        )
    return shapes, other.notes


def _real(source):
    """Give the elevations that the stored values mean."""
    kind = np.promote_types(source.values.dtype, np.float32)
    return source.meta.real(source.values.astype(kind, copy=False))


def _validate(source, shapes, methods, options, threads, progress):
    try:
        return validate(
            _real(source), source.void, shapes=shapes, methods=methods, options=options,
            pixel_size=source.grid.pixel_size_m(), threads=threads, progress=progress,
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"'{source.source}': {error}") from None


def _result(source, found, paths, notes, seconds):
    overall = found.best.errors[-1]
    return ValidateResult(
        **paths,
        seconds=seconds,
        version=demsmith.__version__,
        cells=source.values.size,
        cells_void=int(np.count_nonzero(source.void)),
        cells_hidden=overall.cells,
        holes=overall.voids,
        shapes_from=found.shapes_from,
        best=found.best.method,
        rmse=overall.rmse,
        warnings=(*notes, *(f"'{source.source}': {note}" for note in found.notes)),
        scores=found.scores,
    )


def _write_report(path, **content):
    from demsmith.core.validation.report import validation_report

    report = validation_report(**content)
    if path.lower().endswith(_PAGES):
        report.write_html(path)
    else:
        report.write_json(path)
