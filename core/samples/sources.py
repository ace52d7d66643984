"""Samples from files: tables, vector layers, and rasters of which some cells are known."""

import os
from dataclasses import dataclass, replace

import numpy as np

from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span
from demsmith.core.raster.crs import crs_units, reproject
from demsmith.core.raster.nodata import VoidFinder
from demsmith.core.raster.opening import opened
from demsmith.core.raster.samples_file import read_samples_file
from demsmith.core.raster.table import is_table
from demsmith.core.samples.samples import Samples


@dataclass(frozen=True, eq=False)
class Source:
    """What an input gave.

    Attributes
    ----------
    samples : Samples
        In the coordinates of the output; empty if it is a raster.
    thinned : Raster or None
    crs : str
        CRS of the coordinates; empty if unknown.
    notes : tuple of str
    """

    samples: Samples
    thinned: raster.Raster | None = None
    crs: str = ""
    notes: tuple = ()

    def on(self, grid):
        """Give the samples for a grid: a raster's known cells as the grid's own, or as points."""
        if self.thinned is not None and self.thinned.grid == grid:
            return Samples(cells=_elevations(self.thinned))
        return self.scattered(grid.crs)

    def scattered(self, crs):
        """Give the samples in a CRS, a raster's known cells as points at their centres."""
        if self.thinned is None:
            return self.samples
        row, column = np.nonzero(~self.thinned.void)
        xy = np.stack(self.thinned.grid.xy(row, column), axis=1)
        if self.crs and crs:
            xy = reproject(xy, self.crs, crs)
        return Samples(np.column_stack([xy, _elevations(self.thinned)[row, column]]))


def read_sources(
    inputs, contours, *, crs="", source_crs="", layer=None, field=None, band=1, mask=None,
    progress=SILENT, **voids,
):  # fmt: skip
    """Read all inputs, bringing points and lines to one CRS.

    Parameters
    ----------
    inputs : list of path or Samples
        Points, lines and thinned rasters.
    contours : list of path
        Vector files of contour lines.
    crs : str
        CRS to bring them to; default: that of the first raster, else of the first file that has
        one.
    source_crs : str
        CRS of files that do not tell theirs.
    layer, field : str, optional
        As in `demsmith.core.raster.read_features`; of every vector file.
    band, mask
        As in `demsmith.core.raster.read`; of every raster.
    **voids
        ``nodata``, ``below`` and ``above`` as there; of every input.

    Returns
    -------
    sources : list of Source
    crs : str
        The one they are in now, but for rasters.

    Raises
    ------
    InputError
        If one cannot be read.
    Cancelled
        If ``progress`` asks to stop.
    """
    rasters = [each for each in inputs if not isinstance(each, Samples) and _is_raster(each)]
    others = [each for each in inputs if each not in rasters]
    total = len(inputs) + len(contours)
    features = dict(layer=layer, field=field, source_crs=source_crs)
    sources = []
    for path in rasters:
        part = _part(progress, len(sources), total)
        sources.append(_read_raster(path, band=band, mask=mask, progress=part, **voids))
        crs = crs or sources[-1].crs
    for each, read in (
        *((each, _read_features) for each in others),
        *((each, _read_contours) for each in contours),
    ):
        if isinstance(each, Samples):
            source, about = Source(each, crs=crs), ""
        else:
            part = _part(progress, len(sources), total)
            source, about = read(each, crs=crs, progress=part, **features), f"'{each}': "
        sources.append(_without_voids(source, about, voids))
        crs = crs or source.crs
    return sources, crs


def _part(progress, number, total):
    return Span(progress, number / total, (number + 1) / total)


def _is_raster(path):
    if is_table(path):
        return False  # GDAL takes tables of a full grid for rasters
    try:
        with opened(os.fspath(path)):
            return True
    except InputError:
        return False


def _read_features(path, **how):
    features = read_samples_file(path, **how)
    samples = Samples(features.points, features.lines)
    return Source(samples, crs=features.crs, notes=features.notes)


def _read_contours(path, **how):
    features = read_samples_file(path, **how)
    if len(features.points):
        raise InputError(f"'{path}' holds points; contours are lines")
    try:
        samples = Samples(contours=features.lines)
    except InputError as error:
        raise InputError(f"'{path}': {error}") from None
    return Source(samples, crs=features.crs, notes=features.notes)


def _without_voids(source, about, voids):
    """Take away the elevations that mean none; notes name those that may mean none."""
    vertices = source.samples.vertices()
    if not len(vertices):
        return source
    units = crs_units(source.crs)
    finder = VoidFinder(
        raster.BandMeta(vertices.dtype), metres=units.vertical_unit, earth=units.on_earth,
        noun="sample", **voids,
    )  # fmt: skip
    void = np.zeros(len(vertices), bool)
    finder.find(vertices[:, 2], void)
    samples = source.samples.without(void) if void.any() else source.samples
    notes = tuple(f"{about}{note}" for note in finder.notes())
    return replace(source, samples=samples, notes=(*source.notes, *notes))


def _read_raster(path, **reading):
    thinned = raster.read(path, **reading)
    if thinned.void.all():
        raise InputError(f"'{path}' has no known cell")
    return Source(Samples(), thinned, thinned.grid.crs, thinned.notes)


def _elevations(thinned):
    """Give a raster's real elevations, masked in its voids."""
    meta = thinned.meta
    values = thinned.values
    if (meta.scale, meta.offset) != (1.0, 0.0):
        values = meta.real(values.astype(np.float64))
    return np.ma.masked_array(values, thinned.void)
