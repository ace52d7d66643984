"""The model *raw SRTM to drainage and sunlight*: its file, the tool made of it, `qgis_process`."""

import json
from pathlib import Path

import numpy as np
import pytest
from gdal_reading import read
from qgis import processing
from qgis.core import (
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildParameterSource,
    QgsProcessingParameterDefinition,
    QgsProject,
    QgsVectorLayer,
)
from qgis_runs import TaskRun, parameter_row, tool
from scenes import fractal
from support import digest, make_raster

MODEL = str(Path(__file__).resolve().parents[2] / "models" / "srtm_to_drainage_and_sun.model3")
TOOL = "srtmtodrainageandsun"
VOID = -32768
STEPS = {
    "reconstruct": "demsmith:reconstructsrtm",
    "drainage": "demsmith:drainagearea",
    "sunlight": "demsmith:solarirradiance",
}
MADE = {
    "reconstruct:Elevation": ".tif",
    "drainage:Drainage": ".tif",
    "drainage:Streams": ".gpkg",
    "sunlight:Sunlight": ".tif",
}
PARAMETERS = """
DATE                     datetime           2024-06-20 required
INPUT                    raster             -          required
THRESHOLD                number             1000000.0  required
drainage:Drainage        rasterDestination  -          required
drainage:Streams         vectorDestination  -          required
reconstruct:Elevation    rasterDestination  -          required
sunlight:Sunlight        rasterDestination  -          required
"""


@pytest.fixture
def model(plugin):
    """Load the file as the model designer does."""
    loaded = QgsProcessingModelAlgorithm()
    assert loaded.fromFile(MODEL)
    return loaded


@pytest.fixture(scope="module")
def raw(tmp_path_factory):
    """Make a mountainous 3″ tile with voids, as the raw SRTM has them."""
    ground = np.rint(fractal((70, 90), seed=5, relief=1500)).astype(np.int16)
    ground[20:27, 30:39] = VOID
    ground[50:53, 60:80] = VOID
    ground[40, 12:15] = VOID
    return make_raster(tmp_path_factory.mktemp("raw") / "raw.tif", ground, nodata=VOID)


def targets(folder):
    return {name: str(folder / f"{name.split(':')[1]}{kind}") for name, kind in MADE.items()}


def check_outputs(results, raw):
    """Check the four outputs against what is known of any terrain."""
    elevation, tag = read(results["reconstruct:Elevation"])[:2]
    before = read(raw)[0]
    assert not (elevation == tag).any()
    np.testing.assert_array_equal(elevation[before != VOID], before[before != VOID])
    area, tag = read(results["drainage:Drainage"])[:2]
    assert not (area == tag).any()
    cell = 59.6 * 92.7  # metres of 3″ at 50° N
    assert area.min() == pytest.approx(cell, rel=0.01)
    assert 1e6 < area.max() <= area.size * cell * 1.01
    sunlight = read(results["sunlight:Sunlight"])[0]
    assert 3000 < sunlight.min() < sunlight.max() < 10_000  # Wh/m² in June
    streams = QgsVectorLayer(results["drainage:Streams"], "streams")
    assert streams.isValid()
    assert streams.featureCount() > 0


# --- the file ------------------------------------------------------------------------------------


def test_the_designer_finds_nothing_wrong(model):
    fine, problems = model.validate()
    assert fine, problems
    assert {name: step.algorithmId() for name, step in model.childAlgorithms().items()} == STEPS
    assert model.canExecute()[0]


def test_its_steps_keep_the_defaults_of_their_tools(model):
    """Where this fails, run ``tools/make_model.py``: a tool has another default, or parameter."""
    optional = QgsProcessingParameterDefinition.Flag.FlagOptional
    static = QgsProcessingModelChildParameterSource.Source.StaticValue
    for step in model.childAlgorithms().values():
        sources = step.parameterSources()
        for parameter in step.algorithm().parameterDefinitions():
            if parameter.isDestination() or parameter.flags() & optional:
                continue
            (source,) = sources[parameter.name()]
            if source.source() == static:
                assert source.staticValue() == parameter.defaultValue(), parameter.name()
        assert set(sources) <= {each.name() for each in step.algorithm().parameterDefinitions()}


def test_its_own_defaults_are_those_of_the_tools(model):
    for name, step in (("DATE", "solarirradiance"), ("THRESHOLD", "drainagearea")):
        made = tool(step)
        theirs = made.parameterDefinition(name).defaultValue()
        assert model.parameterDefinition(name).defaultValue() == theirs


