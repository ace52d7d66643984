"""The tools *Compress* and *Decompress*, dropped files, and virtual rasters in QGIS."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from gdal_reading import read
from osgeo import gdal
from qgis import processing
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsMapRendererSequentialJob,
    QgsMapSettings,
    QgsProcessingException,
    QgsProject,
    QgsRasterLayer,
)
from qgis.PyQt.QtCore import QCoreApplication, QSize
from qgis_runs import TaskRun, assert_parameters, tool
from support import digest, hills, make_raster

from demsmith.plugin.sct_files import SctDropHandler

VOID = -32768
ROOT = Path(__file__).resolve().parents[2]
COMPRESS = """
INPUT      raster          -      required
BAND       band            1      optional
NODATA     string          -      optional
MASK       raster          -      optional
BELOW      number          -      optional advanced
ABOVE      number          -      optional advanced
MAX_ERROR  number          -      optional
RATIO      number          -      optional
PSNR       number          -      optional
EFFORT     enum            normal required
VRT        boolean         True   required
ATOMS      number          -      optional advanced
SPARSITY   number          -      optional advanced
RADIUS     number          -      optional advanced
DICTIONARY file            -      optional advanced
THREADS    number          -      optional advanced
OUTPUT     fileDestination -      required
"""
DECOMPRESS = """
INPUT            file              -   required
WINDOW           string            -   optional
SCALE            number            1.0 required
THREADS          number            -   optional advanced
CREATION_OPTIONS string            -   optional advanced
OUTPUT           rasterDestination -   required
"""
OUTPUTS = {
    "OUTPUT": "outputFile",
    "VIRTUAL": "outputRaster",
    "BYTES": "outputNumber",
    "RATIO_REACHED": "outputNumber",
    "BITS_PER_CELL": "outputNumber",
    "LARGEST_ERROR": "outputNumber",
    "RMSE": "outputNumber",
    "SECONDS": "outputNumber",
    "WARNINGS": "outputString",
}


@pytest.fixture
def compress(plugin, tmp_path):
    """Run the tool by `processing.run`; returns its outputs."""

    def run(source, **parameters):
        parameters = {
            "INPUT": source, "OUTPUT": str(tmp_path / "dem.sct"), "EFFORT": "low", **parameters,
        }  # fmt: skip
        return processing.run("demsmith:compress", parameters)

    return run


@pytest.fixture
def decompress(plugin, tmp_path):
    def run(source, **parameters):
        parameters = {"INPUT": source, "OUTPUT": str(tmp_path / "back.tif"), **parameters}
        return processing.run("demsmith:decompress", parameters)

    return run


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """Make a raster of 2 million cells."""
    values = np.tile(hills(500, 500), (2, 4))
    return make_raster(tmp_path_factory.mktemp("large") / "large.tif", values, nodata=VOID)


class _Window:
    """As much of QGIS's window as the drop handler touches."""

    def __init__(self):
        self.messages = []

    def messageBar(self):
        return self

    def pushMessage(self, title, text, level, duration):
        self.messages.append(text)


# --- contract ------------------------------------------------------------------------------------


def test_parameters_are_the_promised_ones(plugin):
    assert_parameters(tool("compress"), COMPRESS)
    assert_parameters(tool("decompress"), DECOMPRESS)


def test_outputs_are_the_promised_ones(plugin):
    made = tool("compress")
    assert {output.name(): output.type() for output in made.outputDefinitions()} == OUTPUTS
    made = tool("decompress")
    names = {output.name() for output in made.outputDefinitions()}
    assert names == {"OUTPUT", "CELLS", "CELLS_KNOWN", "SECONDS", "WARNINGS"}


def test_the_tools_are_named_grouped_and_found(plugin):
    for name, word in (("compress", "lerc"), ("decompress", "sct")):
        made = tool(name)
        assert made.displayName() == name.capitalize()
        assert (made.groupId(), made.group()) == ("compression", "Compression")
        assert word in made.tags()
        assert made.shortDescription()
        assert ".sct" in made.shortHelpString()


# --- runs ----------------------------------------------------------------------------------------


def outputs_in(folder):
    return {name for name in os.listdir(folder) if not name.endswith(".aux.xml")}


def test_there_and_back(compress, decompress, holed):
    source, values = holed
    before = digest(source)
    result = compress(source, MAX_ERROR=0)
    assert set(result) == set(OUTPUTS)
    assert result["BYTES"] == os.path.getsize(result["OUTPUT"])
    assert result["LARGEST_ERROR"] == 0
    back = decompress(result["OUTPUT"])
    decoded, tag, geotransform, kind = read(back["OUTPUT"])
    np.testing.assert_array_equal(decoded, values)
    assert (tag, geotransform, kind) == read(source)[1:]
    assert back["CELLS"] == values.size
    assert back["CELLS_KNOWN"] == np.count_nonzero(values != VOID)
    assert digest(source) == before


