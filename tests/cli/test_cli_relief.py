"""``demsmith relief`` on rasters made on the spot."""

import json
import os

import numpy as np
import pytest
from support import digest, hills, make_raster

from demsmith.core import raster
from demsmith.core.options import specifications
from demsmith.core.relief import ReliefOptions


@pytest.fixture
def dem(tmp_path):
    ground = hills()
    ground[10:13, 20:24] = -9999
    return make_raster(tmp_path / "dem.tif", ground, nodata=-9999)


@pytest.fixture
def output(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder / "made.tif"


def test_summary(demsmith, dem, output):
    before = digest(dem)
    status, out, err = demsmith("relief", dem, output)
    assert (status, out) == (0, "")
    assert err.startswith("slope from ")
    assert err.endswith(f" s -> {output}\n")
    made = raster.read(output)
    np.testing.assert_array_equal(made.void, raster.read(dem).void)
    assert 0 <= made.values[~made.void].min() < made.values.max() < 90
    assert digest(dem) == before


def test_level_ground(demsmith, tmp_path, output):
    level = make_raster(tmp_path / "level.tif", np.full((5, 5), 3, np.int16))
    assert demsmith("relief", level, output, "--kind", "aspect").err.startswith(
        "aspect level everywhere in "
    )


def test_json(demsmith, dem, output):
    status, out, err = demsmith("relief", dem, output, "--json", "--kind", "hillshade")
    result = json.loads(out)
    assert (status, err) == (0, "")
    assert (result["kind"], result["cells"], result["cells_known"]) == ("hillshade", 4800, 4788)
    assert 1 <= result["minimum"] < result["maximum"] <= 255
    assert result["output"] == str(output)
    assert {"seconds", "version", "warnings"} < set(result)


def test_every_option_of_the_core_is_one_here_and_matters(demsmith, dem, output):
    shade, spread = ("--kind", "hillshade"), ("--kind", "deviation")
    made = [
        (), ("--unit", "percent"), ("--method", "zevenbergen-thorne"), shade,
        (*shade, "--azimuth", 90), (*shade, "--altitude", 20), (*shade, "--exaggeration", 3),
        (*shade, "--multidirectional"), spread, (*spread, "--radius", 300),
    ]  # fmt: skip
    used = {word for options in made for word in options if str(word).startswith("--")}
    assert used == {f"--{spec.name}" for spec in specifications(ReliefOptions)}
    files = set()
    for options in made:
        assert demsmith("relief", dem, output, "--overwrite", *options).status == 0
        files.add(raster.read(output).values.tobytes())
    assert len(files) == len(made)


def test_source_and_run_options_matter(demsmith, tmp_path, dem, output):
    mask = np.zeros((60, 80), np.uint8)
    mask[:, :40] = 1
    mask = make_raster(tmp_path / "mask.tif", mask)
    done = demsmith(
        "relief", dem, output, "--mask", mask, "--threads", 1, "--quiet",
        "--creation-option", "COMPRESS=LZW",
    )  # fmt: skip
    assert done == (0, "", "")
    assert raster.read(output).void[:, :40].all()


def test_help(demsmith):
    status, out, err = demsmith("relief", "--help")
    assert (status, err) == (0, "")
    assert {"--kind", "--radius", "--multidirectional", "--json"} <= set(out.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--kind", "curvature"), "curvature"),
        (("--azimuth", 400), "azimuth is 400"),
        (("--kind", "deviation", "--radius", 20), "less than a cell"),
        (("--band", 3), "band 3"),
        (("--below", 99999), "every cell is a void"),
    ],
)
def test_refused(demsmith, dem, output, words, said):
    status, out, err = demsmith("relief", dem, output, *words)
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert said in err
    assert os.listdir(output.parent) == []


def test_existing_output_stays(demsmith, dem, output):
    output.write_text("precious")
    outcome = demsmith("relief", dem, output)
    assert outcome.status == 2
    assert "--overwrite" in outcome.err
    assert output.read_text() == "precious"
