"""Terrain from files of samples to a file, as the command line and QGIS make it."""

import functools
import operator
import os
import time
from dataclasses import asdict, dataclass, replace

import numpy as np

import demsmith
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.mcmd import read_maps
from demsmith.core.options import validate
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.samples.grids import GridWish
from demsmith.core.samples.options import SampleOptions
from demsmith.core.samples.samples import Samples
from demsmith.core.samples.sketch import read_sketch
from demsmith.core.samples.sources import read_sources
from demsmith.core.samples.terrain import from_samples
from demsmith.core.voids.sources import FILLED, ORIGINAL, SOURCE_COLORS

_ELEVATIONS = raster.BandMeta(unit="m", description="elevation")
_SOURCE_NAMES = ("sample", "made between samples")


@dataclass(frozen=True)
class SamplesResult:
    """What was made of samples.

    Attributes
    ----------
    output, source_map : str or None
        Paths of what was written.
    seconds : float
    version : str
        Demsmith's.
    samples, samples_outside : int
        Points, vertices and known cells of rasters in the grid, and beyond it; see
        `Reconstructed`.
    rows, columns, cells, cells_known, cells_filled : int
        The grid's; cells that hold a sample or a sketch's paint, and all others.
    tuning : dict or None
        What tuning found, if it was asked for: `demsmith.core.tuning.Tuned.as_dict`.
    warnings : tuple of str
        One sentence each.
    """

    output: str
    source_map: str | None
    seconds: float
    version: str
    samples: int
    samples_outside: int
    rows: int
    columns: int
    cells: int
    cells_known: int
    cells_filled: int
    tuning: dict | None
    warnings: tuple

    def as_dict(self):
        """Give everything as a dict that JSON can hold."""
        return asdict(self)


def samples_file(
    inputs, output, *, options=None, contours=(), field=None, layer=None, source_crs="",
    sketch=None, sketch_low=0.0, sketch_high=1000.0, sketch_background="black", like=None,
    extent=None, resolution=None, crs="", band=1, nodata=(), below=None, above=None, mask=None,
    maps=None, source_map=None, threads=None, overwrite=False, creation_options=(),
    progress=SILENT,
):  # fmt: skip
    """Make an elevation raster from samples, a sketch, or nothing but noise.

    Everything asked for is written, or nothing is.

    Parameters
    ----------
    inputs : iterable of path or Samples
        Vector files and tables of points and lines, rasters of which some cells are known, and
        samples in the CRS of the output. None of all: noise.
    output : path
        GeoTIFF: Float32, but of the data type of a raster that is the only input and gives the
        grid, unless ``options.float_output``.
    options : SampleOptions, optional
    contours : iterable of path
        Vector files of contour lines.
    field, layer : str, optional
        Attribute of the elevations and name of the layer, as in
        `demsmith.core.raster.read_features`.
    source_crs : str
        CRS of inputs that do not tell theirs; default: the output's.
    sketch : path, optional
        Image that covers the grid, see `read_sketch` for ``sketch_low``, ``sketch_high`` and
        ``sketch_background``.
    like : path, optional
        Raster whose grid to take.
    extent : (xmin, ymin, xmax, ymax), optional
        Of the grid, in its CRS; default: that of the samples. If neither it nor a resolution is
        given, the grid is that of the first raster among the inputs.
    resolution : float or (float, float), optional
        Width and height of a cell in units of the CRS. With an extent and a sketch, by default
        one cell for each pixel.
    crs : str
        Of the output; default: of the first raster, else of the first input that has one.
    nodata, below, above
        Elevations that mean none, as in `demsmith.read_raster`.
    band, mask
        Of rasters, as there.
    maps : mapping of str to path, optional
        Rasters of parameters that change from cell to cell, by their names, as in
        `demsmith.core.mcmd.read_maps`.
    source_map : path, optional
        GeoTIFF of bytes: 0 sample, 1 made between samples.
    threads : int, optional
        Default: one for each core. The outputs do not depend on it.
    overwrite : bool
        Whether existing outputs may be replaced.
    creation_options : iterable of str
        GDAL's for GeoTIFF, ``KEY=VALUE``.
    progress : Progress

    Returns
    -------
    SamplesResult

    Raises
    ------
    InputError
        If an input or option cannot be used, no sample lies in the grid, or the grid is not
        told or too large.
    OutputError
        If an output cannot be written.
    Cancelled
        If ``progress`` asks to stop.
    """
    begin = time.perf_counter()
    options = options or SampleOptions()
    validate(options)
    inputs, contours = _listed(inputs), _listed(contours)
    files = (*inputs, *contours, sketch, like, mask, *(maps or {}).values())
    paths = _checked_outputs(files, output, source_map, overwrite)
    wish = GridWish(None if like is None else raster.read_grid(like), extent, resolution, crs)
    sources, crs = read_sources(
        inputs, contours, crs=wish.target, source_crs=source_crs, layer=layer, field=field,
        band=band, nodata=nodata, below=below, above=above, mask=mask,
        progress=Span(progress, 0, 0.2),
    )  # fmt: skip
    painted = None if sketch is None else read_sketch(
        sketch, low=sketch_low, high=sketch_high, background=sketch_background
    )  # fmt: skip
    grid = wish.decide(sources, crs, painted)
    made = from_samples(
        _together(sources, grid), grid, options=options, sketch=painted,
        maps=read_maps(maps or {}, grid, progress=Span(progress, 0.2, 0.25)), threads=threads,
        progress=Span(progress, 0.25, 0.8),
    )  # fmt: skip
    _write(
        made, *_stored(made, sources, options), paths, Span(progress, 0.8, 1),
        threads=threads, creation_options=creation_options,
    )  # fmt: skip
    return _result(made, sources, paths, begin)


