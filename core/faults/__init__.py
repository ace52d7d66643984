"""SRTM's own faults: spikes, wells, noisy rims, and water that should be flat."""

from demsmith.core.faults.options import FaultOptions
from demsmith.core.faults.outliers import (
    REACH,
    FaultModel,
    find_outliers,
    find_untrusted_rims,
    learn_faults,
)
from demsmith.core.faults.water import WATER_REACH, Water, find_water, hold_water

__all__ = [
    "REACH",
    "WATER_REACH",
    "FaultModel",
    "FaultOptions",
    "Water",
    "find_outliers",
    "find_untrusted_rims",
    "find_water",
    "hold_water",
    "learn_faults",
]
