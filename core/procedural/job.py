"""Inverse procedural modelling from file to file, as the command line and QGIS do it."""

import os
import time
from dataclasses import dataclass, fields

import numpy as np

import demsmith
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.options import specifications, validate
from demsmith.core.procedural.file import EXTENSION, PlacedTerrain, read_terrain, write_terrain
from demsmith.core.procedural.options import OutputOptions, ProceduralizeOptions
from demsmith.core.procedural.terrain import proceduralize
from demsmith.core.progress import SILENT, Span, checkpoint


@dataclass(frozen=True)
class ProceduralizeResult:
    """What was modelled, or evaluated.

    Attributes
    ----------
    output, raster : str or None
        Paths of what was written: the model, and the evaluated raster.
    seconds : float
    version : str
        Demsmith's.
    cells, cells_known : int
        Of the modelled raster: in all, and with an elevation.
    discs, atoms : int
        Of the model.
    bytes : int or None
        Size of the model's file.
    rmse, psnr : float or None
        Of the model against the raster it is of, in the raster's unit and in decibels against
        the range of its elevations; ``psnr`` is None for an exact model, both where no raster was
        modelled.
    warnings : tuple of str
        One sentence each.
    """

    output: str | None
    raster: str | None
    seconds: float
    version: str
    cells: int
    cells_known: int
    discs: int
    atoms: int
    bytes: int | None
    rmse: float | None
    psnr: float | None
    warnings: tuple

    def as_dict(self):
        """Give everything as a dict that JSON can hold."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def proceduralize_file(
    input, output=None, *, raster_output=None, options=None, outputs=None, band=1,  # noqa: A002
    nodata=(), below=None, above=None, mask=None, threads=None, overwrite=False,
    creation_options=(), progress=SILENT,
):  # fmt: skip
    """Model a raster file by functions, or evaluate a model made before.

    Everything asked for is written, or nothing is; the input is never changed.

    Parameters
    ----------
    input : path
        Anything `demsmith.read_raster` reads, which also explains ``band``, ``nodata``,
        ``below``, ``above`` and ``mask``; or a model, ``.dsp``, for which these, ``output`` and
        ``options`` must be left out.
    output : path, optional
        The model, ``.dsp``: the functions' parameters and which of them each disc has.
    raster_output : path, optional
        GeoTIFF of the model's elevations, float32 with voids as not-a-number.
    options : ProceduralizeOptions, optional
    outputs : OutputOptions, optional
        Resolution of ``raster_output``, without which they must be left out.
    threads : int, optional
        Default: one for each core. The outputs do not depend on it.
    overwrite : bool
        Whether existing outputs may be replaced.
    creation_options : iterable of str
        GDAL's for GeoTIFF, ``KEY=VALUE``.
    progress : Progress

    Returns
    -------
    ProceduralizeResult

    Raises
    ------
    InputError
        If the input cannot be used, has nothing but voids, an option is out of range or has no
        meaning for what is asked for, or nothing is asked for.
    OutputError
        If an output cannot be written.
    Cancelled
        If ``progress`` asks to stop.
    """
    begin = time.perf_counter()
    options, outputs = options or ProceduralizeOptions(), outputs or OutputOptions()
    validate(options)
    validate(outputs)
    is_model = os.fspath(input).lower().endswith(EXTENSION)
    inputs = [path for path in (input, mask) if path is not None]
    _check_outputs(output, raster_output, is_model, dict(inputs=inputs, overwrite=overwrite))
    if not raster_output:
        _refuse(_changed(outputs), "no evaluated raster is asked for")
    if is_model:
        reading = dict(
            band=band != 1, nodata=len(nodata) > 0, below=below is not None,
            above=above is not None, mask=mask is not None,
        )  # fmt: skip
        given = [name for name, is_given in reading.items() if is_given]
        _refuse(_changed(options) + given, f"'{input}' is a model already")
        placed, told = read_terrain(input), {}
    else:
        source = raster.read(
            input, band=band, nodata=nodata, below=below, above=above, mask=mask,
            progress=Span(progress, 0, 0.05),
        )  # fmt: skip
        placed, told = _modelled(source, options, threads, Span(progress, 0.05, 0.6))
    with raster.all_or_nothing({"output": output, "raster": raster_output}) as part:
        if output:
            write_terrain(part["output"], placed)
            told["bytes"] = os.path.getsize(part["output"])
        if raster_output:
            made = placed.raster(
                scale=outputs.scale, threads=threads, progress=Span(progress, 0.6, 0.9)
            )  # fmt: skip
            raster.write(
                part["raster"], made.values, void=made.void, like=made, threads=threads,
                creation_options=creation_options, progress=Span(progress, 0.9, 1),
            )  # fmt: skip
        checkpoint(progress, 1.0)
    terrain = placed.terrain
    return ProceduralizeResult(
        output=os.fspath(output) if output else None,
        raster=os.fspath(raster_output) if raster_output else None,
        seconds=round(time.perf_counter() - begin, 3),
        version=demsmith.__version__,
        cells=terrain.void.size,
        cells_known=int(np.count_nonzero(~terrain.void)),
        discs=terrain.grid.count,
        atoms=len(terrain.functions),
        **{"bytes": None, "rmse": None, "psnr": None, "warnings": (), **told},
    )


def _check_outputs(output, raster_output, is_model, checks):
    if not (output or raster_output):
        raise InputError("nothing to make: give a model (.dsp) or a raster (.tif) to write")
    if output:
        if is_model:
            raise InputError(f"the input is a model already: '{output}' would be the same")
        if not os.fspath(output).lower().endswith(EXTENSION):
            raise InputError(f"output '{output}' must be a model: end its name in {EXTENSION}")
        raster.check_place(output, **checks)
    if raster_output:
        raster.check_output(raster_output, **checks)


def _changed(options):
    """Name the options that are not at their default."""
    specs = specifications(type(options))
    return [spec.name for spec in specs if getattr(options, spec.name) != spec.default]


def _refuse(names, why):
    """Refuse options that would do nothing."""
    if names:
        raise InputError(f"{' and '.join(names)} would do nothing, as {why}; leave it out")


def _modelled(source, options, threads, progress):
    """Model a raster, and tell how well."""
    elevations = source.meta.real(source.values.astype(np.float64))
    try:
        terrain = proceduralize(
            elevations, source.void, options=options, pixel_size=source.grid.pixel_size_m(),
            threads=threads, progress=Span(progress, 0, 0.7),
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"'{source.source}': {error}") from None
    model = terrain.evaluate(threads=threads, progress=Span(progress, 0.7, 1))
    known = ~source.void
    rmse = float(np.sqrt(np.mean(np.square(model[known] - elevations[known]))))
    relief = float(np.ptp(elevations[known]))
    placed = PlacedTerrain(terrain, source.grid, source.meta.unit, source.meta.area_or_point)
    psnr = 20 * np.log10(relief / rmse) if rmse > 0 and relief > 0 else None
    told = dict(rmse=rmse, psnr=psnr and float(psnr), warnings=source.notes)
    return placed, told
