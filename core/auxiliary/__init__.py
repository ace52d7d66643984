"""Auxiliary elevation rasters: laid on the target, judged, and voids filled from them."""

from demsmith.core.auxiliary.alignment import Alignment, align
from demsmith.core.auxiliary.checking import check_auxiliary
from demsmith.core.auxiliary.filling import (
    NOT_ASKED,
    REFUSED,
    UNKNOWN,
    UNLIKE,
    USED,
    VERDICTS,
    WORSE,
    AuxiliaryFill,
    fill_from_auxiliaries,
)
from demsmith.core.auxiliary.resampling import Resampler
from demsmith.core.auxiliary.surface import Surface, learn_surface, open_auxiliary

__all__ = [
    "NOT_ASKED",
    "REFUSED",
    "UNKNOWN",
    "UNLIKE",
    "USED",
    "VERDICTS",
    "WORSE",
    "Alignment",
    "AuxiliaryFill",
    "Resampler",
    "Surface",
    "align",
    "check_auxiliary",
    "fill_from_auxiliaries",
    "learn_surface",
    "open_auxiliary",
]
