"""The files that a drainage run writes."""

import os
from dataclasses import dataclass, fields, replace

import numpy as np

from demsmith.core import raster
from demsmith.core.hydrology.coarse import block_maxima
from demsmith.core.hydrology.codes import DIRECTIONS, FLAGS, NO_DIRECTION, NO_FLAG, colors
from demsmith.core.progress import Span, checkpoint
from demsmith.core.raster.layers import check_layer_output

_NODATA = -9999.0


@dataclass(frozen=True, kw_only=True)
class Outputs:
    """Paths of what is to be written; None for what is not.

    Attributes
    ----------
    output : path
        Upstream area, float64.
    log : path
        Its common logarithm, float32.
    specific : path
        Specific catchment area, float32.
    standard_error : path
        Of the area, by method particles, float32.
    directions : path
        ESRI's codes of D8, bytes; 247 at voids.
    flags : path
        What is known of the catchments, bytes; see `demsmith.core.hydrology.codes`.
    conditioned : path
        Elevations after the treatment of depressions, in the input's unit.
    stream_mask : path
        1 in streams, else 0, bytes.
    streams : path
        Stream links as lines, ``.gpkg`` or ``.geojson``.
    coarse : path
        The largest upstream area of each block of cells, float64.
    """

    output: str
    log: str | None = None
    specific: str | None = None
    standard_error: str | None = None
    directions: str | None = None
    flags: str | None = None
    conditioned: str | None = None
    stream_mask: str | None = None
    streams: str | None = None
    coarse: str | None = None

    def paths(self):
        """Give the paths as text by name, None for what is not wanted."""
        paths = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: os.fspath(path) if path else None for name, path in paths.items()}

    def check(self, *, crs, inputs, overwrite):
        """Refuse what cannot be written, before any work is done for it.

        Raises
        ------
        InputError
            If a name has the wrong extension, is an input's or another output's.
        OutputError
            If a folder is missing or not writable, or a file exists.
        """
        checks = dict(inputs=inputs, overwrite=overwrite)
        paths = self.paths()
        streams = paths.pop("streams")
        raster.check_outputs(paths, **checks)
        if streams:
            check_layer_output(streams, crs=crs, **checks)


def write_outputs(paths, drained, source, *, filled, threads, creation_options, progress):
    """Write all that is wanted, or nothing.

    Parameters
    ----------
    paths : dict
        As `Outputs.paths` gives them.
    drained : Drainage
        Of the source in the order of `raster.north_up`.
    source : Raster
    filled : (H, W) bool array or None
        As in `Drainage.flags`, in the same order.
    threads : int or None
    creation_options : iterable of str
    progress : Progress

    Returns
    -------
    Streams or None
        If they or their mask were wanted.
    """
    wanted = [name for name, path in paths.items() if path]
    with raster.all_or_nothing(paths) as unfinished:
        writer = _Writer(unfinished, drained, source, filled, threads, creation_options)
        for number, name in enumerate(wanted):
            span = Span(progress, number / len(wanted), (number + 1) / len(wanted))
            getattr(writer, f"write_{name}")(span)
        checkpoint(progress, 1)
        return writer.streams


