"""QGIS with Processing and the plugin in it, and a small raster with holes."""

import pytest
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
def holed(tmp_path):
    """Make a tile with a hole of 48 cells and one of 10 at its edge; returns path and values."""
    values = hills(60, 80)
    values[20:26, 30:38] = VOID
    values[50:55, 0:2] = VOID
    return make_raster(tmp_path / "holed.tif", values, nodata=VOID), values
