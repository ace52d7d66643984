"""The estimates of many voids, one void after the other."""

import numba
import numpy as np

from demsmith.core.voids.accurate._learned import solve_learned
from demsmith.core.voids.accurate._locality import KNOWN, bounds, states
from demsmith.core.voids.accurate._structured import solve_structured

_PASSES = 2  # the second finds its structure in the first one's surface


@numba.njit(nogil=True, cache=True, error_model="numpy")
def estimate_voids(
    work, void, runs, first_run, numbers, margins, learnable, spreads, strengths,
    weights, noise, tension, stiffness, dx, dy, first_cell, estimates, distance, roughness,
    steepness, deviation,
):  # fmt: skip
    """Estimate the cells of some voids by every estimator.

    Parameters
    ----------
    work : (H, W) float array
        Elevations; first estimates in voids.
    void : (H, W) bool array
    runs, first_run : arrays
        See `demsmith.core.voids.labelling.Voids`.
    numbers : (N,) int64 array
        The voids. The arrays that follow have an element for each.
    margins : int64, cells around the void's bounding box that are looked at
    learnable : bool, whether to use the learned covariance
    spreads, strengths, tension, stiffness : float64, see `solve_structured`
    weights : (N, 5, 5), dx, dy : (N,) float64
    noise : float
    first_cell : (N,) int64
        Where in the arrays by cell each void begins.
    estimates : (3, M) float64 array, written
        First estimate, learned and structured, of each cell.
    distance : (M,) float64 array, written
        Cells (rows) to the nearest known cell, nearly.
    roughness : (N,) float64 array, written
        Root mean square of the Laplacian of the ground around the void, elevation by row².
    steepness : (N,) float64 array, written
        Root mean square of its slope, elevation by row.
    deviation : (N,) float64 array, written
        Standard deviation of its elevations.
    """
    for i in range(numbers.size):
        begin, end = first_run[numbers[i]], first_run[numbers[i] + 1]
        z, state, datum, top, left, relief = survey_void(
            work, void, runs, begin, end, margins[i], dx[i], dy[i], first_cell[i],
            estimates, distance,
        )  # fmt: skip
        roughness[i], steepness[i], deviation[i] = relief
        if learnable[i]:
            smooth = z.copy()
            solve_learned(smooth, state, weights[i], noise)
            put(smooth, datum, runs, begin, end, top, left, estimates[1], first_cell[i])
        for _ in range(_PASSES):
            solve_structured(
                z, state, spreads[i], strengths[i], tension[i], stiffness[i], dx[i], dy[i]
            )
        put(z, datum, runs, begin, end, top, left, estimates[2], first_cell[i])


@numba.njit(nogil=True, cache=True, error_model="numpy")
def survey_void(
    work, void, runs, begin, end, margin, dx, dy, first_cell, estimates, distance
):  # fmt: skip
    """Copy out the ground around a void, and note all that needs no solving.

    Gives the elevations above a datum, the states of their cells, the datum, the window's first
    row and column, and the ground's roughness, steepness and deviation; notes the first estimate,
    as the learned one too.
    """
    top, bottom, left, right = bounds(runs, begin, end, margin, work.shape)
    state = states(void, runs, begin, end, top, bottom, left, right)
    z = work[top:bottom, left:right].astype(np.float64)
    datum = _mean_known(z, state)
    z -= datum
    put(z, datum, runs, begin, end, top, left, estimates[0], first_cell)
    put(z, datum, runs, begin, end, top, left, estimates[1], first_cell)
    away = _distance(state, dx / dy)
    put(away, 0.0, runs, begin, end, top, left, distance, first_cell)
    return z, state, datum, top, left, _relief(z, state, dy / dx)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def put(z, datum, runs, begin, end, top, left, out, first):
    """Copy a void's cells from a window, in the order of its runs."""
    k = first
    for run in range(begin, end):
        for c in range(runs[run, 1], runs[run, 2]):
            out[k] = z[runs[run, 0] - top, c - left] + datum
            k += 1


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _mean_known(z, state):
    total, count = 0.0, 0
    high, wide = z.shape
    for r in range(high):
        for c in range(wide):
            if state[r, c] == KNOWN:
                total += z[r, c]
                count += 1
    return total / max(count, 1)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _distance(state, across):
    """Give each cell's distance to a known one, in rows, by steps along eight directions."""
    high, wide = state.shape
    diagonal = np.hypot(1.0, across)
    away = np.empty((high, wide))
    for r in range(high):
        for c in range(wide):
            away[r, c] = 0.0 if state[r, c] == KNOWN else 1e9
            if c > 0:
                away[r, c] = min(away[r, c], away[r, c - 1] + across)
            if r > 0:
                away[r, c] = min(away[r, c], away[r - 1, c] + 1)
                if c > 0:
                    away[r, c] = min(away[r, c], away[r - 1, c - 1] + diagonal)
                if c + 1 < wide:
                    away[r, c] = min(away[r, c], away[r - 1, c + 1] + diagonal)
    for r in range(high - 1, -1, -1):
        for c in range(wide - 1, -1, -1):
            if c + 1 < wide:
                away[r, c] = min(away[r, c], away[r, c + 1] + across)
            if r + 1 < high:
                away[r, c] = min(away[r, c], away[r + 1, c] + 1)
                if c > 0:
                    away[r, c] = min(away[r, c], away[r + 1, c - 1] + diagonal)
                if c + 1 < wide:
                    away[r, c] = min(away[r, c], away[r + 1, c + 1] + diagonal)
    return away


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _relief(z, state, aspect):
    """Give root mean squares of the Laplacian, the gradient and the elevation of the known cells.

    Where no cell's four neighbours are known, the elevations' stands for the Laplacian's: of such
    ground nothing is known but how high it lies.
    """
    bends, slopes, heights, count, known = 0.0, 0.0, 0.0, 0, 0
    high, wide = z.shape
    squared = aspect * aspect
    for r in range(high):
        for c in range(wide):
            if state[r, c] == KNOWN:
                heights += z[r, c] * z[r, c]
                known += 1
    for r in range(1, high - 1):
        for c in range(1, wide - 1):
            if (
                state[r, c] == KNOWN and state[r - 1, c] == KNOWN and state[r + 1, c] == KNOWN
                and state[r, c - 1] == KNOWN and state[r, c + 1] == KNOWN
            ):  # fmt: skip
                bent = z[r - 1, c] + z[r + 1, c] - 2 * z[r, c]
                bent += squared * (z[r, c - 1] + z[r, c + 1] - 2 * z[r, c])
                bends += bent * bent
                slopes += (z[r + 1, c] - z[r - 1, c]) ** 2 / 4
                slopes += squared * (z[r, c + 1] - z[r, c - 1]) ** 2 / 4
                count += 1
    deviation = np.sqrt(heights / max(known, 1))
    if count == 0:
        return deviation, 0.0, deviation
    return np.sqrt(bends / count), np.sqrt(slopes / count), deviation
