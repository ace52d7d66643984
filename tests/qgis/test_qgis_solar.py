"""The tool *Solar irradiance*: contract, runs, worker thread, `qgis_process`, cancel, styles."""

import json
import os

import numpy as np
import pytest
from gdal_reading import read
from qgis import processing
from qgis.core import QgsProcessingException, QgsProject, QgsRasterLayer
from qgis.PyQt.QtCore import QDate, QTime
from qgis_runs import TaskRun, assert_parameters, tool
from support import digest, hills, make_raster

PARAMETERS = """
INPUT            raster             -              required
BAND             band               1              optional
NODATA           string             -              optional
MASK             raster             -              optional
BELOW            number             -              optional advanced
ABOVE            number             -              optional advanced
WHEN             enum               day            required
DATE             datetime           2024-06-20     required
LAST_DATE        datetime           -              optional
TIME             datetime           -              optional
EVERY            number             1              required advanced
WATTS            boolean            False          required advanced
STEP             number             0.5            required
ATMOSPHERE       enum               linke          required
LINKE            number             3.0            required
ALBEDO           number             0.2            required
SHADOWS          boolean            True           required
DIFFUSE_MODEL    enum               muneer         required advanced
HIDDEN_SKY       boolean            False          required advanced
DIRECTIONS       number             32             required advanced
CURVATURE        boolean            True           required advanced
LATITUDE         number             -              optional advanced
LONGITUDE        number             -              optional advanced
THREADS          number             -              optional advanced
CREATION_OPTIONS string             -              optional advanced
OUTPUT           rasterDestination  -              required
BEAM             rasterDestination  -              optional
DIFFUSE          rasterDestination  -              optional
REFLECTED        rasterDestination  -              optional
HOURS            rasterDestination  -              optional
SHADOW           rasterDestination  -              optional
SKY_VIEW         rasterDestination  -              optional
HORIZONS         rasterDestination  -              optional
"""
LAYERS = (
    "OUTPUT", "BEAM", "DIFFUSE", "REFLECTED", "HOURS", "SHADOW", "SKY_VIEW", "HORIZONS",
)  # fmt: skip
OUTPUTS = {
    **dict.fromkeys(LAYERS, "outputRaster"),
    **dict.fromkeys(("MINIMUM", "MEAN", "MAXIMUM", "INSTANTS", "SECONDS"), "outputNumber"),
    "UNIT": "outputString",
    "WARNINGS": "outputString",
}


@pytest.fixture
def shine(plugin, tmp_path):
    """Run the tool by `processing.run`; returns its outputs."""

    def run(source, **parameters):
        parameters = {
            "INPUT": source, "OUTPUT": str(tmp_path / "light.tif"), "STEP": 2, **parameters,
        }  # fmt: skip
        return processing.run("demsmith:solarirradiance", parameters)

    return run


@pytest.fixture
def mountains(tmp_path):
    """Make a small raster with a void; returns its path."""
    values = 4 * hills(30, 40) - 800
    values[10:13, 20:24] = -9999
    return make_raster(tmp_path / "mountains.tif", values, nodata=-9999)


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """Make a raster of a million cells."""
    values = np.tile(4 * hills(500, 500), (2, 2))
    return make_raster(tmp_path_factory.mktemp("large") / "large.tif", values)


def light(path):
    values, tag, _, _ = read(path)
    return np.where(values == tag, np.nan, values)


# --- contract ------------------------------------------------------------------------------------


def test_parameters_are_the_promised_ones(plugin):
    made = tool("solarirradiance")
    assert_parameters(made, PARAMETERS)
    for name in ("WHEN", "ATMOSPHERE", "DIFFUSE_MODEL"):
        assert made.parameterDefinition(name).usesStaticStrings()


def test_outputs_are_the_promised_ones(plugin):
    made = tool("solarirradiance")
    assert {output.name(): output.type() for output in made.outputDefinitions()} == OUTPUTS
    defaults = {
        each.name(): each.createByDefault() for each in made.destinationParameterDefinitions()
    }
    assert defaults == {name: name == "OUTPUT" for name in LAYERS}


def test_the_tool_is_named_grouped_and_found(plugin):
    made = tool("solarirradiance")
    assert (made.id(), made.displayName()) == ("demsmith:solarirradiance", "Solar irradiance")
    assert (made.groupId(), made.group()) == ("sunlight", "Sunlight")
    assert {"sun", "insolation", "shadow", "r.sun"} <= set(made.tags())
    assert made.shortDescription()
    assert "r.sun" in made.shortHelpString()


# --- runs ----------------------------------------------------------------------------------------


