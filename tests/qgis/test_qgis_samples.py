"""*Reconstruct from samples*: its contract, grids, rasters, sketches, noise, styles and threads."""

import json
import os
import re
from urllib.parse import unquote, urlparse

import numpy as np
import pytest
from gdal_reading import read
from qgis import processing
from qgis.core import (
    QgsGeometry,
    QgsPoint,
    QgsProcessing,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProject,
    QgsRasterLayer,
)
from qgis.PyQt.QtGui import QImage
from qgis_layers import (
    EXTENT,
    GRID,
    GROUND,
    LONLAT,
    SOUTH,
    UTM,
    WEST,
    assert_slope,
    make_layer,
    places,
    plane,
    points_with_field,
    points_with_z,
    save,
    table_in_memory,
    to_lonlat,
)
from qgis_runs import TaskRun, assert_parameters, tool
from support import digest, hills, make_raster

TOOL = "demsmith:reconstructfromsamples"
VOID = -32768
PARAMETERS = """
INPUT             multilayer        -             optional
CONTOURS          multilayer        -             optional
FIELD             string            -             optional
SELECTED_ONLY     boolean           False         required advanced
BAND              number            1             required advanced
NODATA            string            -             optional advanced
MASK              raster            -             optional advanced
BELOW             number            -             optional advanced
ABOVE             number            -             optional advanced
LIKE              raster            -             optional
EXTENT            extent            -             optional
RESOLUTION        number            -             optional
CRS               crs               -             optional
SKETCH            file              -             optional
SKETCH_LOW        number            0.0           required
SKETCH_HIGH       number            1000.0        required
SKETCH_BACKGROUND enum              black         required advanced
PRESET            enum              none          required
TUNE              boolean           False         required
FLOAT             boolean           False         required
VARIANT           enum              converged     required advanced
SCHEME            enum              auto          required advanced
L                 number            -             optional advanced
L_BU              number            -             optional advanced
DATUM             number            -             optional advanced
TENSION           number            -             optional advanced
H                 number            -             optional advanced
R_S               number            -             optional advanced
R_T               number            -             optional advanced
RELIEF            number            -             optional advanced
SEED              number            0             required advanced
STIFFNESS         number            -             optional advanced
L_MAP             raster            -             optional advanced
L_BU_MAP          raster            -             optional advanced
H_MAP             raster            -             optional advanced
R_S_MAP           raster            -             optional advanced
R_T_MAP           raster            -             optional advanced
THREADS           number            -             optional advanced
CREATION_OPTIONS  string            -             optional advanced
OUTPUT            rasterDestination -             required
SOURCE_MAP        rasterDestination -             optional
"""
OUTPUTS = {
    "OUTPUT": "outputRaster",
    "SOURCE_MAP": "outputRaster",
    "SAMPLES": "outputNumber",
    "SAMPLES_OUTSIDE": "outputNumber",
    "ROWS": "outputNumber",
    "COLUMNS": "outputNumber",
    "CELLS_KNOWN": "outputNumber",
    "CELLS_FILLED": "outputNumber",
    "SECONDS": "outputNumber",
    "WARNINGS": "outputString",
}


# --- contract ------------------------------------------------------------------------------------


def test_parameters_are_the_promised_ones(plugin):
    made = tool("reconstructfromsamples")
    assert_parameters(made, PARAMETERS)
    for name in ("PRESET", "VARIANT", "SCHEME", "SKETCH_BACKGROUND"):
        assert made.parameterDefinition(name).usesStaticStrings()


def test_outputs_are_the_promised_ones(plugin):
    made = tool("reconstructfromsamples")
    assert {output.name(): output.type() for output in made.outputDefinitions()} == OUTPUTS
    by_default = {
        each.name(): each.createByDefault() for each in made.destinationParameterDefinitions()
    }
    assert by_default == {"OUTPUT": True, "SOURCE_MAP": False}


def test_the_tool_is_named_grouped_and_found(plugin):
    made = tool("reconstructfromsamples")
    assert (made.id(), made.displayName()) == (TOOL, "Reconstruct from samples")
    assert (made.groupId(), made.group()) == ("samples", "Samples")
    assert {"contours", "ridge", "sketch", "noise"} <= set(made.tags())
    assert made.shortDescription()


def test_the_help_shows_a_picture_that_exists(plugin):
    (address,) = re.findall('<img src="([^"]+)"', tool("reconstructfromsamples").shortHelpString())
    assert not QImage(unquote(urlparse(address).path)).isNull()


