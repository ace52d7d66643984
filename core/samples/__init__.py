"""Terrain from samples: points, lines, contours, a thinned raster, a sketch, or noise alone."""

from demsmith.core.samples.gridding import Gridded, to_cells
from demsmith.core.samples.job import SamplesResult, samples_file
from demsmith.core.samples.options import SampleOptions
from demsmith.core.samples.presets import PRESETS, Preset
from demsmith.core.samples.samples import Samples
from demsmith.core.samples.sketch import read_sketch
from demsmith.core.samples.terrain import Reconstructed, from_samples

__all__ = [
    "PRESETS",
    "Gridded",
    "Preset",
    "Reconstructed",
    "SampleOptions",
    "Samples",
    "SamplesResult",
    "from_samples",
    "read_sketch",
    "samples_file",
    "to_cells",
]
