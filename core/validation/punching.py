"""Artificial voids such as the SRTM's, made from smoothed noise and slope."""

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, checkpoint

# Scale [cells] and share of the raster of each kind of void, 5 % in all.
_MIXTURE = ((2, 0.012), (5, 0.016), (12, 0.016), (30, 0.01))


def punch_voids(values, *, known=None, share=0.05, seed=0, progress=SILENT):
    """Punch voids such as the SRTM's radar shadows: many small, few large, mostly on slopes.

    Four times, smoothed noise plus half the standardised slope is cut at a quantile; the union is
    about the share of the cells that is asked for.

    Parameters
    ----------
    values : (H, W) array
        Elevations.
    known : (H, W) bool array, optional
        Where they are known; only there are voids punched. Default: everywhere.
    share : float
        Of the cells to be punched, between 0 and 1.
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
    for done, (scale, part) in enumerate(_MIXTURE):
        checkpoint(progress, done / len(_MIXTURE))
        noise = gaussian_filter(rng.standard_normal(values.shape), scale)
        field = noise / (noise.std() or 1.0) + 0.5 * gaussian_filter(slope, scale)
        void |= field > np.quantile(field, 1 - part * (share / 0.05))
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