def test_the_dialog_opens_with_widgets_for_all_parameters(plugin, monkeypatch):
    from processing.gui import AlgorithmDialog, ParametersPanel

    # The stand-in window of pytest-qgis has no browser model to hand to the widgets.
    monkeypatch.setattr(ParametersPanel, "iface", None)
    monkeypatch.setattr(AlgorithmDialog, "iface", None)
    made = tool("reconstructfromsamples")
    dialog = AlgorithmDialog.AlgorithmDialog(made)
    wrappers = dialog.mainWidget().wrappers
    names = {each.name() for each in made.parameterDefinitions() if not each.isDestination()}
    assert set(wrappers) >= names
    wrappers["RESOLUTION"].setWidgetValue(1 / 3600, QgsProcessingContext())
    assert wrappers["RESOLUTION"].widgetValue() == pytest.approx(1 / 3600, rel=1e-6)
    dialog.close()


# --- grids, rasters, sketches, noise -------------------------------------------------------------


@pytest.fixture
def thinned(tmp_path):
    """Make a raster of which one cell in seven is known; returns path and values."""
    values = hills(30, 40)
    values.ravel()[np.arange(1200) % 7 > 0] = VOID
    path = make_raster(tmp_path / "thinned.tif", values, geotransform=GRID, crs=UTM, nodata=VOID)
    return path, values


def test_a_thinned_raster_comes_back_on_its_own_grid(make, thinned):
    path, values = thinned
    before = digest(path)
    result = make(INPUT=[path])
    made, _, geotransform, kind = read(result["OUTPUT"])
    known = values != VOID
    assert (geotransform, kind) == (GRID, np.int16)
    assert np.array_equal(made[known], values[known])
    assert abs(made[~known] - hills(30, 40)[~known]).mean() < 10
    assert result["CELLS_KNOWN"] == known.sum()
    assert digest(path) == before


def test_points_beside_a_raster_come_to_its_grid(make, thinned):
    place = to_lonlat(WEST + 105, SOUTH + 105)
    layer = make_layer("PointZ", [(QgsGeometry(QgsPoint(*place, 3000)), [])], crs=LONLAT)
    made, _, geotransform, _ = read(make(INPUT=[layer, QgsRasterLayer(thinned[0])])["OUTPUT"])
    assert geotransform == GRID
    assert made[19, 10] == 3000


def test_elevations_of_points_that_mean_none(make):
    places = ((5, 5, 100), (295, 195, 100), (105, 105, -9999))
    points = [(QgsGeometry(QgsPoint(WEST + x, SOUTH + y, z)), []) for x, y, z in places]
    layer = make_layer("PointZ", points)
    assert "1 sample holds the value -9999" in make(INPUT=[layer], RESOLUTION=10)["WARNINGS"]
    for voids in ({"NODATA": "-9999"}, {"BELOW": -500}):
        result = make(INPUT=[layer], RESOLUTION=10, **voids)
        assert result["CELLS_KNOWN"] == 2
        assert (read(result["OUTPUT"])[0] == 100).all()


def test_the_extent_is_brought_to_the_crs_of_the_result(make):
    x, y = to_lonlat(WEST + 100, SOUTH + 100)
    extent = f"{x},{x + 0.001},{y},{y + 0.001} [{LONLAT}]"
    geotransform = read(make(INPUT=[points_with_z()], EXTENT=extent, RESOLUTION=10)["OUTPUT"])[2]
    assert geotransform[0] == pytest.approx(WEST + 100, abs=1)


def test_a_grid_like_another_rasters(make, tmp_path):
    like = make_raster(tmp_path / "like.tif", hills(30, 40), geotransform=GRID, crs=UTM)
    assert_slope(make(INPUT=[points_with_z()], LIKE=like))
    with pytest.raises(QgsProcessingException, match="leave out extent, resolution and CRS"):
        make(INPUT=[points_with_z()], LIKE=like, RESOLUTION=10)


def test_a_painted_sketch(make, tmp_path):
    painted = np.zeros((30, 40), np.uint16)
    painted[4, 3:37] = 65535
    painted[26, 3:37] = 1
    path = save_image(tmp_path / "sketch.png", painted)
    result = make(SKETCH=path, SKETCH_LOW=100, SKETCH_HIGH=900, EXTENT=EXTENT, CRS=UTM)
    values, _, geotransform, _ = read(result["OUTPUT"])
    assert geotransform == pytest.approx(GRID)
    assert values[4, 3:37] == pytest.approx(900)
    assert values[26, 3:37] == pytest.approx(100, abs=0.1)
    assert 400 < values[15, 20] < 600
    assert result["CELLS_KNOWN"] == 68
    whole = make(SKETCH=path, SKETCH_BACKGROUND="none", EXTENT=EXTENT, CRS=UTM)
    assert whole["CELLS_FILLED"] == 0


