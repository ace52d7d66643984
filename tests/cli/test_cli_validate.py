"""``demsmith validate`` on rasters made on the spot."""

import json
import os

import pytest
from scenes import disc, fractal
from support import digest, make_raster

from demsmith.core.options import specifications
from demsmith.core.validation import METHODS, ValidateOptions

QUICK = ("--methods", "mcmd,gdal", "--seeds", 1)
VOID = -32768


@pytest.fixture
def dem(tmp_path):
    ground = fractal((150, 150), relief=2000).astype("int16")
    ground[disc(ground.shape, (60, 70), 4)] = VOID
    return make_raster(tmp_path / "dem.tif", ground, nodata=VOID)


def test_a_table_on_standard_output_and_a_summary(demsmith, dem):
    before = digest(dem)
    status, out, err = demsmith("validate", dem, *QUICK)
    assert status == 0
    assert err.startswith("hid ") and "best mcmd, RMSE" in err
    lines = [line.split() for line in out.splitlines()]
    assert lines.count(["void", "size", "RMSE", "bias", "MAE", "max", "slope", "68", "%", "95",
                        "%", "s"]) == 1  # fmt: skip
    assert [line[:2] for line in lines].count(["Demsmith", "mcmd"]) == 5
    assert [line[:2] for line in lines].count(["GDAL", "FillNodata"]) == 5
    heads = [line[0] for line in lines if line and line[-1] == "voids)"]
    assert heads == ["1-16", "17-100", "101-1000", ">", "all"]
    assert digest(dem) == before


def test_json_and_files(demsmith, dem, tmp_path):
    table, report, error_map = tmp_path / "t.csv", tmp_path / "r.json", tmp_path / "e.tif"
    status, out, err = demsmith(
        "validate", dem, *QUICK, "--json", "--table", table, "--report", report,
        "--error-map", error_map,
    )  # fmt: skip
    result = json.loads(out)
    assert status == 0 and err.startswith("hid ") is False
    assert (result["output"], result["report"]) == (str(table), str(report))
    assert {"seconds", "version", "holes", "cells_hidden", "best", "rmse", "warnings"} < set(result)
    assert [score["method"] for score in result["scores"]] == ["mcmd", "gdal"]
    assert [error["size"] for error in result["scores"][0]["errors"]][-1] == "all"
    assert len(table.read_text().splitlines()) == 11
    assert json.loads(report.read_text())["scores"] == result["scores"]
    assert error_map.exists()


def test_quiet(demsmith, dem):
    assert demsmith("validate", dem, *QUICK, "--quiet") == (0, "", "")


def test_every_option_of_the_core_is_one_here_and_matters(demsmith, dem, tmp_path):
    words = {"--share": 0.1, "--seeds": 2, "--seed": 5}
    assert set(words) == {f"--{spec.name}" for spec in specifications(ValidateOptions)}
    other = fractal((80, 80)).astype("int16")
    other[20:24, 30:39] = VOID
    other = make_raster(tmp_path / "other.tif", other, nodata=VOID)
    found = set()
    for options in ((), *words.items(), ("--voids-from", other), ("--above", 1000)):
        chosen = ("--methods", "gdal", *options)
        chosen += () if "--seeds" in options else ("--seeds", 1)
        done = demsmith("validate", dem, *chosen, "--json")
        result = json.loads(done.out)
        found.add((result["cells_hidden"], result["rmse"]))
    assert len(found) == 6


def test_methods_by_commas_or_repeated(demsmith, dem):
    for words in (("--methods", "gdal, mcmd"), ("--methods", "gdal", "--methods", "mcmd")):
        result = json.loads(demsmith("validate", dem, *words, "--seeds", 1, "--json").out)
        assert [score["method"] for score in result["scores"]] == ["gdal", "mcmd"]
    every = json.loads(demsmith("validate", dem, "--seeds", 1, "--json").out)
    assert [score["method"] for score in every["scores"]] == list(METHODS)


def test_warnings_are_told(demsmith, tmp_path):
    whole = make_raster(tmp_path / "whole.tif", fractal((120, 120)))
    err = demsmith("validate", whole, *QUICK).err
    assert err.startswith(f"warning: '{whole}': no void lies inside")


def test_help_names_methods_and_options(demsmith):
    status, out, err = demsmith("validate", "--help")
    assert (status, err) == (0, "")
    words = set(out.replace(",", " ").replace(".", " ").split())
    assert {"--methods", "--voids-from", "--share", "--seeds", "--table", *METHODS} <= words


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--methods", "kriging"), "there is no method 'kriging'; choose from auto, mcmd"),
        (("--share", 0), "share is 0"),
        (("--voids-from", "nothing.tif"), "nothing.tif"),
        (("--report", "report.pdf"), "must end in .html or .json"),
        (("--table", "errors.xls"), "must end in one of"),
        (("--below", 99999), "every cell is a void"),
        (("--band", 2), "band 2"),
    ],
)
def test_refused(demsmith, dem, words, said, monkeypatch, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    monkeypatch.chdir(folder)
    status, out, err = demsmith("validate", dem, *words)
    assert (status, out) == (2, "")
    assert err.startswith("error: ") and said in err
    assert os.listdir(folder) == []


def test_existing_outputs_stay(demsmith, dem, tmp_path):
    table = tmp_path / "errors.csv"
    table.write_text("precious")
    outcome = demsmith("validate", dem, *QUICK, "--table", table)
    assert outcome.status == 2 and "--overwrite" in outcome.err
    assert table.read_text() == "precious"
    assert demsmith("validate", dem, *QUICK, "--table", table, "--overwrite").status == 0
    assert table.read_text().startswith("method,size")
