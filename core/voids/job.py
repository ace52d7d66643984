"""Void filling from file to file, as the command line and QGIS do it."""

import json
import os
import time
from dataclasses import asdict, dataclass, fields, replace

import numpy as np

import demsmith
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.mcmd import read_maps
from demsmith.core.options import validate
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.voids.accurate import UNCALIBRATED
from demsmith.core.voids.filling import fill_voids
from demsmith.core.voids.options import FillOptions
from demsmith.core.voids.sizes import SIZE_CLASSES
from demsmith.core.voids.sources import SOURCE_COLORS, SOURCE_NAMES
from demsmith.core.voids.table import VoidTable, tabulate


@dataclass(frozen=True)
class FillResult:
    """What a fill did.

    Attributes
    ----------
    output, source_map, uncertainty, report : str or None
        Paths of what was written.
    seconds : float
    version : str
        Demsmith's.
    voids, cells, cells_void, cells_filled, cells_unfilled, largest_void : int
        Number of voids found, of cells in all, in voids, filled and left, and of cells of the
        largest void.
    reasons : tuple of str
        How voids of each size class are filled and why; empty if nothing was learned for it.
    tuning : dict or None
        What tuning found, if it was asked for: `demsmith.core.tuning.Tuned.as_dict`.
    warnings : tuple of str
        One sentence each.
    table : VoidTable
    """

    output: str
    source_map: str | None
    uncertainty: str | None
    report: str | None
    seconds: float
    version: str
    voids: int
    cells: int
    cells_void: int
    cells_filled: int
    cells_unfilled: int
    largest_void: int
    reasons: tuple
    tuning: dict | None
    warnings: tuple
    table: VoidTable

    def as_dict(self):
        """Give everything but the table as a dict that JSON can hold."""
        return {
            field.name: getattr(self, field.name) for field in fields(self) if field.name != "table"
        }


def fill_file(
    input, output, *, options=None, maps=None, band=1, nodata=(), below=None, above=None,  # noqa: A002
    mask=None, source_map=None, uncertainty=None, report=None, threads=None, overwrite=False,
    creation_options=(), progress=SILENT,
):  # fmt: skip
    """Fill the voids of a raster file.

    Everything asked for is written, or nothing is; the input is never changed.

    Parameters
    ----------
    input : path
        Anything `demsmith.read_raster` reads, which also explains ``band``, ``nodata``,
        ``below``, ``above`` and ``mask``.
    output : path
        GeoTIFF with the voids filled, in the input's data type unless
        ``options.float_output``.
    options : FillOptions, optional
    maps : mapping of str to path, optional
        Rasters on the input's grid of options that change from cell to cell, such as
        ``{"r_s": "rough.tif"}``; see `demsmith.core.mcmd.Maps`.
    source_map : path, optional
        GeoTIFF of bytes: the codes of `demsmith.core.voids.sources`.
    uncertainty : path, optional
        GeoTIFF of the standard error to be expected in each filled cell, 0 in known ones, in the
        raster's unit; only the accurate engine knows it.
    report : path, optional
        JSON file with the result, the options and the table of voids.
    threads : int, optional
        Default: one for each core. The outputs do not depend on it.
    overwrite : bool
        Whether existing outputs may be replaced.
    creation_options : iterable of str
        GDAL's for GeoTIFF, ``KEY=VALUE``.
    progress : Progress

    Returns
    -------
    FillResult

    Raises
    ------
    InputError
        If the input cannot be used, has nothing but voids, a map does not fit, or an option is
        out of range.
    OutputError
        If an output cannot be written.
    Cancelled
        If ``progress`` asks to stop.
    """
    begin = time.perf_counter()
    options = options or FillOptions()
    validate(options)
    maps = {name: os.fspath(path) for name, path in (maps or {}).items()}
    inputs = [path for path in (input, mask, *maps.values()) if path is not None]
    paths = _checked_outputs(inputs, output, source_map, uncertainty, report, overwrite)
    if uncertainty and (maps or not options.accurate):
        raise InputError("an uncertainty needs the method auto, without options of MCMD's own")
    source = raster.read(
        input, band=band, nodata=nodata, below=below, above=above, mask=mask,
        progress=Span(progress, 0, 0.1),
    )  # fmt: skip
    read = read_maps(maps, source.grid, progress=Span(progress, 0.1, 0.15))
    filled = _fill(source, options, read, threads, Span(progress, 0.15, 0.8))
    result = _result(source, filled, paths, begin)
    checkpoint(progress, 0.8)
    left = filled.left()
    checkpoint(progress, 0.8)
    writing = dict(like=source, threads=threads, overwrite=True, creation_options=creation_options)
    with raster.all_or_nothing(paths) as part:
        raster.write(
            part["output"], filled.values, void=left, dtype=filled.values.dtype,
            progress=Span(progress, 0.8, 0.95), **writing,
        )  # fmt: skip
        if source_map:
            raster.write(
                part["source_map"], filled.source(), dtype="uint8", nodata=None,
                description="source", same_quantity=False, color_table=SOURCE_COLORS,
                categories=SOURCE_NAMES, progress=Span(progress, 0.95, 1), **writing,
            )  # fmt: skip
        if uncertainty:
            raster.write(
                part["uncertainty"], _sigma(filled, source.meta), void=left, dtype="float32",
                nodata=-1.0, description="standard error", same_quantity=False,
                progress=Span(progress, 0.97, 1), **writing,
            )  # fmt: skip
        result = replace(result, seconds=round(time.perf_counter() - begin, 3))
        if report:
            _write_report(part["report"], result, options, maps, input, band)
        checkpoint(progress, 1.0)
    return result


