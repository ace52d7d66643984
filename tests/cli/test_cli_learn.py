"""``demsmith learn`` on rasters made on the spot."""

import json
import os

import pytest
from support import digest, hills, make_raster

from demsmith.core.options import specifications
from demsmith.core.sparse import read_dictionary
from demsmith.core.sparse.options import LearnOptions, StoreOptions

FAST = ("--atoms", 10, "--iterations", 3)


@pytest.fixture
def dem(tmp_path):
    ground = hills(80, 100)
    ground[10:13, 20:24] = -9999
    return make_raster(tmp_path / "dem.tif", ground, nodata=-9999)


@pytest.fixture
def output(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder / "learned.dsd"


def test_summary(demsmith, dem, output):
    before = digest(dem)
    status, out, err = demsmith("learn", dem, output, *FAST)
    assert (status, out) == (0, "")
    assert err.startswith("10 atoms of 10 x 10 cells from ")
    assert err.endswith(f" s -> {output}\n")
    assert len(read_dictionary(output)) == 10
    assert digest(dem) == before


def test_json_of_two_exemplars(demsmith, dem, output):
    status, out, err = demsmith("learn", dem, dem, output, "--json", *FAST)
    result = json.loads(out)
    assert (status, err) == (0, "")
    assert (result["atoms"], result["output"]) == (10, str(output))
    assert result["discs_skipped"] > 0
    assert len(result["errors"]) == 3
    assert {"seconds", "version", "warnings", "rmse", "bytes", "discs"} < set(result)


def test_every_option_of_the_core_is_one_here_and_matters(demsmith, dem, output):
    changes = {
        "method": "constrained", "atoms": 9, "sparsity": 3, "radius": 500, "factor": 2,
        "iterations": 2, "polishing": 0, "tolerance": 1e9, "most_discs": 60,
        "weighting": "even", "seed": 5, "precision": "int8",
    }  # fmt: skip
    names = [spec.name for cls in (LearnOptions, StoreOptions) for spec in specifications(cls)]
    assert list(changes) == names
    made = set()
    for words in ((), *((f"--{k.replace('_', '-')}", v) for k, v in changes.items())):
        usual = {"--atoms": 10, "--iterations": 3} | dict([words] if words else [])
        usual = [word for pair in usual.items() for word in pair]
        done = demsmith("learn", dem, output, "--overwrite", *usual)
        assert done.status == 0, done.err
        made.add(digest(output))
    assert len(made) == 1 + len(changes)


def test_source_and_run_options_matter(demsmith, dem, output):
    done = demsmith("learn", dem, output, "--above", 600, "--threads", 1, "--quiet", *FAST)
    assert done == (0, "", "")
    first = digest(output)
    assert demsmith("learn", dem, output, "--overwrite", *FAST).status == 0
    assert digest(output) != first


def test_help(demsmith):
    status, out, err = demsmith("learn", "--help")
    assert (status, err) == (0, "")
    assert {"--method", "--atoms", "--factor", "--radius", "--json"} <= set(out.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--atoms", 0), "atoms is 0"),
        (("--atoms", 5000), "5000 atoms cannot be learned"),
        (("--method", "svd"), "svd"),
        (("--band", 3), "band 3"),
        (("--below", 99999), "no disc of 10 by 10 cells"),
    ],
)
def test_refused(demsmith, dem, output, words, said):
    status, out, err = demsmith("learn", dem, output, *words)
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert said in err
    assert os.listdir(output.parent) == []


def test_an_output_alone_or_an_existing_one_is_refused(demsmith, dem, output):
    outcome = demsmith("learn", output)
    assert outcome.status == 2
    assert "rasters to learn from" in outcome.err
    output.write_text("precious")
    outcome = demsmith("learn", dem, output, *FAST)
    assert outcome.status == 2
    assert "--overwrite" in outcome.err
    assert output.read_text() == "precious"
