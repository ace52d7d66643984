"""Reading results back by GDAL alone, so that our reading does not test our writing."""

import numpy as np


def read(path):
    """Read a raster by GDAL alone; returns values, nodata, geotransform and type."""
    from osgeo import gdal

    dataset = gdal.Open(path)
    band = dataset.GetRasterBand(1)
    types = {"Int16": np.int16, "Float32": np.float32, "Byte": np.uint8}
    kind = types[gdal.GetDataTypeName(band.DataType)]
    values = np.frombuffer(band.ReadRaster(), kind).reshape(band.YSize, band.XSize)
    return values, band.GetNoDataValue(), dataset.GetGeoTransform(), kind
