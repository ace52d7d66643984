"""Which tree makes the smallest file: trials on a sample of the tiles."""

import math

import numpy as np

from demsmith.core.codec.residual import encode_residual, fit_weights
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Muted, checkpoint

_SAMPLES = {"low": 3, "normal": 8, "high": 24}
"""Tiles that are coded to compare trees, and to learn weights, by effort."""

# Steps of a tree below a residual, by steps of the residual. Large ones are next to no tree: the
# best as long as noise is larger than steps, and there for overviews. Small ones make a surface
# that few cells depart from by more than the error. Between them lies nothing but coasts.
_FAINT = {"low": (150.0,), "normal": (600.0, 100.0, 20.0), "high": (600.0, 200.0, 70.0, 20.0)}
_DENSE = {"low": (1.5,), "normal": (2.2, 1.5, 1.1), "high": (4.0, 2.6, 2.0, 1.6, 1.3, 1.1, 0.9)}
_SMALLEST_DENSE = 3  # units of error, below which dense trees never paid

_ROUNDS = 14  # trials of steps for an error or a size
_NEARLY = 0.995  # of the size that is allowed


def best_tree(
    analysis, values, void, tiling, *, error, plain, effort, threads=None, progress=SILENT
):
    """Choose the tree below a residual.

    Parameters
    ----------
    analysis : pyramid.Analysis
    values : int32 (H, W)
    void : bool (H, W)
    tiling : Tiling
    error : int
    plain : int or None
        From `residual.plain_of`; trials tell whether it helps.
    effort : str
        ``low``, ``normal`` or ``high``.
    threads, progress
        As everywhere.

    Returns
    -------
    PyramidTree
    plain : int or None
    weights : float32 array
        Both for `encode_residual`.
    """
    factors = _FAINT[effort] + (_DENSE[effort] if error >= _SMALLEST_DENSE else ())
    tiles = sampled_tiles(void, tiling, effort)
    best = None
    work = dict(tiles=tiles, threads=threads, progress=Muted(progress))
    for done, factor in enumerate(factors):
        checkpoint(progress, done / len(factors))
        tree = analysis.tree(factor * (2 * error + 1))
        surface = tree.surface()
        coded = tree.sections(**work)
        base = sum(map(len, coded["tree"]))
        base += len(coded["root"][0]) * len(tiles) / tiling.count
        for level in dict.fromkeys((plain, None)):
            weights, size = fitted(values, void, surface, tiling, error=error, plain=level, **work)
            if best is None or base + size < best[0]:
                best = base + size, tree, level, weights
    return best[1:]


def sampled_tiles(void, tiling, effort):
    """Give some tiles that are not all void, evenly spread."""
    known = [tile for tile in range(tiling.count) if not void[tiling.slices(tile)].all()]
    count = min(_SAMPLES[effort], len(known))
    return [known[(2 * k + 1) * len(known) // (2 * count)] for k in range(count)]


def fitted(values, void, surface, tiling, *, error, plain, tiles, threads=None, progress=SILENT):
    """Learn the prediction's weights from some tiles, coded as they will be.

    Neighbours carry the errors that coding makes, which depend on the weights: so they are
    learned again from tiles that were coded, and kept if that makes these tiles smaller. (Where a
    tree leaves little, coded cells repeat what was predicted, and teach it.)

    Returns
    -------
    weights : float32 array
    size : int
        Bytes of these tiles' residual.
    """
    more = dict(error=error, plain=plain, tiles=tiles, threads=threads, progress=progress)
    weights = fit_weights(values, void, surface, _rounded(values, error))
    parts, decoded = encode_residual(values, void, surface, tiling, weights, **more)
    size = sum(map(len, parts))
    if not error:
        return weights, size
    elsewhere = np.ones_like(void)
    for tile in tiles:
        rows, columns = tiling.slices(tile)
        elsewhere[rows, columns] = void[rows, columns]
    again = fit_weights(values, elsewhere, surface, decoded)
    parts, _ = encode_residual(values, void, surface, tiling, again, **more)
    return min((weights, size), (again, sum(map(len, parts))), key=lambda pair: pair[1])


def _rounded(values, error):
    """Give values with about the errors that coding makes."""
    step = 2 * error + 1
    return np.rint(values / np.float32(step)).astype(np.int32) * np.int32(step)


def tree_of_rmse(analysis, surface, void, rmse, *, progress=SILENT):
    """Give the coarsest tree whose root mean square error at known cells is within ``rmse``."""
    # A step's error lies between a quarter of it, all coefficients rounded, and next to nothing.
    low, high = float(rmse) / 4, float(rmse) * 1024
    tree = analysis.tree(low)
    for done in range(_ROUNDS):
        checkpoint(progress, done / _ROUNDS)
        middle = math.sqrt(low * high)
        made = analysis.tree(middle)
        wrong = (made.surface() - surface)[~void].astype(np.float64)
        if math.sqrt(np.mean(wrong**2)) <= rmse:
            low, tree = middle, made
        else:
            high = middle
    return tree


def tree_of_bytes(analysis, size, *, threads=None, progress=SILENT):
    """Give the finest tree that takes at most ``size`` bytes.

    Raises
    ------
    InputError
        If none is so small.
    """
    trials = []  # (logarithm of the step, of the size), by step

    def tried(step):
        checkpoint(progress, min(len(trials) / _ROUNDS, 1))
        tree = analysis.tree(step)
        sections = tree.sections(threads=threads, progress=Muted(progress))
        taken = sum(len(part) for parts in sections.values() for part in parts)
        trials.append((math.log(step), math.log(taken)))
        trials.sort()
        return tree, taken

    tree, taken = tried(2.0**30)
    if taken > size:
        raise InputError(f"no tree is as small as {size} bytes; allow more")
    finest, taken = tried(2.0**-6)
    if taken <= size:
        return finest
    # Sizes fall about like a power of the step: where that puts the one wanted, but not so near
    # to an end of the interval that the next trial would tell little.
    for _ in range(_ROUNDS):
        wide = [at for at, taken in trials if taken > math.log(size)]
        narrow = [at for at, taken in trials if taken <= math.log(size)]
        (low, much), (high, little) = trials[len(wide) - 1], trials[len(trials) - len(narrow)]
        share = (much - math.log(size)) / (much - little)
        made, taken = tried(math.exp(low + (high - low) * min(max(share, 0.1), 0.9)))
        if taken <= size:
            tree = made
            if taken > _NEARLY * size:
                break
    return tree
