"""Void shapes laid onto known ground, where it is as steep as around the real voids."""

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.validation.shapes import RIM, blob
from demsmith.core.validation.slope import slopes
from demsmith.core.voids.sizes import SIZE_CLASSES, size_class

_GAP = 2  # known cells between two holes, so that they do not meet even at a corner
_HOLES_BY_CLASS = 20
_PLACES = 64  # looked at for each hole, of which the most alike in slope is taken
_ATTEMPTS = 8  # of so many places, until one is free
_BLOCK_CELLS = 1 << 20


def transplant_voids(
    values, known, shapes, *, share=0.05, count=None, seed=0, turned=True, pixel_size=None,
    progress=SILENT,
):  # fmt: skip
    """Lay the shapes of real voids onto known ground that is as steep as around each of them.

    Each size class gets 20 holes if there are shapes of its size and half of the cells that are
    left, from the small to the large, are enough; all others are drawn at random from ``shapes``,
    so that sizes are as frequent as among them. Of 64 random free places of a hole that one is
    taken whose mean slope around it is nearest to the shape's, but none on level ground, such as
    water. Between two holes, or a hole and a real void, there are at least two known cells.

    Parameters
    ----------
    values : (H, W) array
        Elevations [m].
    known : (H, W) bool array
        Where they are known.
    shapes : sequence of VoidShape
        From `void_shapes`, of this raster or of another one.
    share : float
        Share of the known cells that are not level to be punched; fewer where there is no more
        place.
    count : int, optional
        At most so many holes.
    seed : int
    turned : bool
        Whether shapes may be turned by quarters of a circle and mirrored.
    pixel_size : optional
        Ground metres per cell, see `demsmith.core.mcmd.lattice.metres`.
    progress : Progress

    Returns
    -------
    (H, W) bool array
        The holes; all of them on known ground.

    Raises
    ------
    InputError
        If there are no shapes, or ``share`` is not between 0 and 1.
    Cancelled
        If ``progress`` asks to stop.
    """
    if not shapes:
        raise InputError("there is no void whose shape could be transplanted")
    if not 0 < share < 1:
        raise InputError(f"share is {share}; it must be between 0 and 1")
    rng = np.random.default_rng(seed)
    slope = slopes(values, known, pixel_size=pixel_size, progress=Span(progress, 0, 0.1))
    ground = np.count_nonzero(slope > 0) or np.count_nonzero(known)
    chosen = _draw(shapes, share * ground, count, rng)
    if turned:
        chosen = [shape.turned(int(rng.integers(8))) for shape in chosen]
    return _lay(chosen, known, slope, rng, Span(progress, 0.1, 1))


def single_holes(known, *, cells, count=1, seed=0, progress=SILENT):
    """Punch compact holes of given sizes at random places.

    Parameters
    ----------
    known : (H, W) bool array
        Where ground is known.
    cells : int or sequence of int
        Sizes of the holes.
    count : int
        Holes of each size; fewer where there is no place.
    seed : int
    progress : Progress

    Returns
    -------
    (H, W) bool array
        The holes, all on known ground, with at least two known cells between them.

    Raises
    ------
    InputError
        If a size is less than 1.
    Cancelled
        If ``progress`` asks to stop.
    """
    rng = np.random.default_rng(seed)
    shapes = [blob(int(size), rng) for size in np.atleast_1d(cells) for _ in range(count)]
    return _lay(shapes, known, np.full(known.shape, np.nan, np.float32), rng, progress)


def _draw(shapes, cells, count, rng):
    """Choose which shapes are laid: so many of each class, then as they come."""
    most = np.inf if count is None else count
    sizes = np.array([shape.size for shape in shapes])
    drawn, left = [], cells
    class_of = size_class(sizes)
    for number in range(len(SIZE_CLASSES)):
        members = np.flatnonzero(class_of == number)
        holes = min(_HOLES_BY_CLASS, most // len(SIZE_CLASSES)) if members.size else 0
        spare = left / 2
        for shape in np.resize(rng.permutation(members), int(holes)):
            if sizes[shape] <= left - spare:
                drawn.append(shape)
                left -= sizes[shape]
    while len(drawn) < most and left >= sizes.min():
        shape = rng.integers(sizes.size)
        if sizes[shape] <= left:
            drawn.append(shape)
            left -= sizes[shape]
    return [shapes[shape] for shape in drawn]


def _lay(shapes, known, slope, rng, progress):
    """Find each shape a place, the largest first, for it is the hardest to find one for."""
    ground = _Ground(known, slope)
    for done, shape in enumerate(sorted(shapes, key=lambda shape: -shape.size)):
        checkpoint(progress, done / len(shapes))
        place = ground.find_place(shape, rng)
        if place is not None:
            ground.punch(shape, place)
    checkpoint(progress, 1.0)
    return ground.punched


class _Ground:
    """Known ground, its slope, and where it is taken already."""

    def __init__(self, known, slope):
        from scipy.ndimage import maximum_filter

        self.punched = np.zeros(known.shape, bool)
        # Beyond the raster nothing is known.
        unknown = np.pad(~known, _GAP, constant_values=True)
        self._blocked = maximum_filter(unknown, 2 * _GAP + 1)
        self._slope = np.pad(slope, RIM[1], constant_values=np.nan)

    def find_place(self, shape, rng):
        """Give the row and column of the shape's first corner, or None."""
        room = np.array(self.punched.shape) - shape.cells.shape + 1
        if room.min() < 1:
            return None
        together = max(1, min(_PLACES, _BLOCK_CELLS // shape.cells.size))
        for _ in range(_ATTEMPTS):
            places = rng.integers(0, room, (together, 2))
            places = places[self._free(shape.cells, places)]
            if not np.isnan(shape.slope):
                places = self._by_likeness(shape, places)
            if len(places):
                return places[0]
        return None

    def punch(self, shape, place):
        row, column = place
        height, width = shape.cells.shape
        self.punched[row : row + height, column : column + width] |= shape.cells
        around = shape.grown(_GAP)
        height, width = around.shape
        self._blocked[row : row + height, column : column + width] |= around

    def _free(self, cells, places):
        return ~_gather(self._blocked, cells, places + _GAP).any(axis=1)

    def _by_likeness(self, shape, places):
        """Sort places by how near their slope is to the shape's; leave out level ones."""
        around = _gather(self._slope, shape.rim(), places)
        known = ~np.isnan(around)
        mean = np.where(known, around, 0).sum(axis=1, dtype=np.float64)
        mean /= np.maximum(known.sum(axis=1), 1)
        apart = np.abs(mean - shape.slope)
        order = np.argsort(apart, kind="stable")
        return places[order[(mean[order] > 0) | (shape.slope == 0)]]


def _gather(array, mask, places):
    """Take the cells of a mask at every place; gives an array (places, cells)."""
    row, column = np.nonzero(mask)
    width = array.shape[1]
    first = places[:, 0] * width + places[:, 1]
    return array.ravel()[first[:, None] + (row * width + column)]
