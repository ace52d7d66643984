"""What voids were filled with, as cells that can be laid on any window."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.reconstruction.extents import cells_of


@dataclass(frozen=True)
class Patch:
    """What the voids of a part are filled with, and what is known of each.

    Attributes
    ----------
    voids : (M,) int64 array
        Their numbers.
    filled : (M,) bool array
    codes : (M,) uint8 array
        How each was filled, as a source map says it.
    errors : (M,) float64 array
        Expected root mean square error in the ground's unit; NaN if unknown.
    verdicts : (M, S) uint8 array
        What became of each auxiliary: index into `demsmith.core.auxiliary.VERDICTS`.
    rim_low, rim_mean, rim_high : (M,) float64 arrays
        Of the known cells beside each; NaN if there is none.
    touches_edge : (M,) bool array
        Whether it reaches the edge of the ground.
    runs : (N, 3) int32 array
        Row, first column and one past the last column of each run of cells that were filled.
    elevations : (C,) float array
        Of the cells of ``runs``, in order.
    sigma : (C,) float32 array
        Their uncertainty (one standard deviation); NaN if unknown.
    sources : (C,) uint8 array
        Their codes in a source map.
    """

    voids: np.ndarray
    filled: np.ndarray
    codes: np.ndarray
    errors: np.ndarray
    verdicts: np.ndarray
    rim_low: np.ndarray
    rim_mean: np.ndarray
    rim_high: np.ndarray
    touches_edge: np.ndarray
    runs: np.ndarray
    elevations: np.ndarray
    sigma: np.ndarray
    sources: np.ndarray

    def paste(self, rows, columns, values, sigma, sources):
        """Copy what lies in a window into arrays of it.

        Parameters
        ----------
        rows, columns : slice
        values, sigma, sources : (h, w) arrays
            Changed in place.
        """
        row, column = cells_of(self.runs)
        inside = (row >= rows.start) & (row < rows.stop)
        inside &= (column >= columns.start) & (column < columns.stop)
        place = row[inside] - rows.start, column[inside] - columns.start
        values[place] = self.elevations[inside]
        sigma[place] = self.sigma[inside]
        sources[place] = self.sources[inside]
