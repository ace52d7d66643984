"""The tiles of a raster: squares of cells that are coded apart from each other."""

from dataclasses import dataclass
from itertools import product


@dataclass(frozen=True)
class Tiling:
    """Tiles of ``side`` × ``side`` cells, numbered row by row; the last ones may be smaller.

    Examples
    --------
    >>> tiling = Tiling((300, 500), 256)
    >>> tiling.count
    4
    >>> tiling.slices(3)
    (slice(256, 300, None), slice(256, 500, None))
    >>> list(tiling.overlapping((0, 10), (250, 260)))
    [0, 1]
    """

    shape: tuple
    side: int

    @property
    def rows(self):
        """Number of tiles from top to bottom."""
        return -(-self.shape[0] // self.side)

    @property
    def columns(self):
        """Number of tiles from left to right."""
        return -(-self.shape[1] // self.side)

    @property
    def count(self):
        """Number of tiles."""
        return self.rows * self.columns

    def slices(self, tile):
        """Give the rows and the columns of cells of a tile."""
        corner = divmod(tile, self.columns)
        return tuple(
            slice(at * self.side, min((at + 1) * self.side, end))
            for at, end in zip(corner, self.shape, strict=True)
        )

    def overlapping(self, rows, columns):
        """List the tiles that share cells with a window of ``(start, stop)`` rows and columns."""
        across = range(columns[0] // self.side, -(-columns[1] // self.side))
        down = range(rows[0] // self.side, -(-rows[1] // self.side))
        return (row * self.columns + column for row, column in product(down, across))