def test_options_reach_the_core(compress, holed, tmp_path):
    sizes = []
    for options in ({}, {"MAX_ERROR": 5}, {"RATIO": 15}, {"PSNR": 40}, {"BELOW": 500}):
        sizes.append(compress(holed[0], VRT=False, **options)["BYTES"])
    assert len(set(sizes)) == len(sizes)
    assert sizes[2] <= 60 * 80 * 2 / 15
    assert outputs_in(tmp_path) == {"dem.sct", "holed.tif"}


def test_a_window_and_a_scale(compress, decompress, holed):
    sct = compress(holed[0])["OUTPUT"]
    whole = read(decompress(sct)["OUTPUT"])[0]
    part = read(decompress(sct, WINDOW="10, 20, 30, 5")["OUTPUT"])[0]
    np.testing.assert_array_equal(part, whole[20:25, 10:40])
    assert read(decompress(sct, SCALE=0.5)["OUTPUT"])[0].shape == (30, 40)


def test_the_result_is_loaded_in_the_colours_of_terrain(compress, holed):
    sct = compress(holed[0])["OUTPUT"]
    project = QgsProject.instance()
    project.clear()
    processing.runAndLoadResults(
        "demsmith:decompress", {"INPUT": sct, "OUTPUT": "TEMPORARY_OUTPUT"}
    )
    (layer,) = project.mapLayers().values()
    assert layer.name() == "Decompressed"
    assert layer.renderer().type() == "singlebandpseudocolor"
    project.clear()


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("compress", {"MAX_ERROR": -1}, "MAX_ERROR"),
        ("compress", {"RATIO": 5, "PSNR": 40}, "ratio and psnr are asked for at once"),
        ("compress", {"BAND": 3}, "band 3 asked"),
        ("compress", {"NODATA": "low"}, "NODATA is 'low'; give numbers"),
        ("compress", {"OUTPUT": "{folder}/dem.tif"}, "must end in .sct"),
        ("compress", {"OUTPUT": "{folder}/none/dem.sct"}, "there is no folder"),
        ("decompress", {"WINDOW": "1, 2, 3"}, "WINDOW is '1, 2, 3'; give first column"),
        ("decompress", {"WINDOW": "0, 0, 999, 5"}, "are no part of"),
        ("decompress", {"SCALE": 0}, "SCALE"),
        ("decompress", {"INPUT": "{folder}/holed.tif"}, "Incorrect parameter value for INPUT"),
        ("decompress", {"INPUT": "{folder}/bad.sct"}, "is no Sparse Construction Tree"),
        ("decompress", {"INPUT": "{folder}/none.sct"}, "does not exist"),
    ],
)
def test_errors_say_what_is_wrong_and_leave_nothing(
    compress, decompress, holed, tmp_path, name, parameters, message
):
    source = holed[0] if name == "compress" else compress(holed[0], VRT=False)["OUTPUT"]
    (tmp_path / "bad.sct").write_text("bad")
    before = outputs_in(tmp_path)
    parameters = {
        key: value.format(folder=tmp_path) if isinstance(value, str) else value
        for key, value in parameters.items()
    }
    run = {"compress": compress, "decompress": decompress}[name]
    with pytest.raises(QgsProcessingException) as error:
        run(parameters.pop("INPUT", source), **parameters)
    assert message in str(error.value)
    assert outputs_in(tmp_path) == before


# --- worker thread -------------------------------------------------------------------------------


def test_the_window_stays_responsive(plugin, large, tmp_path):
    sct, back = str(tmp_path / "large.sct"), str(tmp_path / "back.tif")
    for name, parameters in (
        ("compress", {"INPUT": large, "OUTPUT": sct, "EFFORT": "low"}),
        ("decompress", {"INPUT": sct, "OUTPUT": back}),
    ):
        run = TaskRun(name, parameters)
        assert run.fine
        assert max(run.gaps) < 0.5
        assert run.progress == sorted(run.progress)
        assert run.progress[-1] == 100
        assert len(run.progress) >= 5


@pytest.mark.parametrize("percent", [1, 40, 90])
def test_cancel_is_prompt_and_leaves_nothing(plugin, large, tmp_path, percent):
    folder = tmp_path / "out"
    folder.mkdir()
    old = folder / "dem.sct"
    old.write_bytes(b"the user's older result")
    run = TaskRun(
        "compress", {"INPUT": large, "OUTPUT": str(old), "EFFORT": "low"}, cancel_at=percent
    )
    assert run.cancelled_at is not None
    assert run.ended_at - run.cancelled_at < 1
    assert not run.fine
    assert os.listdir(folder) == ["dem.sct"]
    assert old.read_bytes() == b"the user's older result"
    assert "cancelled; nothing was written" in run.feedback.textLog()


# --- dropped files and virtual rasters -----------------------------------------------------------


def dropped(handler, path):
    """Drop a file and wait until its run has ended."""
    taken = handler.handleFileDrop(str(path))
    while handler._runs:
        QCoreApplication.processEvents()
    return taken


