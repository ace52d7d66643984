"""``demsmith compress``, ``decompress`` and ``info`` on rasters made on the spot."""

import json
import os

import numpy as np
import pytest
from support import digest, hills, make_raster, truncate

from demsmith.core import raster
from demsmith.core.options import specifications
from demsmith.core.sct import CompressOptions, DecompressOptions


@pytest.fixture
def dem(tmp_path):
    ground = hills(270, 280)
    ground[10:13, 20:24] = -9999
    return make_raster(tmp_path / "dem.tif", ground, nodata=-9999)


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


@pytest.fixture
def sct(demsmith, dem, folder):
    path = folder / "dem.sct"
    assert demsmith("compress", dem, path, "--effort", "low", "--no-vrt").status == 0
    return path


def test_summary(demsmith, dem, folder):
    before = digest(dem)
    output = folder / "dem.sct"
    status, out, err = demsmith("compress", dem, output)
    assert (status, out) == (0, "")
    size = output.stat().st_size
    assert err.startswith(f"151200 bytes to {size} (")
    assert "bits per cell), maximum error 1, in " in err
    assert err.endswith(f" s -> {output}\n")
    assert sorted(os.listdir(folder)) == ["dem.sct", "dem.sct.vrt"]
    assert digest(dem) == before


def test_there_and_back(demsmith, dem, folder):
    sct, back = folder / "dem.sct", folder / "back.tif"
    assert demsmith("compress", dem, sct, "--max-error", 0, "--effort", "low").status == 0
    status, out, err = demsmith("decompress", sct, back)
    assert (status, out) == (0, "")
    assert err.startswith("270 × 280 cells, maximum error 0, in ")
    one, two = raster.read(dem), raster.read(back)
    np.testing.assert_array_equal(one.values, two.values, strict=True)
    np.testing.assert_array_equal(one.void, two.void)
    assert one.grid.geotransform == two.grid.geotransform
    assert two.meta.nodata == -9999


def test_json(demsmith, dem, folder):
    sct = folder / "dem.sct"
    status, out, err = demsmith("compress", dem, sct, "--json", "--max-error", 4)
    result = json.loads(out)
    assert (status, err) == (0, "")
    assert result["bytes"] == sct.stat().st_size
    assert result["ratio"] == result["bytes_raw"] / result["bytes"] == 151200 / result["bytes"]
    assert result["bits_per_cell"] == 8 * result["bytes"] / 75600
    assert (result["cells"], result["cells_known"]) == (75600, 75588)
    assert (result["mode"], result["tree"], result["max_error"]) == ("max-error", "pyramid", 4)
    assert 0 < result["rmse"] < result["max_error_measured"] <= 4
    assert {"output", "vrt", "seconds", "version", "warnings", "psnr"} < set(result)
    status, out, err = demsmith("decompress", sct, folder / "b.tif", "--json", "--scale", 0.5)
    result = json.loads(out)
    assert (status, err) == (0, "")
    assert (result["rows"], result["columns"], result["max_error"]) == (135, 140, None)
    assert {"output", "seconds", "version", "warnings", "cells", "cells_known"} < set(result)


def test_info(demsmith, dem, sct):
    status, out, err = demsmith("info", sct)
    assert (status, err) == (0, "")
    lines = dict(line.split(":", 1) for line in out.splitlines())
    assert lines["CRS"].strip() == "EPSG:4326"
    assert lines["size"].strip() == "270 rows × 280 columns, int16, nodata -9999"
    assert lines["maximum error"].strip() == "1; measured 1"
    assert lines["known cells"].strip() == "75588 of 75600"
    parts = [int(size) for name, size in lines.items() if name.startswith("  ")]
    assert sum(parts) == sct.stat().st_size
    status, out, err = demsmith("info", sct, "--json")
    told = json.loads(out)
    assert (status, err) == (0, "")
    assert told["bytes"] == sum(told["bytes_by_section"].values()) == sct.stat().st_size
    assert told["geotransform"] == list(raster.read(dem).grid.geotransform)
    assert told["max_error"] == told["max_error_measured"] == 1
    known = raster.read(dem)
    known = known.values[~known.void]
    assert (told["low"], told["high"]) == (known.min(), known.max())


@pytest.mark.parametrize("ratio", [20, 40])
def test_ratio(demsmith, dem, folder, ratio):
    sct = folder / "dem.sct"
    assert demsmith("compress", dem, sct, "--ratio", ratio).status == 0
    size = sct.stat().st_size
    assert 0.7 * 151200 / ratio < size <= 151200 / ratio


