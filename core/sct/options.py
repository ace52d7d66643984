"""The options of compressing and decompressing."""

from dataclasses import dataclass

from demsmith.core.options import option


@dataclass(frozen=True, kw_only=True)
class CompressOptions:
    """How exactly, or how small, and by which kind of tree."""

    max_error: float = option(
        float, None, "Maximum error",
        "No cell is wrong by more than this, in the raster's unit; 0 keeps every value. "
        "Not given: 1, unless a ratio, a PSNR or a patch tree is asked for.",
        minimum=0,
    )  # fmt: skip
    ratio: float = option(
        float, None, "Ratio",
        "Instead: the file takes at most the raw values' bytes by this; the error is not bounded.",
        minimum=1, maximum=1e6,
    )  # fmt: skip
    psnr: float = option(
        float, None, "PSNR [dB]",
        "Instead: the root-mean-square error is at least so far below the raster's range; single "
        "cells are not bounded.",
        minimum=1, maximum=200,
    )  # fmt: skip
    atoms: int = option(
        int, None, "Atoms",
        "Use a tree of patches made of so many atoms, learned from the raster itself, instead of "
        "the pyramid; cosine waves where it is too small or flat to learn from. Its default, where "
        "another option asks for patches: 128.",
        minimum=1, maximum=65536, advanced=True,
    )  # fmt: skip
    sparsity: int = option(
        int, None, "Sparsity",
        "Atoms in each patch; asks for a tree of patches. Its default: 2.",
        minimum=1, maximum=64, advanced=True,
    )  # fmt: skip
    radius: float = option(
        float, None, "Radius [m]",
        "Of a patch's disc, in metres on the ground; asks for a tree of patches. Its default: "
        "5 cells.",
        minimum=1e-6, advanced=True,
    )  # fmt: skip
    effort: str = option(
        str, "normal", "Effort",
        "What time is taken for: high makes the smallest files, low is quick. The error bound is "
        "the same.",
        choices=("low", "normal", "high"),
    )  # fmt: skip
    vrt: bool = option(
        bool, True, "Virtual raster",
        "Write a virtual raster beside the file, OUTPUT.vrt, by which GDAL's tools and QGIS read "
        "it.",
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class DecompressOptions:
    """At which scale."""

    scale: float = option(
        float, 1.0, "Scale",
        "Output cells per cell of the file, along rows and columns: 0.25 decodes only an overview, "
        "above 1 the continuous surface is evaluated.",
        minimum=1e-4, maximum=256,
    )  # fmt: skip
