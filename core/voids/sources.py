"""Where the cells of a filled raster come from: the codes of a source map, one registry."""

from typing import NamedTuple

from demsmith.core.errors import InputError


class Source(NamedTuple):
    """One class of a source map.

    Attributes
    ----------
    code : int
        What the map's cells hold, 0 to 255.
    name : str
    color : (int, int, int, int)
        Red, green, blue and alpha, 0 to 255.
    """

    code: int
    name: str
    color: tuple


ORIGINAL, FILLED, LEFT = 0, 1, 2
"""Known before; interpolated by MCMD; a void that was left as it was."""

STRUCTURED, COVARIANCE, BLEND = 3, 5, 6
"""Interpolated by the accurate engine's estimators."""

NEIGHBOUR, WATER = 8, 9
"""Taken from the neighbouring tile; water held flat."""

MOST_AUXILIARIES = 9
"""So many auxiliary rasters have a code of their own."""

_AUXILIARY = 10
# Greens to yellow: apart from the estimators' colours, and from each other.
_AUXILIARY_COLORS = (
    (0, 128, 92), (84, 178, 62), (176, 206, 44), (16, 94, 40), (122, 152, 16),
    (64, 204, 148), (198, 228, 118), (146, 134, 44), (222, 202, 60),
)  # fmt: skip


def auxiliary_code(number):
    """Give the code of cells taken from the ``number``-th auxiliary raster, from 1.

    Raises
    ------
    InputError
        If there is no code for so many.

    Examples
    --------
    >>> auxiliary_code(2)
    12
    """
    if not 1 <= number <= MOST_AUXILIARIES:
        raise InputError(f"auxiliary {number}: at most {MOST_AUXILIARIES} auxiliaries can be used")
    return _AUXILIARY + number


SOURCES = (
    Source(ORIGINAL, "original", (217, 217, 217, 255)),
    Source(FILLED, "interpolated by MCMD", (214, 24, 111, 255)),
    Source(LEFT, "void left as it was", (0, 0, 0, 255)),
    Source(STRUCTURED, "interpolated along ridges and valleys", (232, 118, 0, 255)),
    Source(COVARIANCE, "interpolated by learned covariance", (40, 84, 190, 255)),
    Source(BLEND, "interpolated by a blend of estimators", (126, 70, 178, 255)),
    Source(NEIGHBOUR, "neighbouring tile", (0, 164, 190, 255)),
    Source(WATER, "water held flat", (122, 190, 240, 255)),
    *(
        Source(auxiliary_code(number), f"auxiliary {number}", (*color, 255))
        for number, color in enumerate(_AUXILIARY_COLORS, start=1)
    ),
)
"""Every class of a source map, by code."""

SOURCE_COLORS = {source.code: source.color for source in SOURCES}
"""Red, green, blue and alpha, 0 to 255, by which a source map shows each code."""

_NAMES = {source.code: source.name for source in SOURCES}

SOURCE_NAMES = tuple(_NAMES.get(code, "") for code in range(max(_NAMES) + 1))
"""Name of each code, in the order of the codes; empty where there is no class."""
