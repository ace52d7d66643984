"""The options of void filling."""

from dataclasses import dataclass, fields

from demsmith.core.mcmd.options import McmdOptions
from demsmith.core.options import option


@dataclass(frozen=True, kw_only=True)
class FillOptions(McmdOptions):
    """How voids are filled, and which of them.

    See `demsmith.core.mcmd.McmdOptions` for the options of MCMD itself.
    """

    method: str = option(
        str, "auto", "Method",
        "auto: the most accurate, learned from the raster's own ground void size by void size "
        "(MCMD, if one of MCMD's own options is set). "
        "mcmd: constrained midpoint displacement (Belhadj 2007), the fastest.",
        choices=("auto", "mcmd"),
    )  # fmt: skip
    natural_roughness: bool = option(
        bool, False, "Natural roughness",
        "Make filled ground as rough as the ground around each void: nicer to look at and to run "
        "models on, but its elevations are less accurate.",
    )  # fmt: skip
    tune: bool = option(
        bool, False, "Tune the parameters",
        "First fit tension, or l and l_bu, to this raster by artificial voids in its known ground; "
        "what is found is used if it gains on others of them too. Takes ten seconds and more.",
    )  # fmt: skip
    interior_only: bool = option(
        bool, False, "Fill interior voids only",
        "Leave voids that touch the raster's edge as they are.",
    )  # fmt: skip
    max_size: int = option(
        int, None, "Largest void to fill [cells]",
        "Leave voids of more cells than this as they are; not given: fill every void.",
        minimum=1,
    )  # fmt: skip
    float_output: bool = option(
        bool, False, "Write floating-point elevations",
        "Write Float32 instead of the input's data type, so that filled ground is not rounded.",
        flag="float",
    )  # fmt: skip

    @property
    def accurate(self):
        """Whether the accurate engine fills: no option asks for MCMD itself."""
        own = {field.name for field in fields(McmdOptions)} - {"tension", "seed"} | {"tune"}
        return self.method == "auto" and all(
            getattr(self, field.name) == field.default
            for field in fields(self)
            if field.name in own
        )
