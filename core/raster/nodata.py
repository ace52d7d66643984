"""Which cells of a band are voids, and which only look odd.

A void is a cell the file tags as nodata, masks out or leaves without a number, a cell the user
names, or one that holds a value nobody ever measured: -32768 or -32767 in integers, where SRTM,
DTED and their converters put them whatever the tag says, and magnitudes beyond 1e30 in floats.
Other impossible heights are counted and named, and left alone: only the user can tell.
"""

import numpy as np

INTEGER_SENTINELS = (-32768, -32767)
"""Void marks of SRTM (.hgt) and DTED, counted as voids in any signed integer band."""

HUGE = 1e30
"""Floats beyond this magnitude are fill values, like the -3.4e38 of ESRI's grids."""

LOWEST_LAND, HIGHEST_LAND = -500.0, 9000.0
"""Heights between which all land of the Earth lies [m], with a margin for noise."""

_METRES = {
    "m": 1.0,
    "metre": 1.0,
    "meter": 1.0,
    "metres": 1.0,
    "meters": 1.0,
    "ft": 0.3048,
    "foot": 0.3048,
    "feet": 0.3048,
    "us-ft": 1200 / 3937,
    "ftus": 1200 / 3937,
    "us survey foot": 1200 / 3937,
    "us survey feet": 1200 / 3937,
    "cm": 0.01,
    "dm": 0.1,
    "mm": 0.001,
    "km": 1000.0,
}


def metres_per_unit(unit, default=None):
    """Metres in a unit of height, as files spell it; ``default`` for an unknown one.

    Examples
    --------
    >>> metres_per_unit("Feet")
    0.3048
    """
    return _METRES.get(unit.strip().lower(), default)


def as_stored(value, dtype):
    """Give a number as a band of this type would store it; ``None`` if it cannot.

    Examples
    --------
    >>> as_stored(-9999, np.uint8) is None
    True
    """
    dtype = np.dtype(dtype)
    if dtype.kind == "f":
        with np.errstate(over="ignore"):
            return dtype.type(value)
    limits = np.iinfo(dtype)
    if value != value or value in (np.inf, -np.inf) or int(value) != value:
        return None
    return dtype.type(int(value)) if limits.min <= value <= limits.max else None


class VoidFinder:
    """Finds the voids of a band, block by block, and counts what deserves a word.

    Parameters
    ----------
    meta : BandMeta
        The band's data type, nodata tag, scale, offset and unit.
    nodata : float or iterable of float
        Further stored values that mean void.
    below, above : float or None
        Real values (scaled and offset) at or below, at or above which cells are void.
    metres : float or None
        Metres in the unit of the heights; 1 is assumed if unknown.
    earth : bool
        Whether the heights are the Earth's, so that impossible ones can be told.
    noun : str
        What holds the values, for the notes.
    """

    def __init__(
        self, meta, *, nodata=(), below=None, above=None, metres=None, earth=True, noun="cell"
    ):
        self._meta = meta
        self._below, self._above = below, above
        self._noun = noun
        self._unit_known = metres is not None
        self._lowest = LOWEST_LAND / (metres or 1.0) if earth else -np.inf
        self._highest = HIGHEST_LAND / (metres or 1.0) if earth else np.inf
        tag = () if meta.nodata is None else (meta.nodata,)
        nodata = nodata if np.iterable(nodata) else (nodata,)
        self._marks = [
            mark
            for mark in (as_stored(value, meta.dtype) for value in (*tag, *nodata))
            if mark is not None and mark == mark
        ]
        self._sentinels = [
            mark
            for mark in (as_stored(value, meta.dtype) for value in INTEGER_SENTINELS)
            if meta.dtype.kind == "i" and mark is not None and mark not in self._marks
        ]
        self._sentinel_counts = dict.fromkeys(self._sentinels, 0)
        self._huge = 0
        self._odd = 0
        self._odd_range = (np.inf, -np.inf)

    def find(self, values, void):
        """Add the voids among a block's ``values`` to the flags in ``void``, in place."""
        for mark in self._marks:
            void |= values == mark
        if values.dtype.kind == "f":
            self._find_unreal(values, void)
        self._find_beyond_thresholds(values, void)
        for mark in self._sentinels:
            found = values == mark
            if found.any():
                self._sentinel_counts[mark] += np.count_nonzero(found & ~void)
                void |= found
        self._note_odd(values, void)

    def _find_unreal(self, values, void):
        unreal = ~(np.abs(values) <= HUGE)  # NaN compares false
        if unreal.any():
            self._huge += np.count_nonzero(unreal & ~void & np.isfinite(values))
            void |= unreal

    def _find_beyond_thresholds(self, values, void):
        if self._below is None and self._above is None:
            return
        real = self._meta.real(values.astype(np.float64))
        with np.errstate(invalid="ignore"):
            if self._below is not None:
                void |= real <= self._below
            if self._above is not None:
                void |= real >= self._above

    def _note_odd(self, values, void):
        ends = self._meta.real(np.array([values.min(), values.max()], dtype=np.float64))
        if self._lowest <= ends.min() and ends.max() <= self._highest:
            return
        real = self._meta.real(values[~void].astype(np.float64))
        odd = real[(real < self._lowest) | (real > self._highest)]
        if odd.size:
            self._odd += odd.size
            low, high = self._odd_range
            self._odd_range = (min(low, odd.min()), max(high, odd.max()))

    def notes(self):
        """Tell what was found, as sentences for the user."""
        notes = []
        tag = self._meta.nodata
        tagged = "has no nodata tag" if tag is None else f"is tagged with nodata {tag:g}"
        for mark, count in self._sentinel_counts.items():
            if count:
                notes.append(
                    f"{self._holders(count)} {mark}, a common void mark, though the band {tagged}; "
                    "counted as voids"
                )
        if self._huge:
            notes.append(f"{self._holders(self._huge)} values beyond 1e30; counted as voids")
        if self._odd:
            notes.append(self._odd_note())
        return notes

    def _holders(self, count):
        return f"1 {self._noun} holds" if count == 1 else f"{count} {self._noun}s hold"

    def _odd_note(self):
        low, high = self._odd_range
        unit = self._meta.unit or "m"
        plain = self._meta.scale == 1 and self._meta.offset == 0
        if low == high:
            values, remedy = f"the value {low:g}", f"--nodata {low:g}" if plain else ""
        else:
            values, remedy = f"values from {low:g} to {high:g}", ""
        if not remedy:
            remedies = []
            if low < self._lowest:
                remedies.append(f"--below {self._lowest:g}")
            if high > self._highest:
                remedies.append(f"--above {self._highest:g}")
            remedy = " ".join(remedies)
        feet = "" if self._unit_known or high > 30000 or low < -1640 else " (unless they are feet)"
        return (
            f"{self._holders(self._odd)} {values}, outside the {self._lowest:g} to "
            f"{self._highest:g} {unit} of land on Earth{feet}; left as they are: "
            f"if they are voids, add {remedy}"
        )
