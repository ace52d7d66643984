"""The accurate engine: what the tile's own ground teaches about its voids."""

from demsmith.core.voids.accurate.estimates import margin
from demsmith.core.voids.accurate.filling import SOURCE_OF_METHOD, Choices, estimate
from demsmith.core.voids.accurate.model import ESTIMATORS, UNCALIBRATED, Model
from demsmith.core.voids.accurate.training import learn
from demsmith.core.voids.accurate.windows import BLOCK, Window, training_spans, training_windows

__all__ = [
    "BLOCK",
    "ESTIMATORS",
    "SOURCE_OF_METHOD",
    "UNCALIBRATED",
    "Choices",
    "Model",
    "Window",
    "estimate",
    "learn",
    "margin",
    "training_spans",
    "training_windows",
]
