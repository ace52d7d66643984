"""Judging a fill: artificial voids on known ground, and the error by void size."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.voids.labelling import find_voids

SIZE_CLASSES = ((1, 16), (17, 100), (101, 1000), (1001, None))
"""Smallest and largest void [cells] of each class in which errors are reported."""

# Scale [cells] and share of the raster of each kind of void.
_MIXTURE = ((2, 0.012), (5, 0.016), (12, 0.016), (30, 0.01))


def punch_voids(values, *, known=None, seed=0, progress=SILENT):
    """Punch voids such as the SRTM's radar shadows: many small, few large, mostly on slopes.

    Four times, smoothed noise plus half the standardised slope is cut at a quantile; the union is
    about 5 % of the cells.

    Parameters
    ----------
    values : (H, W) array
        Elevations.
    known : (H, W) bool array, optional
        Where they are known; only there are voids punched. Default: everywhere.
    seed : int
    progress : Progress

    Returns
    -------
    (H, W) bool array

    Raises
    ------
    InputError
        If nothing is known.
    Cancelled
        If ``progress`` asks to stop.
    """
    from scipy.ndimage import gaussian_filter

    rng = np.random.default_rng(seed)
    slope = _standard_slope(values, known)
    void = np.zeros(values.shape, bool)
    for done, (scale, share) in enumerate(_MIXTURE):
        checkpoint(progress, done / len(_MIXTURE))
        noise = gaussian_filter(rng.standard_normal(values.shape), scale)
        field = noise / (noise.std() or 1.0) + 0.5 * gaussian_filter(slope, scale)
        void |= field > np.quantile(field, 1 - share)
    checkpoint(progress, 1.0)
    return void if known is None else void & known


def _standard_slope(values, known):
    from scipy.ndimage import gaussian_filter

    ground = np.asarray(values, np.float32)
    if known is not None and not known.all():
        if not known.any():
            raise InputError("nothing is known, so no void can be punched")
        ground = np.where(known, ground, np.float32(np.median(ground[known])))
    if min(ground.shape) < 2:
        return np.zeros(ground.shape)
    slope = np.hypot(*np.gradient(gaussian_filter(ground, 2)))
    return (slope - slope.mean()) / (slope.std() or 1.0)


@dataclass(frozen=True)
class SizeError:
    """The error of a fill in the voids of one size class.

    Attributes
    ----------
    smallest, largest : int
        Cells of the smallest and largest void of the class; ``largest`` None: no limit.
    voids, cells : int
    rmse, bias : float
        Root mean square and mean of filled less true elevation; NaN if there is no cell.
    """

    smallest: int
    largest: int | None
    voids: int
    cells: int
    rmse: float
    bias: float


def errors_by_size(filled, truth, void):
    """Score a fill by void size.

    Parameters
    ----------
    filled, truth : (H, W) arrays
        Elevations.
    void : (H, W) bool array
        The cells that were filled.

    Returns
    -------
    list of SizeError
        One for each of `SIZE_CLASSES`, then one for all voids.

    Examples
    --------
    >>> void = np.zeros((4, 4), bool)
    >>> void[1, 1:3] = True
    >>> truth = np.zeros((4, 4))
    >>> [(each.voids, each.rmse) for each in errors_by_size(truth + 3.0, truth, void)][-1]
    (1, 3.0)
    """
    voids = find_voids(void)
    labels = voids.labels[void] - 1
    error = filled[void].astype(np.float64) - truth[void]
    size = voids.cells[labels]
    out = []
    for smallest, largest in (*SIZE_CLASSES, (1, None)):
        top = np.inf if largest is None else largest
        inside = error[(size >= smallest) & (size <= top)]
        count = int(((voids.cells >= smallest) & (voids.cells <= top)).sum())
        rmse = float(np.sqrt((inside**2).mean())) if inside.size else float("nan")
        bias = float(inside.mean()) if inside.size else float("nan")
        out.append(SizeError(smallest, largest, count, inside.size, rmse, bias))
    return out
