"""The options of thinning."""

from dataclasses import dataclass

from demsmith.core.options import option

DETECTORS = ("ridges", "sobel", "random")


@dataclass(frozen=True, kw_only=True)
class ThinOptions:
    """How many cells are kept, and which."""

    share: float = option(
        float, 0.1, "Share of cells to keep",
        "Share of the known cells that is kept, as a fraction of 1; it is rounded down to whole "
        "cells, but one is always kept.",
        minimum=1e-6, maximum=1,
    )  # fmt: skip
    detector: str = option(
        str, "ridges", "Detector",
        "ridges: densest on crests, valleys and edges, sparse on even ground, from which the "
        "terrain is rebuilt best; sobel: the steepest cells (Belhadj 2007); random: any cell.",
        choices=DETECTORS,
    )  # fmt: skip
    seed: int = option(
        int, 0, "Random seed",
        "The same seed keeps the same cells. Besides detector random, it decides between cells "
        "of equal rank.",
        minimum=0, maximum=2**31 - 1,
    )  # fmt: skip
