"""The tool *Inverse procedural model*: contract, runs, worker thread, `qgis_process`, cancel."""

import json
import os

import numpy as np
import pytest
from gdal_reading import read
from qgis import processing
from qgis.core import QgsProcessingException, QgsProject
from qgis_runs import TaskRun, assert_parameters, tool
from support import digest, hills, make_raster

from demsmith.core.procedural import read_terrain

VOID = -32768
PARAMETERS = """
INPUT            raster             -              required
BAND             band               1              optional
NODATA           string             -              optional
MASK             raster             -              optional
BELOW            number             -              optional advanced
ABOVE            number             -              optional advanced
FAMILY           enum               ridged         required
ATOMS            number             128            required
SPARSITY         number             2              required
RADIUS           number             -              optional
CANDIDATES       number             4096           required advanced
TERMS            number             2              required advanced
SEED             number             0              required advanced
SCALE            number             1.0            required
THREADS          number             -              optional advanced
CREATION_OPTIONS string             -              optional advanced
OUTPUT           rasterDestination  -              required
MODEL            fileDestination    -              optional
"""
OUTPUTS = {
    "OUTPUT": "outputRaster",
    "MODEL": "outputFile",
    "RMSE": "outputNumber",
    "PSNR": "outputNumber",
    "DISCS": "outputNumber",
    "BYTES": "outputNumber",
    "SECONDS": "outputNumber",
    "WARNINGS": "outputString",
}
QUICK = {"ATOMS": 30, "CANDIDATES": 200}


@pytest.fixture
def model(plugin, tmp_path):
    """Run the tool by `processing.run`; returns its outputs."""

    def run(source, **parameters):
        parameters = {"INPUT": source, "OUTPUT": str(tmp_path / "made.tif"), **QUICK, **parameters}
        return processing.run("demsmith:inverseprocedural", parameters)

    return run


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """Make a raster of 1.4 million cells."""
    values = np.tile(hills(400, 400), (3, 3))
    return make_raster(tmp_path_factory.mktemp("large") / "large.tif", values, nodata=VOID)


def test_the_contract(plugin):
    made = tool("inverseprocedural")
    assert_parameters(made, PARAMETERS)
    assert {output.name(): output.type() for output in made.outputDefinitions()} == OUTPUTS
    defaults = {
        each.name(): each.createByDefault() for each in made.destinationParameterDefinitions()
    }
    assert defaults == {"OUTPUT": True, "MODEL": False}
    assert (made.id(), made.displayName()) == (
        "demsmith:inverseprocedural", "Inverse procedural model"
    )  # fmt: skip
    assert (made.groupId(), made.group()) == ("synthesis", "Synthesis")
    assert {"noise", "ridged", "perlin"} <= set(made.tags())
    assert made.shortDescription()
    assert "parameters, not of cells" in made.shortHelpString()


def test_the_raster_and_its_model(model, holed, tmp_path):
    source, values = holed
    before = digest(source)
    result = model(source, MODEL=str(tmp_path / "made.dsp"))
    made, tag, geotransform, _ = read(result["OUTPUT"])
    void = values == VOID
    assert np.isnan(tag)
    np.testing.assert_array_equal(np.isnan(made), void)
    assert geotransform == read(source)[2]
    error = np.sqrt(np.mean((made - values)[~void] ** 2))
    assert result["RMSE"] == pytest.approx(error, rel=1e-4)
    assert error < 0.03 * np.ptp(values[~void])
    assert result["BYTES"] == os.path.getsize(tmp_path / "made.dsp")
    assert set(result) == set(OUTPUTS)
    np.testing.assert_array_equal(read_terrain(result["MODEL"]).terrain.evaluate(), made)
    assert digest(source) == before