@pytest.mark.parametrize("psnr", [30, 50])
def test_psnr(demsmith, dem, folder, psnr):
    status, out, _ = demsmith("compress", dem, folder / "dem.sct", "--psnr", psnr, "--json")
    assert status == 0
    result = json.loads(out)
    assert psnr <= result["psnr"] < psnr + 3
    assert demsmith("decompress", folder / "dem.sct", folder / "back.tif").status == 0
    one, two = raster.read(dem), raster.read(folder / "back.tif")
    wrong = (one.values.astype(float) - two.values)[~one.void]
    high, low = one.values[~one.void].max(), one.values[~one.void].min()
    reached = 20 * np.log10((high - low) / np.sqrt(np.mean(wrong**2)))
    assert reached == pytest.approx(result["psnr"])


def test_window_and_scale(demsmith, dem, sct, folder):
    whole, part = folder / "whole.tif", folder / "part.tif"
    assert demsmith("decompress", sct, whole).status == 0
    assert demsmith("decompress", sct, part, "--window", 20, 5, 100, 50).status == 0
    np.testing.assert_array_equal(raster.read(part).values, raster.read(whole).values[5:55, 20:120])
    assert demsmith("decompress", sct, part, "--scale", 2, "--overwrite").status == 0
    assert raster.read(part).values.shape == (540, 560)
    assert raster.read(part).values.dtype == np.float32


def test_the_virtual_raster_can_be_written_anew(demsmith, dem, sct, folder):
    assert demsmith("decompress", sct, folder / "moved.vrt").status == 0
    assert str(sct) in (folder / "moved.vrt").read_text()
    outcome = demsmith("decompress", sct, folder / "half.vrt", "--scale", 0.5)
    assert outcome.status == 2
    assert "a virtual raster is of the whole file" in outcome.err


def test_every_option_of_the_core_is_one_here(demsmith):
    for verb, options in (("compress", CompressOptions), ("decompress", DecompressOptions)):
        status, out, _ = demsmith(verb, "--help")
        assert status == 0
        words = {f"--{spec.name.replace('_', '-')}" for spec in specifications(options)}
        assert words <= set(out.split())


def test_source_options_matter(demsmith, tmp_path, dem, folder):
    mask = np.zeros((270, 280), np.uint8)
    mask[:, :40] = 1
    mask = make_raster(tmp_path / "mask.tif", mask)
    sct, back = folder / "dem.sct", folder / "back.tif"
    done = demsmith(
        "compress", dem, sct, "--mask", mask, "--above", 900, "--threads", 1, "--quiet",
        "--effort", "low",
    )  # fmt: skip
    assert done == (0, "", "")
    assert demsmith("decompress", sct, back, "--creation-option", "COMPRESS=LZW").status == 0
    read = raster.read(back)
    assert read.void[:, :40].all()
    assert read.values[~read.void].max() < 901


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--max-error", -1), "max_error is -1"),
        (("--max-error", 1, "--ratio", 5), "max-error and ratio are asked for at once"),
        (("--psnr", 40, "--sparsity", 2), "psnr and a tree of patches"),
        (("--ratio", 0.5), "ratio is 0.5"),
        (("--ratio", 100000), "ratio of 100000"),
        (("--effort", "extreme"), "extreme"),
        (("--band", 3), "band 3"),
        (("--below", 99999), "every cell is a void"),
    ],
)
def test_refused(demsmith, dem, folder, words, said):
    status, out, err = demsmith("compress", dem, folder / "dem.sct", *words)
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert said in err
    assert os.listdir(folder) == []


def test_wrong_names_are_refused(demsmith, dem, sct, folder):
    for words, said in (
        (("compress", dem, folder / "dem.tif"), "must end in .sct"),
        (("decompress", sct, folder / "dem.png"), "must be a GeoTIFF"),
        (("decompress", dem, folder / "back.tif"), "is no Sparse Construction Tree (.sct)"),
        (("decompress", folder / "none.sct", folder / "back.tif"), "does not exist"),
        (("info", dem), "is no Sparse Construction Tree (.sct)"),
        (("decompress", sct, folder / "back.tif", "--window", 270, 0, 20, 5), "are no part of"),
        (("decompress", sct, folder / "back.tif", "--window", 1, 2, 3), "--window"),
        (("decompress", sct, folder / "back.tif", "--window", 1.5, 2, 3, 4), "no whole number"),
    ):
        status, _, err = demsmith(*words)
        assert status == 2
        assert said in err
    assert os.listdir(folder) == ["dem.sct"]


def test_a_truncated_file_is_told(demsmith, sct, folder):
    truncate(sct, 0.7)
    status, _, err = demsmith("decompress", sct, folder / "back.tif")
    assert status == 2
    assert "dem.sct' is truncated" in err
    assert os.listdir(folder) == ["dem.sct"]


def test_existing_outputs_stay(demsmith, dem, folder):
    for name in ("dem.sct", "dem.sct.vrt"):
        path = folder / name
        path.write_text("precious")
        outcome = demsmith("compress", dem, folder / "dem.sct")
        assert outcome.status == 2
        assert "--overwrite" in outcome.err
        assert path.read_text() == "precious"
        assert os.listdir(folder) == [name]
        path.unlink()
