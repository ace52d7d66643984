"""Kernels of particles: where they drop, and down which slopes they walk."""

import numba
import numpy as np

from demsmith.core.hydrology._chance import begin, binomial, uniform
from demsmith.core.hydrology._dispersal import BUNCH, gather, mfd_shares, release, take
from demsmith.core.hydrology._receivers import lower_neighbours, offsets

_jit = numba.njit(nogil=True, cache=True, error_model="numpy")

# Streams of chance must not be the same for different purposes.
_BY_ROW, _BY_CELL, _WALK = 1, 2, 3
# So many particles or fewer choose one by one.
_FEW = 8


@_jit
def drop_on_rows(weights, particles, seed, counts):
    """Draw how many particles drop on each row, by the rows' weights."""
    _drop(weights, particles, seed, _BY_ROW, 0, counts)


@_jit
def drop_on_cells(on_row, seed, first, last, area):
    """Replace the weights in some rows by how many of each row's particles drop on each cell."""
    for row in range(first, last):
        _drop(area[row].copy(), on_row[row], seed, _BY_CELL, row, area[row])


@_jit
def _drop(weights, particles, seed, purpose, place, counts):
    """Draw how many of some particles drop on each place, one after the other."""
    state = np.empty(1, np.uint64)
    begin(state, seed, purpose, place)
    rest = np.empty(weights.size + 1)
    rest[-1] = 0
    for k in range(weights.size - 1, -1, -1):
        rest[k] = rest[k + 1] + weights[k]
    left = np.int64(particles)
    for k in range(weights.size):
        count = 0
        if left > 0 and weights[k] > 0:
            count = binomial(state, left, weights[k] / rest[k])
        counts[k] = count
        left -= count


@_jit
def walk(
    z, flat, by_row, exponent, seed, rows, free, place, stack, patience, donors, counts
):  # fmt: skip
    """Let the particles of cells walk on, once all that come from above are there.

    Parameters are those of `demsmith.core.hydrology._dispersal.disperse`, but ``counts``, the
    number of particles, in place of ``area``. The particles of a cell part by a multinomial draw,
    so that they walk as if each did so alone.
    """
    drops, ways = np.ones((8, BUNCH), np.float32), np.ones((6, BUNCH), np.float32)
    shares, best = np.empty((8, BUNCH), np.float32), np.empty(BUNCH, np.float32)
    receivers, totals = np.empty(BUNCH, np.uint8), np.empty(BUNCH)
    cells, targets = np.empty(BUNCH, np.int64), np.empty(8 * BUNCH, np.int64)
    state, to = np.empty(1, np.uint64), np.empty(8, np.int64)
    waiting, has = donors.reshape(-1), counts.reshape(-1)
    width = z.shape[1]
    way = offsets(width)
    bounds = free[0] * width, free[1] * width, rows[1] * width
    while patience > 0 and place[1] + 8 * BUNCH < stack.size:
        count = take(waiting, bounds[2], place, stack, cells)
        if count == 0:
            break
        patience -= count
        gather(cells, count, z, flat, by_row, donors, drops, ways)
        lower_neighbours(drops, receivers)
        mfd_shares(drops, ways, exponent, best, shares, totals)
        passed = 0
        for one in range(count):
            cell, bits = cells[one], receivers[one]
            if bits == 0:
                continue
            begin(state, seed, _WALK, cell)
            _part(state, np.int64(has[cell]), bits, shares[:, one], totals[one], to)
            for k in range(8):
                if bits >> k & 1:
                    has[cell + way[k]] += to[k]
                    targets[passed] = cell + way[k]
                    passed += 1
        release(targets, passed, bounds, place, stack, waiting)
    return place[1] == 0 and place[0] >= bounds[2]


@_jit
def _part(state, particles, bits, shares, total, to):
    """Draw how many of a cell's particles go to each neighbour."""
    to[:] = 0
    last = 7
    while not bits >> last & 1:
        last -= 1
    if particles <= _FEW:
        for _ in range(particles):
            left, k = uniform(state) * total, 0
            while k < last and left >= shares[k]:
                left -= shares[k]
                k += 1
            to[k] += 1
        return
    rest = total
    for k in range(last):
        to[k] = binomial(state, particles, shares[k] / rest)
        particles -= to[k]
        rest -= shares[k]
    to[last] = particles
