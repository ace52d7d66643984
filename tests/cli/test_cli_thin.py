"""``demsmith thin`` on rasters made on the spot."""

import json
import os

import numpy as np
import pytest
from support import digest, hills, make_raster

from demsmith.core import raster
from demsmith.core.options import specifications
from demsmith.core.thinning import ThinOptions


@pytest.fixture
def dem(tmp_path):
    ground = hills()
    ground[10:13, 20:24] = -9999
    return make_raster(tmp_path / "dem.tif", ground, nodata=-9999)


@pytest.fixture
def output(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder / "thinned.tif"


def kept_cells(path):
    return ~raster.read(path).void


def test_summary(demsmith, dem, output):
    before = digest(dem)
    status, out, err = demsmith("thin", dem, output)
    assert (status, out) == (0, "")
    assert err.startswith("kept 478 of 4788 known cells (9.98 %) in ")
    assert err.endswith(f" s -> {output}\n")
    kept = kept_cells(output)
    assert kept.sum() == 478
    np.testing.assert_array_equal(raster.read(output).values[kept], raster.read(dem).values[kept])
    assert digest(dem) == before


def test_json(demsmith, dem, output):
    points = output.with_suffix(".csv")
    status, out, err = demsmith(
        "thin", dem, output, "--json", "--share", 0.02, "--points", points, "--detector", "sobel"
    )
    result = json.loads(out)
    assert (status, err) == (0, "")
    assert (result["cells"], result["cells_known"], result["cells_kept"]) == (4800, 4788, 95)
    assert result["share"] == 95 / 4788
    assert (result["output"], result["points"]) == (str(output), str(points))
    assert {"seconds", "version", "warnings"} < set(result)
    assert len(points.read_text().splitlines()) == 1 + 95


def test_every_option_of_the_core_is_one_here_and_matters(demsmith, dem, output):
    words = {"--share": 0.03, "--detector": "random", "--seed": 5}
    assert set(words) == {f"--{spec.name}" for spec in specifications(ThinOptions)}
    made = [("--detector", "random"), ("--detector", "random", "--seed", 5), (), ("--share", 0.03)]
    masks = []
    for options in made:
        assert demsmith("thin", dem, output, "--overwrite", *options).status == 0
        masks.append(kept_cells(output).tobytes())
    assert len(set(masks)) == len(made)


def test_source_and_run_options_matter(demsmith, tmp_path, dem, output):
    mask = np.zeros((60, 80), np.uint8)
    mask[:, :40] = 1
    mask = make_raster(tmp_path / "mask.tif", mask)
    done = demsmith(
        "thin", dem, output, "--mask", mask, "--above", 900, "--threads", 1, "--quiet",
        "--creation-option", "COMPRESS=LZW",
    )  # fmt: skip
    assert done == (0, "", "")
    kept = kept_cells(output)
    assert not kept[:, :40].any()
    assert raster.read(dem).values[kept].max() < 900


def test_help(demsmith):
    status, out, err = demsmith("thin", "--help")
    assert (status, err) == (0, "")
    assert {"--share", "--detector", "--seed", "--points", "--json"} <= set(out.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--share", 0), "share is 0"),
        (("--share", 1.1), "share is 1.1"),
        (("--detector", "canny"), "canny"),
        (("--points", "points.xyz"), "points.xyz"),
        (("--band", 3), "band 3"),
        (("--below", 99999), "every cell is a void"),
    ],
)
def test_refused(demsmith, dem, output, words, said):
    status, out, err = demsmith("thin", dem, output, *words)
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert said in err
    assert os.listdir(output.parent) == []


def test_existing_output_stays(demsmith, dem, output):
    output.write_text("precious")
    outcome = demsmith("thin", dem, output)
    assert outcome.status == 2
    assert "--overwrite" in outcome.err
    assert output.read_text() == "precious"
