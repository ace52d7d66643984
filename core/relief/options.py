"""The options of terrain basics."""

from dataclasses import dataclass

from demsmith.core.options import option

KINDS = ("slope", "aspect", "hillshade", "deviation", "position")
METHODS = ("horn", "zevenbergen-thorne")
UNITS = ("degrees", "percent")


@dataclass(frozen=True, kw_only=True)
class ReliefOptions:
    """What is made of the ground, and how."""

    kind: str = option(
        str, "slope", "What is made",
        "slope: how steep the ground is; aspect: which way it falls, degrees clockwise from north; "
        "hillshade: how much light falls on it; deviation: root mean square deviation of the "
        "elevations within the radius from their mean, a measure of relief [m]; position: "
        "elevation above that mean, positive on ridges and negative in valleys [m].",
        choices=KINDS,
    )  # fmt: skip
    unit: str = option(
        str, "degrees", "Unit of slope",
        "degrees, or percent: 100 times rise by run.", choices=UNITS,
    )  # fmt: skip
    azimuth: float = option(
        float, 315.0, "Azimuth of the light",
        "Where the light of hillshade comes from, degrees clockwise from north.",
        minimum=0, maximum=360,
    )  # fmt: skip
    altitude: float = option(
        float, 45.0, "Altitude of the light",
        "Height of the light of hillshade above the horizon, degrees.", minimum=0, maximum=90,
    )  # fmt: skip
    exaggeration: float = option(
        float, 1.0, "Vertical exaggeration",
        "Elevations count so many times for hillshade.", minimum=1e-3, maximum=1000,
    )  # fmt: skip
    multidirectional: bool = option(
        bool, False, "Light from many directions",
        "Hillshade by four lights from south-west to north, so that ridges show whichever way they "
        "run (after Mark 1992); the azimuth does not count.",
    )  # fmt: skip
    radius: float = option(
        float, 500.0, "Radius [m]",
        "Ground metres around a cell that deviation and position look at.",
        minimum=1e-3, maximum=1e6,
    )  # fmt: skip
    method: str = option(
        str, "horn", "Slope formula",
        "horn: of the 8 cells around each, for rough ground (Horn 1981); zevenbergen-thorne: of 4 "
        "cells, for smooth ground (Zevenbergen and Thorne 1987).",
        choices=METHODS, advanced=True,
    )  # fmt: skip
