"""Known ground that is hidden on purpose, to see how well it comes back."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from demsmith.core import parallel
from demsmith.core.progress import SILENT, Muted, Span, checkpoint
from demsmith.core.tuning.score import Holes, classify
from demsmith.core.validation import SIZE_CLASSES, punch_voids
from demsmith.core.voids.labelling import find_voids

_MASKS = 2  # punched for each holdout; more give more holes, and take longer
_SHARE = 0.2  # of the pieces of samples, for each holdout
_FILL_WINDOW = 1400  # cells along a side; smaller ones would cut the largest voids
_SAMPLE_WINDOW = 512
_PIECE_SIDE = 64


@dataclass(frozen=True)
class Trial:
    """A window of a raster, some of whose known cells are hidden.

    Attributes
    ----------
    rows, columns : slice
        Where the window lies.
    known : (h, w) bool array
        What may be used: known, and not hidden.
    hidden : (h, w) bool array
        Cells to compare with what they were.
    hole_of : (n,) int64 array
        The hole of each hidden cell, in C order.
    sizes : (N,) int64 array
        Size of each hole.
    """

    rows: slice
    columns: slice
    known: np.ndarray
    hidden: np.ndarray
    hole_of: np.ndarray
    sizes: np.ndarray

    def squared_errors(self, values, rebuilt):
        """Give the (N,) sums over each hole of the squared error of a rebuilt window."""
        truth = values[self.rows, self.columns][self.hidden]
        error = rebuilt[self.hidden].astype(np.float64) - truth
        return np.bincount(self.hole_of, error**2, self.sizes.size)


@dataclass(frozen=True)
class Holdout:
    """Trials over several windows, and the holes of all of them."""

    trials: tuple
    holes: Holes

    @classmethod
    def of(cls, trials, limits):
        """Put trials together; ``limits`` are the size classes of the holes."""
        none = np.empty(0, np.int64)
        cells = [np.bincount(trial.hole_of, minlength=trial.sizes.size) for trial in trials]
        sizes = [trial.sizes for trial in trials]
        return cls(
            tuple(trials),
            classify(np.concatenate([none, *cells]), np.concatenate([none, *sizes]), limits),
        )

    def squared_errors(self, values, rebuild, progress=SILENT):
        """Rebuild every window and compare it with what was hidden.

        Parameters
        ----------
        values : (H, W) array
            The raster.
        rebuild : callable
            Called with a `Trial` and a `Progress`; gives the window's (h, w) elevations, made from
            the cells ``trial.known`` alone.
        progress : Progress

        Returns
        -------
        (N,) float64 array
            Each hole's sum of squared errors [m²].
        """
        out = []
        for n, trial in enumerate(self.trials):
            part = Span(progress, n / len(self.trials), (n + 1) / len(self.trials))
            out.append(trial.squared_errors(values, rebuild(trial, part)))
        return np.concatenate(out)


def punched_holdouts(values, known, *, count, most_cells, threads=None, progress=SILENT):
    """Punch artificial voids for several holdouts that share no cell.

    Parameters
    ----------
    values : (H, W) array
        Elevations.
    known : (H, W) bool array
    count : int
        Number of holdouts.
    most_cells : int
        Of a larger raster only windows of so many cells in all are taken, those with the most
        void cells, for it is the ground around the voids that matters.
    threads : int, optional
    progress : Progress

    Returns
    -------
    list of Holdout
        Holes are classed by their size, real voids that they run into included.
    """
    places = _windows(~known, _FILL_WINDOW, most_cells)
    trials = [[] for _ in range(count)]
    for n, (rows, columns) in enumerate(places):
        part = Span(progress, n / len(places), (n + 1) / len(places))
        ground = known[rows, columns]
        masks = _punch(values[rows, columns], ground, count * _MASKS, threads, part)
        for mask, hidden in enumerate(_without_overlap(masks)):
            trials[mask % count].append(_punched_trial(rows, columns, ground, hidden))
    return [Holdout.of(each, SIZE_CLASSES) for each in trials]


def _punch(values, known, count, threads, progress):
    """Punch several masks, side by side."""
    masks = [np.zeros(values.shape, bool)] * count

    def punch(seed):
        masks[seed] = punch_voids(values, known=known, seed=seed, progress=Muted(progress))

    if known.any():
        parallel.run(
            [lambda seed=seed: punch(seed) for seed in range(count)],
            threads=threads, progress=progress,
        )  # fmt: skip
    return masks


def _without_overlap(masks):
    """Leave out holes that meet a larger one of another mask.

    Whole ones, for what is left of a cut hole would be smaller than it.
    """
    holes = [(mask, cells) for mask in range(len(masks)) for cells in _cells_by_hole(masks[mask])]
    taken = np.zeros(masks[0].size, bool)
    kept = [np.zeros_like(mask) for mask in masks]
    for mask, cells in sorted(holes, key=lambda hole: -hole[1].size):
        if not taken[cells].any():
            taken[cells] = True
            kept[mask].ravel()[cells] = True
    return kept


def _cells_by_hole(mask):
    """List the flat indices of each hole's cells."""
    labels = find_voids(mask, threads=1).labels.ravel()
    cells = np.flatnonzero(labels)
    cells = cells[np.argsort(labels[cells], kind="stable")]
    return np.split(cells, np.flatnonzero(np.diff(labels[cells])) + 1) if cells.size else []


