"""The options of finding SRTM's own faults."""

from dataclasses import dataclass

from demsmith.core.options import option


@dataclass(frozen=True, kw_only=True)
class FaultOptions:
    """What of an elevation model is not believed, and what is known of its water."""

    outliers: bool = option(
        bool, True, "Remove spikes and wells",
        "Cells and clusters of up to 3 by 3 cells that stand out from all the ground around them "
        "become voids and are filled.",
    )  # fmt: skip
    outlier_factor: float = option(
        float, 9.0, "Outliers stand out by [times the roughness]",
        "How many times the ground's own roughness a spike or well stands out by; smaller finds "
        "more, and below 7 also true summits and craters.",
        minimum=1.0, advanced=True,
    )  # fmt: skip
    outlier_height: float = option(
        float, 10.0, "Outliers stand out by [m]",
        "The least height of a spike and depth of a well, on however smooth ground.",
        minimum=0.0, advanced=True,
    )  # fmt: skip
    noisy_rims: bool = option(
        bool, False, "Remove noisy rim cells",
        "Cells beside voids that disagree with their neighbours far more than is usual become "
        "voids.",
    )  # fmt: skip
    erode: int = option(
        int, 0, "Widen voids by [cells]",
        "So many known cells all around every void are not believed.",
        minimum=0, maximum=16, advanced=True,
    )  # fmt: skip
    flat_water: bool = option(
        bool, True, "Keep water flat",
        "Voids in the sea and in lakes are held at the water's level, and nothing beside water is "
        "filled lower than that.",
    )  # fmt: skip
    water_area: float = option(
        float, 100_000.0, "Smallest water [m²]",
        "A level area of at least this size is water; 4096 level cells always are.",
        minimum=0.0, advanced=True,
    )  # fmt: skip