def save_image(path, pixels):
    """Write a grey image by OpenImageIO; returns its path as text."""
    oiio = pytest.importorskip("OpenImageIO")
    rows, columns = pixels.shape
    image = oiio.ImageOutput.create(str(path))
    image.open(str(path), oiio.ImageSpec(columns, rows, 1, str(pixels.dtype)))
    image.write_image(np.ascontiguousarray(pixels[..., None]))
    image.close()
    return str(path)


def test_terrain_from_noise_alone(make, tmp_path):
    where = dict(EXTENT=EXTENT, RESOLUTION=5, CRS=UTM)
    first = make(SEED=3, RELIEF=800, DATUM=50, **where)
    values = read(first["OUTPUT"])[0]
    assert values.shape == (60, 80)
    assert np.ptp(values) > 50
    assert first["CELLS_KNOWN"] == 0
    again = make(SEED=3, RELIEF=800, DATUM=50, OUTPUT=str(tmp_path / "again.tif"), **where)
    assert digest(again["OUTPUT"]) == digest(first["OUTPUT"])
    other = make(SEED=4, RELIEF=800, DATUM=50, OUTPUT=str(tmp_path / "other.tif"), **where)
    assert not np.array_equal(read(other["OUTPUT"])[0], values)


@pytest.mark.parametrize(
    "option", [{"VARIANT": "weighted"}, {"PRESET": "figure-11a"}, {"R_S": 0.3}]
)
def test_options_reach_the_core(make, tmp_path, option):
    source = points_with_z()
    plain = read(make(INPUT=[source], **GROUND)["OUTPUT"])[0]
    path = str(tmp_path / "other.tif")
    other = read(make(INPUT=[source], OUTPUT=path, **GROUND, **option)["OUTPUT"])[0]
    assert not np.array_equal(plain, other)


def test_a_map_makes_a_part_rough(make, tmp_path):
    share = np.zeros((30, 40), np.float32)
    share[:, 30:] = 0.5
    strength = make_raster(tmp_path / "r_s.tif", share, geotransform=GRID, crs=UTM)
    source = points_with_z()
    plain = read(make(INPUT=[source], **GROUND)["OUTPUT"])[0]
    rough = read(make(INPUT=[source], R_S_MAP=strength, **GROUND)["OUTPUT"])[0]
    moved = abs(rough - plain)
    assert moved[:, 32:].mean() > 5 * moved[:, :28].mean()
    assert moved[:, 32:].mean() > 1


def test_the_source_map_tells_samples_from_what_was_made(make, tmp_path):
    result = make(
        INPUT=[points_with_z()], **GROUND,
        SOURCE_MAP=str(tmp_path / "source.tif"),
    )  # fmt: skip
    classes = np.bincount(read(result["SOURCE_MAP"])[0].ravel()).tolist()
    assert classes == [result["CELLS_KNOWN"], result["CELLS_FILLED"]]


def test_layers_are_styled_when_loaded(plugin):
    project = QgsProject.instance()
    project.clear()
    processing.runAndLoadResults(
        TOOL,
        {
            "INPUT": [points_with_z()], **GROUND,
            "OUTPUT": "TEMPORARY_OUTPUT", "SOURCE_MAP": "TEMPORARY_OUTPUT",
        },
    )  # fmt: skip
    kinds = {layer.renderer().type(): layer for layer in project.mapLayers().values()}
    values = read(kinds["singlebandpseudocolor"].source())[0]
    terrain = kinds["singlebandpseudocolor"].renderer()
    assert terrain.classificationMin() == pytest.approx(values.min())
    assert terrain.classificationMax() == pytest.approx(values.max())
    classes = kinds["paletted"].renderer().classes()
    assert [each.label for each in classes] == ["sample", "made between samples"]
    project.clear()


