"""Selecting the cells of the largest scores, exactly so many."""

import numpy as np

from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.strips import strips

_DIGITS = 1 << 16


def largest(scores, among, count, *, progress=SILENT):
    """Find the cells of the largest scores, and those that tie for the last places.

    Parameters
    ----------
    scores : (H, W) float32 array
        0 or more, no NaN.
    among : (H, W) bool array
        The cells to choose from.
    count : int
        How many; from 1 to the number of cells in ``among``.
    progress : Progress

    Returns
    -------
    chosen : (H, W) bool array
        Cells whose score is larger than the last one chosen has.
    tied : (H, W) bool array
        Those that have it.
    places : int
        How many of the tied cells are still to be chosen.

    Examples
    --------
    >>> scores = np.array([[5, 2, 4, 2]], np.float32)
    >>> chosen, tied, places = largest(scores, np.ones((1, 4), bool), 3)
    >>> chosen.tolist(), tied.tolist(), places
    ([[True, False, True, False]], [[False, True, False, True]], 1)
    """
    # Floats that are not negative are ordered as their bits are: find the bits of the last one
    # chosen by counting their upper half, then the lower half.
    bits = scores.view(np.uint32)

    def pieces(part):
        for rows in strips(scores.shape):
            yield bits[rows][among[rows]]
            checkpoint(part, rows.stop / scores.shape[0])

    uppers = (piece >> 16 for piece in pieces(Span(progress, 0, 0.4)))
    upper, places = _last_digit(uppers, count)
    lowers = (piece[piece >> 16 == upper] % _DIGITS for piece in pieces(Span(progress, 0.4, 0.8)))
    lower, places = _last_digit(lowers, places)
    last = np.uint32(upper * _DIGITS + lower)
    checkpoint(progress, 0.8)
    return among & (bits > last), among & (bits == last), places


def _last_digit(pieces, count):
    """Give the digit of the ``count``-th largest number, and its place among those that share it.

    Parameters
    ----------
    pieces : iterable of (N,) arrays of integers below ``_DIGITS``
    count : int
    """
    frequency = np.zeros(_DIGITS, np.int64)
    for piece in pieces:
        frequency += np.bincount(piece, minlength=_DIGITS)
    from_top = frequency[::-1].cumsum()
    steps = int(np.searchsorted(from_top, count))
    digit = _DIGITS - 1 - steps
    return digit, int(count - from_top[steps] + frequency[digit])
