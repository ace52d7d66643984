"""GDAL's own void filling, to be compared with: the peer that every user has."""

import time

import numpy as np

from demsmith.core.raster._gdal import load

SEARCH_DISTANCE = 500
"""Cells that GDAL looks away from a void cell; enough for all but giant voids."""


def gdal_fill(values, void, *, smoothings=0):
    """Fill voids by GDAL's ``FillNodata``: inverse distances in four quadrants.

    Parameters
    ----------
    values : (H, W) array
        Elevations.
    void : (H, W) bool array
    smoothings : int
        Passes of a 3 x 3 mean over the filled cells.

    Returns
    -------
    filled : (H, W) float32 array
    seconds : float
        What the fill itself took, arrays in memory.

    Raises
    ------
    DependencyError
        If GDAL's bindings are missing.
    """
    gdal = load().gdal
    height, width = values.shape
    ground = np.where(void, 0, values).astype(np.float32)
    bands = []
    for cells, kind in ((ground, gdal.GDT_Float32), ((~void).astype(np.uint8), gdal.GDT_Byte)):
        dataset = gdal.GetDriverByName("MEM").Create("", width, height, 1, kind)
        dataset.GetRasterBand(1).WriteRaster(0, 0, width, height, cells.tobytes())
        bands.append(dataset)
    data, valid = (dataset.GetRasterBand(1) for dataset in bands)
    begin = time.perf_counter()
    gdal.FillNodata(data, valid, SEARCH_DISTANCE, smoothings)
    seconds = time.perf_counter() - begin
    return np.frombuffer(data.ReadRaster(), np.float32).reshape(values.shape), seconds
