"""The tool *Drainage area*: contract, runs, styles, worker thread, `qgis_process`, cancel."""

import json
import os

import numpy as np
import pytest
from gdal_reading import read
from qgis import processing
from qgis.core import QgsProcessingException, QgsProject, QgsRasterLayer, QgsVectorLayer
from qgis_runs import TaskRun, assert_parameters, tool
from scenes import fractal
from support import digest, hills, make_raster

from demsmith.algorithms import styling
from demsmith.core.hydrology import drainage_area
from demsmith.core.hydrology.codes import DIRECTIONS, FLAGS
from demsmith.core.raster import Grid

VOID = -32768
PARAMETERS = """
INPUT            raster             -              required
BAND             band               1              optional
NODATA           string             -              optional
MASK             raster             -              optional
BELOW            number             -              optional advanced
ABOVE            number             -              optional advanced
METHOD           enum               d8             required
DEPRESSIONS      enum               fill           required
UNIT             enum               m2             required
THRESHOLD        number             1000000.0      required
EXPONENT         number             1.1            required advanced
MAX_DEPTH        number             -              optional advanced
MAX_LENGTH       number             -              optional advanced
PARTICLES        number             1000000        required advanced
SEED             number             0              required advanced
COARSE_FACTOR    number             8              required advanced
WEIGHTS          raster             -              optional advanced
FILLED_MASK      raster             -              optional advanced
THREADS          number             -              optional advanced
CREATION_OPTIONS string             -              optional advanced
OUTPUT           rasterDestination  -              required
STREAMS          vectorDestination  -              optional
LOG              rasterDestination  -              optional
SPECIFIC         rasterDestination  -              optional
STANDARD_ERROR   rasterDestination  -              optional
DIRECTIONS       rasterDestination  -              optional
FLAGS            rasterDestination  -              optional
CONDITIONED      rasterDestination  -              optional
STREAM_MASK      rasterDestination  -              optional
COARSE           rasterDestination  -              optional
"""
RASTERS = (
    "OUTPUT", "LOG", "SPECIFIC", "STANDARD_ERROR", "DIRECTIONS", "FLAGS", "CONDITIONED",
    "STREAM_MASK", "COARSE",
)  # fmt: skip
NUMBERS = ("LARGEST_AREA", "CELLS_CHANGED", "LINKS", "STREAM_LENGTH", "SECONDS")


@pytest.fixture
def drain(plugin, tmp_path):
    """Run the tool by `processing.run`; returns its outputs."""

    def run(source, **parameters):
        parameters = {"INPUT": source, "OUTPUT": str(tmp_path / "area.tif"), **parameters}
        return processing.run("demsmith:drainagearea", parameters)

    return run


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """Make a raster of 6 million cells."""
    values = np.tile(hills(600, 600), (4, 4))
    return make_raster(tmp_path_factory.mktemp("large") / "large.tif", values, nodata=VOID)


# --- contract ------------------------------------------------------------------------------------


def test_parameters_are_the_promised_ones(plugin):
    made = tool("drainagearea")
    assert_parameters(made, PARAMETERS)
    for name in ("METHOD", "DEPRESSIONS", "UNIT"):
        assert made.parameterDefinition(name).usesStaticStrings()


def test_outputs_are_the_promised_ones(plugin):
    made = tool("drainagearea")
    assert {output.name(): output.type() for output in made.outputDefinitions()} == {
        **dict.fromkeys(RASTERS, "outputRaster"),
        "STREAMS": "outputVector",
        **dict.fromkeys(NUMBERS, "outputNumber"),
        "WARNINGS": "outputString",
    }
    defaults = [
        each.name() for each in made.destinationParameterDefinitions() if each.createByDefault()
    ]
    assert defaults == ["OUTPUT"]


def test_the_tool_is_named_grouped_and_found(plugin):
    made = tool("drainagearea")
    assert (made.id(), made.displayName()) == ("demsmith:drainagearea", "Drainage area")
    assert (made.groupId(), made.group()) == ("hydrology", "Hydrology")
    assert {"flow accumulation", "d-infinity", "strahler"} <= set(made.tags())
    assert made.shortDescription()
    assert "Tarboton" in made.shortHelpString()


# --- runs ----------------------------------------------------------------------------------------