# --- the tool ------------------------------------------------------------------------------------


def test_it_is_a_tool_of_the_toolbox(plugin):
    made = tool(TOOL)
    assert (made.id(), made.displayName()) == (f"demsmith:{TOOL}", "SRTM to drainage and sunlight")
    assert (made.group(), made.groupId()) == ("Chains", "chains")
    assert not made.icon().isNull()
    assert "voids" in made.shortHelpString()
    promised = [line.split() for line in PARAMETERS.strip().splitlines()]
    rows = [parameter_row(parameter) for parameter in made.parameterDefinitions()]
    assert rows == promised
    assert {output.name() for output in made.outputDefinitions()} == set(MADE)


def test_it_makes_what_its_tools_make_one_after_the_other(plugin, raw, tmp_path):
    before = digest(raw)
    results = processing.run(f"demsmith:{TOOL}", {"INPUT": raw, **targets(tmp_path)})
    assert {name: results[name] for name in MADE} == targets(tmp_path)
    check_outputs(results, raw)
    assert digest(raw) == before
    elevation = processing.run(
        STEPS["reconstruct"], {"INPUT": raw, "OUTPUT": str(tmp_path / "z.tif")}
    )["OUTPUT"]
    for step, name in (("drainage", "Drainage"), ("sunlight", "Sunlight")):
        path = str(tmp_path / f"{step}.tif")
        alone = processing.run(STEPS[step], {"INPUT": elevation, "OUTPUT": path})
        np.testing.assert_array_equal(read(path)[0], read(results[f"{step}:{name}"])[0])
        assert alone["OUTPUT"] == path


def test_its_parameters_reach_the_tools(plugin, raw, tmp_path):
    summer = processing.run(f"demsmith:{TOOL}", {"INPUT": raw, **targets(tmp_path)})
    (tmp_path / "winter").mkdir()
    winter = processing.run(
        f"demsmith:{TOOL}",
        {"INPUT": raw, "DATE": "2024-12-20", "THRESHOLD": 1e5, **targets(tmp_path / "winter")},
    )
    light = [read(results["sunlight:Sunlight"])[0].mean() for results in (summer, winter)]
    assert light[0] > 3 * light[1]
    streams = [
        QgsVectorLayer(results["drainage:Streams"], "streams").featureCount()
        for results in (summer, winter)
    ]
    assert streams[1] > 2 * streams[0]


def test_its_layers_are_loaded_in_their_own_looks(plugin, raw):
    project = QgsProject.instance()
    project.clear()
    processing.runAndLoadResults(
        f"demsmith:{TOOL}", {"INPUT": raw, **dict.fromkeys(MADE, "TEMPORARY_OUTPUT")}
    )
    layers = {layer.name(): layer for layer in project.mapLayers().values()}
    assert set(layers) == {"Elevation", "Drainage", "Streams", "Sunlight"}
    assert layers["Streams"].renderer().type() == "graduatedSymbol"
    colours = {}
    for name in ("Elevation", "Drainage", "Sunlight"):
        ramp = layers[name].renderer().shader().rasterShaderFunction()
        assert ramp.minimumValue() < ramp.maximumValue()
        colours[name] = tuple(item.color.name() for item in ramp.colorRampItemList())
    assert len(set(colours.values())) == 3
    project.clear()


def test_on_a_worker_thread(plugin, raw, tmp_path):
    run = TaskRun(TOOL, {"INPUT": raw, **targets(tmp_path)})
    assert run.fine
    check_outputs(run.outputs, raw)
    assert run.progress == sorted(run.progress)


def test_cancelled_it_makes_nothing(plugin, raw, tmp_path):
    run = TaskRun(TOOL, {"INPUT": raw, **targets(tmp_path)}, cancel_at=1)
    assert not run.fine
    assert not (tmp_path / "Sunlight.tif").exists()


# --- qgis_process --------------------------------------------------------------------------------


@pytest.mark.parametrize("named", [MODEL, f"demsmith:{TOOL}"], ids=["by file", "by id"])
def test_in_qgis_process(qgis_process, raw, tmp_path, named):
    done = qgis_process(
        "--json", "run", named, f"--INPUT={raw}",
        *(f"--{name}={path}" for name, path in targets(tmp_path).items()),
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    results = json.loads(done.stdout)["results"]
    assert {name: results[name] for name in MADE} == targets(tmp_path)
    check_outputs(results, raw)