def _punched_trial(rows, columns, ground, hidden):
    voids = find_voids(~ground | hidden, threads=1)
    labels, hole_of = np.unique(voids.labels[hidden], return_inverse=True)
    return Trial(rows, columns, ground & ~hidden, hidden, hole_of, voids.cells[labels - 1])


def sampled_holdouts(known, *, count, most_cells, seed=0, progress=SILENT):
    """Hold samples back for several holdouts that share no cell.

    Cells that touch, such as those of a line, are held back together (in pieces of 64 cells), for
    a gap of one cell in a line says nothing about the ground between lines.

    Parameters
    ----------
    known : (H, W) bool array
        Cells that hold samples.
    count : int
        Number of holdouts, each with a fifth of the samples of its windows.
    most_cells : int
        Of a larger raster only windows of so many cells in all are taken, those with the most
        samples.
    seed : int
    progress : Progress

    Returns
    -------
    list of Holdout
    """
    places = _windows(known, _SAMPLE_WINDOW, most_cells)
    rng = np.random.default_rng(seed)
    trials = [[] for _ in range(count)]
    for n, (rows, columns) in enumerate(places):
        checkpoint(progress, n / len(places))
        ground = known[rows, columns]
        piece_of, pieces = _pieces(ground)
        turn = rng.permutation(pieces) / max(pieces, 1) // _SHARE
        for k in range(count):
            trials[k].append(_sampled_trial(rows, columns, ground, piece_of, turn == k))
    return [Holdout.of(each, ((1, None),)) for each in trials]


def _pieces(known):
    """Number the pieces of touching samples; gives each known cell's piece, and their count."""
    from scipy.ndimage import label

    labels, _ = label(known, np.ones((3, 3)))
    row, column = np.nonzero(known)
    block = row // _PIECE_SIDE * known.shape[1] + column // _PIECE_SIDE
    pieces, piece_of = np.unique(
        labels[known].astype(np.int64) * known.size + block, return_inverse=True
    )
    return piece_of, pieces.size


def _sampled_trial(rows, columns, ground, piece_of, is_hidden):
    hidden = ground.copy()
    hidden[ground] = is_hidden[piece_of]
    _, hole_of, sizes = np.unique(
        piece_of[is_hidden[piece_of]], return_inverse=True, return_counts=True
    )
    return Trial(rows, columns, ground & ~hidden, hidden, hole_of, sizes)


def _windows(wanted, side, most_cells):
    """Cut a raster into windows and choose those with the most cells wanted."""
    spans = [_spans(length, side) for length in wanted.shape]
    windows = [(rows, columns) for rows in spans[0] for columns in spans[1]]
    # Among equals a random order, always the same, takes windows here and there.
    tie = np.random.default_rng(0).permutation(len(windows))
    best = np.lexsort((tie, [-np.count_nonzero(wanted[window]) for window in windows]))
    cells = np.cumsum([wanted[windows[n]].size for n in best])
    return [windows[n] for n in best[: max(1, np.count_nonzero(cells <= most_cells))]]


def _spans(length, side):
    parts = -(-length // side)
    edges = [length * k // parts for k in range(parts + 1)]
    return [slice(a, b) for a, b in pairwise(edges)]
