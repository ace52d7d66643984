"""Terrain basics: gradient, slope, aspect, hillshade, and how far ground is from its mean."""

from demsmith.core.relief.deviation import mean_deviation, topographic_position
from demsmith.core.relief.gradient import gradient
from demsmith.core.relief.hillshade import hillshade, light
from demsmith.core.relief.job import ReliefResult, relief_file
from demsmith.core.relief.options import ReliefOptions
from demsmith.core.relief.slope import aspect, slope

__all__ = [
    "ReliefOptions",
    "ReliefResult",
    "aspect",
    "gradient",
    "hillshade",
    "light",
    "mean_deviation",
    "relief_file",
    "slope",
    "topographic_position",
]
