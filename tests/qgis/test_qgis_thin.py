"""The tool *Thin raster*: its contract, runs, worker thread, `qgis_process` and cancel."""

import json
import os

import numpy as np
import pytest
from gdal_reading import read
from qgis import processing
from qgis.core import (
    QgsFeatureRequest,
    QgsProcessingException,
    QgsProject,
    QgsVectorLayer,
    QgsWkbTypes,
)
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
SHARE            number             0.1            required
DETECTOR         enum               ridges         required
SEED             number             0              required
THREADS          number             -              optional advanced
CREATION_OPTIONS string             -              optional advanced
OUTPUT           rasterDestination  -              required
POINTS           vectorDestination  -              optional
"""
OUTPUTS = {
    "OUTPUT": "outputRaster",
    "POINTS": "outputVector",
    "CELLS_KNOWN": "outputNumber",
    "CELLS_KEPT": "outputNumber",
    "SHARE_KEPT": "outputNumber",
    "SECONDS": "outputNumber",
    "WARNINGS": "outputString",
}


@pytest.fixture
def thin(plugin, tmp_path):
    """Run the tool by `processing.run`; returns its outputs."""

    def run(source, **parameters):
        parameters = {"INPUT": source, "OUTPUT": str(tmp_path / "thinned.tif"), **parameters}
        return processing.run("demsmith:thinraster", parameters)

    return run


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """Make a raster of 9 million cells."""
    values = np.tile(hills(600, 600), (5, 5))
    return make_raster(tmp_path_factory.mktemp("large") / "large.tif", values, nodata=VOID)


# --- contract ------------------------------------------------------------------------------------


def test_parameters_are_the_promised_ones(plugin):
    made = tool("thinraster")
    assert_parameters(made, PARAMETERS)
    assert made.parameterDefinition("DETECTOR").usesStaticStrings()


def test_outputs_are_the_promised_ones(plugin):
    made = tool("thinraster")
    assert {output.name(): output.type() for output in made.outputDefinitions()} == OUTPUTS
    defaults = {
        each.name(): each.createByDefault() for each in made.destinationParameterDefinitions()
    }
    assert defaults == {"OUTPUT": True, "POINTS": False}


def test_the_tool_is_named_grouped_and_found(plugin):
    made = tool("thinraster")
    assert (made.id(), made.displayName()) == ("demsmith:thinraster", "Thin raster")
    assert (made.groupId(), made.group()) == ("samples", "Samples")
    assert {"ridge", "sobel", "decimate"} <= set(made.tags())
    assert made.shortDescription()
    assert "Sobel" in made.shortHelpString()


# --- runs ----------------------------------------------------------------------------------------


def test_keeps_the_share_and_changes_nothing(thin, holed):
    source, values = holed
    before = digest(source)
    result = thin(source)
    thinned, tag, geotransform, kind = read(result["OUTPUT"])
    kept = thinned != tag
    known = values != VOID
    assert kept.sum() == result["CELLS_KEPT"] == int(0.1 * known.sum())
    assert result["CELLS_KNOWN"] == known.sum()
    assert result["SHARE_KEPT"] == kept.sum() / known.sum()
    assert not (kept & ~known).any()
    np.testing.assert_array_equal(thinned[kept], values[kept])
    assert (geotransform, kind) == read(source)[2:]
    assert set(result) == set(OUTPUTS) - {"POINTS"}
    assert digest(source) == before


def test_options_reach_the_core(thin, holed, tmp_path):
    masks = []
    for number, options in enumerate(
        ({}, {"SHARE": 0.3}, {"DETECTOR": "sobel"}, {"DETECTOR": "random"},
         {"DETECTOR": "random", "SEED": 3}, {"BELOW": 400}, {"NODATA": "500"})
    ):  # fmt: skip
        path = str(tmp_path / f"{number}.tif")
        masks.append((read(thin(holed[0], OUTPUT=path, **options)["OUTPUT"])[0] != VOID).tobytes())
    assert len(set(masks)) == len(masks)


@pytest.mark.parametrize("target", ["TEMPORARY_OUTPUT", "points.gpkg", "points.geojson"])
def test_points_are_a_layer_of_the_kept_cells(thin, holed, tmp_path, target):
    where = target if target == "TEMPORARY_OUTPUT" else str(tmp_path / target)
    result = thin(holed[0], POINTS=where)
    layer = QgsVectorLayer(result["POINTS"], "points")
    assert layer.isValid()
    assert layer.crs().authid() == "EPSG:4326"
    assert QgsWkbTypes.flatType(layer.wkbType()) == QgsWkbTypes.Point
    assert layer.featureCount() == result["CELLS_KEPT"]
    thinned, tag, geotransform, _ = read(result["OUTPUT"])
    row, column = np.argwhere(thinned != tag)[0]
    feature = next(layer.getFeatures(QgsFeatureRequest().setLimit(1)))
    place = feature.geometry().asPoint()
    assert place.x() == pytest.approx(geotransform[0] + (column + 0.5) * geotransform[1], abs=1e-9)
    assert place.y() == pytest.approx(geotransform[3] + (row + 0.5) * geotransform[5], abs=1e-9)
    assert feature["z"] == thinned[row, column]


def test_both_outputs_are_loaded(plugin, holed):
    project = QgsProject.instance()
    project.clear()
    processing.runAndLoadResults(
        "demsmith:thinraster",
        {"INPUT": holed[0], "OUTPUT": "TEMPORARY_OUTPUT", "POINTS": "TEMPORARY_OUTPUT"},
    )
    layers = {layer.name(): layer for layer in project.mapLayers().values()}
    assert set(layers) == {"Thinned", "Kept cells as points"}
    assert layers["Thinned"].renderer().type() == "singlebandpseudocolor"
    project.clear()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"SHARE": 0}, "SHARE"),
        ({"DETECTOR": "canny"}, "DETECTOR"),
        ({"NODATA": "low"}, "NODATA is 'low'; give numbers"),
        ({"BAND": 3}, "band 3 asked"),
        ({"BELOW": 99999}, "every cell is a void"),
        ({"OUTPUT": "{folder}/thinned.png"}, "not supported"),
        ({"POINTS": "{folder}/none/points.gpkg"}, "there is no folder"),
        ({"POINTS": "{folder}/points.kml"}, "files are not supported as outputs"),
    ],
)
def test_errors_say_what_is_wrong_and_leave_nothing(thin, holed, tmp_path, parameters, message):
    before = set(os.listdir(tmp_path))
    parameters = {
        key: value.format(folder=tmp_path) if isinstance(value, str) else value
        for key, value in parameters.items()
    }
    with pytest.raises(QgsProcessingException) as error:
        thin(holed[0], **parameters)
    assert message in str(error.value)
    assert {name for name in os.listdir(tmp_path) if not name.endswith(".aux.xml")} == before


# --- worker thread -------------------------------------------------------------------------------


def test_the_window_stays_responsive(plugin, large, tmp_path):
    run = TaskRun(
        "thinraster", {"INPUT": large, "OUTPUT": str(tmp_path / "thinned.tif"), "SHARE": 0.01}
    )
    assert run.fine
    assert run.outputs["CELLS_KEPT"] == 90_000
    assert max(run.gaps) < 0.5
    assert len(run.progress) >= 5
    assert run.progress == sorted(run.progress)
    assert run.progress[-1] == 100


@pytest.mark.parametrize("percent", [1, 30, 60, 90])
def test_cancel_is_prompt_and_leaves_nothing(plugin, large, tmp_path, percent):
    folder = tmp_path / "out"
    folder.mkdir()
    old = folder / "thinned.tif"
    old.write_bytes(b"the user's older result")
    run = TaskRun(
        "thinraster",
        {"INPUT": large, "OUTPUT": str(old), "POINTS": str(folder / "points.gpkg"), "SHARE": 0.01},
        cancel_at=percent,
    )
    assert run.cancelled_at is not None
    assert run.ended_at - run.cancelled_at < 1
    assert not run.fine
    assert os.listdir(folder) == ["thinned.tif"]
    assert old.read_bytes() == b"the user's older result"
    assert "cancelled; nothing was written" in run.feedback.textLog()


# --- qgis_process --------------------------------------------------------------------------------


def test_in_qgis_process(qgis_process, holed, tmp_path):
    target, points = tmp_path / "thinned.tif", tmp_path / "points.gpkg"
    done = qgis_process(
        "--json", "run", "demsmith:thinraster", f"--INPUT={holed[0]}", "--DETECTOR=sobel",
        "--SHARE=0.2", f"--OUTPUT={target}", f"--POINTS={points}",
    )  # fmt: skip
    results = json.loads(done.stdout)["results"]
    assert (results["OUTPUT"], results["POINTS"]) == (str(target), str(points))
    assert results["CELLS_KEPT"] == int(0.2 * (60 * 80 - 58))
    assert (read(target)[0] != VOID).sum() == results["CELLS_KEPT"]
    assert points.exists()
