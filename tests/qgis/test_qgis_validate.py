"""The tool *Validate void filling*: its contract, runs, worker thread, `qgis_process`, cancel."""

import json
import os

import numpy as np
import pytest
from gdal_reading import read
from qgis import processing
from qgis.core import QgsProcessingException, QgsProject, QgsVectorLayer
from qgis_runs import TaskRun, assert_parameters, tool
from support import digest, hills, make_raster

VOID = -32768
PARAMETERS = """
INPUT            raster             -              required
BAND             band               1              optional
NODATA           string             -              optional
MASK             raster             -              optional
BELOW            number             -              optional advanced
ABOVE            number             -              optional advanced
METHODS          enum               -              optional
VOIDS_FROM       raster             -              optional
SHARE            number             0.05           required
SEEDS            number             3              required
SEED             number             0              required
THREADS          number             -              optional advanced
CREATION_OPTIONS string             -              optional advanced
OUTPUT           vectorDestination  -              required
REPORT           fileDestination    -              optional
ERROR_MAP        rasterDestination  -              optional
"""
OUTPUTS = {
    "OUTPUT": "outputVector",
    "REPORT": "outputHtml",
    "ERROR_MAP": "outputRaster",
    "HOLES": "outputNumber",
    "CELLS_HIDDEN": "outputNumber",
    "RMSE": "outputNumber",
    "SECONDS": "outputNumber",
    "BEST": "outputString",
    "WARNINGS": "outputString",
}
COLUMNS = [
    "method", "size", "smallest", "largest", "voids", "cells", "rmse", "bias", "mae", "max_error",
    "slope_rmse", "within_68", "within_95", "seconds",
]  # fmt: skip


@pytest.fixture
def validate(plugin, tmp_path):
    """Run the tool by `processing.run`; returns its outputs."""

    def run(source, **parameters):
        parameters = {
            "INPUT": source, "METHODS": ["mcmd", "gdal"], "SEEDS": 1,
            "OUTPUT": str(tmp_path / "errors.gpkg"), **parameters,
        }  # fmt: skip
        return processing.run("demsmith:validatefill", parameters)

    return run


@pytest.fixture
def tile(tmp_path):
    """Make a tile with a void of 48 cells inside."""
    values = hills(150, 160)
    values[70:76, 80:88] = VOID
    return make_raster(tmp_path / "tile.tif", values, nodata=VOID), values


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """Make a raster of 4 million cells with voids."""
    values = np.tile(hills(400, 400), (5, 5))
    for side in range(2, 32):
        values[side * 50 : side * 51, side * 50 : side * 51] = VOID
    return make_raster(tmp_path_factory.mktemp("large") / "large.tif", values, nodata=VOID)


# --- contract ------------------------------------------------------------------------------------


def test_parameters_are_the_promised_ones(plugin):
    made = tool("validatefill")
    assert_parameters(made, PARAMETERS)
    methods = made.parameterDefinition("METHODS")
    assert methods.usesStaticStrings()
    assert methods.allowMultiple()
    assert {"mcmd", "gdal", "gdal-smooth", "biharmonic"} <= set(methods.options())


def test_outputs_are_the_promised_ones(plugin):
    made = tool("validatefill")
    assert {output.name(): output.type() for output in made.outputDefinitions()} == OUTPUTS
    defaults = {
        each.name(): each.createByDefault() for each in made.destinationParameterDefinitions()
    }
    assert defaults == {"OUTPUT": True, "REPORT": True, "ERROR_MAP": False}


def test_the_tool_is_named_grouped_and_found(plugin):
    made = tool("validatefill")
    assert (made.id(), made.displayName()) == ("demsmith:validatefill", "Validate void filling")
    assert (made.groupId(), made.group()) == ("voids", "Void filling")
    assert {"rmse", "accuracy", "voids"} <= set(made.tags())
    assert made.shortDescription()
    assert "artificial voids" in made.shortHelpString()