def test_a_day_and_its_hours(shine, mountains, tmp_path):
    before = digest(mountains)
    result = shine(mountains, HOURS=str(tmp_path / "hours.tif"))
    total, hours = light(result["OUTPUT"]), light(result["HOURS"])
    assert np.isnan(total).sum() == 12
    assert (result["MINIMUM"], result["MAXIMUM"]) == (np.nanmin(total), np.nanmax(total))
    assert result["MEAN"] == pytest.approx(np.nanmean(total), rel=1e-5)
    assert 5000 < result["MEAN"] < 10000
    assert 12 < np.nanmax(hours) <= 18
    assert result["UNIT"] == "Wh/m²/day"
    assert set(result) == set(OUTPUTS) - set(LAYERS) | {"OUTPUT", "HOURS"}
    assert read(result["OUTPUT"])[2] == read(mountains)[2]
    assert digest(mountains) == before


def test_when_reaches_the_core(shine, mountains, tmp_path):
    ways = {
        "june": {},
        "december": {"DATE": "2024-12-20"},
        "the same, as QGIS's widget gives it": {"DATE": QDate(2024, 12, 20)},
        "autumn": {"WHEN": "range", "LAST_DATE": "2024-12-20", "EVERY": 60},
        "year": {"WHEN": "annual", "EVERY": 91},
        "morning": {"WHEN": "instant", "TIME": "07:00:00"},
        "noon": {"WHEN": "instant", "TIME": QTime(11, 30)},
    }
    mean = {}
    for name, parameters in ways.items():
        result = shine(mountains, OUTPUT=str(tmp_path / f"{name}.tif"), **parameters)
        mean[name] = result["MEAN"]
        assert result["UNIT"] == ("W/m²" if parameters.get("WHEN") == "instant" else "Wh/m²/day")
    assert mean["the same, as QGIS's widget gives it"] == mean["december"] < mean["june"]
    assert mean["december"] < mean["autumn"] < mean["june"]
    assert mean["december"] < mean["year"] < mean["june"]
    assert 100 < mean["morning"] < mean["noon"] < 1200


def test_options_reach_the_core(shine, mountains, tmp_path):
    made = []
    for number, options in enumerate(
        ({}, {"STEP": 1}, {"ATMOSPHERE": "ineichen"}, {"LINKE": 5}, {"ALBEDO": 0.5},
         {"SHADOWS": False}, {"DIFFUSE_MODEL": "isotropic"}, {"HIDDEN_SKY": True},
         {"HIDDEN_SKY": True, "DIRECTIONS": 8}, {"WATTS": True}, {"ABOVE": 1000})
    ):  # fmt: skip
        path = str(tmp_path / f"{number}.tif")
        result = shine(mountains, **{"OUTPUT": path, "DATE": "2024-12-20", **options})
        made.append(light(result["OUTPUT"]).tobytes())
    assert len(set(made)) == len(made)


def test_a_raster_without_crs(shine, tmp_path):
    nowhere = dict(crs="", geotransform=(0, 1, 0, 0, 0, 1))
    bare = make_raster(tmp_path / "bare.tif", hills(20, 30), **nowhere)
    with pytest.raises(QgsProcessingException, match="latitude of its middle"):
        shine(bare)
    assert shine(bare, LATITUDE=46.5)["MEAN"] > 1000


def test_outputs_are_loaded_with_their_styles(plugin, mountains):
    project = QgsProject.instance()
    project.clear()
    outputs = dict.fromkeys(LAYERS, "TEMPORARY_OUTPUT")
    for when, left_out in (("day", "SHADOW"), ("instant", "HOURS")):
        processing.runAndLoadResults(
            "demsmith:solarirradiance",
            {"INPUT": mountains, "STEP": 2, "DIRECTIONS": 8, "WHEN": when, "TIME": "07:00:00",
             **{name: to for name, to in outputs.items() if name != left_out}},
        )  # fmt: skip
    layers = {layer.name(): layer for layer in project.mapLayers().values()}
    made = tool("solarirradiance")
    titles = {each.name(): each.description() for each in made.destinationParameterDefinitions()}
    assert set(layers) == set(titles.values())
    for name in LAYERS:
        layer = layers[titles[name]]
        assert layer.isValid()
        if name in ("SHADOW", "HORIZONS"):
            continue
        assert layer.renderer().type() == "singlebandpseudocolor", name
        stretched = layer.renderer().classificationMin(), layer.renderer().classificationMax()
        found = light(layer.source())
        assert stretched == pytest.approx((np.nanmin(found), np.nanmax(found)), rel=1e-4, abs=1e-4)
    assert layers[titles["SHADOW"]].renderer().type() == "paletted"
    assert layers[titles["HORIZONS"]].bandCount() == 8
    del layer
    layers.clear()
    project.clear()


