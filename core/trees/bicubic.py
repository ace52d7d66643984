"""How far a bicubic surface can go beyond its samples, and how steep it can be."""

import numpy as np

# Keys' cubic convolution: the most that the absolute weights of four samples sum to, and the most
# that those of their three differences sum to in the slope; both in the middle between samples.
_WEIGHTS, _SLOPES = 1.25, 1.5


def bicubic_limits(samples):
    """Bound the surface through samples.

    Parameters
    ----------
    samples : (..., rows, columns) array
        With two samples more on every side than the part of the surface that is meant.

    Returns
    -------
    low, high, by_row, by_column : (...) ndarray of float64
        Of the surface, and of the magnitude of its slopes per sample.

    Examples
    --------
    >>> low, high, by_row, by_column = bicubic_limits(np.ones((4, 4)))
    >>> float(low), float(high), float(by_row), float(by_column)
    (1.0, 1.0, 0.0, 0.0)
    """
    samples = np.asarray(samples, np.float64)
    least, most = samples.min(axis=(-2, -1)), samples.max(axis=(-2, -1))
    middle, reach = (least + most) / 2, _WEIGHTS**2 * (most - least) / 2
    by_row, by_column = (
        _WEIGHTS * _SLOPES * np.abs(np.diff(samples, axis=axis)).max(axis=(-2, -1), initial=0.0)
        for axis in (-2, -1)
    )
    return middle - reach, middle + reach, by_row, by_column
