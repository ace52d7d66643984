"""Ground for water to run over, and slow, plain ways to tell where it runs."""

import heapq
import itertools
import math

import numpy as np
from hypothesis import strategies as st

# East, south-east, south, ... north-east: the bits of ESRI's codes.
STEPS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))


@st.composite
def grounds(draw, side=18):
    """Elevations, voids, and ground metres per cell by row: (z, void, dx, dy)."""
    rows, columns = draw(st.integers(1, side)), draw(st.integers(1, side))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    dtype = draw(st.sampled_from(["float32", "float64"]))
    levels = draw(st.sampled_from([0, 1, 2, 4, 30]))  # 0: no two cells are level
    if levels:
        z = rng.integers(-1, levels, (rows, columns)).astype(dtype)
    else:
        z = rng.normal(size=(rows, columns)).astype(dtype)
    void = rng.random(z.shape) < draw(st.sampled_from([0, 0, 0.05, 0.4, 1]))
    if draw(st.booleans()):
        z[void] = np.nan
    return z, void, rng.uniform(10, 40, rows), rng.uniform(10, 40, rows)


def large_basin(rows=70, columns=90, *, levels=25, seed=2):
    """Integer elevations with wide flats, nested depressions and a sea, as float32."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:rows, :columns] / 9.0
    z = sum(
        np.sin(k * x + rng.uniform(0, 6)) * np.cos(k * y + rng.uniform(0, 6)) for k in (1, 2, 3)
    )
    z = np.floor(levels * z / 4)
    return np.maximum(z, np.floor(-levels / 5)).astype(np.float32)


def around(row, column, shape):
    """The neighbours of a cell that are on the raster, with their bit: (bit, row, column)."""
    for bit, (down, right) in enumerate(STEPS):
        r, c = row + down, column + right
        if 0 <= r < shape[0] and 0 <= c < shape[1]:
            yield bit, r, c


def outlets(void):
    """Known cells at the raster's edge or beside a void."""
    beyond = np.pad(void, 1, constant_values=True)
    rows, columns = void.shape
    near = np.zeros_like(void)
    for down, right in itertools.product(range(3), range(3)):
        near |= beyond[down : down + rows, right : right + columns]
    return near & ~void


def priority_flood(z, void, sinks=()):
    """Fill depressions by the Priority-Flood itself, from outlets and sinks."""
    filled, done = z.copy(), void.copy()
    queue = [(z[cell], *cell) for cell in map(tuple, np.argwhere(outlets(void)))]
    queue += [(z[cell], *cell) for cell in sinks]
    for _, row, column in queue:
        done[row, column] = True
    heapq.heapify(queue)
    while queue:
        level, row, column = heapq.heappop(queue)
        for _, r, c in around(row, column, z.shape):
            if not done[r, c]:
                done[r, c] = True
                filled[r, c] = max(z[r, c], level)
                heapq.heappush(queue, (filled[r, c], r, c))
    return filled


def distance(bit, row, dx, dy):
    """Ground metres to a neighbour."""
    down, right = STEPS[bit]
    return dx[row] if not down else dy[row] if not right else math.hypot(dx[row], dy[row])


def steepest(surface, row, column, dx, dy, neighbours):
    """Code of the first neighbour of steepest descent, and the slope; 0 if none is lower."""
    code, steep = 0, 0.0
    for bit, r, c in neighbours:
        drop = float(surface[row, column]) - float(surface[r, c])
        slope = drop / distance(bit, row, dx, dy)
        if slope > steep:
            code, steep = 1 << bit, slope
    return code, steep


def step(code, row, column):
    """The cell that a code leads to."""
    down, right = STEPS[int(code).bit_length() - 1]
    return row + down, column + right


def ends(codes):
    """Follow the codes from each cell: flat index of where it ends; -1 for a way without an end."""
    code = codes.ravel()
    to = np.arange(codes.size)
    for bit, (down, right) in enumerate(STEPS):
        to[code == 1 << bit] += down * codes.shape[1] + right
    for _ in range(codes.size.bit_length()):
        to = to[to]
    stays = np.isin(code, (0, 247))
    return np.where(stays[to], to, -1)


class Stop:
    """A progress that cancels after so many questions, and keeps what was reported."""

    def __init__(self, after=0):
        self.left, self.seen = after, []

    def report(self, fraction):
        self.seen.append(fraction)

    def cancelled(self):
        self.left -= 1
        return self.left < 0
