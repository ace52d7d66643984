"""The options of sunlight."""

from dataclasses import dataclass

from demsmith.core.options import option

ATMOSPHERES = ("linke", "ineichen", "none")
DIFFUSE_MODELS = ("muneer", "isotropic")


@dataclass(frozen=True, kw_only=True)
class SolarOptions:
    """How the sun, the air and the ground are modelled."""

    step: float = option(
        float, 0.5, "Time step [h]",
        "Hours between the instants at which a day's sun is looked at.",
        minimum=0.01, maximum=4,
    )  # fmt: skip
    atmosphere: str = option(
        str, "linke", "Clear sky",
        "linke: the European Solar Radiation Atlas' clear sky, as in GRASS r.sun; ineichen: "
        "Ineichen and Perez's, as in pvlib; none: no air at all, the light above the atmosphere.",
        choices=ATMOSPHERES,
    )  # fmt: skip
    linke: float = option(
        float, 3.0, "Linke turbidity",
        "How hazy the air is: 1 is clean and dry, 2 mountains in winter, 3 the countryside, "
        "5 a city in summer.",
        minimum=1, maximum=10,
    )  # fmt: skip
    albedo: float = option(
        float, 0.2, "Albedo of the ground",
        "Share of the light that the surrounding ground sends back: 0.1 forest, 0.2 grass, "
        "0.8 fresh snow.",
        minimum=0, maximum=1,
    )  # fmt: skip
    shadows: bool = option(
        bool, True, "Shadows of the terrain",
        "Whether terrain that hides the sun throws its shadow.",
    )  # fmt: skip
    diffuse_model: str = option(
        str, "muneer", "Light of the sky on slopes",
        "muneer: brighter towards the sun, as in GRASS r.sun; isotropic: the same from all of "
        "the sky.",
        choices=DIFFUSE_MODELS, advanced=True,
    )  # fmt: skip
    hidden_sky: bool = option(
        bool, False, "Hills hide the sky",
        "Whether hills around a cell take from the light of the sky, by the sky-view factor; "
        "GRASS r.sun lets them not.",
        advanced=True,
    )  # fmt: skip
    directions: int = option(
        int, 32, "Directions of the horizon",
        "In how many directions, evenly around, the horizon is looked for where the horizon "
        "itself or the sky-view factor is asked for.",
        minimum=4, maximum=360, advanced=True,
    )  # fmt: skip
    curvature: bool = option(
        bool, True, "Curvature of the Earth",
        "Whether far terrain sinks below the horizon, by the Earth's curvature and the usual "
        "refraction of light.",
        advanced=True,
    )  # fmt: skip
