"""How far an auxiliary raster lies beside the target: phase correlation, refined by nlopt."""

import math

import numpy as np

from demsmith.core.progress import SILENT, Span, checkpoint

_FARTHEST = 32
"""Cells within which the shift is looked for."""

_LONGEST = 33
"""Cells, a side of the squares whose mean is taken off the ground before it is compared."""

_SHORTEST = 0.64
"""Cells, the scale of the Gaussian by which the correlation is smoothed, for noise is shorter."""

_NEAR = 1.5
"""Cells about the whole number of the coarse shift within which it is refined."""

_SMOOTHING = 1.5
_SAMPLES = 16_000
_EVALUATIONS = 40


def coarse_shift(pairs, *, progress=SILENT):
    """Find the shift in whole cells by phase correlation of all windows together.

    Kuglin and Hines 1975, "The phase correlation image alignment method"; of ground without its
    longest and shortest waves, the normalised cross-spectra of all windows summed.

    Parameters
    ----------
    pairs : list of (ground, known, auxiliary, known)
        Elevations of a window, the same of the auxiliary on it: (h, w) arrays with their masks.
    progress : Progress

    Returns
    -------
    (int, int)
        Rows and columns to add to a cell's place to find it in the auxiliary.
    """
    from scipy import fft

    side = [fft.next_fast_len(max(pair[0].shape[axis] for pair in pairs)) for axis in range(2)]
    spectrum = 0
    for number, (ground, ground_known, other, other_known) in enumerate(pairs):
        checkpoint(progress, number / len(pairs))
        product = np.conj(fft.rfft2(_band(ground, ground_known), side))
        product *= fft.rfft2(_band(other, other_known), side)
        spectrum = spectrum + product / np.maximum(np.abs(product), np.finfo(float).tiny)
    wave = np.hypot(fft.fftfreq(side[0])[:, None], fft.rfftfreq(side[1]))
    correlation = fft.irfft2(spectrum * np.exp(-2 * (np.pi * _SHORTEST * wave) ** 2), side)
    far = [min(_FARTHEST, size // 4) for size in side]
    near = np.roll(correlation, far, (0, 1))[: 2 * far[0] + 1, : 2 * far[1] + 1]
    row, column = np.unravel_index(np.argmax(near), near.shape)
    return int(row) - far[0], int(column) - far[1]


def _band(values, known):
    """Keep the ground's shorter waves, fading towards voids and the window's edge."""
    from scipy.ndimage import uniform_filter

    if not known.any():
        return np.zeros(values.shape)
    weight = known.astype(np.float64)
    ground = np.where(known, values - values[known].mean(), 0.0)
    around = uniform_filter(ground, _LONGEST, mode="constant")
    around /= np.maximum(uniform_filter(weight, _LONGEST, mode="constant"), 1e-3)
    fade = [np.hanning(size + 2)[1:-1] for size in values.shape]
    return (ground - around) * weight * np.outer(*fade)


def fine_shift(pairs, *, progress=SILENT):
    """Find the rest of the shift, a part of a cell, as that of the least spread of the delta.

    Both are smoothed alike first, so that the interpolation between cells makes no difference,
    and a plane is taken off the delta.

    Parameters
    ----------
    pairs : list of (ground, known, auxiliary, known)
        As in `coarse_shift`, the auxiliary already moved by the coarse shift.
    progress : Progress

    Returns
    -------
    (float, float)
        Rows and columns to add, at most 1.5 each; 0 where nothing can be compared.
    """
    from demsmith.core.tuning.search import Axis, search

    grounds, others, cells, planes = [], [], [], []
    for number, pair in enumerate(pairs):
        checkpoint(progress, 0.2 * number / len(pairs))
        ground, other, usable = _smoothed(*pair)
        chosen = _some(usable, _SAMPLES // len(pairs))
        grounds.append(ground[chosen])
        others.append(other)
        cells.append(chosen)
        planes.append(_plane_basis(*chosen))
    if not sum(each.size for each in grounds):
        return 0.0, 0.0

    def deltas(row, column):
        moved = (
            _interpolated(other, each, row, column)
            for other, each in zip(others, cells, strict=True)
        )
        return np.concatenate(
            [
                _without(plane, ground - there)
                for plane, ground, there in zip(planes, grounds, moved, strict=True)
            ]
        )

    scale = robust_spread(deltas(0.0, 0.0)) or 1.0
    axes = [Axis(name, 0.0, -_NEAR, _NEAR) for name in ("row", "column")]
    found = search(
        lambda at, _: np.log1p((deltas(**at) / scale) ** 2).sum(), axes,
        evaluations=_EVALUATIONS, progress=Span(progress, 0.2, 1),
    )  # fmt: skip
    return found["row"], found["column"]


def robust_spread(values):
    """Standard deviation of the bulk of some numbers, by their median absolute deviation.

    Examples
    --------
    >>> round(robust_spread(np.array([-1.0, 0.0, 1.0, 1e6])), 4)
    1.4826
    """
    if not values.size:
        return 0.0
    return float(1.4826 * np.median(np.abs(values - np.median(values))))


def _smoothed(ground, ground_known, other, other_known):
    """Smooth both; usable are cells with known ground all around as far as the shift reaches."""
    from scipy.ndimage import gaussian_filter, minimum_filter

    both = ground_known & other_known
    usable = minimum_filter(both, 2 * math.ceil(4 * _SMOOTHING + _NEAR) + 1, mode="constant")
    mean = ground[both].mean() if both.any() else 0.0
    smooth = [
        gaussian_filter(np.where(both, each - mean, 0.0), _SMOOTHING) for each in (ground, other)
    ]
    return *smooth, usable


def _some(usable, count):
    """Choose about ``count`` usable cells, spread evenly."""
    flat = np.flatnonzero(usable)
    if flat.size > count:
        flat = np.random.default_rng(0).choice(flat, count, replace=False)
        flat.sort()
    return np.unravel_index(flat, usable.shape)


def _interpolated(values, cells, row, column):
    from scipy.ndimage import map_coordinates

    return map_coordinates(
        values, [cells[0] + row, cells[1] + column], order=3, prefilter=False, mode="nearest"
    )


def _plane_basis(rows, columns):
    basis = np.stack([np.ones(rows.size), rows, columns], axis=1)
    return np.linalg.qr(basis)[0]


def _without(basis, values):
    """Take the plane off, found without the farthest of the values."""
    middle = np.median(values) if values.size else 0.0
    reach = 3 * robust_spread(values)
    centred = values - middle
    return centred - basis @ (basis.T @ np.clip(centred, -reach, reach))
