"""Reconstruction of voids in elevation models: from rasters in memory to mosaics of any size."""

from demsmith.core.reconstruction.arrays import Reconstruction, reconstruct
from demsmith.core.reconstruction.job import ReconstructResult, reconstruct_file
from demsmith.core.reconstruction.options import ReconstructOptions

__all__ = [
    "ReconstructOptions",
    "ReconstructResult",
    "Reconstruction",
    "reconstruct",
    "reconstruct_file",
]