def test_a_dropped_file_becomes_a_layer(compress, holed):
    sct = compress(holed[0], MAX_ERROR=0)["OUTPUT"]
    project, window = QgsProject.instance(), _Window()
    project.clear()
    handler = SctDropHandler(window)
    assert dropped(handler, sct)
    (layer,) = project.mapLayers().values()
    assert layer.isValid()
    assert layer.name() == "dem"
    assert layer.renderer().type() == "singlebandpseudocolor"
    np.testing.assert_array_equal(read(layer.source())[0], holed[1])
    assert not handler.handleFileDrop(holed[0])
    assert window.messages == []
    project.clear()


def test_a_damaged_dropped_file_is_told(compress, holed, tmp_path):
    sct = compress(holed[0])["OUTPUT"]
    Path(sct).write_bytes(Path(sct).read_bytes()[:-7])
    window = _Window()
    assert dropped(SctDropHandler(window), sct)
    (message,) = window.messages
    assert "dem.sct' is truncated" in message
    assert QgsProject.instance().mapLayers() == {}


def test_the_virtual_raster_is_read_by_gdal_and_qgis(compress, holed):
    source, values = holed
    path = compress(source, MAX_ERROR=0)["VIRTUAL"]
    decoded, tag, geotransform, kind = read(path)
    np.testing.assert_array_equal(decoded, values)
    assert (tag, geotransform, kind) == read(source)[1:]
    dataset = gdal.Open(path)
    small = dataset.GetRasterBand(1).ReadAsArray(0, 0, 80, 60, buf_xsize=20, buf_ysize=15)
    assert small.shape == (15, 20)
    known = values[values != VOID]
    assert np.abs(small[small != VOID]).max() <= np.abs(known).max()
    layer = QgsRasterLayer(path, "virtual")
    assert layer.isValid()
    assert layer.crs() == QgsCoordinateReferenceSystem("EPSG:4326")
    assert rendered(layer) > 10


def rendered(layer):
    """Render a layer by QGIS; returns how many colours there are."""
    settings = QgsMapSettings()
    settings.setLayers([layer])
    settings.setExtent(layer.extent())
    settings.setDestinationCrs(layer.crs())
    settings.setOutputSize(QSize(50, 40))
    job = QgsMapRendererSequentialJob(settings)
    job.start()
    job.waitForFinished()
    image = job.renderedImage()
    return len({image.pixel(x, y) for x in range(0, 50, 2) for y in range(0, 40, 2)})


def test_a_program_of_gdal_reads_the_virtual_raster(compress, holed, tmp_path):
    path = compress(holed[0], MAX_ERROR=0)["VIRTUAL"]
    (tmp_path / "python").mkdir()
    (tmp_path / "python" / "demsmith").symlink_to(ROOT)
    libraries = [folder for folder in sys.path if folder.endswith("site-packages")]
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join([str(tmp_path / "python"), *libraries]),
        "GDAL_VRT_PYTHON_TRUSTED_MODULES": "demsmith.core.sct.pixels",
    }
    call = ["gdal_translate", "-q", "-srcwin", "10", "20", "30", "25", path, tmp_path / "part.tif"]
    done = subprocess.run(call, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    np.testing.assert_array_equal(read(tmp_path / "part.tif")[0], holed[1][20:45, 10:40])
    Path(path).with_suffix("").unlink()
    done = subprocess.run(call, env=environment, capture_output=True, text=True, check=False)
    assert "dem.sct' does not exist" in done.stderr


def test_nobody_is_trusted_once_the_plugin_is_gone(plugin):
    key = "GDAL_VRT_PYTHON_TRUSTED_MODULES"
    assert gdal.GetConfigOption(key) == "demsmith.core.sct.pixels"
    gdal.SetConfigOption(key, "my.module,demsmith.core.sct.pixels")
    plugin.unload()
    assert gdal.GetConfigOption(key) == "my.module"
    plugin.initProcessing()
    assert gdal.GetConfigOption(key) == "my.module,demsmith.core.sct.pixels"
    gdal.SetConfigOption(key, "demsmith.core.sct.pixels")


# --- qgis_process --------------------------------------------------------------------------------


def test_in_qgis_process(qgis_process, holed, tmp_path):
    sct, back = tmp_path / "dem.sct", tmp_path / "back.tif"
    done = qgis_process(
        "--json", "run", "demsmith:compress", f"--INPUT={holed[0]}", "--MAX_ERROR=0",
        f"--OUTPUT={sct}",
    )  # fmt: skip
    results = json.loads(done.stdout)["results"]
    assert (results["OUTPUT"], results["VIRTUAL"]) == (str(sct), f"{sct}.vrt")
    done = qgis_process(
        "--json", "run", "demsmith:decompress", f"--INPUT={sct}", f"--OUTPUT={back}"
    )
    assert json.loads(done.stdout)["results"]["OUTPUT"] == str(back)
    np.testing.assert_array_equal(read(back)[0], holed[1])
