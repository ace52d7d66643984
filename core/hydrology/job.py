"""Drainage from file to file, as the command line and QGIS do it."""

import time
from dataclasses import dataclass, fields, replace

import numpy as np

import demsmith
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.hydrology.drainage import drainage_area
from demsmith.core.hydrology.options import DrainageOptions
from demsmith.core.hydrology.outputs import Outputs, write_outputs
from demsmith.core.options import validate
from demsmith.core.progress import SILENT, Span
from demsmith.core.raster.grid import check_same_grid

# Pixels: programs disagree on whether a coordinate is a corner or a centre.
_TOLERANCE = 0.51

# From this share of cells at 0 on, it is the sea that is drained.
_SEA = 0.05


@dataclass(frozen=True)
class DrainageResult:
    """What a run did.

    Attributes
    ----------
    outputs : dict
        Path of each of the `Outputs` by name, None for what was not written.
    seconds : float
    version : str
        Demsmith's.
    cells, cells_void : int
        Number of cells, and of those without an elevation.
    cells_changed : int
        Cells that the treatment of depressions raised or lowered.
    largest_area : float
        In the output's unit.
    links, highest_order : int or None
        Of the streams, if these or their mask were asked for.
    stream_length_m : float or None
    warnings : tuple of str
        One sentence each.
    """

    outputs: dict
    seconds: float
    version: str
    cells: int
    cells_void: int
    cells_changed: int
    largest_area: float
    links: int | None
    highest_order: int | None
    stream_length_m: float | None
    warnings: tuple

    @property
    def output(self):
        """Path of the upstream area."""
        return self.outputs["output"]

    def as_dict(self):
        """Give everything as a dict that JSON can hold, the paths among it by their names."""
        rest = {field.name: getattr(self, field.name) for field in fields(self)[1:]}
        return {**self.outputs, **rest}


def drainage_file(
    input, output, *, options=None, weights=None, filled_mask=None, log=None, specific=None,  # noqa: A002
    standard_error=None, directions=None, flags=None, conditioned=None, stream_mask=None,
    streams=None, coarse=None, band=1, nodata=(), below=None, above=None, mask=None, threads=None,
    overwrite=False, creation_options=(), progress=SILENT,
):  # fmt: skip
    """Tell how much ground drains through each cell of a raster file.

    Everything asked for is written, or nothing is; the input is never changed.

    Parameters
    ----------
    input : path
        Anything `demsmith.read_raster` reads, which also explains ``band``, ``nodata``,
        ``below``, ``above`` and ``mask``. Heights are taken in the band's unit, or in that of its
        CRS, else in metres.
    output, log, specific, standard_error, directions, flags, conditioned, stream_mask, streams, \
    coarse : path, optional
        What is to be written; see `demsmith.core.hydrology.Outputs`.
    options : DrainageOptions, optional
    weights : path, optional
        Raster on the input's grid of what each cell adds instead of its area: 0 or more. Where it
        has no value, nothing is added.
    filled_mask : path, optional
        Raster on the input's grid that is not 0 where elevations were filled, such as the source
        map of `demsmith.fill_file`; for ``flags``.
    threads : int, optional
        Default: one for each core. The outputs do not depend on it.
    overwrite : bool
        Whether existing outputs may be replaced.
    creation_options : iterable of str
        GDAL's for GeoTIFF, ``KEY=VALUE``.
    progress : Progress

    Returns
    -------
    DrainageResult

    Raises
    ------
    InputError
        If the input cannot be used, has nothing but voids, another raster does not fit, an option
        is out of range, or does not go with what is asked for.
    OutputError
        If an output cannot be written.
    Cancelled
        If ``progress`` asks to stop.
    """
    begin = time.perf_counter()
    options = options or DrainageOptions()
    validate(options)
    wanted = Outputs(
        output=output, log=log, specific=specific, standard_error=standard_error,
        directions=directions, flags=flags, conditioned=conditioned, stream_mask=stream_mask,
        streams=streams, coarse=coarse,
    )  # fmt: skip
    _check_sense(wanted, options, weights, filled_mask)
    inputs = [path for path in (input, mask, weights, filled_mask) if path]
    wanted.check(crs=raster.read_grid(input).crs, inputs=inputs, overwrite=overwrite)
    source = raster.read(
        input, band=band, nodata=nodata, below=below, above=above, mask=mask,
        progress=Span(progress, 0, 0.1),
    )  # fmt: skip
    filled = _read_filled(filled_mask, source, Span(progress, 0.1, 0.13)) if filled_mask else None
    added = _read_weights(weights, source, Span(progress, 0.13, 0.16)) if weights else None
    drained = _drain(source, added, options, threads, Span(progress, 0.16, 0.7))
    paths = wanted.paths()
    network = write_outputs(
        paths, drained, source, filled=filled, threads=threads, creation_options=creation_options,
        progress=Span(progress, 0.7, 1),
    )  # fmt: skip
    return DrainageResult(
        outputs=paths,
        seconds=round(time.perf_counter() - begin, 3),
        version=demsmith.__version__,
        cells=source.values.size,
        cells_void=int(np.count_nonzero(source.void)),
        cells_changed=int(np.count_nonzero(drained.changed())),
        largest_area=float(np.nanmax(drained.area)),
        links=None if network is None else len(network),
        highest_order=None if network is None else int(network.order.max(initial=0)),
        stream_length_m=None if network is None else round(float(network.length.sum()), 3),
        warnings=_warnings(source, added, options, network),
    )


