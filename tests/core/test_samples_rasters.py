"""Terrain from thinned rasters, from sketches, and from nothing but noise: files to a file."""

import numpy as np
import pytest
from sample_files import EXTENT, FAST, UTM, made, thinned
from support import digest, hills, make_raster

from demsmith import Samples, samples_file
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.samples import SampleOptions

pytest.importorskip("osgeo.gdal", reason="GDAL is missing")


def make_image(path, pixels):
    oiio = pytest.importorskip("OpenImageIO", reason="OpenImageIO is missing")
    pixels = np.atleast_3d(pixels)
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], str(pixels.dtype))
    spec.attribute("oiio:UnassociatedAlpha", 1)
    image = oiio.ImageOutput.create(str(path))
    assert image.open(str(path), spec) and image.write_image(np.ascontiguousarray(pixels))
    image.close()
    return path


# --- thinned rasters -----------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", ["int16", "float32", "float64"])
def test_a_thinned_raster_comes_back_complete(tmp_path, dtype):
    source = thinned(tmp_path / "in.tif", dtype=dtype)
    before = raster.read(source)
    result = samples_file(source, tmp_path / "out.tif")
    back = made(result)
    assert back.grid == before.grid and back.values.dtype == dtype
    np.testing.assert_array_equal(back.values[~before.void], before.values[~before.void])
    assert result.samples == result.cells_known == (~before.void).sum()
    truth = hills(60, 80)
    assert np.abs(back.values - truth).mean() < 0.1 * np.abs(truth - truth.mean()).mean()


def test_floating_point_if_asked(tmp_path):
    source = thinned(tmp_path / "in.tif")
    whole = made(samples_file(source, tmp_path / "a.tif", options=FAST))
    options = SampleOptions(variant="relaxed", float_output=True)
    real = made(samples_file(source, tmp_path / "b.tif", options=options))
    assert (whole.values.dtype, real.values.dtype) == (np.int16, np.float32)
    np.testing.assert_array_equal(whole.values, np.rint(real.values))


