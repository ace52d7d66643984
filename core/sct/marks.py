"""What void cells hold, kept as it was, and kept apart from what cells with a value hold."""

import zlib
from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.raster.nodata import HUGE, INTEGER_SENTINELS, as_stored

_DOWN = 255
"""In a map: the value lies below the mark that it was rounded to."""

MOST_MARKS = 250


@dataclass(frozen=True, eq=False)
class Marks:
    """The values of void cells.

    Attributes
    ----------
    values : (K,) array of the raster's data type
        The most frequent one first; none where there is no void.
    nodata : scalar of that type or None
        The nodata tag.
    """

    values: np.ndarray
    nodata: object = None

    def nudges(self):
        """List the marks that values must not fall on, and the next values up and down.

        Returns
        -------
        list of (mark, up, down)
        """
        refused = (*self.values, self.nodata, *_sentinels(self.values.dtype))
        refused = {mark.item() for mark in refused if mark is not None and np.isfinite(mark)}
        return [
            (mark, _next(mark, refused, self.values.dtype, 1),
             _next(mark, refused, self.values.dtype, -1))
            for mark in sorted(refused)
        ]  # fmt: skip

    def apply(self, values, void, classes=None):
        """Put marks into void cells, and move other values off them, in place.

        Parameters
        ----------
        values : (h, w) array
        void : (h, w) bool array
        classes : (h, w) uint8 array, optional
            As `classes` gives it; default: 0 everywhere.
        """
        for mark, up, down in self.nudges():
            hit = values == mark
            hit &= ~void
            if hit.any():
                values[hit] = up if down is None else down if up is None else (
                    up if classes is None
                    else np.where(classes[hit] == _DOWN, down, up).astype(values.dtype)
                )  # fmt: skip
        if not self.values.size:
            values[void] = 0
        elif classes is None:
            values[void] = self.values[0]
        else:
            values[void] = self.values[np.minimum(classes[void], self.values.size - 1)]

    def classes(self, original, decoded, void):
        """Tell what `apply` has to know of cells.

        Parameters
        ----------
        original, decoded : (h, w) arrays
            Values before and after; of voids, only those before matter.
        void : (h, w) bool array

        Returns
        -------
        (h, w) uint8 array
            Of void cells the number of their mark, of values on a mark whether they are below it;
            0 elsewhere, and nearly everywhere.
        """
        classes = np.zeros(original.shape, np.uint8)
        if self.values.size > 1:
            held = original[void]
            number = np.zeros(held.size, np.uint8)
            for index, mark in enumerate(self.values[1:], start=1):
                number[(held == mark) if mark == mark else np.isnan(held)] = index
            classes[void] = number
        for mark, _, down in self.nudges():
            if down is not None:
                classes[(decoded == mark) & ~void & (original < mark)] = _DOWN
        return classes


def marks_of(values, void, meta):
    """Find what the void cells of a raster hold.

    Values that mean void by themselves are kept: the nodata tag, numbers that are not finite or
    huge, and the sentinels of integers. Cells that are void for another reason, such as a mask,
    get the tag, or one that is chosen.

    Parameters
    ----------
    values, void : (H, W) arrays
    meta : BandMeta

    Returns
    -------
    Marks
    list of str
        What the user should know, one sentence each.

    Raises
    ------
    InputError
        If a mark is needed and the data type has no value left for one.
    """
    tag = None if meta.nodata is None else as_stored(meta.nodata, values.dtype)
    held, counts = np.unique(values[void], return_counts=True)
    speaks = _means_void(held, tag)
    own = held[speaks][np.argsort(-counts[speaks], kind="stable")]
    mute = int(counts[~speaks].sum()) + int(counts[speaks].sum() if own.size > MOST_MARKS else 0)
    notes = []
    if own.size > MOST_MARKS:
        own = own[:0]
    if mute:
        default = tag if tag is not None else _spare(values, void)
        own = np.array([default, *own[own != default]], values.dtype)
        tag = default if tag is None else tag
        notes.append(
            f"{mute} cells are voids by a mask or an option, or hold one of many huge numbers; "
            f"they get the value {default}"
        )
    if own.size > 1:
        listed = ", ".join(str(mark) for mark in own)
        notes.append(f"its voids hold {own.size} different values ({listed}); each keeps its own")
    return Marks(own, tag), notes


def packed_classes(classes):
    """Deflate the classes of a tile; nothing if all are 0."""
    return zlib.compress(classes.tobytes(), 9) if classes.any() else b""


def unpacked_classes(data, shape):
    """Give the classes of a tile back.

    Raises
    ------
    InputError
        If the data are not of this shape.
    """
    if not data:
        return np.zeros(shape, np.uint8)
    inflate = zlib.decompressobj()
    cells = shape[0] * shape[1]
    try:
        plain = inflate.decompress(data, cells + 1)
    except zlib.error:
        plain = b""
    if len(plain) != cells or not inflate.eof:
        raise InputError("the values of its voids are damaged")
    return np.frombuffer(plain, np.uint8).reshape(shape)


def _sentinels(dtype):
    if dtype.kind != "i":
        return []
    marks = (as_stored(value, dtype) for value in INTEGER_SENTINELS)
    return [mark for mark in marks if mark is not None]


def _means_void(held, tag):
    speaks = np.zeros(held.shape, bool) if tag is None else held == tag
    if held.dtype.kind == "f":
        with np.errstate(invalid="ignore"):
            return speaks | ~(np.abs(held) <= HUGE)
    return speaks | np.isin(held, _sentinels(held.dtype))


def _spare(values, void):
    """Choose a mark where there is no tag, one that no value has."""
    if values.dtype.kind == "f":
        return values.dtype.type(np.nan)
    known, limits = values[~void], np.iinfo(values.dtype)
    low, high = known.min(), known.max()
    for value in (*INTEGER_SENTINELS, limits.max, limits.min):
        mark = as_stored(value, values.dtype)
        if mark is not None and not low <= mark <= high:
            return mark
    raise InputError(
        f"{values.dtype} has no value left to mark voids with: convert it to a larger type"
    )


def _next(mark, refused, dtype, step):
    """Give the next value up or down that is no mark; None if there is none."""
    limits = np.finfo(dtype) if dtype.kind == "f" else np.iinfo(dtype)
    while limits.min <= mark <= limits.max:
        if dtype.kind == "f":
            with np.errstate(over="ignore", under="ignore"):
                mark = np.nextafter(dtype.type(mark), dtype.type(step * np.inf)).item()
        else:
            mark += step
        if mark not in refused:
            return mark if limits.min <= mark <= limits.max else None
    return None
