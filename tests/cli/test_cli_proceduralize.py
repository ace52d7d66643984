"""``demsmith proceduralize`` on rasters made on the spot."""

import json
import os

import numpy as np
import pytest
from support import hills, make_raster

from demsmith.core import raster
from demsmith.core.options import specifications
from demsmith.core.procedural import OutputOptions, ProceduralizeOptions

QUICK = ("--candidates", 200, "--atoms", 30)


@pytest.fixture
def dem(tmp_path):
    ground = hills()
    ground[10:13, 20:24] = -9999
    return make_raster(tmp_path / "dem.tif", ground, nodata=-9999)


@pytest.fixture
def output(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder / "model.dsp"


def test_summary(demsmith, dem, output):
    status, out, err = demsmith("proceduralize", dem, output, *QUICK)
    assert (status, out) == (0, "")
    assert err.startswith("modelled 4788 cells by 192 discs of 30 functions in ")
    assert err.endswith(f" s -> {output}\n")
    assert os.listdir(output.parent) == ["model.dsp"]


def test_a_model_is_evaluated_again(demsmith, dem, output):
    fine, again = output.with_name("fine.tif"), output.with_name("again.tif")
    words = ("--raster", fine, "--scale", 2, "--json")
    status, out, err = demsmith("proceduralize", dem, output, *QUICK, *words)
    result = json.loads(out)
    assert (status, err) == (0, "")
    assert (result["output"], result["raster"]) == (str(output), str(fine))
    assert result["rmse"] > 0
    assert {"seconds", "version", "warnings", "psnr", "bytes"} < set(result)
    status, out, err = demsmith("proceduralize", output, again, "--scale", 2)
    assert (status, out) == (0, "")
    assert err.startswith("evaluated 192 discs in ")
    one, other = raster.read(fine), raster.read(again)
    assert one.grid.shape == (120, 160)
    np.testing.assert_array_equal(one.values, other.values)


def test_every_option_of_the_core_is_one_here_and_matters(demsmith, dem, output):
    words = {"--family": "perlin", "--atoms": 20, "--sparsity": 3, "--radius": 600,
             "--candidates": 150, "--terms": 3, "--seed": 5, "--scale": 0.5}  # fmt: skip
    specs = [*specifications(ProceduralizeOptions), *specifications(OutputOptions)]
    assert set(words) == {f"--{spec.name}" for spec in specs}
    made = output.with_name("made.tif")
    rasters = []
    for options in ((), *words.items()):
        quick = [word for pair in zip(QUICK[::2], QUICK[1::2], strict=True)
                 if pair[0] not in options for word in pair]  # fmt: skip
        done = demsmith(
            "proceduralize", dem, output, "--overwrite", "--raster", made, *quick, *options
        )
        assert done.status == 0, done.err
        rasters.append(raster.read(made).values.tobytes())
    assert len(set(rasters)) == len(rasters)


def test_help(demsmith):
    status, out, err = demsmith("proceduralize", "--help")
    assert (status, err) == (0, "")
    assert {"--family", "--sparsity", "--raster", "--scale", "--json"} <= set(out.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--atoms", 0), "atoms is 0"),
        (("--family", "simplex"), "simplex"),
        (("--scale", 0), "scale is 0"),
        (("--raster", "m.png"), "m.png"),
        (("--band", 3), "band 3"),
        (("--below", 99999), "every cell is a void"),
        (("--scale", 4), "scale would do nothing, as no evaluated raster is asked for"),
    ],
)
def test_refused(demsmith, dem, output, words, said):
    status, out, err = demsmith("proceduralize", dem, output, *words)
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert said in err
    assert os.listdir(output.parent) == []


def test_models_are_told_from_rasters(demsmith, dem, output, tmp_path):
    (tmp_path / "junk.dsp").write_bytes(b"junk" * 99)
    for words, said in (
        ((dem, output.with_suffix(".tif")), "end its name in .dsp"),
        ((tmp_path / "junk.dsp", output.with_suffix(".tif")), "is no procedural terrain (.dsp)"),
        ((tmp_path / "junk.dsp", output.with_suffix(".tif"), "--raster", "x.tif"), "--raster"),
    ):
        status, _, err = demsmith("proceduralize", *words)
        assert status == 2
        assert said in err
        assert os.listdir(output.parent) == []


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--family", "perlin"), "family"),
        (("--sparsity", 3, "--below", 0), "sparsity and below"),
        (("--band", 2, "--nodata", 5), "band and nodata"),
    ],
)
def test_options_without_a_use_for_a_model_are_refused(demsmith, dem, output, words, named):
    assert demsmith("proceduralize", dem, output, *QUICK).status == 0
    status, _, err = demsmith("proceduralize", output, output.with_suffix(".tif"), *words)
    assert status == 2
    assert f"{named} would do nothing, as '{output}' is a model already" in err
    assert os.listdir(output.parent) == ["model.dsp"]
