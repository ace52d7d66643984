"""QGIS with Processing and the plugin in it, and a small raster with holes."""

import subprocess

import pytest
import qgis_process as finder  # the demo's
from support import hills, make_raster

TOOL = "demsmith:fillvoids"
VOID = -32768


@pytest.fixture(scope="session")
def plugin(qgis_processing):
    """Keep the plugin loaded, as QGIS has it without a window."""
    import demsmith

    loaded = demsmith.classFactory(None)
    loaded.initProcessing()
    yield loaded
    loaded.unload()


@pytest.fixture
def fill(plugin, tmp_path):
    """Run the tool by `processing.run`; returns its outputs."""
    from qgis import processing

    def run(source, **parameters):
        parameters = {"INPUT": source, "OUTPUT": str(tmp_path / "filled.tif"), **parameters}
        feedback = parameters.pop("feedback", None)
        return processing.run(TOOL, parameters, feedback=feedback)

    return run


@pytest.fixture
def make(plugin, tmp_path):
    """Make terrain from samples by `processing.run`; returns its outputs."""
    from qgis import processing

    def run(feedback=None, **parameters):
        parameters = {"OUTPUT": str(tmp_path / "terrain.tif"), **parameters}
        return processing.run("demsmith:reconstructfromsamples", parameters, feedback=feedback)

    return run


@pytest.fixture
def holed(tmp_path):
    """Make a tile with a hole of 48 cells and one of 10 at its edge; returns path and values."""
    values = hills(60, 80)
    values[20:26, 30:38] = VOID
    values[50:55, 0:2] = VOID
    return make_raster(tmp_path / "holed.tif", values, nodata=VOID), values


@pytest.fixture(scope="session")
def qgis_process(tmp_path_factory):
    """Give a function that calls `qgis_process` with the checkout enabled as a plugin."""
    program = finder.find()
    if program is None:
        pytest.skip("qgis_process is not installed")
    environment = finder.environment(tmp_path_factory.mktemp("qgis"))

    def call(*arguments):
        return subprocess.run(
            [program, *arguments], env=environment, capture_output=True, text=True,
            timeout=240, check=False,
        )  # fmt: skip

    enabled = call("plugins", "enable", "demsmith")
    assert enabled.returncode == 0, enabled.stderr
    return call