def test_scaled_elevations_are_real_ones(tmp_path):
    """Stored in decimetres above 1000 m: the options speak of metres, the file of decimetres."""

    def scaled(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(1000)

    source = thinned(tmp_path / "in.tif", setup=scaled)
    before = raster.read(source)
    back = made(samples_file(source, tmp_path / "out.tif"))
    assert (back.meta.scale, back.meta.offset) == (0.1, 1000)
    np.testing.assert_array_equal(back.values[~before.void], before.values[~before.void])
    assert abs(back.values - hills(60, 80)).mean() < 30
    other = samples_file(source, tmp_path / "o.tif", resolution=1 / 1200, crs="EPSG:4326")
    assert made(other).values.mean() == pytest.approx(1000 + 0.1 * back.values.mean(), abs=2)


def test_a_raster_on_another_grid_gives_points(tmp_path):
    """Known cells of 30 m become samples of a finer grid in another place."""
    values = np.full((30, 40), -9999, np.int16)
    values[::5, ::5] = 700
    source = make_raster(
        tmp_path / "in.tif", values, nodata=-9999, geotransform=(300000, 30, 0, 4700900, 0, -30),
        crs=UTM,
    )  # fmt: skip
    result = samples_file(
        source, tmp_path / "out.tif", extent=(300300, 4700000, 301200, 4700900), resolution=10,
        options=FAST,
    )  # fmt: skip
    back = made(result)
    assert back.values.dtype == np.float32 and (back.values == 700).all()
    assert (result.samples, result.samples_outside) == (6 * 6, 6 * 2)
    warped = samples_file(
        source, tmp_path / "w.tif", resolution=0.001, crs="EPSG:4326", options=FAST
    )
    assert warped.samples == 48 and "4326" in made(warped).grid.crs


def test_points_beside_a_raster(tmp_path):
    """The raster's grid; a point is believed rather than its cell."""
    source = thinned(tmp_path / "in.tif")
    before = raster.read(source)
    row, column = (int(each[0]) for each in np.nonzero(~before.void))
    x, y = before.grid.xy(row, column)
    result = samples_file([Samples([(x, y, 4321.5)]), source], tmp_path / "out.tif", options=FAST)
    back = made(result)
    assert back.grid == before.grid and back.values[row, column] == 4321.5
    assert result.samples == (~before.void).sum() + 1


def test_rasters_are_read_as_elsewhere(tmp_path):
    values = hills(20, 30)
    values[5:15, 5:15] = 7
    bands = np.stack([np.zeros_like(values), values])
    source = make_raster(tmp_path / "in.tif", bands)
    result = samples_file(source, tmp_path / "out.tif", band=2, nodata=[7])
    assert result.cells_filled == 100
    with pytest.raises(InputError, match="band 3 asked"):
        samples_file(source, tmp_path / "no.tif", band=3)
    with pytest.raises(InputError, match="no known cell"):
        samples_file(source, tmp_path / "no.tif", band=1, nodata=0)


# --- sketches and noise --------------------------------------------------------------------------


def test_a_sketch_in_its_extent(tmp_path):
    pixels = np.zeros((9, 12), np.uint8)
    pixels[2, 2:10] = 255
    pixels[6, :] = 51
    sketch = make_image(tmp_path / "s.png", pixels)
    result = samples_file(
        (), tmp_path / "out.tif", sketch=sketch, sketch_low=100, sketch_high=600, extent=EXTENT,
        crs=UTM,
    )  # fmt: skip
    back = made(result)
    assert back.grid.geotransform == (300000, 100, 0, 4700900, 0, -100)
    assert (back.values[2, 2:10] == 600).all()
    np.testing.assert_allclose(back.values[6], 200, atol=1e-4)
    assert result.cells_known == 8 + 12 and result.samples == 0
    finer = samples_file(
        (), tmp_path / "f.tif", sketch=sketch, extent=EXTENT, resolution=10, options=FAST
    )
    assert finer.cells_known == 100 * result.cells_known


def test_what_is_unpainted(tmp_path):
    gray = np.full((4, 4), 255, np.uint8)
    gray[0, 0] = 0
    plain = make_image(tmp_path / "plain.png", gray)
    seen = np.stack([gray, np.where(gray == 255, 0, 255).astype(np.uint8)], axis=2)
    veiled = make_image(tmp_path / "veiled.png", seen)

    def known(sketch, **how):
        out = tmp_path / "out.tif"
        return samples_file((), out, sketch=sketch, overwrite=True, **how).cells_known

    assert known(plain) == 15
    assert known(plain, sketch_background="white") == 1
    assert known(plain, sketch_background="none") == 16
    assert known(veiled) == known(veiled, sketch_background="none") == 1
    blank = make_image(tmp_path / "blank.png", np.zeros((4, 4), np.uint8))
    with pytest.raises(InputError, match="all of it is black"):
        known(blank)
    with pytest.raises(InputError, match="background is 'grey'"):
        known(plain, sketch_background="grey")
    with pytest.raises(InputError, match="must be finite"):
        known(plain, sketch_high=np.inf)
    with pytest.raises(InputError, match="does not exist"):
        known(tmp_path / "no.png")


def test_nothing_but_noise(tmp_path):
    for name, seed, threads in (("a", 3, 1), ("b", 3, 2), ("c", 4, 1)):
        result = samples_file(
            (), tmp_path / f"{name}.tif", extent=EXTENT, resolution=5, crs=UTM, threads=threads,
            options=SampleOptions(seed=seed),
        )  # fmt: skip
    assert (result.samples, result.cells_known) == (0, 0)
    assert np.ptp(made(result).values) > 200
    a, b, c = (digest(tmp_path / f"{name}.tif") for name in "abc")
    assert a == b != c