def test_drains_and_changes_nothing(drain, holed):
    source, values = holed
    before = digest(source)
    result = drain(source)
    area, tag, geotransform, _ = read(result["OUTPUT"])
    grid = Grid(values.shape, geotransform, "EPSG:4326")
    expected = drainage_area(
        values, values == VOID, pixel_size=grid.pixel_size_m(), cell_area=grid.cell_area_m2()
    )
    np.testing.assert_array_equal(np.where(area == tag, np.nan, area), expected.area)
    assert result["LARGEST_AREA"] == np.nanmax(expected.area)
    assert result["CELLS_CHANGED"] == expected.changed().sum()
    assert set(result) == {"OUTPUT", "LARGEST_AREA", "CELLS_CHANGED", "SECONDS", "WARNINGS"}
    assert digest(source) == before


def test_options_reach_the_core(drain, tmp_path):
    ground = np.rint(fractal((40, 50), seed=3, relief=400)).astype(np.int16)
    source = make_raster(tmp_path / "rough.tif", ground)
    weights = make_raster(tmp_path / "weights.tif", np.full(ground.shape, 3, np.uint8))
    areas = []
    for number, options in enumerate(
        ({}, {"METHOD": "dinf"}, {"METHOD": "mfd"}, {"METHOD": "mfd", "EXPONENT": 3},
         {"METHOD": "particles"}, {"METHOD": "particles", "PARTICLES": 999},
         {"METHOD": "particles", "SEED": 3}, {"DEPRESSIONS": "keep"}, {"UNIT": "km2"},
         {"DEPRESSIONS": "breach"}, {"DEPRESSIONS": "breach", "MAX_LENGTH": 150},
         {"MAX_DEPTH": 2}, {"WEIGHTS": weights}, {"BELOW": 100}, {"NODATA": "200"})
    ):  # fmt: skip
        path = str(tmp_path / f"{number}.tif")
        areas.append(read(drain(source, OUTPUT=path, **options)["OUTPUT"])[0].tobytes())
    assert len(set(areas)) == len(areas)


def test_every_output_is_loaded_in_its_style(plugin, holed, tmp_path):
    project = QgsProject.instance()
    project.clear()
    result = processing.runAndLoadResults(
        "demsmith:drainagearea",
        {
            "INPUT": holed[0], "METHOD": "particles", "PARTICLES": 20_000, "THRESHOLD": 5e5,
            "FILLED_MASK": holed[0], **dict.fromkeys((*RASTERS, "STREAMS"), "TEMPORARY_OUTPUT"),
        },
    )  # fmt: skip
    layers = {layer.name(): layer for layer in project.mapLayers().values()}
    styles = {name: layer.renderer().type() for name, layer in layers.items()}
    assert styles == {
        "Upstream area": "singlebandpseudocolor",
        "Logarithm of upstream area": "singlebandpseudocolor",
        "Specific catchment area": "singlebandpseudocolor",
        "Standard error": "singlebandpseudocolor",
        "Flow directions": "paletted",
        "Catchment flags": "paletted",
        "Conditioned elevations": "singlebandpseudocolor",
        "Stream mask": "paletted",
        "Largest area of coarse cells": "singlebandpseudocolor",
        "Streams": "graduatedSymbol",
    }
    assert result["LINKS"] == layers["Streams"].featureCount() > 3
    ramp = layers["Upstream area"].renderer().shader().rasterShaderFunction()
    assert ramp.maximumValue() == result["LARGEST_AREA"]
    orders = layers["Streams"].uniqueValues(layers["Streams"].fields().lookupField("strahler"))
    assert [each.label() for each in layers["Streams"].renderer().ranges()] == [
        f"order {order}" for order in sorted(orders)
    ]
    layers.clear()
    project.clear()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"METHOD": "d9"}, "METHOD"),
        ({"EXPONENT": -1}, "EXPONENT"),
        ({"NODATA": "low"}, "NODATA is 'low'; give numbers"),
        ({"BAND": 3}, "band 3 asked"),
        ({"BELOW": 99999}, "every cell is a void"),
        ({"OUTPUT": "{folder}/area.png"}, "not supported"),
        ({"STREAMS": "{folder}/streams.kml"}, "files are not supported as outputs"),
        ({"STREAMS": "{folder}/streams.csv"}, "must end in one of .gpkg, .geojson"),
        ({"STREAMS": "{folder}/none/streams.gpkg"}, "there is no folder"),
        ({"STANDARD_ERROR": "{folder}/error.tif"}, "d8 has no standard error"),
    ],
)
def test_errors_say_what_is_wrong_and_leave_nothing(drain, holed, tmp_path, parameters, message):
    before = set(os.listdir(tmp_path))
    parameters = {
        key: value.format(folder=tmp_path) if isinstance(value, str) else value
        for key, value in parameters.items()
    }
    with pytest.raises(QgsProcessingException) as error:
        drain(holed[0], **parameters)
    assert message in str(error.value)
    assert {name for name in os.listdir(tmp_path) if not name.endswith(".aux.xml")} == before


