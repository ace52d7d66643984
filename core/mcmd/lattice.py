"""The square lattice on which midpoints are displaced."""

from dataclasses import dataclass

import numpy as np


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


def metres(shape, pixel_size):
    """Give ``(dx, dy)`` per row as float64 arrays from what a caller gave.

    Parameters
    ----------
    shape : (int, int)
    pixel_size : None, float, (float, float) or two arrays of length H
        Ground metres per cell: both ways, east-west and north-south, or these by row;
        None means 1.

    Raises
    ------
    InputError
        If it is not positive and finite, or of the wrong length.
    """
    from demsmith.core.errors import InputError

    sizes = 1.0 if pixel_size is None else pixel_size
    pair = tuple(sizes) if np.iterable(sizes) else (sizes, sizes)
    if len(pair) != 2:
        raise InputError(f"pixel_size has {len(pair)} parts; give (east-west, north-south)")
    out = []
    for size in pair:
        size = np.asarray(size, np.float64)
        if size.ndim and size.shape != (shape[0],):
            raise InputError(f"pixel_size by row has shape {size.shape} for {shape[0]} rows")
        if not np.all(np.isfinite(size)) or np.any(size <= 0):
            raise InputError("pixel_size must be positive and finite")
        out.append(np.broadcast_to(size, (shape[0],)).copy())
    return tuple(out)
