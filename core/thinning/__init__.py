"""Thinning: a few cells of a raster are kept, those that carry its shape."""

from demsmith.core.thinning.job import ThinResult, thin_file
from demsmith.core.thinning.options import ThinOptions
from demsmith.core.thinning.thinning import Thinned, thin

__all__ = ["ThinOptions", "ThinResult", "Thinned", "thin", "thin_file"]
