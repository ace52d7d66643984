"""The options of drainage."""

from dataclasses import dataclass

from demsmith.core.options import option

METHODS = ("d8", "dinf", "mfd", "particles")
DEPRESSIONS = ("fill", "breach", "keep")
UNITS = ("m2", "km2", "cells")


@dataclass(frozen=True, kw_only=True)
class DrainageOptions:
    """How water flows, what becomes of depressions, and in what area is counted."""

    method: str = option(
        str, "d8", "Method",
        "d8: all to the steepest of the eight neighbours; dinf: to the two about the steepest "
        "slope (Tarboton 1997); mfd: to all that are lower, by slope (Holmgren 1994); particles: "
        "by chance in the shares of mfd, many times, with a standard error.",
        choices=METHODS,
    )  # fmt: skip
    depressions: str = option(
        str, "fill", "Depressions",
        "fill: up to their lowest rim; breach: cut through their rim where that moves the least "
        "ground, and fill what stays; keep: water ends in them.",
        choices=DEPRESSIONS,
    )  # fmt: skip
    unit: str = option(
        str, "m2", "Unit of area",
        "Square metres or square kilometres on the ground, or number of cells. A raster of weights "
        "has its own unit.",
        choices=UNITS,
    )  # fmt: skip
    threshold: float = option(
        float, 1e6, "Stream threshold [m²]",
        "Upstream area, in square metres whatever the unit, from which on there is a stream.",
        minimum=0,
    )  # fmt: skip
    exponent: float = option(
        float, 1.1, "Exponent of the slope",
        "mfd and particles: a neighbour's share grows with this power of the slope towards it; "
        "1.1 as in Freeman 1991, larger ones gather the flow.",
        minimum=0, maximum=100, advanced=True,
    )  # fmt: skip
    max_depth: float | None = option(
        float, None, "Deepest change [m]",
        "fill: depressions that would be filled deeper are kept. breach: breaches that would be "
        "cut deeper are not made; those depressions are filled. Not given: no limit.",
        minimum=0, advanced=True,
    )  # fmt: skip
    max_length: float | None = option(
        float, None, "Longest breach [m]",
        "breach: breaches that would be longer are not made; those depressions are filled. "
        "Not given: no limit.",
        minimum=0, advanced=True,
    )  # fmt: skip
    particles: int = option(
        int, 1_000_000, "Particles",
        "How many are dropped by method particles; the standard error falls with its square root.",
        minimum=1, maximum=10**12, advanced=True,
    )  # fmt: skip
    seed: int = option(
        int, 0, "Random seed",
        "Of method particles: the same seed gives the same walks.",
        minimum=0, maximum=2**31 - 1, advanced=True,
    )  # fmt: skip
    coarse_factor: int = option(
        int, 8, "Cells of a coarse cell",
        "The coarse raster has a cell for so many by so many.",
        minimum=2, maximum=100_000, advanced=True,
    )  # fmt: skip
