"""Names, types and defaults of the tools of reconstruction: what users' models rely on."""

import re
from urllib.parse import unquote, urlparse

import pytest
from qgis.PyQt.QtGui import QImage
from qgis_runs import assert_parameters, tool

TILE_PARAMETERS = """
INPUT            raster             -              required
BAND             band               1              optional
NODATA           string             -              optional
MASK             raster             -              optional
BELOW            number             -              optional advanced
ABOVE            number             -              optional advanced
AUXILIARIES      multilayer         -              optional
NEIGHBOURS       file               -              optional
OUTLIERS         boolean            True           required
NOISY_RIMS       boolean            False          required
FLAT_WATER       boolean            True           required
METHOD           enum               auto           required
INTERIOR_ONLY    boolean            False          required
MAX_SIZE         number             -              optional
FLOAT            boolean            False          required
OUTLIER_FACTOR   number             9.0            required advanced
OUTLIER_HEIGHT   number             10.0           required advanced
ERODE            number             0              required advanced
WATER_AREA       number             100000.0       required advanced
THREADS          number             -              optional advanced
CREATION_OPTIONS string             -              optional advanced
OUTPUT           rasterDestination  -              required
SOURCE_MAP       rasterDestination  -              optional
UNCERTAINTY      rasterDestination  -              optional
VOIDS_LAYER      vectorDestination  -              optional
REPORT           fileDestination    -              optional
"""
MOSAIC_PARAMETERS = """
INPUT            multilayer         -              optional
FOLDER           file               -              optional
BAND             number             1              required advanced
NODATA           string             -              optional
BELOW            number             -              optional advanced
ABOVE            number             -              optional advanced
AUXILIARIES      multilayer         -              optional
OUTLIERS         boolean            True           required
NOISY_RIMS       boolean            False          required
FLAT_WATER       boolean            True           required
METHOD           enum               auto           required
INTERIOR_ONLY    boolean            False          required
MAX_SIZE         number             -              optional
FLOAT            boolean            False          required
OUTLIER_FACTOR   number             9.0            required advanced
OUTLIER_HEIGHT   number             10.0           required advanced
ERODE            number             0              required advanced
WATER_AREA       number             100000.0       required advanced
THREADS          number             -              optional advanced
CREATION_OPTIONS string             -              optional advanced
WITH_SOURCE_MAPS boolean            False          required
WITH_UNCERTAINTIES boolean          False          required
WITH_VOIDS_LAYER boolean            False          required
OVERWRITE        boolean            False          required
LOAD             boolean            True           required
OUTPUT           folderDestination  -              required
"""
COUNTS = (
    "VOIDS", "CELLS_FILLED", "CELLS_UNFILLED", "CELLS_FAULTY", "LARGEST_VOID", "SECONDS",
)  # fmt: skip
TILE_OUTPUTS = {
    "OUTPUT": "outputRaster",
    "SOURCE_MAP": "outputRaster",
    "UNCERTAINTY": "outputRaster",
    "VOIDS_LAYER": "outputVector",
    "REPORT": "outputHtml",
    **dict.fromkeys(COUNTS, "outputNumber"),
    "WARNINGS": "outputString",
}
MOSAIC_OUTPUTS = {
    "OUTPUT": "outputFolder",
    "VRT": "outputRaster",
    "VOIDS_LAYER": "outputVector",
    "REPORT": "outputHtml",
    **dict.fromkeys(("TILES", *COUNTS), "outputNumber"),
    "WARNINGS": "outputString",
}
PARAMETERS = {"reconstructsrtm": TILE_PARAMETERS, "reconstructmosaic": MOSAIC_PARAMETERS}
OUTPUTS = {"reconstructsrtm": TILE_OUTPUTS, "reconstructmosaic": MOSAIC_OUTPUTS}


@pytest.fixture(params=PARAMETERS)
def made(plugin, request):
    return tool(request.param)


def test_parameters_are_the_promised_ones(made):
    assert_parameters(made, PARAMETERS[made.name()])
    method = made.parameterDefinition("METHOD")
    assert (method.options(), method.usesStaticStrings()) == (["auto", "mcmd"], True)


def test_outputs_are_the_promised_ones(made):
    found = {output.name(): output.type() for output in made.outputDefinitions()}
    assert found == OUTPUTS[made.name()]


def test_optional_outputs_are_not_made_unasked(made):
    unasked = {
        each.name() for each in made.destinationParameterDefinitions() if not each.createByDefault()
    }
    layers = {"SOURCE_MAP", "UNCERTAINTY", "VOIDS_LAYER"}
    assert unasked == (layers if made.name() == "reconstructsrtm" else set())


def test_the_tools_are_named_grouped_and_found(made):
    names = {
        "reconstructsrtm": "Reconstruct SRTM voids",
        "reconstructmosaic": "Reconstruct a mosaic",
    }
    assert made.id() == f"demsmith:{made.name()}"
    assert made.displayName() == names[made.name()]
    assert (made.groupId(), made.group()) == ("voids", "Void filling")
    assert {"srtm", "voids", "auxiliary", "uncertainty"} <= set(made.tags())
    assert made.shortDescription()


def test_the_help_shows_a_picture_that_exists(made):
    (address,) = re.findall('<img src="([^"]+)"', made.shortHelpString())
    assert not QImage(unquote(urlparse(address).path)).isNull()


def test_the_dialog_opens_with_widgets_for_all_parameters(made, monkeypatch):
    from processing.gui import AlgorithmDialog, ParametersPanel

    # The stand-in window of pytest-qgis has no browser model to hand to the widgets.
    monkeypatch.setattr(ParametersPanel, "iface", None)
    monkeypatch.setattr(AlgorithmDialog, "iface", None)
    dialog = AlgorithmDialog.AlgorithmDialog(made)
    names = {each.name() for each in made.parameterDefinitions() if not each.isDestination()}
    assert set(dialog.mainWidget().wrappers) >= names
    dialog.close()
