"""Stored values as whole numbers of a unit, so that a bounded number of units bounds the error."""

import math
from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.strips import strips

MOST_UNITS = 1 << 30
"""Units between the lowest and the highest value."""

_WANTED_UNITS = 1 << 22
"""The same, where the unit is ours to choose: float32 still tells neighbours apart."""

_FINEST_ERROR = 8
"""Units of error allowed, where the unit is ours to choose."""

_DECIMALS = tuple(10.0**digits for digits in range(7))
_LOOKED_AT = 4096  # cells that refute most steps


@dataclass(frozen=True)
class Quantisation:
    """How whole numbers stand for values: number n for ``(first + n) * unit / divisor``.

    Attributes
    ----------
    dtype : numpy.dtype
        Of the values.
    unit, divisor : float
        A step of a tenth is 1 by 10, so that its multiples are the nearest to decimal fractions.
    first : int

    Examples
    --------
    >>> tenths = Quantisation(np.dtype(np.float32), divisor=10.0, first=5000)
    >>> n = tenths.units(np.float32([[500.3, -1]]), np.array([[False, True]]))
    >>> n, tenths.values(n)
    (array([[3, 0]], dtype=int32), array([[500.3, 500. ]], dtype=float32))
    """

    dtype: np.dtype
    unit: float = 1.0
    divisor: float = 1.0
    first: int = 0

    def units(self, values, void):
        """Give the nearest whole numbers, int32; 0 in voids."""
        units = np.empty(values.shape, np.int32)
        for rows in strips(values.shape):
            known = np.where(void[rows], self.dtype.type(0), values[rows])
            units[rows] = np.where(void[rows], 0, self._number(known) - self.first)
        return units

    def values(self, units):
        """Give the values of whole numbers, cut to what ``dtype`` can hold."""
        values = np.empty(units.shape, self.dtype)
        limits = None if self.dtype.kind == "f" else np.iinfo(self.dtype)
        for rows in strips(units.shape) if units.size else ():
            if limits is None:
                whole = units[rows].astype(np.float64) + self.first
                with np.errstate(over="ignore"):
                    values[rows] = whole * self.unit / self.divisor
            else:
                whole = units[rows].astype(np.int64) + self.first
                values[rows] = np.clip(whole, limits.min, min(limits.max, 2**63 - 1))
        return values

    def _number(self, values):
        if self.dtype.kind != "f":
            return values.astype(np.int64)
        return np.rint(values.astype(np.float64) * self.divisor / self.unit).astype(np.int64)


def quantised(values, void, max_error):
    """Choose the unit for a guaranteed error.

    Parameters
    ----------
    values : (H, W) array
        Of any real or integer type.
    void : (H, W) bool array
        Not all True.
    max_error : float
        Of the stored values; 0 for none at all.

    Returns
    -------
    Quantisation
    int
        Units by which a number may be wrong: then no value is by more than ``max_error``, the
        rounding to the unit and to the type included.

    Raises
    ------
    InputError
        If the values cannot be kept as exactly as that.
    """
    low, high = _range(values, void)
    if values.dtype.kind != "f":
        _refuse_wide(low, high, 1.0, max_error)
        error = min(math.floor(max_error), high - low)
        return Quantisation(values.dtype, first=low), error
    size = max(abs(low), abs(high))
    # The half of the last digit by which rounding to the type may move a value; and of float64.
    rounding = 0.500001 * float(np.spacing(values.dtype.type(size + max_error)))
    rounding += 4 * float(np.spacing(size))
    decimal, continuous = None, None
    divisor = _decimal(values, void)
    if divisor is not None:
        slack = 0.0 if divisor == 1 and size < 2 ** np.finfo(values.dtype).nmant else 2 * rounding
        error = math.floor(max(max_error - slack, 0) * divisor)
        decimal = _from_low(values.dtype, 1.0, divisor, low), error
    if max_error > 2 * rounding:
        continuous = _continuous(values.dtype, low, high, max_error - rounding)
    best = _coarser(decimal, continuous)
    if best is None:
        raise InputError(_too_exact(max_error, 4 * rounding))
    chosen, error = best
    _refuse_wide(low, high, chosen.unit / chosen.divisor, max_error)
    return chosen, int(min(error, MOST_UNITS))


def quantised_finely(values, void):
    """Choose a unit that is no loss beside any base without a guaranteed error.

    Parameters
    ----------
    values, void
        As in `quantised`.

    Returns
    -------
    Quantisation
    """
    low, high = _range(values, void)
    if values.dtype.kind != "f":
        _refuse_wide(low, high, 1.0, 0)
        return Quantisation(values.dtype, first=low)
    if _decimal(values, void) == 1 and high - low < _WANTED_UNITS:
        return _from_low(values.dtype, 1.0, 1.0, low)
    span = (high - low) or max(abs(low), 1.0)
    return _from_low(values.dtype, span / _WANTED_UNITS, 1.0, low)


def _range(values, void):
    known = values[~void]
    low, high = known.min(), known.max()
    if values.dtype.kind == "f":
        return float(low), float(high)
    return int(low), int(high)


def _from_low(dtype, unit, divisor, low):
    return Quantisation(dtype, unit, divisor, round(low * divisor / unit))


def _continuous(dtype, low, high, max_error):
    """Choose a unit so fine that rounding to it takes little of the error allowed."""
    for error in range(_FINEST_ERROR, -1, -1):
        unit = max_error / (error + 0.5)
        if (high - low) / unit <= _WANTED_UNITS:
            break
    return _from_low(dtype, unit, 1.0, low), error


def _coarser(*choices):
    """Give the one in which most values may stand for each other."""
    made = [each for each in choices if each is not None]
    return max(
        made, key=lambda each: (2 * each[1] + 1) * each[0].unit / each[0].divisor, default=None
    )


def _decimal(values, void):
    """Find by what the values have to be multiplied to be whole; None if by no power of ten."""
    known = values[~void]
    few = known[:: max(1, known.size // _LOOKED_AT)]
    for divisor in _DECIMALS:
        if float(np.abs(few).max()) * divisor < 2**52 and _whole(few, divisor):
            step = 1 << 20
            parts = (known[start : start + step] for start in range(0, known.size, step))
            if all(_whole(part, divisor) for part in parts):
                return divisor
    return None


def _whole(values, divisor):
    whole = np.rint(values.astype(np.float64) * divisor)
    return bool(((whole / divisor).astype(values.dtype) == values).all())


def _refuse_wide(low, high, unit, max_error):
    if (high - low) / unit > MOST_UNITS:
        raise InputError(
            f"its values reach from {low:g} to {high:g}, too far for a maximum error of "
            f"{max_error:g}: allow at least {(high - low) / MOST_UNITS:.2g}, or name values that "
            "mean void"
        )


def _too_exact(max_error, possible):
    if max_error:
        return (
            f"its values are too large for a maximum error of {max_error:g}, finer than their "
            f"own last digits: allow at least {possible:.2g}"
        )
    return (
        "its values are neither whole numbers nor decimals of up to 6 digits, so that no maximum "
        f"error of 0 is possible: allow a small one, such as {max(possible, 1e-4):.2g}"
    )
