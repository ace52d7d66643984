"""The tool *Slope, aspect, hillshade*: contract, runs, worker thread, `qgis_process`, styles."""

import json
import os

import numpy as np
import pytest
from gdal_reading import read
from qgis import processing
from qgis.core import QgsProcessingException, QgsProject
from qgis.PyQt.QtGui import QPainter
from qgis_runs import TaskRun, assert_parameters, tool
from support import digest, hills, make_raster

from demsmith.core.relief.options import KINDS

VOID = -32768
PARAMETERS = """
INPUT            raster             -              required
BAND             band               1              optional
NODATA           string             -              optional
MASK             raster             -              optional
BELOW            number             -              optional advanced
ABOVE            number             -              optional advanced
KIND             enum               slope          required
UNIT             enum               degrees        required
AZIMUTH          number             315.0          required
ALTITUDE         number             45.0           required
EXAGGERATION     number             1.0            required
MULTIDIRECTIONAL boolean            False          required
RADIUS           number             500.0          required
METHOD           enum               horn           required advanced
THREADS          number             -              optional advanced
CREATION_OPTIONS string             -              optional advanced
OUTPUT           rasterDestination  -              required
"""
OUTPUTS = {
    "OUTPUT": "outputRaster",
    "CELLS_KNOWN": "outputNumber",
    "MINIMUM": "outputNumber",
    "MAXIMUM": "outputNumber",
    "SECONDS": "outputNumber",
    "WARNINGS": "outputString",
}


@pytest.fixture
def relief(plugin, tmp_path):
    """Run the tool by `processing.run`; returns its outputs."""

    def run(source, **parameters):
        parameters = {"INPUT": source, "OUTPUT": str(tmp_path / "made.tif"), **parameters}
        return processing.run("demsmith:relief", parameters)

    return run


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """Make a raster of 9 million cells."""
    values = np.tile(hills(600, 600), (5, 5))
    return make_raster(tmp_path_factory.mktemp("large") / "large.tif", values, nodata=VOID)


# --- contract ------------------------------------------------------------------------------------


def test_parameters_are_the_promised_ones(plugin):
    made = tool("relief")
    assert_parameters(made, PARAMETERS)
    assert made.parameterDefinition("KIND").usesStaticStrings()


def test_outputs_are_the_promised_ones(plugin):
    made = tool("relief")
    assert {output.name(): output.type() for output in made.outputDefinitions()} == OUTPUTS


def test_the_tool_is_named_grouped_and_found(plugin):
    made = tool("relief")
    assert (made.id(), made.displayName()) == ("demsmith:relief", "Slope, aspect, hillshade")
    assert (made.groupId(), made.group()) == ("relief", "Relief")
    assert {"slope", "tpi", "shaded relief"} <= set(made.tags())
    assert made.shortDescription()
    assert "Topographic position" in made.shortHelpString()


# --- runs ----------------------------------------------------------------------------------------


def test_makes_a_slope_and_changes_nothing(relief, holed):
    source, values = holed
    before = digest(source)
    result = relief(source)
    steep, tag, geotransform, kind = read(result["OUTPUT"])
    known = steep != tag
    np.testing.assert_array_equal(known, values != VOID)
    assert result["CELLS_KNOWN"] == known.sum()
    assert (result["MINIMUM"], result["MAXIMUM"]) == (steep[known].min(), steep[known].max())
    assert (geotransform, kind) == (read(source)[2], np.float32)
    assert set(result) == set(OUTPUTS)
    assert digest(source) == before