def _listed(paths):
    """Give a list, also of one path that stands for itself."""
    return [paths] if isinstance(paths, (str, os.PathLike, Samples)) else list(paths)


def _checked_outputs(files, output, source_map, overwrite):
    inputs = [each for each in files if each is not None and not isinstance(each, Samples)]
    paths = {"output": output, "source_map": source_map}
    paths = {name: os.fspath(path) if path else None for name, path in paths.items()}
    for path in filter(None, paths.values()):
        raster.check_output(path, inputs=inputs, overwrite=overwrite)
    if source_map and os.path.realpath(output) == os.path.realpath(source_map):
        raise InputError("output and source map must be different files")
    return paths


def _together(sources, grid):
    """Put all samples together; None where there are no sources at all."""
    if not sources:
        return None
    return functools.reduce(operator.add, (source.on(grid) for source in sources))


def _stored(made, sources, options):
    """Give the values to write, and the raster whose properties they get.

    A raster that is the only source gives all of its own, so that it comes back complete.
    """
    thinned = sources[0].thinned if len(sources) == 1 else None
    if thinned is None or thinned.grid != made.grid:
        return made.values, raster.Raster(made.values, ~made.known, made.grid, _ELEVATIONS)
    meta, values = thinned.meta, made.values
    if (meta.scale, meta.offset) != (1.0, 0.0):
        values = (values - meta.offset) / meta.scale
    if options.float_output:
        thinned = replace(thinned, meta=replace(meta, dtype=values.dtype))
    return values, thinned


def _write(made, values, like, paths, progress, **how):
    how.update(like=like, overwrite=True)
    with raster.all_or_nothing(paths) as part:
        raster.write(
            part["output"], values, void=np.zeros(values.shape, bool), dtype=like.meta.dtype,
            progress=Span(progress, 0, 0.8), **how,
        )  # fmt: skip
        if "source_map" in part:
            raster.write(
                part["source_map"], np.where(made.known, ORIGINAL, FILLED).astype(np.uint8),
                dtype="uint8", nodata=None, description="source", same_quantity=False,
                color_table=SOURCE_COLORS, categories=_SOURCE_NAMES,
                progress=Span(progress, 0.8, 1), **how,
            )  # fmt: skip
        checkpoint(progress, 1.0)


def _result(made, sources, paths, begin):
    notes = [note for source in sources for note in source.notes]
    if made.samples and not made.grid.crs:
        notes.append("the output has no CRS; its coordinates are taken as metres")
    if made.tuned and not made.tuned.accepted:
        notes.append(made.tuned.summary())
    return SamplesResult(
        **paths,
        seconds=round(time.perf_counter() - begin, 3),
        version=demsmith.__version__,
        samples=made.samples,
        samples_outside=made.samples_outside,
        rows=made.grid.shape.rows,
        columns=made.grid.shape.columns,
        cells=made.values.size,
        cells_known=made.cells_known,
        cells_filled=made.values.size - made.cells_known,
        tuning=made.tuned and made.tuned.as_dict(),
        warnings=(*notes, *made.notes),
    )
