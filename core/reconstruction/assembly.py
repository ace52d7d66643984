"""Putting one tile together: its own cells, its neighbours', and what voids were filled with."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.raster import elevations
from demsmith.core.reconstruction.removed import RemovedCells, removed_cells
from demsmith.core.voids.sources import LEFT, NEIGHBOUR, ORIGINAL


@dataclass(frozen=True)
class Assembled:
    """A tile without voids, but for those that were left.

    Attributes
    ----------
    values : (H, W) array
        As the tile's file stores them, in its data type or in floating point.
    left : (H, W) bool array
        Voids that were left as they were.
    sources : (H, W) uint8 array
        Source map.
    sigma : (H, W) float32 array
        Standard error to be expected, in the real unit: 0 where the elevation was known, NaN where
        it is not known.
    replaced : int
        Known cells that another tile, which comes first, knows otherwise, and which were given
        that one's elevation.
    removed : RemovedCells
        Known cells that were not believed, and filled.
    """

    values: np.ndarray
    left: np.ndarray
    sources: np.ndarray
    sigma: np.ndarray
    replaced: int
    removed: RemovedCells


def assemble(
    own, ground, rows, columns, patches, *, outliers=(), float_output=False, progress=SILENT
):
    """Put a tile together.

    Parameters
    ----------
    own : Raster
        The tile as its file holds it.
    ground : Ground
        What all tiles together know.
    rows, columns : slice
        Where the tile lies in it.
    patches : iterable of Patch
    outliers : (K, 2) int array
        Rows and columns of the ground's spikes and wells, of this tile and of others.
    float_output : bool
        Whether to give floating point whatever the tile's data type.
    progress : Progress

    Returns
    -------
    Assembled

    Raises
    ------
    InputError
        If the ground cannot be read.
    Cancelled
        If ``progress`` asks to stop.
    """
    known, void = ground.read(rows, columns, progress=Span(progress, 0, 0.3))
    real = np.array(known, order="C")
    sources = np.full(real.shape, ORIGINAL, np.uint8)
    sources[own.void & ~void] = NEIGHBOUR
    replaced = ~own.void & ~void & _differ(own, real)
    sources[replaced] = NEIGHBOUR
    sources[void] = LEFT
    checkpoint(progress, 0.5)
    sigma = np.where(void, np.float32(np.nan), np.float32(0))
    for patch in patches:
        patch.paste(rows, columns, real, sigma, sources)
    checkpoint(progress, 0.7)
    left = sources == LEFT
    values = own.values.astype(_output_type(own.meta.dtype, float_output))
    changed = (sources != ORIGINAL) & ~left
    values[changed] = stored(real[changed], own.meta, values.dtype)
    faulty = changed & ~own.void & (sources != NEIGHBOUR)
    checkpoint(progress, 1.0)
    here = _within(np.reshape(outliers, (-1, 2)), rows, columns)
    removed = removed_cells(own, values, faulty, here)
    return Assembled(values, left, sources, sigma, int(np.count_nonzero(replaced)), removed)


def stored(real, meta, dtype):
    """Give real elevations as a band stores them: unscaled, rounded, cut to the type's range.

    Parameters
    ----------
    real : array of float
    meta : BandMeta
        Its scale and offset.
    dtype : numpy.dtype

    Examples
    --------
    >>> from demsmith.core.raster import BandMeta
    >>> stored(np.array([1.26, 99999.0]), BandMeta(scale=0.5), np.dtype(np.int16))
    array([    3, 32767], dtype=int16)
    """
    if (meta.scale, meta.offset) != (1, 0):
        real = (real.astype(np.float64) - meta.offset) / meta.scale
    if dtype.kind not in "iu":
        return real.astype(dtype)
    limits = np.iinfo(dtype)
    # In float64, for float32 has no 2147483647 and would round the limit out of the range.
    return np.clip(np.rint(real.astype(np.float64)), limits.min, limits.max).astype(dtype)


def _differ(own, real):
    """Tell where the ground's elevation is another than the tile's, as the tile would store it."""
    differ = elevations(own, real.dtype) != real
    differ[own.void] = False
    if own.meta.dtype.kind in "iu" and differ.any():
        differ[differ] = stored(real[differ], own.meta, own.meta.dtype) != own.values[differ]
    return differ


def _within(places, rows, columns):
    """Give the places that lie in a window, counted from its first cell."""
    corner = np.array([rows.start, columns.start])
    inside = (places >= corner) & (places < [rows.stop, columns.stop])
    return (places - corner)[inside.all(axis=1)].astype(np.int64)


def _output_type(dtype, float_output):
    if not float_output or dtype.kind == "f":
        return dtype
    return np.dtype(np.float32 if dtype.itemsize <= 2 else np.float64)