# --- runs ----------------------------------------------------------------------------------------


def test_the_table_tells_the_errors_of_each_method_and_size(validate, tile):
    source, _ = tile
    before = digest(source)
    result = validate(source)
    layer = QgsVectorLayer(result["OUTPUT"], "errors")
    assert layer.isValid()
    assert not layer.isSpatial()
    assert [field.name() for field in layer.fields()][-len(COLUMNS) :] == COLUMNS
    rows = {(row["method"], row["size"]): row for row in layer.getFeatures()}
    sizes = ["1-16", "17-100", "101-1000", "> 1000", "all"]
    assert set(rows) == {(method, size) for method in ("mcmd", "gdal") for size in sizes}
    assert rows["mcmd", "17-100"]["cells"] == 48 * rows["mcmd", "17-100"]["voids"]
    assert rows["mcmd", "all"]["cells"] == result["CELLS_HIDDEN"]
    assert rows["mcmd", "all"]["voids"] == result["HOLES"] > 10
    assert 0 < rows["mcmd", "all"]["rmse"] < rows["gdal", "all"]["rmse"]
    assert result["BEST"] == "mcmd"
    assert result["RMSE"] == rows["mcmd", "all"]["rmse"]
    assert set(result) == set(OUTPUTS) - {"REPORT", "ERROR_MAP"}
    assert digest(source) == before


def test_report_and_map_of_errors(validate, tile, tmp_path):
    source, values = tile
    result = validate(
        source, REPORT=str(tmp_path / "report.html"), ERROR_MAP=str(tmp_path / "map.tif")
    )
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.startswith("<!DOCTYPE html>")
    assert "GDAL FillNodata" in page
    error, tag, geotransform, kind = read(result["ERROR_MAP"])
    hidden = ~np.isnan(error) & (error != tag)
    assert (hidden.sum(), kind) == (result["CELLS_HIDDEN"], np.float32)
    assert not (hidden & (values == VOID)).any()
    assert np.sqrt((error[hidden].astype(float) ** 2).mean()) == pytest.approx(result["RMSE"])
    assert geotransform == read(source)[2]


def test_options_reach_the_core(validate, tile, tmp_path):
    other = hills(60, 60)
    other[20:23, 20:40] = VOID
    other = make_raster(tmp_path / "other.tif", other, nodata=VOID)
    found = set()
    for number, options in enumerate(
        ({}, {"SEEDS": 2}, {"SEED": 5}, {"SHARE": 0.1}, {"VOIDS_FROM": other}, {"BELOW": 400})
    ):
        result = validate(tile[0], OUTPUT=str(tmp_path / f"{number}.csv"), **options)
        found.add((result["HOLES"], result["CELLS_HIDDEN"], result["RMSE"]))
    assert len(found) == 6


def test_without_methods_all_are_tried(validate, tile, tmp_path):
    validate(tile[0], METHODS=None, OUTPUT=str(tmp_path / "all.csv"))
    rows = (tmp_path / "all.csv").read_text(encoding="utf-8").splitlines()
    methods = {row.split(",")[0] for row in rows}
    assert {"mcmd", "gdal", "gdal-smooth", "biharmonic"} <= methods


def test_a_raster_without_voids_is_told_of(validate, tmp_path):
    source = make_raster(tmp_path / "whole.tif", hills(150, 160))
    assert "mixture" in validate(source)["WARNINGS"]