def test_options_reach_the_core(model, holed, tmp_path):
    made = []
    for number, options in enumerate(
        ({}, {"FAMILY": "perlin"}, {"SPARSITY": 3}, {"RADIUS": 600}, {"TERMS": 3}, {"SEED": 2},
         {"BELOW": 400}, {"SCALE": 2})
    ):  # fmt: skip
        path = str(tmp_path / f"{number}.tif")
        made.append(read(model(holed[0], OUTPUT=path, **options)["OUTPUT"])[0])
    assert len({each.tobytes() for each in made}) == len(made)
    assert made[-1].shape == (120, 160)


def test_the_output_is_loaded(plugin, holed):
    project = QgsProject.instance()
    project.clear()
    processing.runAndLoadResults(
        "demsmith:inverseprocedural",
        {"INPUT": holed[0], "OUTPUT": "TEMPORARY_OUTPUT", **QUICK},
    )
    (layer,) = project.mapLayers().values()
    assert layer.name() == "Modelled terrain"
    assert layer.renderer().type() == "singlebandpseudocolor"
    project.clear()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"ATOMS": 0}, "ATOMS"),
        ({"FAMILY": "simplex"}, "FAMILY"),
        ({"BAND": 3}, "band 3 asked"),
        ({"BELOW": 99999}, "every cell is a void"),
        ({"RADIUS": 1e7}, "a radius of 1e+07 m"),
        ({"MODEL": "{folder}/none/made.dsp"}, "there is no folder"),
        ({"MODEL": "{folder}/made.json"}, "end its name in .dsp"),
    ],
)
def test_errors_say_what_is_wrong_and_leave_nothing(model, holed, tmp_path, parameters, message):
    before = set(os.listdir(tmp_path))
    parameters = {
        key: value.format(folder=tmp_path) if isinstance(value, str) else value
        for key, value in parameters.items()
    }
    with pytest.raises(QgsProcessingException) as error:
        model(holed[0], **parameters)
    assert message in str(error.value)
    assert {name for name in os.listdir(tmp_path) if not name.endswith(".aux.xml")} == before


def test_the_window_stays_responsive(plugin, large, tmp_path):
    run = TaskRun(
        "inverseprocedural", {"INPUT": large, "OUTPUT": str(tmp_path / "made.tif"), **QUICK}
    )
    assert run.fine
    assert run.outputs["DISCS"] == 240 * 240
    assert max(run.gaps) < 0.5
    assert len(run.progress) >= 5
    assert run.progress == sorted(run.progress)
    assert run.progress[-1] == 100


@pytest.mark.parametrize("percent", [1, 30, 75])
def test_cancel_is_prompt_and_leaves_nothing(plugin, large, tmp_path, percent):
    folder = tmp_path / "out"
    folder.mkdir()
    old = folder / "made.tif"
    old.write_bytes(b"the user's older result")
    run = TaskRun(
        "inverseprocedural",
        {"INPUT": large, "OUTPUT": str(old), "MODEL": str(folder / "made.dsp"), **QUICK},
        cancel_at=percent,
    )
    assert run.cancelled_at is not None
    assert run.ended_at - run.cancelled_at < 1
    assert not run.fine
    assert os.listdir(folder) == ["made.tif"]
    assert old.read_bytes() == b"the user's older result"
    assert "cancelled; nothing was written" in run.feedback.textLog()


def test_in_qgis_process(qgis_process, holed, tmp_path):
    target, model = tmp_path / "made.tif", tmp_path / "made.dsp"
    done = qgis_process(
        "--json", "run", "demsmith:inverseprocedural", f"--INPUT={holed[0]}", "--FAMILY=mixed",
        "--ATOMS=20", "--CANDIDATES=100", "--SCALE=2", f"--OUTPUT={target}", f"--MODEL={model}",
    )  # fmt: skip
    results = json.loads(done.stdout)["results"]
    assert (results["OUTPUT"], results["MODEL"]) == (str(target), str(model))
    assert results["DISCS"] == 12 * 16
    assert read(target)[0].shape == (120, 160)
    assert model.exists()
