"""The options of terrain from samples."""

from dataclasses import dataclass

from demsmith.core.mcmd.options import McmdOptions
from demsmith.core.options import option, specifications
from demsmith.core.samples.presets import PRESETS

VARIANTS = ("converged", "relaxed", "weighted", "paper")


def _as_preset(name):
    """Make the field of an option of MCMD's that presets set, to which None is not given."""
    spec = next(spec for spec in specifications(McmdOptions) if spec.name == name)
    return option(
        spec.kind, None, spec.title,
        f"{spec.help} Not given: the preset's, else what noise alone needs, else {spec.default:g}.",
        minimum=spec.minimum, maximum=spec.maximum, advanced=True,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class SampleOptions(McmdOptions):
    """How the ground between samples is made.

    See `demsmith.core.mcmd.McmdOptions` for the options of MCMD itself.
    """

    variant: str = option(
        str, "converged", "MCMD variant",
        "converged: the surface of least bending through the samples, most accurate; relaxed: "
        "the same, stopped early, fastest; weighted: bottom-up pass by distance-weighted means, "
        "finest level first; paper: the bottom-up pass as published.",
        choices=VARIANTS, advanced=True,
    )  # fmt: skip
    l: float = _as_preset("l")  # noqa: E741, the paper's name
    l_bu: float = _as_preset("l_bu")
    h: float = _as_preset("h")
    r_s: float = _as_preset("r_s")
    r_t: float = _as_preset("r_t")
    stiffness: float = option(
        float, None, "Stiffness length [m]",
        "Distance over which curvature changes smoothly: more suits ground that was measured "
        "smoothly, less noisy ground. Not given: 0.7 cells. Variant converged only.",
        minimum=0, advanced=True,
    )  # fmt: skip
    preset: str = option(
        str, "none", "Preset",
        "Parameters of a figure of the paper: its l, l_bu, h, r_t and r_s, where these are not "
        "given, and variant paper instead of converged.",
        choices=("none", *PRESETS),
    )  # fmt: skip
    tune: bool = option(
        bool, False, "Tune the parameters",
        "First fit tension and stiffness, or l and l_bu, to samples held back; what is found is "
        "used if it gains on others of them too. Takes as long as fifty runs over a part.",
    )  # fmt: skip
    float_output: bool = option(
        bool, False, "Write floating-point elevations",
        "Write Float32 also where a thinned raster alone is read, whose data type is kept else.",
        flag="float",
    )  # fmt: skip
