"""Kernels that measure how rough ground is and find cells that stand out from it."""

import numba
import numpy as np

_JIT = dict(nogil=True, cache=True, error_model="numpy")

UPPER_QUARTER = 0.75
"""The quantile of the misfits that roughness is: a fault in the neighbourhood leaves it be."""

# How far [cells] the ground beyond a cluster or a void is looked for.
_FAR = 8
# Radius [cells] of the square from which a place's roughness is taken.
_AROUND = 7
# A ray takes so many steps outwards: clusters of three by three cells have all their edges there.
_STEPS = 3
# Ground farther than this says too little of the cell before it.
_LONGEST_STEP = 2
# The square of this radius is left out of a place's roughness: a cluster and its neighbours.
_OWN = 4
# Weight, in cells, of the usual roughness in that of a place.
_PRIOR = 100.0
_MOST_CELLS = (2 * _AROUND + 1) ** 2 - (2 * _OWN + 1) ** 2
# The eight directions; of the first four, no two are opposite.
_DOWN = (0, 1, 1, 1, 0, -1, -1, -1)
_RIGHT = (1, 1, 0, -1, -1, -1, 0, 1)
_FEWEST_RAYS = 5


@numba.njit(**_JIT)
def sample_misfits(values, void, out):
    """Write the misfits of the cells that have four known pairs of neighbours; count them."""
    pairs = np.empty(4)
    count = 0
    for row in range(values.shape[0]):
        for column in range(values.shape[1]):
            misfit = _misfit(values, void, row, column, 4, pairs)
            if misfit >= 0:
                out[count] = misfit
                count += 1
    return count