def test_table_and_map_are_loaded(plugin, tile):
    project = QgsProject.instance()
    project.clear()
    processing.runAndLoadResults(
        "demsmith:validatefill",
        {"INPUT": tile[0], "METHODS": "mcmd", "SEEDS": 1, "OUTPUT": "TEMPORARY_OUTPUT",
         "ERROR_MAP": "TEMPORARY_OUTPUT"},
    )  # fmt: skip
    layers = {layer.name(): layer for layer in project.mapLayers().values()}
    assert set(layers) == {"Errors by method and void size", "Map of errors"}
    assert layers["Errors by method and void size"].featureCount() == 5
    ramp = layers["Map of errors"].renderer().shader().rasterShaderFunction()
    assert ramp.minimumValue() == -ramp.maximumValue() < 0
    middle = ramp.colorRampItemList()[2]
    assert (middle.value, middle.color.name()) == (0, "#f7f7f7")
    project.clear()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"SHARE": 0}, "SHARE"),
        ({"METHODS": ["kriging"]}, "METHODS"),
        ({"BAND": 3}, "band 3 asked"),
        ({"BELOW": 99999}, "every cell is a void"),
        ({"VOIDS_FROM": "{whole}"}, "no void lies inside"),
        ({"OUTPUT": "{folder}/errors.xlsx"}, "not supported"),
        ({"OUTPUT": "{folder}/none/errors.gpkg"}, "there is no folder"),
        ({"REPORT": "{folder}/report.pdf"}, "must end in .html or .json"),
    ],
)
def test_errors_say_what_is_wrong_and_leave_nothing(validate, tile, tmp_path, parameters, message):
    whole = make_raster(tmp_path / "whole.tif", hills(50, 50))
    before = set(os.listdir(tmp_path))
    parameters = {
        key: value.format(folder=tmp_path, whole=whole) if isinstance(value, str) else value
        for key, value in parameters.items()
    }
    with pytest.raises(QgsProcessingException) as error:
        validate(tile[0], **parameters)
    assert message in str(error.value)
    assert {name for name in os.listdir(tmp_path) if not name.endswith(".aux.xml")} == before


# --- worker thread -------------------------------------------------------------------------------


def test_the_window_stays_responsive(plugin, large, tmp_path):
    run = TaskRun(
        "validatefill",
        {"INPUT": large, "OUTPUT": str(tmp_path / "errors.csv"), "METHODS": ["mcmd"], "SEEDS": 1},
    )
    assert run.fine
    assert run.outputs["CELLS_HIDDEN"] > 100_000
    assert max(run.gaps) < 0.5
    assert len(run.progress) >= 5
    assert run.progress == sorted(run.progress)
    assert run.progress[-1] == 100


@pytest.mark.parametrize("percent", [1, 8, 20, 60])
def test_cancel_is_prompt_and_leaves_nothing(plugin, large, tmp_path, percent):
    folder = tmp_path / "out"
    folder.mkdir()
    old = folder / "errors.csv"
    old.write_bytes(b"the user's older result")
    run = TaskRun(
        "validatefill",
        {
            "INPUT": large,
            "OUTPUT": str(old),
            "REPORT": str(folder / "report.html"),
            "ERROR_MAP": str(folder / "map.tif"),
            "METHODS": ["mcmd", "gdal"],
            "SEEDS": 1,
        },
        cancel_at=percent,
    )
    assert run.cancelled_at is not None
    assert run.ended_at - run.cancelled_at < 1
    assert not run.fine
    assert os.listdir(folder) == ["errors.csv"]
    assert old.read_bytes() == b"the user's older result"
    assert "cancelled; nothing was written" in run.feedback.textLog()


# --- qgis_process --------------------------------------------------------------------------------


def test_in_qgis_process(qgis_process, tile, tmp_path):
    target = tmp_path / "errors.csv"
    done = qgis_process(
        "--json", "run", "demsmith:validatefill", f"--INPUT={tile[0]}", "--METHODS=mcmd",
        "--METHODS=gdal", "--SEEDS=1", f"--OUTPUT={target}",
    )  # fmt: skip
    results = json.loads(done.stdout)["results"]
    assert (results["OUTPUT"], results["BEST"]) == (str(target), "mcmd")
    assert len(target.read_text(encoding="utf-8").splitlines()) == 1 + 2 * 5
