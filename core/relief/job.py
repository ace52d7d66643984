"""Terrain basics from file to file, as the command line and QGIS make them."""

import os
import time
from dataclasses import dataclass, fields

import numpy as np

import demsmith
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.options import validate
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.relief.deviation import mean_deviation, topographic_position
from demsmith.core.relief.hillshade import hillshade
from demsmith.core.relief.options import ReliefOptions
from demsmith.core.relief.slope import aspect, slope

_NODATA = -9999.0


@dataclass(frozen=True)
class ReliefResult:
    """What was made of a terrain.

    Attributes
    ----------
    output : str
        Path of what was written.
    kind : str
        Of `ReliefOptions`.
    seconds : float
    version : str
        Demsmith's.
    cells, cells_known : int
        Number of cells in all, and with a result.
    minimum, maximum : float or None
        Of the results, as written; None if there is none, as of the aspect of level ground.
    warnings : tuple of str
        One sentence each.
    """

    output: str
    kind: str
    seconds: float
    version: str
    cells: int
    cells_known: int
    minimum: float | None
    maximum: float | None
    warnings: tuple

    def as_dict(self):
        """Give everything as a dict that JSON can hold."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def relief_file(
    input, output, *, options=None, band=1, nodata=(), below=None, above=None,  # noqa: A002
    mask=None, threads=None, overwrite=False, creation_options=(), progress=SILENT,
):  # fmt: skip
    """Make slope, aspect, hillshade, mean deviation or topographic position of a raster file.

    All are in ground units: metres per cell are those of each row, also of geographic coordinates,
    and elevations in feet or with a scale become metres. North is that of the grid.

    Parameters
    ----------
    input : path
        Anything `demsmith.read_raster` reads, which also explains ``band``, ``nodata``,
        ``below``, ``above`` and ``mask``.
    output : path
        GeoTIFF: float32, nodata -9999; of a hillshade, uint8 from 1 (dark) to 255, nodata 0.
    options : ReliefOptions, optional
    threads : int, optional
        Default: one for each core. The output does not depend on it.
    overwrite : bool
        Whether an existing output may be replaced.
    creation_options : iterable of str
        GDAL's for GeoTIFF, ``KEY=VALUE``.
    progress : Progress

    Returns
    -------
    ReliefResult

    Raises
    ------
    InputError
        If the input cannot be used, has nothing but voids, or an option is out of range.
    OutputError
        If the output cannot be written.
    Cancelled
        If ``progress`` asks to stop; nothing is written then.
    """
    begin = time.perf_counter()
    options = options or ReliefOptions()
    validate(options)
    inputs = [path for path in (input, mask) if path is not None]
    raster.check_output(output, inputs=inputs, overwrite=overwrite)
    source = raster.read(
        input, band=band, nodata=nodata, below=below, above=above, mask=mask,
        progress=Span(progress, 0, 0.2),
    )  # fmt: skip
    if source.void.all():
        raise InputError(f"'{source.source}': every cell is a void; there is no ground to look at")
    values, unit = _made(source, options, threads, Span(progress, 0.2, 0.6))
    unknown = np.isnan(values)
    shaded = options.kind == "hillshade"
    if shaded:
        values = _as_bytes(values)
    raster.write(
        output, values, void=unknown, dtype=values.dtype, nodata=0 if shaded else _NODATA,
        like=source, same_quantity=False, description=options.kind, unit=unit, threads=threads,
        overwrite=overwrite, creation_options=creation_options, progress=Span(progress, 0.6, 1),
    )  # fmt: skip
    checkpoint(progress, 1.0)
    known = values[~unknown]
    return ReliefResult(
        output=os.fspath(output),
        kind=options.kind,
        seconds=round(time.perf_counter() - begin, 3),
        version=demsmith.__version__,
        cells=values.size,
        cells_known=known.size,
        minimum=float(known.min()) if known.size else None,
        maximum=float(known.max()) if known.size else None,
        warnings=source.notes,
    )


def _made(source, options, threads, progress):
    """Compute what is asked for; gives it and its unit."""
    order, grid = raster.north_up(source.grid)
    ground = dict(
        values=raster.elevations_m(source)[order], void=source.void[order],
        pixel_size=grid.pixel_size_m(), threads=threads, progress=progress,
    )  # fmt: skip
    if options.kind == "deviation":
        made, unit = mean_deviation(**ground, radius=options.radius), "m"
    elif options.kind == "position":
        made, unit = topographic_position(**ground, radius=options.radius), "m"
    elif options.kind == "slope":
        made = slope(**ground, unit=options.unit, method=options.method)
        unit = "°" if options.unit == "degrees" else "%"
    elif options.kind == "aspect":
        made, unit = aspect(**ground, method=options.method), "°"
    else:
        made, unit = _shaded(ground, options), ""
    return made[order], unit


def _shaded(ground, options):
    return hillshade(
        **ground, azimuth=options.azimuth, altitude=options.altitude,
        exaggeration=options.exaggeration, multidirectional=options.multidirectional,
        method=options.method,
    )  # fmt: skip


def _as_bytes(lit):
    """Give light from 0 to 1 as whole numbers from 1 to 255; voids get any."""
    return np.rint(1 + 254 * np.nan_to_num(lit)).astype(np.uint8)
