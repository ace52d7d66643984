"""The tool *Learn dictionary*: its contract, runs, worker thread, `qgis_process` and cancel."""

import json
import os

import numpy as np
import pytest
from qgis import processing
from qgis.core import QgsProcessingException
from qgis_runs import TaskRun, assert_parameters, tool
from scenes import fractal
from support import digest, make_raster

from demsmith.core.sparse import read_dictionary

PARAMETERS = """
INPUT       multilayer      -        required
BAND        number          1        required advanced
NODATA      string          -        optional
BELOW       number          -        optional advanced
ABOVE       number          -        optional advanced
METHOD      enum            ksvd     required
ATOMS       number          128      required
SPARSITY    number          2        required
RADIUS      number          -        optional
FACTOR      number          1        required
ITERATIONS  number          30       required advanced
POLISHING   number          5        required advanced
TOLERANCE   number          0.0      required advanced
MOST_DISCS  number          50000    required advanced
WEIGHTING   enum            blend    required advanced
SEED        number          0        required advanced
PRECISION   enum            float32  required advanced
THREADS     number          -        optional advanced
OUTPUT      fileDestination -        required
"""
OUTPUTS = {
    "OUTPUT": "outputFile",
    "ATOMS_LEARNED": "outputNumber",
    "SIDE_ROWS": "outputNumber",
    "SIDE_COLUMNS": "outputNumber",
    "DISCS": "outputNumber",
    "DISCS_SKIPPED": "outputNumber",
    "RMSE": "outputNumber",
    "BYTES": "outputNumber",
    "SECONDS": "outputNumber",
    "WARNINGS": "outputString",
}
FAST = {"ATOMS": 12, "ITERATIONS": 3}


@pytest.fixture
def learn(plugin, tmp_path):
    """Run the tool by `processing.run`; returns its outputs."""

    def run(*sources, **parameters):
        parameters = {
            "INPUT": list(sources), "OUTPUT": str(tmp_path / "learned.dsd"), **FAST, **parameters,
        }  # fmt: skip
        return processing.run("demsmith:learndictionary", parameters)

    return run


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """Make a raster on which learning takes a second or two."""
    values = np.rint(fractal((513, 513), seed=1)).astype(np.int16)
    return make_raster(tmp_path_factory.mktemp("large") / "large.tif", values)


def test_parameters_are_the_promised_ones(plugin):
    made = tool("learndictionary")
    assert_parameters(made, PARAMETERS)
    assert made.parameterDefinition("METHOD").usesStaticStrings()


def test_outputs_are_the_promised_ones(plugin):
    made = tool("learndictionary")
    assert {output.name(): output.type() for output in made.outputDefinitions()} == OUTPUTS


def test_the_tool_is_named_grouped_and_found(plugin):
    made = tool("learndictionary")
    assert (made.id(), made.displayName()) == ("demsmith:learndictionary", "Learn dictionary")
    assert (made.groupId(), made.group()) == ("compression", "Compression")
    assert {"dsd", "ksvd", "atoms"} <= set(made.tags())
    assert made.shortDescription()
    assert "K-SVD" in made.shortHelpString()


def test_learns_and_changes_nothing(learn, holed):
    source, _ = holed
    before = digest(source)
    result = learn(source, source)
    assert set(result) == set(OUTPUTS)
    assert result["ATOMS_LEARNED"] == len(read_dictionary(result["OUTPUT"])) == 12
    assert result["DISCS_SKIPPED"] > 0
    assert result["RMSE"] > 0
    assert result["BYTES"] == os.path.getsize(result["OUTPUT"])
    assert digest(source) == before


def test_options_reach_the_core(learn, holed, tmp_path):
    made = set()
    for number, options in enumerate(
        ({}, {"ATOMS": 11}, {"METHOD": "constrained"}, {"METHOD": "complete"}, {"SPARSITY": 1},
         {"FACTOR": 2}, {"RADIUS": 400}, {"SEED": 4}, {"PRECISION": "int8"}, {"ABOVE": 600},
         {"NODATA": "500"}, {"WEIGHTING": "even"}, {"POLISHING": 0})
    ):  # fmt: skip
        path = str(tmp_path / f"{number}.dsd")
        learn(holed[0], OUTPUT=path, **options)
        made.add(digest(path))
    assert len(made) == 13


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"ATOMS": 0}, "ATOMS"),
        ({"ATOMS": 3000}, "3000 atoms cannot be learned"),
        ({"METHOD": "svd"}, "METHOD"),
        ({"NODATA": "low"}, "NODATA is 'low'; give numbers"),
        ({"BAND": 3}, "band 3 asked"),
        ({"BELOW": 99999}, "no disc of 10 by 10 cells"),
        ({"OUTPUT": "{folder}/none/x.dsd"}, "there is no folder"),
    ],
)
def test_errors_say_what_is_wrong_and_leave_nothing(learn, holed, tmp_path, parameters, message):
    before = set(os.listdir(tmp_path))
    parameters = {
        key: value.format(folder=tmp_path) if isinstance(value, str) else value
        for key, value in parameters.items()
    }
    with pytest.raises(QgsProcessingException) as error:
        learn(holed[0], **parameters)
    assert message in str(error.value)
    assert {name for name in os.listdir(tmp_path) if not name.endswith(".aux.xml")} == before


def test_the_window_stays_responsive_and_cancel_is_prompt(plugin, large, tmp_path):
    parameters = {"INPUT": [large], "OUTPUT": str(tmp_path / "learned.dsd"), "ITERATIONS": 2}
    run = TaskRun("learndictionary", parameters)
    assert run.fine
    assert max(run.gaps) < 0.5
    assert run.progress == sorted(run.progress)
    os.remove(tmp_path / "learned.dsd")
    for percent in (5, 50):
        run = TaskRun("learndictionary", {**parameters, "ITERATIONS": 50}, cancel_at=percent)
        assert not run.fine
        assert run.ended_at - run.cancelled_at < 1
    assert os.listdir(tmp_path) == []


def test_runs_in_qgis_process(qgis_process, holed, tmp_path):
    target = tmp_path / "learned.dsd"
    done = qgis_process(
        "--json", "run", "demsmith:learndictionary", f"--INPUT={holed[0]}", "--ATOMS=10",
        "--ITERATIONS=2", f"--OUTPUT={target}",
    )  # fmt: skip
    results = json.loads(done.stdout)["results"]
    assert results["ATOMS_LEARNED"] == 10
    assert len(read_dictionary(target)) == 10
