"""The square lattice on which midpoints are displaced."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Lattice:
    """A virtual lattice of ``(2**levels + 1)**2`` points that covers a raster (section 3.1).

    Attributes
    ----------
    row, column : int
        Where the lattice's first corner lies in the raster; 0 or less.
    levels : int
        How often its side can be halved; the first midpoints stand ``2**(levels - 1)`` cells apart
        from their ascendants.
    """

    row: int
    column: int
    levels: int

    @classmethod
    def covering(cls, shape, origin=(0, 0)):
        """Give the smallest lattice from ``origin`` that covers a raster of ``shape``.

        Examples
        --------
        >>> Lattice.covering((344, 403))
        Lattice(row=0, column=0, levels=9)
        >>> Lattice.covering((5, 5)).levels
        2
        """
        row, column = origin
        reach = max(shape[0] - row, shape[1] - column) - 1
        return cls(row, column, max(int(reach - 1).bit_length(), 0) if reach > 0 else 0)

    @property
    def side(self):
        """Points along one side."""
        return 2**self.levels + 1
