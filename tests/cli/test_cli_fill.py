"""``demsmith fill`` on rasters made on the spot, and on the real tiles."""

import json
import os

import numpy as np
import pytest
from support import WGS84_3ARC, digest, hills, make_hgt, make_raster, shared_data, truncate

from demsmith.core import raster

ROTATED = (10.0, 1 / 1200, 1 / 5000, 50.0, 1 / 5000, -1 / 1200)
REAL = (
    "catalonia_raw/N41E001.hgt",
    "mindoro_raw/N13E120.hgt",
    "pair_naples/raw/N40E014.hgt",
    "pyrenees_raw/N42E001.hgt",
    "rainier_raw/mt_rainier_90m_N46W122.tif",
    "saotome_raw/n00_e006_3arc_v2.dt1",
    "taunus_raw/N50E008.hgt",
    "vancouver_raw/N49W124.tif",
    "edge/dtm_philondenx_1m_zero_nodata.tif",
    "edge/no_srs.tif",
    "edge/skinny_8x160.tif",
    "edge/tiny_6x4.tif",
)


@pytest.fixture
def dem(tmp_path):
    """Raster with two voids: one of 12 cells inside, one of 6 at the edge."""
    ground = hills()
    ground[10:13, 20:24] = -9999
    ground[0:2, 0:3] = -9999
    return make_raster(tmp_path / "dem.tif", ground, nodata=-9999)


