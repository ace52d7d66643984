"""Thinning from file to file, as the command line and QGIS do it."""

import os
import time
from dataclasses import dataclass, fields

import numpy as np

import demsmith
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.options import validate
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.raster.points import check_points_output
from demsmith.core.thinning.options import ThinOptions
from demsmith.core.thinning.thinning import thin


@dataclass(frozen=True)
class ThinResult:
    """What a thinning did.

    Attributes
    ----------
    output, points : str or None
        Paths of what was written.
    seconds : float
    version : str
        Demsmith's.
    cells, cells_known, cells_kept : int
        Number of cells in all, with an elevation, and kept.
    share : float
        Kept by known cells.
    warnings : tuple of str
        One sentence each.
    """

    output: str
    points: str | None
    seconds: float
    version: str
    cells: int
    cells_known: int
    cells_kept: int
    share: float
    warnings: tuple

    def as_dict(self):
        """Give everything as a dict that JSON can hold."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def thin_file(
    input, output, *, options=None, points=None, band=1, nodata=(), below=None,  # noqa: A002
    above=None, mask=None, threads=None, overwrite=False, creation_options=(), progress=SILENT,
):  # fmt: skip
    """Keep a share of the cells of a raster file.

    Everything asked for is written, or nothing is; the input is never changed.

    Parameters
    ----------
    input : path
        Anything `demsmith.read_raster` reads, which also explains ``band``, ``nodata``,
        ``below``, ``above`` and ``mask``.
    output : path
        GeoTIFF of the kept cells, bit by bit as they were; all others are nodata. It has the
        input's data type and nodata tag, or another tag where a kept cell has that value.
    options : ThinOptions, optional
    points : path, optional
        GeoPackage, GeoJSON or table (``.gpkg``, ``.geojson``, ``.csv``) of the kept cells'
        centres, with their elevations, scale and offset applied, as ``z``.
    threads : int, optional
        Default: one for each core. The outputs do not depend on it.
    overwrite : bool
        Whether existing outputs may be replaced.
    creation_options : iterable of str
        GDAL's for GeoTIFF, ``KEY=VALUE``.
    progress : Progress

    Returns
    -------
    ThinResult

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
    options = options or ThinOptions()
    validate(options)
    checks = dict(inputs=[path for path in (input, mask) if path is not None], overwrite=overwrite)
    raster.check_output(output, **checks)
    source = raster.read(
        input, band=band, nodata=nodata, below=below, above=above, mask=mask,
        progress=Span(progress, 0, 0.15),
    )  # fmt: skip
    if points:
        check_points_output(points, crs=source.grid.crs, **checks)
    thinned = _thin(source, options, threads, Span(progress, 0.15, 0.7))
    with raster.all_or_nothing({"output": output, "points": points}) as part:
        raster.write(
            part["output"], source.values, void=~thinned.kept, like=source, threads=threads,
            creation_options=creation_options, progress=Span(progress, 0.7, 0.85),
        )  # fmt: skip
        if points:
            _write_points(part["points"], source, thinned.kept, Span(progress, 0.85, 1))
        checkpoint(progress, 1.0)
    return ThinResult(
        output=os.fspath(output),
        points=os.fspath(points) if points else None,
        seconds=round(time.perf_counter() - begin, 3),
        version=demsmith.__version__,
        cells=source.values.size,
        cells_known=thinned.cells_known,
        cells_kept=thinned.cells_kept,
        share=thinned.share,
        warnings=source.notes,
    )


def _thin(source, options, threads, progress):
    try:
        return thin(
            source.values, source.void, options=options, pixel_size=source.grid.pixel_size_m(),
            threads=threads, progress=progress,
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"'{source.source}': {error}") from None


def _write_points(path, source, kept, progress):
    rows, columns = np.nonzero(kept)
    x, y = source.grid.xy(rows, columns)
    z = source.meta.real(source.values[kept].astype(np.float64))
    raster.write_points(path, x, y, z, crs=source.grid.crs, progress=progress)