def _checked_outputs(inputs, output, source_map, uncertainty, report, overwrite):
    raster.check_output(output, inputs=inputs, overwrite=overwrite)
    for path in (source_map, uncertainty):
        if path:
            raster.check_output(path, inputs=inputs, overwrite=overwrite)
    if report:
        raster.check_place(report, inputs=inputs, overwrite=overwrite)
    paths = dict(output=output, source_map=source_map, uncertainty=uncertainty, report=report)
    paths = {name: os.fspath(path) if path else None for name, path in paths.items()}
    named = [os.path.realpath(path) for path in paths.values() if path]
    if len(set(named)) < len(named):
        raise InputError("the outputs must be different files")
    return paths


def _fill(source, options, maps, threads, progress):
    meta = source.meta
    # The options speak of real elevations, the cells of stored ones.
    stored = replace(
        options,
        datum=None if options.datum is None else (options.datum - meta.offset) / meta.scale,
        relief=None if options.relief is None else options.relief / abs(meta.scale),
    )
    try:
        return fill_voids(
            source.values, source.void, options=stored, maps=maps,
            pixel_size=source.grid.pixel_size_m(), threads=threads, progress=progress,
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"'{source.source}': {error}") from None


def _sigma(filled, meta):
    """Give the standard errors in the raster's unit, of voids that were left too."""
    if filled.sigma is None:
        return np.zeros(filled.values.shape, np.float32)
    return filled.sigma * np.float32(abs(meta.scale))


def _result(source, filled, paths, begin):
    cells = filled.voids.cells
    warnings = list(source.notes)
    if not cells.size:
        warnings.append(f"'{source.source}' has no voids; its elevations are written as they are")
    if paths["uncertainty"] and filled.model is not None and not filled.model.calibrated:
        warnings.append(f"'{source.source}': {UNCALIBRATED}")
    if filled.tuned and not filled.tuned.accepted:
        warnings.append(f"'{source.source}': {filled.tuned.summary()}")
    return FillResult(
        **paths,
        seconds=time.perf_counter() - begin,
        version=demsmith.__version__,
        voids=len(cells),
        cells=source.values.size,
        cells_void=int(cells.sum()),
        cells_filled=filled.cells_filled,
        cells_unfilled=int(cells.sum()) - filled.cells_filled,
        largest_void=int(cells.max(initial=0)),
        reasons=_reasons(filled.model),
        tuning=filled.tuned and filled.tuned.as_dict(),
        warnings=tuple(warnings),
        table=tabulate(filled, source.grid, source.meta),
    )


def _reasons(model):
    if model is None:
        return ()
    return tuple(
        f"{smallest} to {largest} cells: {model.reason(k)}" if largest
        else f"{smallest} cells and more: {model.reason(k)}"
        for k, (smallest, largest) in enumerate(SIZE_CLASSES)
    )  # fmt: skip


def _write_report(path, result, options, maps, source, band):
    content = {
        **result.as_dict(),
        "input": os.fspath(source),
        "band": band,
        "options": asdict(options),
        "maps": maps,
        "void_table": list(result.table.rows()),
    }
    with open(path, "w", encoding="utf-8") as file:
        json.dump(content, file, indent=1, allow_nan=False)
        file.write("\n")
