"""The parameters of MCMD, with the paper's names."""

from dataclasses import dataclass

from demsmith.core.options import option

VARIANTS = ("relaxed", "weighted", "paper")
SCHEMES = ("auto", "triangle-edge", "diamond-square")


@dataclass(frozen=True, kw_only=True)
class McmdOptions:
    """Parameters of constrained midpoint displacement (Belhadj 2007, section 3)."""

    variant: str = option(
        str, "relaxed", "MCMD variant",
        "relaxed: each generation of midpoints is relaxed to the surface of least bending, most "
        "accurate; weighted: bottom-up pass by distance-weighted means, finest level first; "
        "paper: the bottom-up pass as published.",
        choices=VARIANTS, advanced=True,
    )  # fmt: skip
    scheme: str = option(
        str, "auto", "Subdivision scheme",
        "Which neighbours a midpoint descends from. auto: triangle-edge, or diamond-square where "
        "nothing is known, for noise alone shows triangle-edge's squares. Variants weighted and "
        "paper only.",
        choices=SCHEMES, advanced=True,
    )  # fmt: skip
    l: float = option(  # noqa: E741, the paper's name
        float, 0.0, "Curve l of the top-down pass",
        "Shape of the interpolation between known cells: 0 plain average, above 0 falling and "
        "below 0 rising with distance; 1 a line, less a bell, more a ridge. Variants weighted "
        "and paper only.",
        minimum=-50, maximum=50, advanced=True,
    )  # fmt: skip
    l_bu: float = option(
        float, 0.0, "Curve l of the bottom-up pass",
        "The same shape for the bottom-up pass. Variants weighted and paper only.",
        minimum=-50, maximum=50, advanced=True,
    )  # fmt: skip
    datum: float = option(
        float, None, "Datum [m]",
        "Elevation from which l and l_bu bend the surface; not above the lowest known cell. "
        "Not given: the lowest known cell. Where nothing is known: about which terrain is made.",
        advanced=True,
    )  # fmt: skip
    tension: float = option(
        float, None, "Tension length [m]",
        "Distance over which bending gives way to stretching: less is tauter, with less overshoot "
        "in large voids. Not given: 12 cells. Variants relaxed and converged only.",
        minimum=1e-6, advanced=True,
    )  # fmt: skip
    h: float = option(
        float, 0.5, "Roughness exponent H",
        "Displacements shrink by 2^(-2H) a level: 0.4 to 0.5 is natural, less is rougher.",
        minimum=0, maximum=1, advanced=True,
    )  # fmt: skip
    r_s: float = option(
        float, 0.0, "Displacement strength r_s",
        "Largest first displacement as a share of the reference relief; 0 adds no roughness.",
        minimum=0, maximum=10, advanced=True,
    )  # fmt: skip
    r_t: float = option(
        float, 0.0, "Displacement shift r_t",
        "Moves the displacements up (above 0) or down, in units of their strength.",
        minimum=-10, maximum=10, advanced=True,
    )  # fmt: skip
    relief: float = option(
        float, None, "Reference relief [m]",
        "Relief that r_s is a share of. Not given: the range of the known cells.",
        minimum=0, advanced=True,
    )  # fmt: skip
    seed: int = option(
        int, 0, "Random seed",
        "The same seed gives the same displacements.",
        minimum=0, maximum=2**31 - 1, advanced=True,
    )  # fmt: skip
