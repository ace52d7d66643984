"""Kernel that looks at the ground around each void: how far from a plane it is."""

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")

_TERMS = 3  # of a plane


@numba.njit(**_JIT)
def survey(fields, unknown, runs, first_run, selected, reach, spread, cells):
    """Measure how far some fields are from a plane on the rim of each void.

    Parameters
    ----------
    fields : (F, H, W) float64 array
    unknown : (H, W) bool array
        Cells that are no ground.
    runs, first_run : arrays
        The voids' runs, see `demsmith.core.voids.Voids`.
    selected : (N,) int64 array
        Numbers of the voids.
    reach : int
        A rim's cells lie at most so many rows and columns from the void; those near more of its
        runs count more.
    spread : (F, V) float64 array
        Root mean square distance from the best plane; NaN where there are too few cells.
    cells : (V,) int64 array
        Cells seen, by void.
    """
    count = fields.shape[0]
    for void in selected:
        normal = np.zeros((_TERMS, _TERMS))
        seen = np.zeros((count, _TERMS))
        squares = np.zeros(count)
        base = np.zeros(count)
        total = 0
        row, column = runs[first_run[void], 0], runs[first_run[void], 1]
        for r in range(first_run[void], first_run[void + 1]):
            top, bottom = max(runs[r, 0] - reach, 0), min(runs[r, 0] + reach + 1, unknown.shape[0])
            left = max(runs[r, 1] - reach, 0)
            right = min(runs[r, 2] + reach, unknown.shape[1])
            for i in range(top, bottom):
                for j in range(left, right):
                    if unknown[i, j]:
                        continue
                    if total == 0:
                        for f in range(count):
                            base[f] = fields[f, i, j]
                    total += 1
                    terms = (1.0, float(i - row), float(j - column))
                    for a in range(_TERMS):
                        for b in range(_TERMS):
                            normal[a, b] += terms[a] * terms[b]
                        for f in range(count):
                            seen[f, a] += terms[a] * (fields[f, i, j] - base[f])
                    for f in range(count):
                        squares[f] += (fields[f, i, j] - base[f]) ** 2
        cells[void] = total
        for f in range(count):
            spread[f, void] = np.nan
        if total <= _TERMS:
            continue
        for a in range(_TERMS):
            normal[a, a] += 1e-9 * total
        for f in range(count):
            plane = np.linalg.solve(normal, seen[f])
            left_over = squares[f]
            for a in range(_TERMS):
                left_over -= plane[a] * seen[f, a]
            spread[f, void] = np.sqrt(max(left_over, 0.0) / (total - _TERMS))
