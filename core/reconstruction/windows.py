"""The ground around the voids of a part, ready for filling them."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.progress import SILENT
from demsmith.core.reconstruction.extents import cells_of, runs_of
from demsmith.core.voids.labelling import Voids, find_runs, find_voids


@dataclass(frozen=True)
class Window:
    """A window of ground, with all voids that reach into it.

    Attributes
    ----------
    values : (h, w) float array
        Elevations; not to be changed.
    void : (h, w) bool array
        What is not known, or not believed.
    voids : Voids
        All of it; what no tile covers is the last void.
    numbers : (M,) int64 array
        Which of them are the part's own.
    own : Voids
        These alone, numbered in this order; its labels are those of all.
    beside_gap : (M,) bool array
        Whether each has a cell beside ground that no tile covers.
    """

    values: np.ndarray
    void: np.ndarray
    voids: Voids
    numbers: np.ndarray
    own: Voids
    beside_gap: np.ndarray


def read_window(ground, part, *, progress=SILENT):
    """Read the window of a part.

    Parameters
    ----------
    ground : Ground
    part : Part
    progress : Progress

    Returns
    -------
    Window

    Raises
    ------
    InputError
        If the ground cannot be read.
    """
    values, _ = ground.read(part.rows, part.columns, progress=progress)
    void = np.zeros(values.shape, bool)
    void[cells_of(part.runs - part.corner)] = True
    voids = find_voids(void, threads=1)
    row, column = (part.first_cells - part.corner[:2]).T
    numbers = voids.labels[row, column].astype(np.int64) - 1
    own = _chosen(voids, numbers)
    gap = ~ground.covered(part.rows, part.columns)
    beside_gap = np.zeros(numbers.size, bool)
    if gap.any():
        beside_gap = _beside(voids, gap)[numbers]
        voids = _with_gap(voids, gap)
        void |= gap
    return Window(values, void, voids, numbers, own, beside_gap)


def _chosen(voids, numbers):
    lengths = np.diff(voids.first_run)[numbers]
    first_run = np.append(0, np.cumsum(lengths))
    return Voids(voids.labels, runs_of(voids, numbers), first_run, voids.cells[numbers])


def _beside(voids, gap):
    """Tell which voids have a cell beside ground that no tile covers."""
    reach = np.zeros(gap.shape, bool)
    reach[1:] |= gap[:-1]
    reach[:-1] |= gap[1:]
    reach[:, 1:] |= gap[:, :-1]
    reach[:, :-1] |= gap[:, 1:]
    found = np.zeros(len(voids) + 1, bool)
    found[voids.labels[reach]] = True
    return found[1:]


def _with_gap(voids, gap):
    """Add what no tile covers as a last void, for it is unknown too, and none of the others."""
    runs = find_runs(gap)
    voids.labels[gap] = len(voids) + 1
    return Voids(
        voids.labels,
        np.concatenate([voids.runs, runs]),
        np.append(voids.first_run, len(voids.runs) + len(runs)),
        np.append(voids.cells, np.count_nonzero(gap)),
    )
