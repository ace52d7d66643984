"""The paper's parameter sets, and what stands in for parameters where nothing is known."""

from dataclasses import dataclass, replace

from demsmith.core.errors import InputError
from demsmith.core.mcmd.maps import MAP_NAMES
from demsmith.core.mcmd.options import McmdOptions


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
    """Put a preset's values where the options give none.

    Parameters
    ----------
    options : SampleOptions

    Returns
    -------
    SampleOptions
        Of variant ``paper`` instead of ``converged``, which has no curves.

    Raises
    ------
    InputError
        If the options name variant ``relaxed``, which has none either.
    """
    if options.preset == "none":
        return options
    if options.variant == "relaxed":
        raise InputError(
            f"preset {options.preset} bends the surface by l and l_bu, which variant relaxed has "
            "not: choose variant paper or weighted, or no preset"
        )
    if options.variant == "converged":
        options = replace(options, variant="paper")
    preset = PRESETS[options.preset]
    return _where_none(
        options, l=preset.l, l_bu=preset.l_bu, h=preset.h, r_t=preset.r_t, r_s=preset.r_s
    )


def from_noise(options):
    """Put what is needed without any known cell where the options give nothing."""
    return _where_none(options, **FROM_NOISE)


def settled(options):
    """Put MCMD's own defaults where the options still give nothing."""
    defaults = McmdOptions()
    return _where_none(options, **{name: getattr(defaults, name) for name in MAP_NAMES})


def _where_none(options, **values):
    wanted = {name: value for name, value in values.items() if getattr(options, name) is None}
    return replace(options, **wanted)
