"""Cutting the filling of all voids into parts that fit in memory, each with its window."""

from dataclasses import dataclass

import numpy as np

LARGEST_WINDOW = 5120 * 5120
"""Cells of the largest window that a void may need around it; larger ones are left."""

_REACH = 512
"""Cells by which the common window of a chunk's voids may reach beyond the chunk."""


@dataclass(frozen=True)
class Part:
    """Voids that are filled in one go.

    Attributes
    ----------
    rows, columns : slice
        The window that holds them and the ground their filling depends on.
    voids : (M,) int64 array
        Their numbers.
    first_cells : (M, 2) int32 array
        Row and column of each one's first cell.
    runs : (N, 3) int32 array
        The void cells of the window, of these voids and of others.
    """

    rows: slice
    columns: slice
    voids: np.ndarray
    first_cells: np.ndarray
    runs: np.ndarray

    @property
    def corner(self):
        """What to take off a run's row and columns to count them from the window's first cell."""
        return np.array([self.rows.start, self.columns.start, self.columns.start], np.int32)


def parts_of(extents, voids, shape, side, margin):
    """Cut the filling of some voids into parts.

    Voids whose first cells are in the same chunk are filled together, but for large ones, which
    have windows of their own. What a void is filled with does not depend on it.

    Parameters
    ----------
    extents : VoidExtents
    voids : (M,) int64 array
        The numbers of those to fill.
    shape : (int, int)
        Of the ground.
    side : (int, int)
        Rows and columns of a chunk.
    margin : callable
        Gives the cells of ground around a void's bounding box that its filling may depend on,
        from the box's height and width.

    Returns
    -------
    list of Part
    """
    boxes = _windows(extents, voids, shape, margin)
    chunk = extents.first_cells[voids] // side
    corner = chunk * side
    inside = (boxes[:, :2] >= corner - _REACH).all(axis=1)
    inside &= (boxes[:, 2:] <= corner + side + _REACH).all(axis=1)
    chunk_number = np.where(inside, chunk[:, 0] * (shape[1] // side[1] + 1) + chunk[:, 1], -1)
    groups = [np.flatnonzero(chunk_number == number) for number in np.unique(chunk_number[inside])]
    groups += [np.array([alone]) for alone in np.flatnonzero(~inside)]
    return [_part(extents, voids[group], boxes[group]) for group in groups]


def too_large(extents, voids, shape, margin):
    """Tell which voids need more ground in memory than can be promised: bool array."""
    top, left, bottom, right = _windows(extents, voids, shape, margin).T
    return (bottom - top) * (right - left) > LARGEST_WINDOW


def large_note(cells):
    """Tell the user that voids of so many cells each were left."""
    voids = "1 void" if cells.size == 1 else f"{cells.size} voids"
    return (
        f"{voids} (the largest of {cells.max()} cells) left as they were: the ground they depend "
        f"on is more than {LARGEST_WINDOW} cells; use an auxiliary or cut them off as a mask"
    )


def _windows(extents, voids, shape, margin):
    """Give each void's window: first row and column, one past the last row and column."""
    top, left = extents.top[voids], extents.left[voids]
    bottom, right = extents.bottom[voids], extents.right[voids]
    sizes, of_void = np.unique(
        np.stack([bottom - top, right - left], axis=1), axis=0, return_inverse=True
    )
    margins = np.array([margin(int(high), int(wide)) for high, wide in sizes], np.int64)
    around = margins[of_void.ravel()] if voids.size else np.empty(0, np.int64)
    return np.stack(
        [
            np.maximum(top - around, 0), np.maximum(left - around, 0),
            np.minimum(bottom + around, shape[0]), np.minimum(right + around, shape[1]),
        ],
        axis=1,
    )  # fmt: skip


def _part(extents, voids, boxes):
    rows = slice(int(boxes[:, 0].min()), int(boxes[:, 2].max()))
    columns = slice(int(boxes[:, 1].min()), int(boxes[:, 3].max()))
    return Part(
        rows, columns, voids, extents.first_cells[voids], extents.runs_within(rows, columns)
    )
