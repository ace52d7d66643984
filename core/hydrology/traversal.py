"""Down the slopes in parallel: every cell after all that drain to it, in strips that grow.

First each strip of rows is worked on by itself, from the cells that nothing drains to down to its
first or last row; these rows wait, for the next strip may drain to them. Then strips are joined
two by two, and what the rows between them held back goes on, until there is one strip. So no two
threads touch the same cell, and the order in which a cell's donors are added up does not depend on
the number of threads. What waits to the end, and is done by one thread, is what drains from one
half of the raster to the other.
"""

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.hydrology.surfaces import by_row, surface
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.strips import strips

# Cells that are passed on between two looks at the progress.
_PATIENCE = 1 << 20
# Cells that can wait because they were met too late; some hundred do in most strips. Kernels leave
# less than half of this unused.
_ROOM = 1 << 12


class Surface:
    """Elevations, flats and voids as the kernels take them, checked.

    Parameters
    ----------
    z, flat, void, dx, dy
        As of `demsmith.core.hydrology.d8_directions`.

    Attributes
    ----------
    z : (H, W) float32 or float64 array
    flat : (H, W) uint16 or uint32 array
    void : (H, W) bool array
    ways : (H, 6) float32 array
        Of each row: one by the ground distance to the neighbours east and west, north and south,
        and across the corners; and the lengths of the contours towards them, see `_contours`.
    """

    def __init__(self, z, flat, void, dx, dy):
        self.z, self.void = surface(z, void)
        rows = len(self.z)
        dx, dy = by_row(dx, "dx", rows), by_row(dy, "dy", rows)
        if flat is None:
            flat = np.broadcast_to(np.uint16(0), self.z.shape)
        if flat.shape != self.z.shape:
            raise InputError(f"flat has shape {flat.shape}, the elevations {self.z.shape}")
        narrow = flat.dtype.itemsize <= 2
        self.flat = np.ascontiguousarray(flat, np.uint16 if narrow else np.uint32)
        rates = 1 / dx, 1 / dy, 1 / np.hypot(dx, dy)
        self.ways = np.column_stack([*rates, *_contours(dx, dy)]).astype(np.float32)

    def receivers(self, exponent, *, threads=None, progress=SILENT):
        """Tell which neighbours each cell drains to.

        Parameters
        ----------
        exponent : float or None
            Of MFD, which makes no difference here; None for D-infinity.

        Returns
        -------
        (H, W) uint8 array
            Sum of the codes, as of D8, of all neighbours that get a share; 0 at voids.
        """
        from demsmith.core.hydrology._receivers import find_receivers

        receivers = np.empty(self.z.shape, np.uint8)

        def find(rows):
            find_receivers(
                self.z, self.flat, self.void, self.ways, exponent is None, rows.start, rows.stop,
                receivers,
            )  # fmt: skip

        in_strips(find, self.z.shape, threads=threads, progress=progress)
        return receivers

    def donors(self, exponent, *, threads=None, progress=SILENT):
        """Count how many neighbours drain to each cell, as `traverse` needs it."""
        from demsmith.core.hydrology._receivers import count_donors

        receivers = self.receivers(exponent, threads=threads, progress=Span(progress, 0, 0.8))
        donors = np.empty_like(receivers)
        in_strips(
            lambda rows: count_donors(receivers, self.void, rows.start, rows.stop, donors),
            self.z.shape, threads=threads, progress=Span(progress, 0.8, 1),
        )  # fmt: skip
        return donors


def _contours(dx, dy):
    """Give the lengths through which water leaves east and west, north and south, over corners.

    They are the sides of a cell whose corners are cut off square to the diagonals, which makes of a
    square cell a regular octagon, so that the sides are all the same. With shares by slope times
    these lengths, water goes down the slope of any plane on average: the sum over the neighbours of
    length · distance · direction ⊗ direction is twice the cell's area times the identity.
    """
    cut = np.minimum(dx, dy) / np.maximum(dx, dy) / (2 + np.sqrt(2))
    return dy - 2 * cut * dx, dx - 2 * cut * dy, cut * np.hypot(dx, dy)


def in_strips(work, shape, *, threads, progress):
    """Call ``work`` with the rows of each strip, as a slice, side by side."""
    parallel.run(
        [lambda rows=rows: work(rows) for rows in strips(shape)],
        threads=threads, progress=progress,
    )  # fmt: skip


class Reach:
    """Rows in which a kernel passes on what cells have, and how far it came.

    Attributes
    ----------
    rows : (int, int)
        In these, from and to before, cells that wait for nothing are looked for.
    free : (int, int)
        In these, cells may be passed on; ``rows`` are among them.
    place : (2,) int64 array
        The cell to look at next, as flat index, and how many are on the stack.
    stack : (N,) int64 array
        Cells that wait for nothing any more, but lie behind.
    """

    def __init__(self, rows, free, width):
        self.free = free
        self.rows = max(rows[0], free[0]), min(rows[1], free[1])
        self.place = np.array([self.rows[0] * width, 0])
        self.stack = np.empty(_ROOM, np.int64)

    def make_room(self):
        """Double the stack if a kernel may have stopped for want of room."""
        if self.place[1] > self.stack.size - _ROOM // 2:
            self.stack = np.concatenate([self.stack, np.empty_like(self.stack)])


def traverse(step, shape, *, threads=None, progress=SILENT):
    """Pass on what all cells have, in the order told above.

    Parameters
    ----------
    step : callable
        Called with a `Reach` and a number of cells, it passes on about so many and tells whether
        it is done with that reach.
    shape : (int, int)
    threads : int, optional
    progress : Progress
    """
    height, width = shape
    edges = [rows.start for rows in strips(shape)] + [height]

    def free(first, last):
        return edges[first] + (first > 0), edges[last] - (edges[last] < height)

    last = len(edges) - 1
    levels = [[Reach(free(k, k + 1), free(k, k + 1), width) for k in range(last)]]
    size = 1
    while size < last:
        levels.append(
            [
                Reach((edges[k] - 1, edges[k] + 1), free(k - size, min(k + size, last)), width)
                for k in range(size, last, 2 * size)
            ]
        )
        size *= 2
    # Of the cells, most are passed on in the first level.
    ends = np.linspace(1, 0.8, len(levels))[::-1]
    done = 0.0
    for reaches, end in zip(levels, ends, strict=True):
        while reaches:
            # As a rule all reaches are done at once.
            after = done + 0.9 * (end - done)
            reaches = _pass_on(step, reaches, threads, Span(progress, done, after))
            done = after
        done = end
    checkpoint(progress, 1)


def _pass_on(step, reaches, threads, progress):
    """Let all reaches pass on for a while; gives those that are not done."""
    unfinished = [False] * len(reaches)

    def work(place):
        if not step(reaches[place], _PATIENCE):
            reaches[place].make_room()
            unfinished[place] = True

    parallel.run(
        [lambda place=place: work(place) for place in range(len(reaches))],
        threads=threads, progress=progress,
    )  # fmt: skip
    return [reach for reach, more in zip(reaches, unfinished, strict=True) if more]