# --- errors --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({}, "there are no samples: give INPUT, CONTOURS or SKETCH"),
        ({"EXTENT": EXTENT}, "there are no samples: give INPUT, CONTOURS or SKETCH"),
        ({"INPUT": points_with_z}, "for example 10"),
        ({"INPUT": points_with_z, "RESOLUTION": -1}, "must be positive"),
        ({"INPUT": points_with_z, "FIELD": "q", **GROUND}, "'samples' has no attribute 'q'"),
        ({"INPUT": lambda: points_with_field("q:double"), **GROUND}, "elevation"),
        ({"INPUT": lambda: points_with_z(crs=LONLAT), "CRS": UTM, **GROUND}, "no feature of layer"),
        ({"INPUT": lambda: points_with_z(crs="EPSG:32633"), **GROUND, "CRS": UTM}, "in the grid"),
        ({"INPUT": table_in_memory, **GROUND}, "'table' has no geometries"),
        ({"CONTOURS": points_with_z, **GROUND}, "CONTOURS: layer 'samples' does not hold lines"),
        ({"INPUT": "{folder}/none.gpkg", **GROUND}, "INPUT"),
        ({"SKETCH": "{folder}/none.png", **GROUND}, "none.png"),
        ({"INPUT": points_with_z, **GROUND, "R_S": 99}, "R_S"),
        ({"INPUT": points_with_z, **GROUND, "NODATA": "none"}, "NODATA is 'none'; give numbers"),
        ({"INPUT": points_with_z, **GROUND, "OUTPUT": "{folder}/x.asc"}, "not supported"),
        ({"INPUT": points_with_z, **GROUND, "OUTPUT": "{folder}/no/x.tif"}, "there is no folder"),
        ({"INPUT": points_with_z, "RESOLUTION": 1e-4}, "GB of memory"),
    ],
)
def test_errors_say_what_is_wrong_and_leave_nothing(make, tmp_path, parameters, message):
    made = {}
    for name, value in parameters.items():
        value = value.format(folder=tmp_path) if isinstance(value, str) else value
        made[name] = [value()] if callable(value) else value
    with pytest.raises(QgsProcessingException) as error:
        make(**made)
    assert message in str(error.value)
    assert "Traceback" not in str(error.value)
    assert not os.listdir(tmp_path)


# --- worker thread -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def many(qgis_app):
    """Make a layer of 100,000 points."""
    places = np.random.default_rng(5).uniform(
        (WEST, SOUTH), (WEST + 9000, SOUTH + 9000), (10**5, 2)
    )
    shapes = [(QgsGeometry(QgsPoint(x, y, plane(x, y))), []) for x, y in places.tolist()]
    return make_layer("PointZ", shapes)


def _parameters(layer, output):
    return {"INPUT": [layer], "RESOLUTION": 10, "OUTPUT": str(output)}


def test_the_window_stays_responsive(make, many, tmp_path):
    make(INPUT=[points_with_z()], **GROUND)  # compiles or loads the kernels
    run = TaskRun("reconstructfromsamples", _parameters(many, tmp_path / "terrain.tif"))
    assert run.fine, run.feedback.textLog()
    assert run.outputs["SAMPLES"] == 10**5
    assert max(run.gaps) < 0.5
    assert len(run.progress) >= 5
    assert run.progress == sorted(run.progress)
    assert run.progress[-1] == 100


@pytest.mark.parametrize("percent", [1, 30, 85])
def test_cancel_is_prompt_and_leaves_nothing(make, many, tmp_path, percent):
    make(INPUT=[points_with_z()], **GROUND)
    folder = tmp_path / "out"
    folder.mkdir()
    old = folder / "terrain.tif"
    old.write_bytes(b"the user's older result")
    parameters = {**_parameters(many, old), "SOURCE_MAP": str(folder / "source.tif")}
    run = TaskRun("reconstructfromsamples", parameters, cancel_at=percent)
    assert run.cancelled_at is not None
    assert run.ended_at - run.cancelled_at < 1
    assert not run.fine
    assert os.listdir(folder) == ["terrain.tif"]
    assert old.read_bytes() == b"the user's older result"
    assert "cancelled; nothing was written" in run.feedback.textLog()


# --- chains and qgis_process ---------------------------------------------------------------------


@pytest.mark.parametrize("kept", ["OUTPUT", "POINTS"])
def test_after_thinning(make, tmp_path, kept):
    values = hills(30, 40)
    source = make_raster(tmp_path / "dem.tif", values, geotransform=GRID, crs=UTM, nodata=VOID)
    temporary = QgsProcessing.TEMPORARY_OUTPUT
    thinned = processing.run(
        "demsmith:thinraster",
        {"INPUT": source, "SHARE": 0.2, "OUTPUT": temporary, "POINTS": temporary},
    )
    result = make(INPUT=[thinned[kept]], LIKE=source)
    made = read(result["OUTPUT"])[0]
    assert result["CELLS_KNOWN"] == thinned["CELLS_KEPT"]
    assert abs(made - values.astype(float)).mean() < 5


def test_in_qgis_process(qgis_process, tmp_path):
    source = save(points_with_field(), tmp_path / "points.gpkg")
    target = tmp_path / "terrain.tif"
    done = qgis_process(
        "--json", "run", TOOL, f"--INPUT={source}", "--FIELD=height", f"--EXTENT={EXTENT}",
        "--RESOLUTION=10", f"--OUTPUT={target}",
    )  # fmt: skip
    results = json.loads(done.stdout)["results"]
    assert results["OUTPUT"] == str(target)
    assert results["SAMPLES"] == len(places())
    assert_slope(results)
