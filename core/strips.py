"""Strips of rows: the pieces in which a raster is worked on."""

_STRIP_CELLS = 1 << 19


def strips(shape):
    """Cut a raster's rows into strips of about half a million cells.

    Examples
    --------
    >>> strips((5, 1 << 18))
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    rows, columns = shape
    step = max(1, _STRIP_CELLS // columns)
    return [slice(start, min(start + step, rows)) for start in range(0, rows, step)]
