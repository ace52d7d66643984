"""Raster files with voids, for the tests of filling from file to file."""

import numpy as np
import pytest
from scenes import disc, fractal, holed
from support import make_raster

from demsmith.core.voids import FILLED
from demsmith.core.voids.accurate import SOURCE_OF_METHOD

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

SHAPE = (60, 80)
VOID = disc(SHAPE, (30, 30), 9) | holed(SHAPE, (0, 3, 70, 76), (50, 52, 60, 61))


def tile(path, *, dtype="int16", nodata=-32768, ground=None, void=VOID, **options):
    """A raster with an interior void of 253 cells, one of 2, and one of 18 at the edge."""
    values = np.rint(fractal(SHAPE, seed=2)).astype(dtype) if ground is None else ground
    values = values.astype(dtype)
    values[void] = nodata
    return make_raster(path, values, nodata=nodata, **options)


every_method = pytest.mark.parametrize("method", ["auto", "mcmd"])


def source_map_is(path, filled, left, method):
    """Whether a source map tells these cells filled by the method, those left, the rest known."""
    codes = stored(path)[0]
    by = [FILLED] if method == "mcmd" else SOURCE_OF_METHOD
    inside = filled & ~left
    return (
        np.isin(codes[inside], by).all() and (codes[left] == 2).all()
        and (codes[~(filled | left)] == 0).all()
    )  # fmt: skip


def stored(path):
    """Values, void cells by GDAL's own mask, nodata tag."""
    dataset = gdal.Open(str(path))
    band = dataset.GetRasterBand(1)
    return band.ReadAsArray(), band.GetMaskBand().ReadAsArray() == 0, band.GetNoDataValue()
