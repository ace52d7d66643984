"""What the tests of terrain from files share: where it lies, what it is made of, a look at it."""

import numpy as np
from support import hills, make_raster

from demsmith.core import raster
from demsmith.core.samples import SampleOptions

UTM = "EPSG:32631"
EXTENT = (300000, 4700000, 301200, 4700900)
FAST = SampleOptions(variant="relaxed")


def thinned(path, *, dtype="int16", nodata=-9999, **options):
    """Write a raster of which one cell in ten is known; returns its path as text."""
    values = hills(60, 80, dtype=dtype)
    lost = np.random.default_rng(1).random(values.shape) > 0.1
    return make_raster(path, np.where(lost, nodata, values).astype(dtype), nodata=nodata, **options)


def made(result):
    """Read an output; nothing in it may be void."""
    back = raster.read(result.output)
    assert not back.void.any()
    assert back.values.shape == (result.rows, result.columns)
    return back