@pytest.fixture
def output(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder / "filled.tif"


def assert_refused(outcome, said, output):
    assert (outcome.status, outcome.out) == (2, "")
    assert outcome.err.startswith("error: ")
    assert said in outcome.err
    assert len(outcome.err.splitlines()) == 1
    assert os.listdir(output.parent) == []


def test_summary(demsmith, dem, output):
    before = digest(dem)
    status, out, err = demsmith("fill", dem, output)
    assert (status, out) == (0, "")
    assert err.startswith("filled 18 cells in 2 voids (largest 12) in ")
    assert err.endswith(f" s -> {output}\n")
    assert len(err.splitlines()) == 1
    assert digest(dem) == before
    assert os.listdir(output.parent) == ["filled.tif"]


def test_summary_counts_what_is_left(demsmith, dem, output):
    status, _, err = demsmith("fill", dem, output, "--interior-only")
    assert status == 0
    assert "filled 12 cells in 2 voids (largest 12), left 6 cells unfilled in " in err
    assert raster.read(output).void.sum() == 6


def test_summary_without_voids(demsmith, tmp_path, output):
    whole = make_raster(tmp_path / "whole.tif", hills())
    status, _, err = demsmith("fill", whole, output)
    warning, summary = err.splitlines()
    assert status == 0
    assert warning.startswith("warning: ")
    assert summary.startswith("no voids to fill in ")


def test_json(demsmith, dem, output):
    source_map, report = output.with_name("source.tif"), output.with_name("report.json")
    sigma = output.with_name("sigma.tif")
    status, out, err = demsmith(
        "fill", dem, output, "--json", "--source-map", source_map, "--report", report,
        "--uncertainty", sigma,
    )  # fmt: skip
    result = json.loads(out)
    assert (status, err) == (0, "")
    assert len(out.splitlines()) == 1
    assert {"output", "seconds", "version", "voids", "cells_filled", "cells_unfilled"} <= set(
        result
    )
    assert result["output"] == str(output)
    assert result["source_map"] == str(source_map)
    assert result["report"] == str(report)
    assert (result["voids"], result["cells_filled"], result["cells_unfilled"]) == (2, 18, 0)
    assert result["seconds"] > 0
    assert result["uncertainty"] == str(sigma)
    assert len(result["reasons"]) == 4
    assert np.count_nonzero(raster.read(source_map).values) == 18
    assert np.count_nonzero(raster.read(sigma).values) == 18
    assert len(json.loads(report.read_text())["void_table"]) == 2


def test_methods(demsmith, dem, output):
    """MCMD is another fill, has no uncertainty, and says so before it begins."""
    made = []
    for method in ("auto", "mcmd"):
        words = ("--method", method, "--float", "--overwrite")
        assert demsmith("fill", dem, output, *words).status == 0
        made.append(digest(output))
    assert made[0] != made[1]
    output.unlink()
    outcome = demsmith(
        "fill", dem, output, "--method", "mcmd", "--uncertainty", output.with_name("sigma.tif")
    )
    assert_refused(outcome, "method auto", output)


def test_quiet_says_nothing(demsmith, tmp_path, output):
    odd = make_raster(tmp_path / "odd.tif", hills(), crs="", geotransform=None)
    assert demsmith("fill", odd, output, "--quiet") == (0, "", "")
    again = demsmith("fill", odd, output, "--quiet")
    assert again.status == 2
    assert "--overwrite" in again.err


def test_warnings_have_a_line_each(demsmith, tmp_path, output):
    ground = hills()
    ground[5, 5] = 32000
    odd = make_raster(tmp_path / "odd.tif", ground, crs="")
    err = demsmith("fill", odd, output).err.splitlines()
    assert len(err) > 2
    assert all(line.startswith("warning: ") for line in err[:-1])
    assert any("32000" in line for line in err[:-1])


def test_options_matter(demsmith, tmp_path, dem, output):
    mask = np.zeros((60, 80), np.uint8)
    mask[30:32, 30:40] = 1
    mask = make_raster(tmp_path / "mask.tif", mask)
    ground = raster.read(dem).values
    high = int((ground >= 900).sum())
    outcome = demsmith(
        "fill", dem, output, "--mask", mask, "--nodata", ground[50, 60], "--above", 900, "--float",
        "--json", "--creation-option", "COMPRESS=LZW",
    )  # fmt: skip
    result = json.loads(outcome.out)
    assert result["cells_void"] >= 18 + 20 + high
    assert raster.read(output).values.dtype == np.float32
    assert demsmith("fill", dem, output, "--overwrite", "--max-size", 6, "--json").status == 0
    assert raster.read(output).void.sum() == 12


def test_same_seed_same_bytes(demsmith, dem, output):
    made = []
    for seed, threads in ((1, 1), (1, 2), (2, 2)):
        words = ("--r-s", 0.3, "--seed", seed, "--threads", threads, "--overwrite")
        assert demsmith("fill", dem, output, *words).status == 0
        made.append(digest(output))
    assert made[0] == made[1] != made[2]


def test_maps(demsmith, tmp_path, dem, output):
    """Rough in the west, where the void at the edge is, and smooth inside."""
    r_s = np.zeros((60, 80), np.float32)
    r_s[:, :10] = 0.5
    rough = make_raster(tmp_path / "rough.tif", r_s)
    words = ("--r-s-map", rough, "--variant", "weighted", "--float")
    assert demsmith("fill", dem, output, *words).status == 0
    mapped = raster.read(output).values
    assert demsmith("fill", dem, output, *words[2:], "--overwrite").status == 0
    smooth = raster.read(output).values
    assert (mapped != smooth)[0:2, 0:3].any()
    assert (mapped == smooth)[10:13, 20:24].all()


def test_maps_that_do_not_fit(demsmith, tmp_path, dem, output):
    small = make_raster(tmp_path / "small.tif", np.zeros((4, 4), np.float32))
    steep = make_raster(tmp_path / "steep.tif", np.full((60, 80), 3, np.float32))
    x, *rest = WGS84_3ARC
    aside = make_raster(tmp_path / "aside.tif", np.zeros((60, 80)), geotransform=(x + 1, *rest))
    assert_refused(demsmith("fill", dem, output, "--h-map", small), "4 × 4", output)
    assert_refused(demsmith("fill", dem, output, "--h-map", aside), "lies elsewhere", output)
    assert_refused(demsmith("fill", dem, output, "--h-map", "no.tif"), "does not exist", output)
    assert_refused(demsmith("fill", dem, output, "--h-map", steep), "map of h is 3", output)
    assert_refused(demsmith("fill", dem, output, "--l-map", steep), "no such curve", output)


def test_band(demsmith, tmp_path, output):
    bands = np.stack([hills(), hills(seed=2)])
    bands[1, 5:9, 5:9] = -9999
    two = make_raster(tmp_path / "two.tif", bands, nodata=-9999)
    assert "filled 16 cells" in demsmith("fill", two, output, "--band", 2).err
    output.unlink()
    assert_refused(demsmith("fill", two, output, "--band", 3), "band 3 asked", output)


def test_existing_output_stays(demsmith, dem, output):
    output.write_text("precious")
    outcome = demsmith("fill", dem, output)
    assert outcome.status == 2
    assert "--overwrite" in outcome.err
    assert output.read_text() == "precious"
    assert demsmith("fill", dem, output, "--overwrite").status == 0
    assert raster.read(output).void.sum() == 0


def test_output_is_input(demsmith, dem):
    before = digest(dem)
    outcome = demsmith("fill", dem, dem, "--overwrite")
    assert outcome.status == 2
    assert "is an input" in outcome.err
    assert digest(dem) == before


def test_truncated_hgt(demsmith, tmp_path, output):
    tile = make_hgt(tmp_path / "N42E001.hgt", np.zeros((1201, 1201)))
    assert_refused(demsmith("fill", truncate(tile, 0.7), output), "truncated", output)


def test_bad_input(demsmith, tmp_path, dem, output):
    nothing = make_raster(tmp_path / "nothing.tif", np.full((9, 9), -9999, np.int16), nodata=-9999)
    rotated = make_raster(tmp_path / "rotated.tif", hills(), geotransform=ROTATED)
    text = tmp_path / "text.tif"
    text.write_text("no raster")
    small = make_raster(tmp_path / "small.tif", np.ones((4, 4), np.uint8))
    assert_refused(demsmith("fill", nothing, output), "'" + nothing, output)
    assert_refused(demsmith("fill", rotated, output), "rotated", output)
    assert_refused(demsmith("fill", text, output), "not a raster", output)
    assert_refused(demsmith("fill", tmp_path / "no.tif", output), "does not exist", output)
    assert_refused(demsmith("fill", dem, output, "--mask", small), "4 × 4", output)
    assert_refused(demsmith("fill", dem, output, "--threads", 0), "threads is 0", output)
    assert_refused(demsmith("fill", dem, output, "--creation-option", "LZW"), "KEY=VALUE", output)
    assert_refused(demsmith("fill", dem, output.with_suffix(".png")), ".tif", output)
    assert_refused(demsmith("fill", dem, output.parent / "no" / "o.tif"), "no folder", output)
    assert_refused(demsmith("fill", dem, output, "--report", output), "different files", output)


def test_half_a_tile_void(demsmith, tmp_path, output):
    ground = hills()
    ground[:, 40:] = -32768
    half = make_raster(tmp_path / "half.tif", ground, geotransform=WGS84_3ARC)
    assert demsmith("fill", half, output).status == 0
    filled = raster.read(output)
    assert not filled.void.any()
    np.testing.assert_array_equal(filled.values[:, :40], ground[:, :40])


@pytest.mark.parametrize("name", REAL)
def test_real_tile(demsmith, output, name):
    tile = shared_data(name)
    before = digest(tile)
    status, out, err = demsmith("fill", tile, output, "--json")
    assert status == 0, err
    result = json.loads(out)
    source, filled = raster.read(tile), raster.read(output)
    assert result["cells_unfilled"] == 0
    assert result["cells_filled"] == source.void.sum()
    assert not filled.void.any()
    np.testing.assert_array_equal(filled.values[~source.void], source.values[~source.void])
    assert filled.values.dtype == source.values.dtype
    assert filled.grid.geotransform == pytest.approx(source.grid.geotransform, rel=1e-12)
    assert digest(tile) == before


def test_real_tile_all_void(demsmith, output):
    assert_refused(demsmith("fill", shared_data("edge/all_nodata.tif"), output), "void", output)
