"""Tuning: parameters of MCMD fitted to the raster at hand, and what that gains."""

from demsmith.core.tuning.score import ClassError
from demsmith.core.tuning.tuning import Tuned, tune_fill, tune_samples

__all__ = ["ClassError", "Tuned", "tune_fill", "tune_samples"]