class _Writer:
    """Computes and writes one output after another, so that few of them are in memory at once."""

    def __init__(self, paths, drained, source, filled, threads, creation_options):
        self._paths, self._drained, self._source, self._filled = paths, drained, source, filled
        self._turn, _ = raster.north_up(source.grid)
        self._running = dict(threads=threads)
        self._writing = dict(
            threads=threads, creation_options=creation_options, same_quantity=False
        )
        self.streams = None
        unit = drained.unit
        self._units = dict(area=unit, per_metre="m" if unit in ("m2", "km2") else "")

    def write_output(self, progress):
        self._write_real(
            "output", self._drained.area, "upstream area", self._units["area"], np.float64, progress
        )

    def write_log(self, progress):
        log = self._drained.log(progress=Span(progress, 0, 0.3))
        self._write_real(
            "log", log, "log10 of upstream area", "", np.float32, Span(progress, 0.3, 1)
        )

    def write_specific(self, progress):
        specific = self._drained.specific(progress=Span(progress, 0, 0.5), **self._running)
        self._write_real(
            "specific", specific, "specific catchment area", self._units["per_metre"], np.float32,
            Span(progress, 0.5, 1),
        )  # fmt: skip

    def write_standard_error(self, progress):
        self._write_real(
            "standard_error", self._drained.standard_error, "standard error of upstream area",
            self._units["area"], np.float32, progress,
        )  # fmt: skip

    def write_conditioned(self, progress):
        conditioned = self._drained.conditioned
        self._write(
            "conditioned", conditioned, self._source.void, progress, dtype=conditioned.dtype,
            nodata=_NODATA, description="conditioned elevation", unit=self._source.meta.unit,
        )  # fmt: skip

    def write_directions(self, progress):
        self._write(
            "directions", self._drained.directions, self._source.void, progress, dtype=np.uint8,
            nodata=NO_DIRECTION, description="flow direction", color_table=colors(DIRECTIONS),
        )  # fmt: skip

    def write_flags(self, progress):
        flags = self._drained.flags(self._filled, progress=Span(progress, 0, 0.7), **self._running)
        self._write(
            "flags", flags, self._source.void, Span(progress, 0.7, 1), dtype=np.uint8,
            nodata=NO_FLAG, description="catchment flags", color_table=colors(FLAGS),
            categories=[each.name for each in FLAGS],
        )  # fmt: skip

    def write_stream_mask(self, progress):
        self._find_streams(Span(progress, 0, 0.7))
        self._write(
            "stream_mask", self.streams.mask.view(np.uint8), self._source.void,
            Span(progress, 0.7, 1), dtype=np.uint8, nodata=NO_FLAG, description="streams",
        )  # fmt: skip

    def write_streams(self, progress):
        self._find_streams(Span(progress, 0, 0.5))
        streams, grid = self.streams, self._source.grid
        row, column = streams.cells[:, 0].astype(float), streams.cells[:, 1].astype(float)
        rows, columns = self._turn
        row = row if rows.step is None else grid.shape.rows - 1 - row
        column = column if columns.step is None else grid.shape.columns - 1 - column
        raster.write_lines(
            self._paths["streams"], np.column_stack(grid.xy(row, column)), streams.first_cell,
            streams.columns, crs=grid.crs, progress=Span(progress, 0.5, 1),
        )  # fmt: skip

    def write_coarse(self, progress):
        factor = self._drained.options.coarse_factor
        area = block_maxima(self._drained.area[self._turn], factor, progress=Span(progress, 0, 0.5))
        void = np.isnan(area)
        grid = coarser(self._source.grid, factor)
        meta = replace(self._source.meta, gcps=(), rpc={})  # they count in the finer cells
        raster.write(
            self._paths["coarse"], area, void=void, nodata=_NODATA, dtype=np.float64,
            like=raster.Raster(area, void, grid, meta),
            description="largest upstream area", unit=self._units["area"],
            progress=Span(progress, 0.5, 1), **self._writing,
        )  # fmt: skip

    def _find_streams(self, progress):
        if self.streams is None:
            self.streams = self._drained.streams(progress=progress, **self._running)

    def _write_real(self, name, values, description, unit, dtype, progress):
        void = np.isnan(values[self._turn])
        self._write(
            name, values, void, progress, dtype=dtype, nodata=_NODATA, description=description,
            unit=unit,
        )  # fmt: skip

    def _write(self, name, values, void, progress, **how):
        raster.write(
            self._paths[name], values[self._turn], void=void, like=self._source, progress=progress,
            **how, **self._writing,
        )  # fmt: skip


def coarser(grid, factor):
    """Give the grid of blocks of ``factor`` × ``factor`` cells, from the first cell on.

    Examples
    --------
    >>> coarser(raster.Grid((5, 4), (0, 10, 0, 90, 0, -10)), 2)
    Grid(shape=Shape(rows=3, columns=2), geotransform=(0.0, 20.0, 0.0, 90.0, 0.0, -20.0), crs='')
    """
    x, width, _, y, _, height = grid.geotransform
    shape = tuple(-(-side // factor) for side in grid.shape)
    if not grid.georeferenced:
        return raster.Grid(shape)
    return raster.Grid(shape, (x, factor * width, 0, y, 0, factor * height), grid.crs)
