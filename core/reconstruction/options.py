"""The options of reconstruction."""

from dataclasses import dataclass

from demsmith.core.faults.options import FaultOptions
from demsmith.core.options import option, same_option
from demsmith.core.voids.options import FillOptions


@dataclass(frozen=True, kw_only=True)
class ReconstructOptions(FaultOptions):
    """How the voids of a raster or a mosaic are reconstructed, and which of them.

    See `demsmith.core.faults.options.FaultOptions` for what is not believed before.
    """

    method: str = option(
        str, "auto", "Method",
        "auto: what proves best on the ground itself, by void size, with its uncertainty; mcmd: "
        "constrained midpoint displacement (Belhadj 2007), fast.",
        choices=("auto", "mcmd"),
    )  # fmt: skip
    interior_only: bool = same_option(FillOptions, "interior_only")
    max_size: int = same_option(FillOptions, "max_size")
    float_output: bool = same_option(FillOptions, "float_output")
