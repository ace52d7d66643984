"""Reading results back by GDAL alone, so that our reading does not test our writing."""

import numpy as np
from support import GDAL_TYPES

_TYPES = {name: np.dtype(kind).type for kind, name in GDAL_TYPES.items()}


def read(path):
    """Read a raster by GDAL alone; returns values, nodata, geotransform and type."""
    from osgeo import gdal

    dataset = gdal.Open(str(path))
    band = dataset.GetRasterBand(1)
    kind = _TYPES[gdal.GetDataTypeName(band.DataType)]
    values = np.frombuffer(band.ReadRaster(), kind).reshape(band.YSize, band.XSize)
    return values, band.GetNoDataValue(), dataset.GetGeoTransform(), kind
