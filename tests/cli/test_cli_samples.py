"""``demsmith samples`` on files made on the spot."""

import importlib
import inspect
import json
import os
import types

import numpy as np
import pytest
from support import digest, hills, make_raster

from demsmith.core import raster
from demsmith.core.cli import main
from demsmith.core.options import specifications
from demsmith.core.samples import SampleOptions, samples_file

GRID = ("--extent", 0, 0, 200, 100, "--resolution", 10)


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("x,y,z\n5,5,10\n195,5,20\n5,95,30\n195,95,40\n105,55,90\n")
    return path


@pytest.fixture
def output(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder / "dem.tif"


@pytest.fixture
def call(monkeypatch):
    """Call `demsmith samples` with no work behind it; gives the arguments of `samples_file`."""
    given = {}

    def stand_in(*paths, **arguments):
        given.update(zip(("inputs", "output"), paths, strict=True), **arguments)
        return types.SimpleNamespace(
            rows=1, columns=2, cells_known=1, samples=1, seconds=0.1, output=paths[1],
            tuning=None, warnings=(), as_dict=dict,
        )  # fmt: skip

    module = importlib.import_module("demsmith.core.cli.samples")
    monkeypatch.setattr(module, "samples_file", stand_in)

    def run(*words):
        given.clear()
        assert main(["samples", *map(str, words)]) == 0
        return dict(given)

    return run


def test_summary(demsmith, table, output):
    before = digest(table)
    status, out, err = demsmith("samples", table, output, *GRID, "--crs", "EPSG:32631")
    assert (status, out) == (0, "")
    warning, summary = err.splitlines()
    assert warning.startswith("warning: ") and "CRS" in warning
    assert summary.startswith("made 10 × 20 cells, 5 of them from 5 samples, in ")
    assert summary.endswith(f" s -> {output}")
    assert digest(table) == before and os.listdir(output.parent) == ["dem.tif"]
    assert raster.read(output).values[9, 0] == 10


def test_json(demsmith, table, output):
    status, out, _ = demsmith("samples", table, output, *GRID, "--json", "--quiet")
    result = json.loads(out)
    assert status == 0
    assert (result["output"], result["source_map"]) == (str(output), None)
    assert (result["rows"], result["columns"], result["cells"]) == (10, 20, 200)
    assert (result["samples"], result["samples_outside"]) == (5, 0)
    assert (result["cells_known"], result["cells_filled"]) == (5, 195)
    assert result["seconds"] > 0 and result["version"]


def test_a_thinned_raster_alone(demsmith, tmp_path, output):
    values = hills()
    values[np.random.default_rng(0).random(values.shape) > 0.2] = -9999
    source = make_raster(tmp_path / "thinned.tif", values, nodata=-9999)
    assert demsmith("samples", source, output).status == 0
    back = raster.read(output)
    assert not back.void.any() and back.values.dtype == np.int16
    assert (back.values[values != -9999] == values[values != -9999]).all()


def test_noise_by_preset_and_seed(demsmith, output):
    made = []
    for words in (("--seed", 1), ("--seed", 2), ("--seed", 1, "--preset", "figure-11b")):
        assert demsmith("samples", output, *GRID, *words, "--overwrite").status == 0
        made.append(digest(output))
    assert len(set(made)) == 3


def test_every_parameter_is_reached(call):
    given = call(
        "a.csv", "b.gpkg", "out.tif", "--contours", "c.gpkg", "--contours", "d.shp", "--field",
        "height", "--layer", "peaks", "--source-crs", "EPSG:4326", "--sketch", "s.png",
        "--sketch-low", -5, "--sketch-high", 700, "--sketch-background", "white", "--like",
        "l.tif", "--extent", -10, -20, 30.5, 40, "--resolution", 2.5, "--crs", "EPSG:32631",
        "--band", 2, "--nodata", -9999, "--below", -500, "--above", 9000, "--mask", "m.tif",
        "--h-map", "h.tif", "--source-map", "map.tif", "--threads", 3, "--overwrite",
        "--creation-option", "COMPRESS=LZW",
    )  # fmt: skip
    assert set(given) == set(inspect.signature(samples_file).parameters)
    del given["options"], given["progress"]
    assert given == dict(
        inputs=["a.csv", "b.gpkg"], output="out.tif", contours=("c.gpkg", "d.shp"),
        field="height", layer="peaks", source_crs="EPSG:4326", sketch="s.png", sketch_low=-5.0,
        sketch_high=700.0, sketch_background="white", like="l.tif",
        extent=(-10.0, -20.0, 30.5, 40.0), resolution=2.5, crs="EPSG:32631", band=2,
        nodata=(-9999.0,), below=-500.0, above=9000.0, mask="m.tif", maps={"h": "h.tif"},
        source_map="map.tif", threads=3, overwrite=True, creation_options=("COMPRESS=LZW",),
    )  # fmt: skip


def test_defaults_are_those_of_the_library(call):
    given = call("out.tif")
    assert given["inputs"] == [] and given["maps"] == {}
    assert given["options"] == type(given["options"])()
    for name, parameter in inspect.signature(samples_file).parameters.items():
        if name not in ("inputs", "output", "options", "maps", "progress"):
            assert given[name] == parameter.default


@pytest.mark.parametrize("spec", specifications(SampleOptions), ids=lambda spec: spec.name)
def test_every_option_is_reached(call, spec):
    if spec.kind is bool:
        words, value = [], True
    else:
        value = spec.choices[-1] if spec.choices else spec.kind(spec.minimum or 0.25)
        words = [value]
    flag = "--" + (spec.flag or spec.name).replace("_", "-")
    assert getattr(call("out.tif", flag, *words)["options"], spec.name) == value


def test_help(demsmith):
    out = demsmith("samples", "--help").out
    assert "Usage: demsmith samples [INPUT...] OUTPUT" in out
    for word in ("figure-12b", "--extent XMIN YMIN XMAX YMAX", "demsmith samples thinned.tif"):
        assert word in out
    assert "samples" in demsmith("--help").out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "OUTPUT is needed"),
        (("--resolution", "10"), "OUTPUT is needed"),
        (("{table}", "{output}"), "give a resolution"),
        (("{table}", "{output}", "--resolution", "0"), "must be positive"),
        (("{table}", "{output}", "--resolution", "x"), "--resolution"),
        (("{table}", "{output}", "--resolution", "1", "--extent", "0", "0", "5"), "--extent"),
        (("{table}", "{output}", *GRID[:1], 9, 0, 0, 9, "--resolution", 1), "is empty"),
        (("{table}", "{output}", *GRID[:1], 900, 0, 990, 9, "--resolution", 1), "none of 5"),
        (("{table}", "{output}", "--resolution", "0.0001"), "GB of memory"),
        (("{table}", "{output}", *GRID, "--preset", "figure-1"), "figure-1"),
        (("{table}", "{output}", *GRID, "--preset", "smooth", "--variant", "relaxed"), "relaxed"),
        (("{table}", "{output}", *GRID, "--sketch-background", "grey"), "grey"),
        (("no.csv", "{output}", *GRID), "does not exist"),
        (("{table}", "{table}"), ".tif"),
    ],
)
def test_bad_usage(demsmith, table, output, words, said):
    words = [str(word).format(table=table, output=output) for word in words]
    status, out, err = demsmith("samples", *words)
    assert (status, out) == (2, "")
    assert err.startswith("error: ") and said in err and "Traceback" not in err
    assert os.listdir(output.parent) == []
