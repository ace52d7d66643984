"""Numbers as people read them."""

import math

MISSING = "–"
_THIN_SPACE = "\u2009"


def written(value, digits=None):
    r"""Write a value for people: thousands apart, few digits, a dash where there is none.

    Parameters
    ----------
    value : number, bool, str, None, or a sequence or mapping of these
    digits : int, optional
        Decimals of a real number. Default: three significant digits below 100, else none.

    Examples
    --------
    >>> written(0.123456), written(12.3456), written(1234.5, 1), written(None), written(True)
    ('0.123', '12.3', '1\u2009234.5', '–', 'yes')
    """
    if value is None or value != value:
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}".replace(",", _THIN_SPACE)
    if isinstance(value, float):
        return _real(value, digits)
    if isinstance(value, dict):
        return ", ".join(f"{name} {written(item)}" for name, item in value.items()) or MISSING
    if isinstance(value, (list, tuple)):
        return ", ".join(written(item) for item in value) or MISSING
    return str(value)


def _real(value, digits):
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if digits is None:
        size = abs(value)
        digits = 0 if size >= 100 or size == 0 else max(0, 2 - math.floor(math.log10(size)))
        digits = min(digits, 6)
    text = f"{value:,.{digits}f}".replace(",", _THIN_SPACE)
    return text.replace("-", "−")


def is_number(value):
    """Tell whether a value is a finite number, and no truth value.

    Examples
    --------
    >>> is_number(1.5), is_number(float("nan")), is_number(None), is_number(True)
    (True, False, False, False)
    """
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def size_class(smallest, largest):
    r"""Name a class of void sizes.

    Examples
    --------
    >>> size_class(17, 100), size_class(1001, None), size_class(1, None)
    ('17–100 cells', '> 1\u2009000 cells', 'all sizes')
    """
    if largest is None:
        return "all sizes" if smallest == 1 else f"> {written(smallest - 1)} cells"
    return f"{written(smallest)}–{written(largest)} cells"


def plain(value):
    """Bring a value to what JSON holds: NumPy's numbers to Python's, NaN and infinity to None.

    Examples
    --------
    >>> plain({"a": (1, float("nan"))})
    {'a': [1, None]}
    """
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return str(value)
