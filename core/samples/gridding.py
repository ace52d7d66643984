"""From samples to the cells of a grid."""

from dataclasses import dataclass

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.samples.samples import usable
from demsmith.core.samples.sketch import laid_over

_AT_ONCE = 500_000  # vertices between two checkpoints


@dataclass(frozen=True, eq=False)
class Gridded:
    """Samples as cells.

    Attributes
    ----------
    values : (H, W) float32 or float64 array
        Elevations [m]; 0 where not known.
    known : (H, W) bool array
    contour : (H, W) bool array or None
        Cells on a contour line; None without such lines.
    used, outside, unusable : int
        Samples in the grid, beyond it, and with a coordinate or elevation that is not finite. All
        vertices of a line that has a cell of the grid are used, for they lead it there.
    shared : int
        Cells that hold several points.
    deviation : float
        How far a point is from the mean of its cell at most [m].
    """

    values: np.ndarray
    known: np.ndarray
    contour: np.ndarray | None
    used: int
    outside: int
    unusable: int
    shared: int
    deviation: float


def to_cells(samples, grid, sketch=None, *, progress=SILENT):
    """Give the cells of a grid the elevations of the samples in them.

    Points of one cell give it their mean. Lines and contours give theirs to one cell in each
    column, or in each row where they run more north-south than east-west, and the mean where they
    meet: two cells of one elevation side by side across a contour would be a terrace. A cell takes
    its elevation from the first of these that has one for it: points, cells, lines, contours,
    sketch.

    Parameters
    ----------
    samples : Samples
    grid : Grid
    sketch : (h, w) float array, optional
        Elevations [m] over the whole grid in a resolution of its own, NaN where not painted; a
        cell takes the one at its centre.
    progress : Progress

    Returns
    -------
    Gridded

    Raises
    ------
    InputError
        If ``samples.cells`` does not have the grid's shape.
    Cancelled
        If ``progress`` asks to stop.
    """
    shape = tuple(grid.shape)
    dtype = np.float32 if samples.cells is None else samples.cells.dtype
    values, known = np.zeros(shape, dtype), np.zeros(shape, bool)
    if sketch is not None:
        laid = laid_over(sketch, grid)
        _lay(laid, np.isfinite(laid), values, known)
    contour, beyond = _lay_lines(samples.contours, grid, values, known, Span(progress, 0, 0.4))
    _, besides = _lay_lines(samples.lines, grid, values, known, Span(progress, 0.4, 0.6))
    if samples.cells is not None:
        if samples.cells.shape != shape:
            raise InputError(f"cells {samples.cells.shape} do not have the grid's shape {shape}")
        _lay(samples.cells, np.isfinite(samples.cells), values, known)
    points = samples.points[usable(samples.points)]
    inside, shared, deviation = _lay_points(points, grid, values, known, Span(progress, 0.6, 1))
    outside = beyond + besides + len(points) - inside
    unusable = int(np.count_nonzero(~usable(samples.vertices())))
    used = len(samples) - outside - unusable
    return Gridded(values, known, contour, used, outside, unusable, shared, deviation)


def _lay(layer, there, values, known):
    """Put a layer of elevations over the values, where it has any."""
    np.copyto(values, layer, where=there, casting="same_kind")
    known |= there


def _lay_means(sums, counts, values, known):
    """Lay the means of what was added up; gives the cells that have one."""
    there = counts > 0
    np.divide(sums, counts, out=sums, where=there)
    _lay(sums, there, values, known)
    return there


def _lay_lines(lines, grid, values, known, progress):
    """Lay lines over the values.

    Gives the cells they take, or None without lines; and how many vertices have the lines that
    take none.
    """
    from demsmith.core.samples._gridding import add_lines

    if not lines:
        return None, 0
    vertices = np.concatenate(lines)
    good = usable(vertices)
    first = np.concatenate([[0], np.cumsum(good)])[np.cumsum([0, *map(len, lines)])]
    vertices = vertices[good]
    u, v = _cell_coordinates(vertices, grid)
    entering = np.zeros(len(lines), bool)
    sums, counts = np.zeros(values.shape), np.zeros(values.shape, np.int32)
    for begin, end in parallel.even_spans(np.diff(first) + 1, len(vertices) // _AT_ONCE + 1):
        checkpoint(progress, first[begin] / len(vertices))
        add_lines(u, v, vertices[:, 2], first[begin : end + 1], sums, counts, entering[begin:end])
    beyond = int(np.diff(first)[~entering].sum())
    return _lay_means(sums, counts, values, known), beyond


def _lay_points(points, grid, values, known, progress):
    """Lay points over the values; tells how many lie in the grid, cells that share, deviation."""
    from demsmith.core.samples._gridding import add_points, largest_deviation

    if not len(points):
        return 0, 0, 0.0
    u, v = _cell_coordinates(points, grid)
    z = points[:, 2]
    spans = parallel.even_spans(np.ones(len(points)), len(points) // _AT_ONCE + 1)
    sums, counts = np.zeros(values.shape), np.zeros(values.shape, np.int32)
    for begin, end in spans:
        checkpoint(progress, 0.5 * begin / len(points))
        add_points(u, v, z, begin, end, sums, counts)
    _lay_means(sums, counts, values, known)
    deviation = 0.0
    for begin, end in spans:
        checkpoint(progress, 0.5 + 0.5 * begin / len(points))
        deviation = max(deviation, largest_deviation(u, v, z, begin, end, sums))
    return int(counts.sum()), int(np.count_nonzero(counts > 1)), deviation


def _cell_coordinates(points, grid):
    """Give places as columns and rows, from the grid's outer corner on."""
    x_corner, width, _, y_corner, _, height = grid.geotransform
    return (points[:, 0] - x_corner) / width, (points[:, 1] - y_corner) / height
