"""Known cells that were not believed: where they lie, and what they held before and after."""

from dataclasses import dataclass

import numpy as np

MOST = 10_000
"""So many of them are listed, those that changed most."""


@dataclass(frozen=True)
class RemovedCells:
    """Known cells of a tile that were not believed and filled, the most changed first.

    Attributes
    ----------
    row, column : (N,) int64 arrays
    before, after : (N,) float64 arrays
        Real elevations.
    outlier : (N,) bool array
        Whether each was a spike or a well; the others lay at the rim of a void.
    """

    row: np.ndarray
    column: np.ndarray
    before: np.ndarray
    after: np.ndarray
    outlier: np.ndarray

    def counts(self):
        """Count the cells by the reason of their removal."""
        reasons, counts = np.unique(self._reasons(), return_counts=True)
        return dict(zip(reasons.tolist(), counts.tolist(), strict=True))

    def rows(self, grid):
        """Give a dict of plain values for each of the first `MOST` cells.

        Parameters
        ----------
        grid : Grid
            The tile's.
        """
        row, column = self.row[:MOST], self.column[:MOST]
        centre = grid.xy(row, column)
        columns = dict(
            row=row, column=column, x=centre.x, y=centre.y, before=self.before[:MOST],
            after=self.after[:MOST], reason=self._reasons()[:MOST],
        )  # fmt: skip
        values = zip(*(each.tolist() for each in columns.values()), strict=True)
        return [dict(zip(columns, each, strict=True)) for each in values]

    def _reasons(self):
        beyond = np.where(self.before > self.after, "spike", "well")
        return np.where(self.outlier, beyond, "rim of a void")


def removed_cells(own, values, faulty, outliers):
    """Collect the known cells of a tile that were not believed.

    Parameters
    ----------
    own : Raster
        The tile as its file holds it.
    values : (H, W) array
        As its output is to hold it.
    faulty : (H, W) bool array
        The cells.
    outliers : (K, 2) int array
        Rows and columns of the spikes and wells of the tile.

    Returns
    -------
    RemovedCells
    """
    row, column = np.nonzero(faulty)
    before, after = (
        own.meta.real(each[row, column].astype(np.float64)) for each in (own.values, values)
    )
    is_outlier = np.zeros(faulty.shape, bool)
    is_outlier[tuple(np.transpose(outliers))] = True
    order = np.argsort(-np.abs(before - after), kind="stable")
    return RemovedCells(
        row[order], column[order], before[order], after[order], is_outlier[row, column][order]
    )


def largest_changes(lists):
    """Join lists of `RemovedCells.rows` to one of at most `MOST`, the most changed first."""
    joined = [row for rows in lists for row in rows]
    return sorted(joined, key=lambda row: -abs(row["before"] - row["after"]))[:MOST]