def test_options_reach_the_core(relief, holed, tmp_path):
    made = []
    shade, spread = {"KIND": "hillshade"}, {"KIND": "deviation"}
    for number, options in enumerate(
        ({}, {"UNIT": "percent"}, {"METHOD": "zevenbergen-thorne"}, {"KIND": "aspect"}, shade,
         {**shade, "AZIMUTH": 90}, {**shade, "ALTITUDE": 20}, {**shade, "EXAGGERATION": 2},
         {**shade, "MULTIDIRECTIONAL": True}, spread, {**spread, "RADIUS": 300},
         {"KIND": "position"}, {"BELOW": 400})
    ):  # fmt: skip
        path = str(tmp_path / f"{number}.tif")
        made.append(read(relief(holed[0], OUTPUT=path, **options)["OUTPUT"])[0].tobytes())
    assert len(set(made)) == len(made)


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_is_loaded_in_its_own_look(plugin, holed, kind):
    project = QgsProject.instance()
    project.clear()
    result = processing.runAndLoadResults(
        "demsmith:relief", {"INPUT": holed[0], "OUTPUT": "TEMPORARY_OUTPUT", "KIND": kind}
    )
    (layer,) = project.mapLayers().values()
    renderer = layer.renderer()
    if kind == "hillshade":
        assert renderer.type() == "singlebandgray"
        assert layer.blendMode() == QPainter.CompositionMode.CompositionMode_Multiply
    else:
        ramp = renderer.shader().rasterShaderFunction()
        shown = ramp.minimumValue(), ramp.maximumValue()
        low, high = result["MINIMUM"], result["MAXIMUM"]
        most = max(-low, high)
        expected = {"aspect": (0, 360), "position": (-most, most)}.get(kind, (low, high))
        assert shown == pytest.approx(expected, rel=1e-5)
        colours = [item.color.name() for item in ramp.colorRampItemList()]
        assert len(set(colours)) >= 5
        assert (colours[0] == colours[-1]) == (kind == "aspect")
    project.clear()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"KIND": "curvature"}, "KIND"),
        ({"AZIMUTH": 400}, "AZIMUTH"),
        ({"KIND": "deviation", "RADIUS": 10}, "less than a cell"),
        ({"BAND": 3}, "band 3 asked"),
        ({"BELOW": 99999}, "every cell is a void"),
        ({"OUTPUT": "{folder}/made.png"}, "not supported"),
        ({"OUTPUT": "{folder}/none/made.tif"}, "there is no folder"),
    ],
)
def test_errors_say_what_is_wrong_and_leave_nothing(relief, holed, tmp_path, parameters, message):
    before = set(os.listdir(tmp_path))
    parameters = {
        key: value.format(folder=tmp_path) if isinstance(value, str) else value
        for key, value in parameters.items()
    }
    with pytest.raises(QgsProcessingException) as error:
        relief(holed[0], **parameters)
    assert message in str(error.value)
    assert {name for name in os.listdir(tmp_path) if not name.endswith(".aux.xml")} == before


# --- worker thread -------------------------------------------------------------------------------


def test_the_window_stays_responsive(plugin, large, tmp_path):
    run = TaskRun("relief", {"INPUT": large, "OUTPUT": str(tmp_path / "made.tif")})
    assert run.fine
    assert run.outputs["CELLS_KNOWN"] == 9_000_000
    assert max(run.gaps) < 0.5
    assert len(run.progress) >= 5
    assert run.progress == sorted(run.progress)
    assert run.progress[-1] == 100


@pytest.mark.parametrize("percent", [1, 40, 80])
def test_cancel_is_prompt_and_leaves_nothing(plugin, large, tmp_path, percent):
    folder = tmp_path / "out"
    folder.mkdir()
    old = folder / "made.tif"
    old.write_bytes(b"the user's older result")
    run = TaskRun(
        "relief", {"INPUT": large, "OUTPUT": str(old), "KIND": "deviation", "RADIUS": 1500},
        cancel_at=percent,
    )  # fmt: skip
    assert run.cancelled_at is not None
    assert run.ended_at - run.cancelled_at < 1
    assert not run.fine
    assert os.listdir(folder) == ["made.tif"]
    assert old.read_bytes() == b"the user's older result"
    assert "cancelled; nothing was written" in run.feedback.textLog()


# --- qgis_process --------------------------------------------------------------------------------


def test_in_qgis_process(qgis_process, holed, tmp_path):
    target = tmp_path / "made.tif"
    done = qgis_process(
        "--json", "run", "demsmith:relief", f"--INPUT={holed[0]}", "--KIND=position",
        "--RADIUS=400", f"--OUTPUT={target}",
    )  # fmt: skip
    results = json.loads(done.stdout)["results"]
    assert results["OUTPUT"] == str(target)
    assert results["MINIMUM"] < 0 < results["MAXIMUM"]
    assert (read(target)[0] != -9999).sum() == results["CELLS_KNOWN"] == 60 * 80 - 58
