"""Upstream area by chance: particles that drop on the ground and walk down it."""

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.hydrology.accumulation import check_exponent, initial
from demsmith.core.hydrology.traversal import Surface, in_strips, traverse
from demsmith.core.progress import SILENT, Span


def drop_particles(
    filled, flat, void, dx, dy, weights, *, exponent=1.1, particles=1_000_000, seed=0,
    threads=None, progress=SILENT,
):  # fmt: skip
    """Estimate upstream area by particles.

    Each drops on a cell by chance in proportion to the weights, and from each cell walks on to a
    lower neighbour by chance in proportion to the shares of `accumulate_mfd`, until it leaves. The
    share of the particles that come through a cell, times the sum of the weights, is its area. So
    the area of `accumulate_mfd` is what this is on average.

    Parameters
    ----------
    filled, flat, void, dx, dy, exponent
        As of `demsmith.core.hydrology.accumulation.accumulate_mfd`.
    weights : (H,) or (H, W) array
        What each cell adds, or each of a row, 0 or more: its area [m²], or 1 to count cells.
    particles : int
        1 to 10^15. Those in a cell are moved together, by draws from the multinomial distribution,
        which is the same in law; so time hardly grows with their number.
    seed : int
        0 or more.
    threads : int, optional
        Default: one for each core. The result does not depend on it: every draw depends on the seed
        and the cell alone.
    progress : Progress

    Returns
    -------
    area : (H, W) float64 array
        0 at voids, and where no particle came through.
    error : (H, W) float32 array
        Standard error of the area, see `standard_error`; 0 at voids.

    Raises
    ------
    InputError
        If the arrays do not fit, a weight is negative or not finite, all are 0, or an option is out
        of range.
    Cancelled
        If ``progress`` asks to stop.
    """
    check_exponent(exponent)
    if not 1 <= particles <= 10**15:
        raise InputError(f"particles is {particles}; it must be from 1 to 10^15")
    if not 0 <= seed < 2**63:
        raise InputError(f"seed is {seed}; it must be 0 or more and below 2^63")
    ground = Surface(filled, flat, void, dx, dy)
    counts, total = _drop(
        weights, ground.void, particles, seed, threads=threads, progress=Span(progress, 0, 0.3)
    )
    _walk(ground, exponent, seed, counts, threads=threads, progress=Span(progress, 0.3, 0.95))

    def scale(rows):
        counts[rows] *= total / particles

    in_strips(scale, counts.shape, threads=threads, progress=Span(progress, 0.95, 1))
    error = standard_error(counts, total, particles)
    error[ground.void] = 0
    return counts, error


def _drop(weights, void, particles, seed, *, threads, progress):
    """Give how many particles drop on each cell, as float64, and the sum of the weights."""
    from demsmith.core.hydrology._particles import drop_on_cells, drop_on_rows

    counts = initial(weights, void, threads=threads, progress=Span(progress, 0, 0.2))
    by_row = _row_sums(counts)
    on_row = np.empty(by_row.size, np.int64)
    drop_on_rows(by_row, particles, seed, on_row)
    in_strips(
        lambda rows: drop_on_cells(on_row, seed, rows.start, rows.stop, counts),
        counts.shape, threads=threads, progress=Span(progress, 0.2, 1),
    )  # fmt: skip
    return counts, by_row.sum()


def _walk(ground, exponent, seed, counts, *, threads, progress):
    """Let the particles of all cells walk until they leave; adds them up in ``counts``."""
    from demsmith.core.hydrology._particles import walk

    donors = ground.donors(exponent, threads=threads, progress=Span(progress, 0, 0.1))
    traverse(
        lambda reach, patience: walk(
            ground.z, ground.flat, ground.ways, np.float32(exponent), seed, reach.rows, reach.free,
            reach.place, reach.stack, patience, donors, counts,
        ),
        counts.shape, threads=threads, progress=Span(progress, 0.1, 1),
    )  # fmt: skip


def _row_sums(weights):
    """Add up each row; refuse what is no distribution."""
    if weights.min() < 0:
        row, column = (int(place) for place in np.argwhere(weights < 0)[0])
        raise InputError(
            f"the weight at row {row}, column {column} is {weights[row, column]:g}; "
            "particles cannot drop on less than 0"
        )
    by_row = weights.sum(axis=1)
    if by_row.sum() == 0:
        raise InputError("all weights are 0; no particle drops anywhere")
    return by_row


def standard_error(area, total, particles):
    """Give the standard error of areas found by particles.

    The number that comes through a cell is binomial: of ``particles``, each does so with the same
    probability p, so that the error of the area is total · √(p (1 − p) / particles). Where none
    came, it is that of one particle, for p is then as good as never 0.

    Parameters
    ----------
    area : array
        As `drop_particles` gives it.
    total : float
        Sum of all weights, in the same unit.
    particles : int

    Returns
    -------
    array of float32

    Examples
    --------
    >>> standard_error(np.array([0.0, 50.0, 100.0]), 100.0, 400).round(2)
    array([0.25, 2.5 , 0.  ], dtype=float32)
    """
    error = np.empty(area.shape, np.float32)
    for here, there in zip(np.atleast_2d(area), np.atleast_2d(error), strict=True):
        share = np.maximum(here / total, 1 / particles)
        there[:] = total * np.sqrt(share * np.maximum(1 - share, 0) / particles)
    return error
