"""A size or a PSNR is asked for: reached, and without loss where that takes no more."""

import numpy as np
import pytest
from support import hills, make_raster

from demsmith.core import raster
from demsmith.core.sct import (
    CompressOptions,
    DecompressOptions,
    compress_file,
    decompress_file,
)


@pytest.fixture
def dem(tmp_path):
    noise = np.random.default_rng(0).normal(0, 2, (160, 192))
    return make_raster(tmp_path / "dem.tif", (hills(160, 192) + noise).astype(np.int16))


def _compressed(tmp_path, path, **options):
    return compress_file(
        path, tmp_path / "x.sct", options=CompressOptions(effort="low", **options), overwrite=True
    )


@pytest.mark.parametrize("psnr", [30, 40, 50])
def test_psnr_is_reached_and_not_far_surpassed(tmp_path, dem, psnr):
    assert psnr <= _compressed(tmp_path, dem, psnr=psnr).psnr < psnr + 3


def test_ratio_is_reached_and_made_use_of(tmp_path, dem):
    result = _compressed(tmp_path, dem, ratio=12)
    assert 12 <= result.bytes_raw / result.bytes < 12.5


def test_a_psnr_beyond_rounding_and_a_low_ratio_are_without_loss(tmp_path, dem):
    lossless = _compressed(tmp_path, dem, max_error=0).bytes
    for options in (dict(psnr=150), dict(ratio=1.5)):
        result = _compressed(tmp_path, dem, **options)
        assert result.max_error_measured == 0
        assert result.bytes <= lossless + 40


@pytest.mark.parametrize("dtype", [np.int16, np.float32])
def test_a_level_raster_has_any_psnr(tmp_path, dtype):
    path = make_raster(tmp_path / "level.tif", np.full((90, 70), 0.3).astype(dtype))
    assert _compressed(tmp_path, path, psnr=60).max_error_measured < 1e-6


@pytest.mark.parametrize("options", [dict(max_error=1), dict(max_error=12), dict(ratio=12)])
@pytest.mark.parametrize("scale", [0.5, 0.25, 0.125])
def test_overviews_are_means_of_the_cells(tmp_path, dem, options, scale):
    _compressed(tmp_path, dem, **options)
    for name, at in (("whole.tif", 1.0), ("small.tif", scale)):
        decompress_file(
            tmp_path / "x.sct", tmp_path / name, options=DecompressOptions(scale=at), overwrite=True
        )
    whole, small = (raster.read(tmp_path / name).values for name in ("whole.tif", "small.tif"))
    side = round(1 / scale)
    means = whole.reshape(160 // side, side, 192 // side, side).mean(axis=(1, 3))
    inner = np.s_[2:-2, 2:-2]
    assert np.abs(small - means)[inner].max() < 0.03 * np.ptp(means)
    # No shift: what is left does not go with the slope.
    slopes = [slope[inner].ravel() for slope in np.gradient(means)]
    shift = np.linalg.lstsq(np.stack(slopes, 1), (small - means)[inner].ravel(), rcond=None)[0]
    assert np.abs(shift).max() < 0.03


def test_a_mean_of_cells_is_within_the_error_of_the_truth(tmp_path, dem):
    _compressed(tmp_path, dem, max_error=3)
    truth = raster.read(dem).values.astype(float)
    decompress_file(
        tmp_path / "x.sct", tmp_path / "part.tif", options=DecompressOptions(scale=0.25),
        window=(21, 13, 120, 96), overwrite=True,
    )  # fmt: skip
    part = truth[13 : 13 + 96, 21 : 21 + 120].reshape(24, 4, 30, 4).mean(axis=(1, 3))
    assert np.abs(raster.read(tmp_path / "part.tif").values - part).max() <= 3
