"""A decoded raster at any scale: finer by continuous evaluation, coarser from its base's levels."""

import math
from dataclasses import replace

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.parallel import run
from demsmith.core.progress import SILENT, Muted, Span, checkpoint
from demsmith.core.raster import Grid, Raster, Shape
from demsmith.core.sct.file import LEVELS
from demsmith.core.strips import strips

_MOST_CELLS = 1 << 31

_ROWS = 1024
"""Decoded at once for means."""

_MARGIN = 8
"""Cells beyond a window on which its rim may depend: so it is the same in any window."""


def decoded_at(file, rows, columns, scale, *, threads=None, progress=SILENT):
    """Decode a window at a scale, as a raster of its own.

    Parameters
    ----------
    file : SctFile
    rows, columns : slice
        The window.
    scale : float
        Output cells per cell, along rows and columns; the output covers the window exactly.
    threads, progress
        As in `resampled`.

    Returns
    -------
    Raster
        At scale 1 as stored, else in float32, or float64 where the file is.
    list of str
        What the user should know, one sentence each.

    Raises
    ------
    InputError
        If the window is not in the raster, the output would be huge, or the file is damaged.
    Cancelled
        If ``progress`` asks to stop.
    """
    grid = file.grid.part(rows, columns)
    meta, notes = _meta_at(file.meta, rows, columns, scale, whole=grid.shape == file.grid.shape)
    if scale == 1:
        read = file.read(rows, columns, progress=progress)
        return replace(read, meta=meta), notes
    shape = Shape(*(max(1, round(side * scale)) for side in grid.shape))
    too_many = InputError(
        f"{shape.rows} × {shape.columns} cells at scale {scale:g} are more than can be made at "
        "once: choose a smaller scale, or a window"
    )
    if shape.rows * shape.columns > _MOST_CELLS:
        raise too_many
    try:
        values, void = resampled(file, rows, columns, shape, threads=threads, progress=progress)
    except MemoryError:
        raise too_many from None
    x, width, row_shear, y, column_shear, height = grid.geotransform
    if grid.georeferenced:
        width *= grid.shape.columns / shape.columns
        height *= grid.shape.rows / shape.rows
    placed = Grid(shape, (x, width, row_shear, y, column_shear, height), grid.crs)
    return Raster(values.astype(meta.dtype), void, placed, meta, source=file.path), notes


def _meta_at(meta, rows, columns, scale, *, whole):
    """Give what is told of a window at a scale, and what is left out."""
    notes = []
    if scale != 1:
        double = meta.dtype == np.float64
        meta = replace(meta, dtype=np.dtype(np.float64 if double else np.float32))
    if whole and scale == 1:
        return meta, notes
    if meta.rpc:
        notes.append("its rational polynomials (RPC) hold for the whole raster; they are left out")
    points = tuple(
        ((row - rows.start) * scale, (column - columns.start) * scale, *place)
        for row, column, *place in meta.gcps
    )
    return replace(meta, rpc={}, gcps=points), notes