def _check_sense(wanted, options, weights, filled_mask):
    """Refuse outputs and inputs that have no meaning with these options."""
    if wanted.standard_error and options.method != "particles":
        raise InputError(f"method {options.method} has no standard error; only particles have one")
    if wanted.specific and options.unit == "cells" and not weights:
        raise InputError("a specific catchment area needs unit m2 or km2, not cells")
    if options.max_length is not None and options.depressions != "breach":
        raise InputError("max_length is of breaches; ask for depressions breach, too")
    if options.max_depth is not None and options.depressions == "keep":
        raise InputError("max_depth is of depressions that are filled or breached, not kept")
    if filled_mask and not wanted.flags:
        raise InputError("a mask of filled cells is for the flags; ask for these too")


def _read_filled(path, source, progress):
    """Tell which cells were filled, in the order of `raster.north_up`."""
    codes = raster.read(path, progress=progress)
    _check_place(codes, source, f"the mask of filled cells, '{path}',")
    order, _ = raster.north_up(source.grid)
    return ((codes.values != 0) & ~codes.void)[order]


def _read_weights(path, source, progress):
    """Give the weights, NaN where there is none, in the order of `raster.north_up`."""
    weights = raster.read(path, progress=progress)
    _check_place(weights, source, f"the raster of weights, '{path}',")
    values = raster.elevations(weights, np.float64)
    values[weights.void] = np.nan
    order, _ = raster.north_up(source.grid)
    return values[order]


def _check_place(other, source, what):
    check_same_grid(
        other.grid, source.grid, what=what, whose="the elevations", tolerance=_TOLERANCE
    )


def _drain(source, weights, options, threads, progress):
    """Drain the source in the order of `raster.north_up`, elevations in the band's unit."""
    (rows, columns), _ = raster.north_up(source.grid)
    pixel_size = source.grid.pixel_size_m()
    unit = raster.height_unit(source.meta, source.grid.crs) or 1.0
    if options.max_depth is not None:
        options = replace(options, max_depth=options.max_depth / unit)
    try:
        return drainage_area(
            _elevations(source)[rows, columns], source.void[rows, columns],
            pixel_size=(pixel_size.dx[rows], pixel_size.dy[rows]),
            cell_area=source.grid.cell_area_m2()[rows], weights=weights, options=options,
            threads=threads, progress=progress,
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"'{source.source}': {error}") from None


def _elevations(source):
    """Give real elevations; as they are stored, where that is the same."""
    if (source.meta.scale, source.meta.offset) == (1, 0):
        return source.values
    return raster.elevations(source, np.result_type(source.values.dtype, np.float32))


def _warnings(source, weights, options, network):
    warnings = list(source.notes)
    level = int(np.count_nonzero((source.values == 0) & ~source.void))
    if level > _SEA * np.count_nonzero(~source.void):
        warnings.append(
            f"{level} cells lie at 0, as the sea does, and are drained like land; with below = 0 "
            "they are voids, into which water leaves"
        )
    if weights is not None:
        order, _ = raster.north_up(source.grid)
        known = ~source.void[order]
        lacking = int(np.count_nonzero(np.isnan(weights) & known))
        if lacking:
            warnings.append(f"{lacking} cells have an elevation but no weight; they add nothing")
    if network is not None and not len(network):
        warnings.append(
            f"no stream: the upstream area reaches {options.threshold:g} m² nowhere, or in single "
            "cells; lower the threshold"
        )
    return tuple(warnings)
