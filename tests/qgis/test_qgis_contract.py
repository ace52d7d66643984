"""Names, types and defaults of the tool: what models and scripts of users rely on."""

import pytest
from qgis_runs import parameter_row
from qgis_runs import tool as make

PARAMETERS = """
INPUT            raster             -              required
BAND             band               1              optional
NODATA           string             -              optional
MASK             raster             -              optional
BELOW            number             -              optional advanced
ABOVE            number             -              optional advanced
METHOD           enum               auto           required
NATURAL_ROUGHNESS boolean           False          required
TUNE             boolean            False          required
INTERIOR_ONLY    boolean            False          required
MAX_SIZE         number             -              optional
FLOAT            boolean            False          required
VARIANT          enum               relaxed        required advanced
SCHEME           enum               auto           required advanced
L                number             0.0            required advanced
L_BU             number             0.0            required advanced
DATUM            number             -              optional advanced
TENSION          number             -              optional advanced
H                number             0.5            required advanced
R_S              number             0.0            required advanced
R_T              number             0.0            required advanced
RELIEF           number             -              optional advanced
SEED             number             0              required advanced
L_MAP            raster             -              optional advanced
L_BU_MAP         raster             -              optional advanced
H_MAP            raster             -              optional advanced
R_S_MAP          raster             -              optional advanced
R_T_MAP          raster             -              optional advanced
THREADS          number             -              optional advanced
CREATION_OPTIONS string             -              optional advanced
OUTPUT           rasterDestination  -              required
SOURCE_MAP       rasterDestination  -              optional
UNCERTAINTY      rasterDestination  -              optional
REPORT           fileDestination    -              optional
"""

OUTPUTS = {
    "OUTPUT": "outputRaster",
    "SOURCE_MAP": "outputRaster",
    "UNCERTAINTY": "outputRaster",
    "REPORT": "outputFile",
    "VOIDS": "outputNumber",
    "CELLS_FILLED": "outputNumber",
    "CELLS_UNFILLED": "outputNumber",
    "LARGEST_VOID": "outputNumber",
    "SECONDS": "outputNumber",
    "WARNINGS": "outputString",
}


@pytest.fixture
def tool(plugin):
    return make("fillvoids")


def test_parameters_are_the_promised_ones(tool):
    promised = [line.split() for line in PARAMETERS.strip().splitlines()]
    assert [parameter_row(parameter) for parameter in tool.parameterDefinitions()] == promised


def test_outputs_are_the_promised_ones(tool):
    assert {output.name(): output.type() for output in tool.outputDefinitions()} == OUTPUTS


def test_optional_outputs_are_not_made_unasked(tool):
    made = {each.name(): each.createByDefault() for each in tool.destinationParameterDefinitions()}
    unasked = dict.fromkeys(("SOURCE_MAP", "UNCERTAINTY", "REPORT"), False)
    assert made == {"OUTPUT": True, **unasked}


def test_words_instead_of_numbers_for_choices(tool):
    for name in ("METHOD", "VARIANT", "SCHEME"):
        assert tool.parameterDefinition(name).usesStaticStrings()


def test_methods_are_the_promised_ones(tool):
    assert tool.parameterDefinition("METHOD").options() == ["auto", "mcmd"]


def test_every_parameter_has_a_label_and_help(tool):
    for parameter in tool.parameterDefinitions():
        assert parameter.help(), parameter.name()
        assert parameter.description() != parameter.name()


def test_the_tool_is_named_grouped_and_found(tool):
    assert (tool.id(), tool.displayName()) == ("demsmith:fillvoids", "Fill voids")
    assert (tool.groupId(), tool.group()) == ("voids", "Void filling")
    assert {"srtm", "nodata", "holes"} <= set(tool.tags())
    assert tool.helpUrl().startswith("https://")
    assert tool.shortDescription()
    assert not tool.icon().isNull()


def test_the_help_shows_a_picture_that_exists(tool):
    import re
    from urllib.parse import unquote, urlparse

    from qgis.PyQt.QtGui import QImage

    (address,) = re.findall('<img src="([^"]+)"', tool.shortHelpString())
    assert not QImage(unquote(urlparse(address).path)).isNull()


def test_the_dialog_opens_with_widgets_for_all_parameters(tool, monkeypatch):
    from processing.gui import AlgorithmDialog, ParametersPanel

    # The stand-in window of pytest-qgis has no browser model to hand to the widgets.
    monkeypatch.setattr(ParametersPanel, "iface", None)
    monkeypatch.setattr(AlgorithmDialog, "iface", None)

    dialog = AlgorithmDialog.AlgorithmDialog(tool)
    names = {each.name() for each in tool.parameterDefinitions() if not each.isDestination()}
    assert set(dialog.mainWidget().wrappers) >= names
    dialog.close()