@numba.njit(**_JIT)
def _misfit(values, void, row, column, fewest, pairs):
    """Give how far a cell lies from the middle of its opposite neighbours.

    That is the magnitude of the median over the pairs of opposite neighbours, of which at least
    ``fewest`` of the four must be known. -1 where they are not, in voids, and where all are equal:
    water and made ground tell nothing of how rough ground is.

    Parameters
    ----------
    pairs : (4,) float64 array
        To work in.
    """
    if void[row, column]:
        return -1.0
    height, width = values.shape
    here = np.float64(values[row, column])
    count, flat = 0, True
    for k in range(4):
        i1, j1 = row + _DOWN[k], column + _RIGHT[k]
        i2, j2 = row - _DOWN[k], column - _RIGHT[k]
        if min(i1, i2, j1, j2) < 0 or max(i1, i2) >= height or max(j1, j2) >= width:
            continue
        if void[i1, j1] or void[i2, j2]:
            continue
        first, second = np.float64(values[i1, j1]), np.float64(values[i2, j2])
        flat &= first == here and second == here
        # Sorted in: few enough that a call to sort() would cost more.
        misfit = here - (first + second) / 2
        at = count
        while at > 0 and pairs[at - 1] > misfit:
            pairs[at] = pairs[at - 1]
            at -= 1
        pairs[at] = misfit
        count += 1
    if count < fewest or flat:
        return -1.0
    return abs(pairs[(count - 1) // 2] + pairs[count // 2]) / 2


@numba.njit(**_JIT)
def _local_roughness(values, void, row, column, usual, pairs, around):
    """Give the roughness of the ground around a cell, the usual one where little is known.

    Parameters
    ----------
    around : (_MOST_CELLS,) float64 array
        To work in.
    """
    height, width = values.shape
    count = 0
    for i in range(max(row - _AROUND, 0), min(row + _AROUND + 1, height)):
        for j in range(max(column - _AROUND, 0), min(column + _AROUND + 1, width)):
            if max(abs(i - row), abs(j - column)) > _OWN:
                misfit = _misfit(values, void, i, j, 4, pairs)
                if misfit >= 0:
                    around[count] = misfit
                    count += 1
    if count == 0:
        return usual
    at = int(UPPER_QUARTER * (count - 1))
    quartile = np.partition(around[:count], at)[at]
    return (_PRIOR * usual + count * quartile) / (_PRIOR + count)


@numba.njit(**_JIT)
def _drop(values, void, row, column, least, enough):
    """Give by how much a cell, or a small cluster it is in, stands above all ground around it.

    Returns
    -------
    drop : float
        The largest step down along a ray, of the eight rays the one where it is least; negative
        for cells that lie below. Nought if that is less than ``least``, or than ``enough`` where
        the ground is not level.
    rays : int
        How many rays had ground.
    level : bool
        Whether that ground ends at the same elevation on all of them, as water does.
    """
    above, below = np.inf, np.inf
    rays, level, shore = 0, True, 0.0
    for k in range(8):
        up, down, end, steps = _steps(values, void, row, column, _DOWN[k], _RIGHT[k])
        if steps == 0:
            continue
        if rays == 0:
            shore = end
        level &= end == shore
        rays += 1
        above, below = min(above, up), min(below, down)
        needed = least if level else enough
        if above < needed and below < needed:
            return 0.0, rays, level
    if rays == 0:
        return 0.0, 0, False
    return (above if above > below else -below), rays, level


@numba.njit(**_JIT)
def _steps(values, void, row, column, down, right):
    """Give the largest steps down and up along a ray, its last elevation, and how many there are.

    The ground outside is drawn on inwards, as a line through two cells one after the other, to the
    cell before them; the step is from there. A void cell is stepped over, more end the ray.
    """
    height, width = values.shape
    highest, deepest = -np.inf, -np.inf
    x0, z0 = 0, np.float64(values[row, column])
    x1, z1 = 0, z0
    steps = 0
    for x in range(1, _FAR + 1):
        i, j = row + x * down, column + x * right
        if i < 0 or j < 0 or i >= height or j >= width:
            break
        if void[i, j]:
            continue
        z2 = np.float64(values[i, j])
        if x1 > 0:
            near, far = x1 - x0, x - x0
            if near > _LONGEST_STEP:
                break
            step = z0 - z1 - (z1 - z2) * near / (far - near)
            step /= np.sqrt(near * far / 2)  # ground bends away in proportion
            highest, deepest = max(highest, step), max(deepest, -step)
            steps += 1
            x0, z0 = x1, z1
        x1, z1 = x, z2
        if steps == _STEPS:
            break
    return highest, deepest, z1, steps


@numba.njit(**_JIT)
def mark_outliers(values, void, begin, end, usual, factor, least, rock, mask):
    """Mark the spikes and wells of some rows.

    Parameters
    ----------
    begin, end : int
        Rows; ``mask`` is written only there.
    usual : float
        The usual roughness.
    factor, least : float
        A cell must stand out by ``factor`` times the roughness, and by ``least``.
    rock : (H,) float64 array
        How high a rock may rise out of level water, by row.
    mask : (H, W) bool array
    """
    pairs, around = np.empty(4), np.empty(_MOST_CELLS)
    # No place is less rough than this.
    enough = max(least, factor * usual * _PRIOR / (_PRIOR + _MOST_CELLS))
    for row in range(begin, end):
        for column in range(values.shape[1]):
            if void[row, column]:
                continue
            drop, rays, level = _drop(values, void, row, column, least, enough)
            if drop == 0 or rays < _FEWEST_RAYS:
                continue
            if level:
                mask[row, column] = drop < 0 or drop > rock[row]
                continue
            needed = factor * np.sqrt(8 / rays)  # fewer witnesses have to say it louder
            rough = _local_roughness(values, void, row, column, usual, pairs, around)
            mask[row, column] = abs(drop) > needed * rough


@numba.njit(**_JIT)
def keep_those_among_their_like(values, void, cells, mask):
    """Unmark the outliers beside which what stays is much like them.

    A tip of ground between voids may lie below all rays that have ground, and yet be the valley
    that goes on under the void. So the neighbours that are known and not marked must lie, in the
    median, at least a third of the step away, unless as many are marked: a cluster's inner cells
    have no others.

    Parameters
    ----------
    cells : (N, 2) int64 array
        The marked ones.
    mask : (H, W) bool array
    """
    alike = np.zeros(cells.shape[0], np.bool_)
    for n in range(cells.shape[0]):
        alike[n] = _among_its_like(values, void, mask, cells[n, 0], cells[n, 1])
    for n in range(cells.shape[0]):
        if alike[n]:
            mask[cells[n, 0], cells[n, 1]] = False


@numba.njit(**_JIT)
def _among_its_like(values, void, mask, row, column):
    height, width = values.shape
    staying = np.empty(8)
    count, marked = 0, 0
    for k in range(8):
        i, j = row + _DOWN[k], column + _RIGHT[k]
        if not (0 <= i < height and 0 <= j < width) or void[i, j]:
            continue
        if mask[i, j]:
            marked += 1
        else:
            staying[count] = values[i, j]
            count += 1
    if count <= marked:
        return False
    step, _, _ = _drop(values, void, row, column, 0.0, 0.0)
    return abs(values[row, column] - np.median(staying[:count])) < abs(step) / 3


@numba.njit(**_JIT)
def mark_noisy(values, void, begin, end, usual, factor, rim, mask):
    """Mark the rim cells of some rows that lie far from the middle of their neighbours.

    That is, by more than ``factor`` times the roughness around; other parameters are those of
    `mark_outliers`.

    Parameters
    ----------
    rim : (H, W) bool array
    """
    pairs, around = np.empty(4), np.empty(_MOST_CELLS)
    for row in range(begin, end):
        for column in range(values.shape[1]):
            if rim[row, column]:
                misfit = _misfit(values, void, row, column, 1, pairs)
                if misfit > 0:
                    rough = _local_roughness(values, void, row, column, usual, pairs, around)
                    mask[row, column] = misfit > factor * rough