@pytest.mark.parametrize("name", ["irradiance", "hours", "sky_view"])
def test_more_is_brighter(plugin, mountains, name):
    """Ramps that rise evenly in lightness are read without a legend."""
    from demsmith.algorithms.provider import ROOT

    layer = QgsRasterLayer(mountains, "any")
    message, done = layer.loadNamedStyle(os.path.join(ROOT, "styles", f"{name}.qml"))
    assert done, message
    ramp = layer.renderer().shader().rasterShaderFunction().colorRampItemList()
    lightness = [item.color.lightnessF() for item in ramp]
    luminance = [
        0.2126 * c.redF() + 0.7152 * c.greenF() + 0.0722 * c.blueF()
        for c in (item.color for item in ramp)
    ]
    assert len(ramp) >= 3
    assert luminance == sorted(luminance)
    assert lightness[-1] > lightness[0] + 0.4
    del layer


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"STEP": 0}, "STEP"),
        ({"WHEN": "never"}, "WHEN"),
        ({"DATE": "some day"}, "DATE"),
        ({"WHEN": "range"}, "LAST_DATE"),
        ({"WHEN": "range", "LAST_DATE": "2020-01-01"}, "before it begins"),
        ({"WHEN": "instant"}, "give TIME"),
        ({"SHADOW": "{folder}/shadow.tif"}, "shadow mask is of an instant"),
        ({"LATITUDE": 5}, "itself tells where it lies"),
        ({"BELOW": 99999}, "every cell is a void"),
        ({"OUTPUT": "{folder}/light.png"}, "not supported"),
        ({"BEAM": "{folder}/none/beam.tif"}, "there is no folder"),
    ],
)
def test_errors_say_what_is_wrong_and_leave_nothing(
    shine, mountains, tmp_path, parameters, message
):
    before = set(os.listdir(tmp_path))
    parameters = {
        key: value.format(folder=tmp_path) if isinstance(value, str) else value
        for key, value in parameters.items()
    }
    with pytest.raises(QgsProcessingException) as error:
        shine(mountains, **parameters)
    assert message in str(error.value)
    assert {name for name in os.listdir(tmp_path) if not name.endswith(".aux.xml")} == before


# --- worker thread -------------------------------------------------------------------------------


def test_the_window_stays_responsive(plugin, large, tmp_path):
    run = TaskRun(
        "solarirradiance",
        {"INPUT": large, "OUTPUT": str(tmp_path / "light.tif"), "STEP": 3,
         "SKY_VIEW": str(tmp_path / "sky.tif"), "DIRECTIONS": 4},
    )  # fmt: skip
    assert run.fine
    assert run.outputs["MEAN"] > 1000
    assert max(run.gaps) < 0.5
    assert len(run.progress) >= 5
    assert run.progress == sorted(run.progress)
    assert run.progress[-1] == 100


@pytest.mark.parametrize("percent", [1, 40, 80])
def test_cancel_is_prompt_and_leaves_nothing(plugin, large, tmp_path, percent):
    folder = tmp_path / "out"
    folder.mkdir()
    old = folder / "light.tif"
    old.write_bytes(b"the user's older result")
    run = TaskRun(
        "solarirradiance",
        {"INPUT": large, "OUTPUT": str(old), "HORIZONS": str(folder / "horizons.tif"), "STEP": 3},
        cancel_at=percent,
    )
    assert run.cancelled_at is not None
    assert run.ended_at - run.cancelled_at < 1
    assert not run.fine
    assert os.listdir(folder) == ["light.tif"]
    assert old.read_bytes() == b"the user's older result"
    assert "cancelled; nothing was written" in run.feedback.textLog()


# --- qgis_process --------------------------------------------------------------------------------


def test_in_qgis_process(qgis_process, mountains, tmp_path):
    target, shadow = tmp_path / "light.tif", tmp_path / "shadow.tif"
    done = qgis_process(
        "--json", "run", "demsmith:solarirradiance", f"--INPUT={mountains}", "--WHEN=instant",
        "--DATE=2024-12-20", "--TIME=08:00:00", f"--OUTPUT={target}", f"--SHADOW={shadow}",
    )  # fmt: skip
    results = json.loads(done.stdout)["results"]
    assert (results["OUTPUT"], results["SHADOW"]) == (str(target), str(shadow))
    assert (results["UNIT"], results["INSTANTS"]) == ("W/m²", 1)
    assert results["MEAN"] == pytest.approx(np.nanmean(light(target)), rel=1e-5)
    assert set(np.unique(read(shadow)[0])) == {0, 1, 255}
