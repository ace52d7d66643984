"""The windows of a ground from which its reconstruction learns."""

import numpy as np

from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.voids.accurate import BLOCK, Window, training_spans
from demsmith.core.voids.accurate.windows import cells_by_block


def count_voids(ground, rows, columns, *, progress=SILENT):
    """Count the cells without known ground of each block, as far as a chunk has part in it.

    Parameters
    ----------
    ground : Ground
    rows, columns : slice
        The chunk.
    progress : Progress

    Returns
    -------
    row, column : int
        The first block.
    counts : (h, w) int64 array
    """
    _, void = ground.read(rows, columns, progress=progress)
    for axis, span in enumerate((rows, columns)):
        begins = np.arange(span.start // BLOCK, (span.stop - 1) // BLOCK + 1) * BLOCK - span.start
        void = np.add.reduceat(void, np.maximum(begins, 0), axis=axis, dtype=np.int64)
    return rows.start // BLOCK, columns.start // BLOCK, void


def gathered_counts(shape, found, chunks):
    """Add up what `count_voids` found in all chunks that have ground.

    Parameters
    ----------
    shape : (int, int)
        Of the ground. What is in none of the chunks is void.
    found : iterable
        What `count_voids` gave for each.
    chunks : iterable of (slice, slice)

    Returns
    -------
    (H, W) int64 array
        Void cells of each block.
    """
    counts = cells_by_block(shape)
    for (row, column, part), (rows, columns) in zip(found, chunks, strict=True):
        cells = np.outer(_shares(rows), _shares(columns))
        block = slice(row, row + part.shape[0]), slice(column, column + part.shape[1])
        counts[block] += part - cells
    return counts


def _shares(span):
    """Give the rows or columns that a chunk has in each block it has part in."""
    edges = np.arange(span.start // BLOCK, (span.stop - 1) // BLOCK + 2) * BLOCK
    return np.diff(np.clip(edges, span.start, span.stop))


def training_windows(ground, counts, pixel_size, *, progress=SILENT):
    """Read the windows from which a ground's reconstruction learns.

    Parameters
    ----------
    ground : Ground
    counts : (H, W) int array
        Void cells of each block: `gathered_counts`.
    pixel_size : (array, array)
        Ground metres per cell of each row.
    progress : Progress

    Returns
    -------
    list of Window
        At most a dozen; they depend on the ground alone, not on how it is cut into tiles.
    """
    dx, dy = pixel_size
    windows = []
    chosen = training_spans(ground.shape, counts)
    for number, (rows, columns) in enumerate(chosen):
        checkpoint(progress, number / len(chosen))
        values, void = ground.read(rows, columns)
        if not void.all():
            windows.append(Window(rows.start, columns.start, values, void, dx[rows], dy[rows]))
    return windows
