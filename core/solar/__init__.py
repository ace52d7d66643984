"""Sunlight on terrain: where the sun is, what hides it, and how much of its light arrives."""

from demsmith.core.solar.horizon import HorizonSweep, horizon_tangent, horizons
from demsmith.core.solar.irradiance import Irradiance, solar_irradiance
from demsmith.core.solar.job import SolarResult, solar_file
from demsmith.core.solar.options import SolarOptions
from demsmith.core.solar.sky_view import sky_view_factor
from demsmith.core.solar.when import When

__all__ = [
    "HorizonSweep",
    "Irradiance",
    "SolarOptions",
    "SolarResult",
    "When",
    "horizon_tangent",
    "horizons",
    "sky_view_factor",
    "solar_file",
    "solar_irradiance",
]
