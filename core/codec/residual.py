"""The residual layer: what a tree leaves, tile by tile, within a maximum error."""

from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.codec import _residual
from demsmith.core.codec._coder import buffer_for
from demsmith.core.progress import SILENT

WEIGHTS = _residual.FEATURES
_FITTED_CELLS = 120_000
_MOST_VALUES = 1 << 24
_PLAIN_SHARE = 0.01  # of the known cells
_REACH = _residual.MARGIN


def encode_residual(
    values,
    void,
    surface,
    tiling,
    weights,
    *,
    error,
    plain=None,
    tiles=None,
    threads=None,
    progress=SILENT,
):
    """Code tiles within ``error`` units.

    Parameters
    ----------
    values : int32 (H, W)
    void : bool (H, W)
    surface : float32 (H, W)
        The tree's, as it will be decoded.
    tiling : Tiling
    weights : float (WEIGHTS,)
        Of the prediction, from `fit_weights`.
    error : int
    plain : int, optional
        From `plain_of`.
    tiles : list of int, optional
        Tiles to code; default: all. The parts of others are empty.
    threads, progress
        As everywhere.

    Returns
    -------
    parts : list of bytes
    decoded : int32 (H, W)
        What decoding gives; in tiles that were not coded, the values.
    """
    parts, decoded = [b""] * tiling.count, values.copy()
    around = np.pad(surface, 1, mode="edge")

    def encode(tile):
        rows, columns = tiling.slices(tile)
        cells = values[rows, columns].copy()
        below = around[rows.start : rows.stop + 2, columns.start : columns.stop + 2]
        parts[tile] = _code(cells, void[rows, columns], below, weights, error, plain, None)
        decoded[rows, columns] = cells

    tasks = [partial(encode, tile) for tile in (range(tiling.count) if tiles is None else tiles)]
    parallel.run(tasks, threads=threads, progress=progress)
    return parts, decoded


def decode_residual(void, around, weights, *, error, plain=None, part):
    """Decode a tile, or its first rows.

    Parameters
    ----------
    void : bool (h, w)
        Of as many rows as are wanted.
    around : float32 (h + 2, w + 2)
        The tree's surface with a cell around; beyond the raster its edge goes on.
    weights, error, plain
        As they were encoded.
    part : bytes
        Not trusted: whatever it is, some values result.

    Returns
    -------
    int32 (h, w)
        Voids have arbitrary values.
    """
    cells = np.zeros(void.shape, np.int32)
    _code(cells, void, around, weights, error, plain, part)
    return cells


def _code(cells, void, around, weights, error, plain, part):
    room = _residual.workspace(*cells.shape)
    decisions = _residual.DECISIONS_PER_CELL * cells.size
    data = buffer_for(decisions) if part is None else np.frombuffer(part, np.uint8)
    _residual.code_tile(
        cells, np.ascontiguousarray(void), np.ascontiguousarray(around), error,
        _residual.NO_PLAIN if plain is None else plain, _residual.fixed_weights(weights),
        data=data, decoding=part is not None, **room,
    )  # fmt: skip
    return data[: room["coder"][3]].tobytes() if part is None else b""


def plain_of(values, void):
    """Give the value that far more cells have than its neighbours would let expect, or None.

    The sea, a reservoir, a fill value that is no void.
    """
    known = values[~void]
    low, high = int(known.min()), int(known.max())
    if high - low >= _MOST_VALUES or high == low:
        return low if high == low else None
    counts = np.bincount(known - low, minlength=high - low + 1)
    most = int(counts.argmax())
    around = counts[max(most - 3, 0) : most + 4].sum() - counts[most]
    if counts[most] < _PLAIN_SHARE * known.size or counts[most] < around:
        return None
    return low + most


def fit_weights(values, void, surface, decoded):
    """Find the weights with which neighbours and tree predict a cell best.

    Weighted least squares: cells among rough neighbours count less, as their errors cost no more
    bits than those on even ground.

    Parameters
    ----------
    values : int32 (H, W)
    void : bool (H, W)
    surface : float32 (H, W)
        The tree's.
    decoded : int32 (H, W)
        Values as neighbours will have them: with errors.

    Returns
    -------
    float32 (WEIGHTS,)
        Rounded to half precision, as they are kept.
    """
    height, width = values.shape
    if height <= _REACH + 1 or width <= 2 * _REACH + 1:
        return _plain_weights()
    rows, columns = _sampled(height, width)
    known = ~void[rows, columns]
    rows, columns = rows[known], columns[known]
    rest = decoded - surface.astype(np.float64)
    middle = (rest[rows, columns - 1] + rest[rows - 1, columns]) / 2
    here = surface[rows, columns].astype(np.float64)
    features = [
        rest[rows + up, columns + right] - middle
        for up, right in zip(_residual.TAP_ROWS, _residual.TAP_COLUMNS, strict=True)
    ]
    features.append(-middle)
    features += [
        surface[rows + down, columns + right] - here
        for down, right in ((0, 1), (0, -1), (1, 0), (-1, 0))
    ]
    features = np.stack(features, axis=1)
    wanted = values[rows, columns] - here - middle
    counts = 1 / (1 + np.mean(features[:, : _residual.TAPS] ** 2, axis=1))
    weighted = features * counts[:, None]
    normal = weighted.T @ features
    ridge = 1e-5 * np.diag(normal) + 1e-9 * np.trace(normal) + 1e-9
    weights = np.linalg.solve(normal + np.diag(ridge), weighted.T @ wanted)
    if not np.all(np.abs(weights) < 100):
        return _plain_weights()
    return weights.astype(np.float16).astype(np.float32)


def _sampled(height, width):
    """Give the rows and columns of an even share of the cells whose taps lie in the raster."""
    every = max(int(np.sqrt(height * width / _FITTED_CELLS)), 1)
    rows, columns = np.mgrid[_REACH : height - 1 : every, _REACH : width - _REACH : every]
    columns = columns + rows % every  # not the same columns in each row
    rows, columns = rows.ravel(), np.minimum(columns.ravel(), width - _REACH - 1)
    return rows, columns


def _plain_weights():
    """Give the weights of the plane through three neighbours."""
    weights = np.zeros(WEIGHTS, np.float32)
    weights[:3] = 0.75, 0.75, -0.5
    return weights
