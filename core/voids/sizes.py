"""The size classes of voids, in which errors are learned and reported."""

import numpy as np

SIZE_CLASSES = ((1, 16), (17, 100), (101, 1000), (1001, None))
"""Smallest and largest void [cells] of each class."""


def size_class(cells):
    """Give the numbers of the size classes of voids of so many cells.

    Examples
    --------
    >>> size_class(np.array([1, 16, 17, 5000]))
    array([0, 0, 1, 3])
    """
    return np.searchsorted([largest for _, largest in SIZE_CLASSES[:-1]], cells)
