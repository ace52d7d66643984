"""What the tests share: the real data beside the checkout, and rasters made on the spot."""

import hashlib
from pathlib import Path

import numpy as np
import pytest

import demsmith

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"

WGS84_3ARC = (10.0, 1 / 1200, 0.0, 50.0, 0.0, -1 / 1200)
"""Geotransform of a 3″ raster whose north-west corner is 10° E, 50° N."""

GDAL_TYPES = {
    "uint8": "Byte",
    "uint16": "UInt16",
    "int16": "Int16",
    "uint32": "UInt32",
    "int32": "Int32",
    "int64": "Int64",
    "float32": "Float32",
    "float64": "Float64",
    "complex64": "CFloat32",
}


def shared_data(name):
    """Path of a file of the shared data as text; the test is skipped where it is absent."""
    path = SHARED / name
    if not path.exists():
        pytest.skip(f"real data '{name}' is not beside the checkout")
    return str(path)


def fill_by_mcmd(values, void=None, **options):
    """`demsmith.fill_voids` by MCMD alone."""
    return demsmith.fill_voids(values, void, method="mcmd", **options)


def hills(rows=60, columns=80, *, dtype=np.int16, seed=1):
    """Smooth ground between about 0 and 1000, by a few random waves."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:rows, :columns] / 20.0
    ground = np.full((rows, columns), 500.0)
    for _ in range(6):
        kx, ky, phase = rng.normal(size=3)
        ground += 80 * np.sin(kx * x + ky * y + 6 * phase)
    return ground.astype(dtype)


def make_raster(
    path, values, *, driver="GTiff", geotransform=WGS84_3ARC, crs="EPSG:4326", nodata=None,
    options=(), metadata=None, setup=None,
):  # fmt: skip
    """Write a raster by GDAL itself, so that our writing is not tested by our reading.

    ``values`` has shape (rows, columns) or (bands, rows, columns); ``setup(dataset)`` may change
    the dataset before it is saved. Returns the path as text.
    """
    gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
    from osgeo import osr

    bands = np.ascontiguousarray(values).reshape((-1, *np.shape(values)[-2:]))
    kind = gdal.GetDataTypeByName(GDAL_TYPES[str(bands.dtype)])
    count, rows, columns = bands.shape
    direct = driver == "GTiff"
    dataset = (
        gdal.GetDriverByName("GTiff").Create(str(path), columns, rows, count, kind, list(options))
        if direct
        else gdal.GetDriverByName("MEM").Create("", columns, rows, count, kind)
    )
    if geotransform is not None:
        dataset.SetGeoTransform(geotransform)
    if crs:
        reference = osr.SpatialReference()
        reference.SetFromUserInput(crs)
        reference.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        dataset.SetSpatialRef(reference)
    if metadata:
        dataset.SetMetadata(metadata)
    for number, band in enumerate(bands, start=1):
        if nodata is not None:
            dataset.GetRasterBand(number).SetNoDataValue(nodata)
        dataset.GetRasterBand(number).WriteRaster(0, 0, columns, rows, band)
    if setup is not None:
        setup(dataset)
    if not direct:
        copy = gdal.GetDriverByName(driver).CreateCopy(str(path), dataset, 0, list(options))
        del copy
    del dataset
    return str(path)


def make_hgt(path, values):
    """Write the bare bytes of an .hgt tile; returns the path as text."""
    np.asarray(values).astype(">i2").tofile(path)
    return str(path)


def digest(path):
    """Fingerprint of a file's bytes."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def truncate(path, fraction):
    """Cut a file off after this part of its bytes; returns its path as text."""
    data = Path(path).read_bytes()
    Path(path).write_bytes(data[: int(len(data) * fraction)])
    return str(path)