# --- styles --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "codes"), [("directions", DIRECTIONS), ("catchment_flags", FLAGS)]
)
def test_classes_have_their_names_and_colours(plugin, tmp_path, name, codes):
    values = np.array([[each.code for each in codes]], np.uint8)
    path = make_raster(tmp_path / "codes.tif", values)
    layer = QgsRasterLayer(path, "codes")
    _, done = layer.loadNamedStyle(os.path.join(styling.ROOT, "styles", f"{name}.qml"))
    assert done
    told = [(each.value, each.label, each.color.getRgb()) for each in layer.renderer().classes()]
    assert told == [tuple(each) for each in codes]
    del layer


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((100, 5e4, 2e6), (100, 300, 1000, 3000, 1e4, 3e4, 1e5, 3e5, 1e6, 2e6)),
        ((0, 1, 10), (1e-7, 3e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03,
                      0.1, 0.3, 1, 3, 10)),
        ((7, 7, 7), (7, 30, 70)),
        ((0, 0, 0), (1, 3, 10)),
    ],
)  # fmt: skip
def test_areas_are_coloured_by_their_logarithm(plugin, tmp_path, values, expected):
    path = make_raster(tmp_path / "area.tif", np.array([values], np.float32))
    layer = QgsRasterLayer(path, "area")
    layer.loadNamedStyle(os.path.join(styling.ROOT, "styles", "flow.qml"))
    styling._stretch_by_logarithm(layer)
    ramp = layer.renderer().shader().rasterShaderFunction()
    items = ramp.colorRampItemList()
    assert [item.value for item in items] == pytest.approx(expected, rel=1e-6)
    source = ramp.sourceColorRamp()
    low, high = expected[0], expected[-1]
    for item in items:
        share = np.log(item.value / low) / np.log(high / low)
        assert item.color.getRgb() == pytest.approx(source.color(share).getRgb(), abs=1)
    assert items[0].color.lightness() > 240
    assert items[-1].color.lightness() < 80
    del layer


@pytest.mark.parametrize(
    ("value", "label"),
    [(3154069499.9, "3 150 000 000"), (30000, "30 000"), (6770.4, "6 770"), (3, "3.00"),
     (0.000123, "0.000123")],
)  # fmt: skip
def test_labels_have_three_digits(plugin, value, label):
    assert styling._round_label(value) == label


# --- worker thread -------------------------------------------------------------------------------


def test_the_window_stays_responsive(plugin, large, tmp_path):
    run = TaskRun(
        "drainagearea",
        {"INPUT": large, "OUTPUT": str(tmp_path / "area.tif"), "METHOD": "mfd",
         "STREAMS": str(tmp_path / "streams.gpkg")},
    )  # fmt: skip
    assert run.fine
    assert run.outputs["LINKS"] > 1000
    assert max(run.gaps) < 0.5
    assert len(run.progress) >= 5
    assert run.progress == sorted(run.progress)
    assert run.progress[-1] == 100


@pytest.mark.parametrize("percent", [1, 30, 60, 90])
def test_cancel_is_prompt_and_leaves_nothing(plugin, large, tmp_path, percent):
    folder = tmp_path / "out"
    folder.mkdir()
    old = folder / "area.tif"
    old.write_bytes(b"the user's older result")
    run = TaskRun(
        "drainagearea",
        {"INPUT": large, "OUTPUT": str(old), "STREAMS": str(folder / "streams.gpkg")},
        cancel_at=percent,
    )
    assert run.cancelled_at is not None
    assert run.ended_at - run.cancelled_at < 1
    assert not run.fine
    assert os.listdir(folder) == ["area.tif"]
    assert old.read_bytes() == b"the user's older result"
    assert "cancelled; nothing was written" in run.feedback.textLog()


# --- qgis_process --------------------------------------------------------------------------------


def test_in_qgis_process(qgis_process, holed, tmp_path):
    area, streams = tmp_path / "area.tif", tmp_path / "streams.gpkg"
    done = qgis_process(
        "--json", "run", "demsmith:drainagearea", f"--INPUT={holed[0]}", "--METHOD=dinf",
        "--THRESHOLD=300000", f"--OUTPUT={area}", f"--STREAMS={streams}",
    )  # fmt: skip
    results = json.loads(done.stdout)["results"]
    assert (results["OUTPUT"], results["STREAMS"]) == (str(area), str(streams))
    layer = QgsVectorLayer(str(streams), "streams")
    assert layer.featureCount() == results["LINKS"] > 3
    assert layer.crs().authid() == "EPSG:4326"
    assert read(area)[0].max() == results["LARGEST_AREA"]
