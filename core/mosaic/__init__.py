"""Mosaics: many tiles reconstructed as the one raster they are parts of, in bounded memory."""

from demsmith.core.mosaic.job import reconstruct_mosaic
from demsmith.core.mosaic.summary import MosaicResult

__all__ = ["MosaicResult", "reconstruct_mosaic"]
