"""Kernel of choosing atoms: what more a candidate explains than those chosen before."""

import numba

_JIT = dict(nogil=True, cache=True, error_model="numpy")


@numba.njit(**_JIT)
def gain(explained, candidate, best):
    """Sum what a candidate explains of each disc beyond the best so far.

    Parameters
    ----------
    explained : (M, n) float32 array
        Energy that each candidate explains of each disc.
    best : (n,) float32 array
        The most that any chosen one explains.
    """
    total = 0.0
    for i in range(best.size):
        more = explained[candidate, i] - best[i]
        if more > 0:
            total += more
    return total