def resampled(file, rows, columns, shape, *, threads=None, progress=SILENT):
    """Evaluate a window of an `.sct` file at the centres of larger or smaller cells.

    Smaller ones are on the bicubic surface through the cells of the file, as are those of less than
    two cells. Larger ones are means of the cells, or parts of cells, that they cover; but where the
    tree alone is right enough, they are on the bicubic surface through the level of the tree that
    they can show.

    Parameters
    ----------
    file : SctFile
    rows, columns : slice
        The window.
    shape : (int, int)
        Number of rows and columns that it is divided into.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    values : (h, w) float64 array
        Stored values, not rounded; 0 in voids.
    void : (h, w) bool array
        Whether the cell under a centre is void.

    Raises
    ------
    InputError
        If the file is damaged.
    Cancelled
        If ``progress`` asks to stop.
    """
    window = rows, columns
    ratios = [_length(side) / count for side, count in zip(window, shape, strict=True)]
    level = max(0, math.floor(math.log2(min(ratios)) + 1e-9))
    centres = [
        side.start + (np.arange(count) + 0.5) * ratio - 0.5
        for side, count, ratio in zip(window, shape, ratios, strict=True)
    ]
    void = file.voids_at(
        *(np.floor(each + 0.5).astype(int) for each in centres), progress=Span(progress, 0, 0.1)
    )
    if not file.shows_level(level):
        if level:  # at least two cells each way
            values = _means(file, window, shape, Span(progress, 0.1, 1))
            values[void] = 0
            return values, void
        level = 0
    level = min(level, LEVELS)
    coarser = math.ceil(max(0.0, math.log2(max(ratios) / (1 << level)) - 1e-9))
    near = [
        _reach(side, level, whole, 1 << coarser)
        for side, whole in zip(window, file.grid.shape, strict=True)
    ]
    cells, unknown = _overview(file, level, near, Span(progress, 0.1, 0.7))
    values = np.zeros(shape)
    if not (void.all() or unknown.all()):
        places = [
            np.clip((each + 0.5) / (1 << level) - 0.5 - side.start, -0.5, _length(side) - 0.5)
            for each, side in zip(centres, near, strict=True)
        ]
        detail = max(1.0, max(ratios) / (1 << level))
        _evaluate(cells, unknown, places, detail, values, threads, Span(progress, 0.7, 1))
    values[void] = 0
    return values, void


def _length(side):
    return side.stop - side.start


def _reach(side, level, whole, block):
    """Give the cells of the overview that a window depends on, from whole blocks of them on."""
    size, margin = 1 << level, _MARGIN * block
    first = max(0, side.start // size - margin)
    stop = min(-(-whole // size), -(-side.stop // size) + margin)
    return slice(first - first % block, stop)


def _overview(file, level, near, progress):
    """Give a level of the tree, or the cells themselves, and where there are none."""
    if level:
        cells = file.overview(level, *near, progress=progress)
        return cells, np.zeros(cells.shape, bool)
    read = file.read(*near, progress=progress)
    return np.where(read.void, 0, read.values).astype(np.float64), read.void


def _means(file, window, shape, progress):
    """Give the mean of what is known of the cells, and parts of cells, under each larger cell."""
    (rows, columns), height = window, shape[0]
    edges = [
        np.arange(count + 1) * (_length(side) / count)
        for side, count in zip(window, shape, strict=True)
    ]
    means = np.zeros(shape)
    step = max(1, int(_ROWS * height / _length(rows)))
    for first in range(0, height, step):
        checkpoint(progress, first / height)
        lines = edges[0][first : first + step + 1]
        top, bottom = int(lines[0]), min(math.ceil(lines[-1] - 1e-9), _length(rows))
        read = file.read(
            slice(rows.start + top, rows.start + bottom), columns, progress=Muted(progress)
        )
        known = ~read.void
        sums = [
            _between(_between(each, edges[1], 1), lines - top, 0)
            for each in (np.where(known, read.values, 0).astype(np.float64), known.astype(float))
        ]
        means[first : first + step] = sums[0] / np.maximum(sums[1], 1e-9)
    return means


def _between(values, edges, axis):
    """Sum values between edges, that of a cell which an edge cuts by its parts."""
    total = np.insert(np.cumsum(values, axis=axis), 0, 0, axis=axis)
    whole = np.minimum(edges.astype(int), values.shape[axis] - 1)
    part = (edges - whole).reshape((-1, 1) if axis == 0 else -1)
    at = np.take(total, whole, axis) * (1 - part) + np.take(total, whole + 1, axis) * part
    return np.diff(at, axis=axis)


def _evaluate(cells, unknown, places, detail, values, threads, progress):
    """Fill ``values`` with the surface through cells at rows and columns counted in them."""
    from demsmith.core.trees import Detail, Frame, RasterNode

    frame = Frame(cells.shape, 1.0, 1.0)
    node = RasterNode(cells, unknown, frame=frame)

    def fill(strip):
        x, y = frame.xy(places[0][strip, np.newaxis], places[1])
        values[strip] = node.joint(x, y, detail=Detail(resolution=detail)).elevation

    run(
        [lambda strip=strip: fill(strip) for strip in strips(values.shape)],
        threads=threads, progress=progress,
    )  # fmt: skip
