"""The paper's parameter sets, and what stands in for parameters where nothing is known."""

from dataclasses import dataclass, replace

from demsmith.core.errors import InputError
from demsmith.core.options import specifications


@dataclass(frozen=True)
class Preset:
    """One parameter set of the paper; the fields have its names.

    Attributes
    ----------
    l, l_bu, h, r_t, r_s : float
        As in `demsmith.core.mcmd.McmdOptions`; strengths are shares of the reference relief.
    median : bool
        Whether unknown cells go through a median filter of 3 × 3 cells at the end.
    """

    l: float  # noqa: E741, the paper's name
    l_bu: float
    h: float = 0.5
    r_t: float = 0.0
    r_s: float = 0.0
    median: bool = False


PRESETS = {
    "smooth": Preset(1, 6),
    "figure-8d": Preset(0.7, 5, 0.4, 1, 0.2),
    "figure-11a": Preset(1, 6, 0.49, 0, 0.5),
    "figure-11b": Preset(1.1, 10, 0.48, 0, 0.5),
    "figure-12a": Preset(1.1, 20, 0.45, 0.2, 1),
    "figure-12b": Preset(1.1, 4, 0.45, 0, 1.1),
    "figure-13": Preset(3, 7.5, 0.5, 0.1, 1.3, median=True),
}
"""The parameters of Belhadj 2007's figures. The signs of r_t are lost in the scan we have."""

FROM_NOISE = {"h": 0.45, "r_s": 1.0, "relief": 1000.0}
"""What makes natural terrain where no cell is known: as rough as the paper's figures 12."""


def with_preset(options):
    """Put a preset's values into the options that are at their defaults.

    Parameters
    ----------
    options : SampleOptions

    Returns
    -------
    SampleOptions
        Of variant ``paper``, unless the options name another.

    Raises
    ------
    InputError
        If the options name a variant that has no curves.
    """
    if options.preset == "none":
        return options
    preset = PRESETS[options.preset]
    options = _where_default(
        options, variant="paper", l=preset.l, l_bu=preset.l_bu, h=preset.h, r_t=preset.r_t,
        r_s=preset.r_s,
    )  # fmt: skip
    if options.variant == "relaxed":
        raise InputError(
            f"preset {options.preset} bends the surface by l and l_bu, which variant relaxed has "
            "not: choose variant paper or weighted, or no preset"
        )
    return options


def from_noise(options):
    """Put what is needed without any known cell into the options that are at their defaults."""
    return _where_default(options, **FROM_NOISE)


def _where_default(options, **values):
    defaults = {spec.name: spec.default for spec in specifications(type(options))}
    return replace(
        options,
        **{
            name: value
            for name, value in values.items()
            if getattr(options, name) == defaults[name]
        },
    )
