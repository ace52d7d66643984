"""The tool by `processing.run`: values, types, outputs, styles, models and clear errors."""

import json
import os

import numpy as np
import pytest
from gdal_reading import read
from qgis import processing
from qgis.core import (
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildAlgorithm,
    QgsProcessingModelChildParameterSource,
    QgsProcessingModelOutput,
    QgsProcessingModelParameter,
    QgsProcessingParameterRasterLayer,
    QgsProject,
    QgsRasterLayer,
)
from support import digest, hills, make_hgt, make_raster, shared_data

from demsmith.core.voids import FILLED, LEFT, ORIGINAL
from demsmith.core.voids.accurate import SOURCE_OF_METHOD

VOID = -32768


def _check_filled(source, values, result):
    filled, nodata, geotransform, kind = read(result["OUTPUT"])
    known = values != VOID
    assert np.array_equal(filled[known], values[known])
    assert not (filled == VOID).any()
    assert filled[~known].min() >= values[known].min() - 200
    assert filled[~known].max() <= values[known].max() + 200
    assert (geotransform, kind) == read(source)[2:]
    return filled, nodata


def test_fills_every_void_and_changes_nothing_else(fill, holed):
    source, values = holed
    before = digest(source)
    result = fill(source)
    _check_filled(source, values, result)
    counts = {"VOIDS": 2, "CELLS_FILLED": 58, "CELLS_UNFILLED": 0, "LARGEST_VOID": 48}
    assert {name: result[name] for name in counts} == counts
    assert result["SECONDS"] > 0
    assert result["WARNINGS"] == ""
    assert set(result) == {"OUTPUT", "SECONDS", "WARNINGS", *counts}
    assert digest(source) == before


def test_takes_a_layer_of_the_project(fill, holed):
    source, values = holed
    layer = QgsRasterLayer(source, "holed")
    QgsProject.instance().addMapLayer(layer)
    _check_filled(source, values, fill(layer.id()))


def test_real_tile(fill):
    source = shared_data("pyrenees_raw/N42E001.hgt")
    result = fill(source)
    _check_filled(source, read(source)[0], result)
    assert result["CELLS_FILLED"] == 7652
    assert result["CELLS_UNFILLED"] == 0


def test_two_runs_as_in_batch_give_the_same_bytes(fill, holed, tmp_path):
    first = fill(holed[0], OUTPUT=str(tmp_path / "a.tif"), R_S=0.2, SEED=7, THREADS=1)
    second = fill(holed[0], OUTPUT=str(tmp_path / "b.tif"), R_S=0.2, SEED=7, THREADS=2)
    assert digest(first["OUTPUT"]) == digest(second["OUTPUT"])


@pytest.mark.parametrize("option", [{"SEED": 8}, {"R_S": 0.4}, {"VARIANT": "paper"}, {"H": 0.2}])
def test_advanced_options_reach_the_core(fill, holed, tmp_path, option):
    rough = {"R_S": 0.2, "SEED": 7}
    plain = read(fill(holed[0], OUTPUT=str(tmp_path / "a.tif"), **rough)["OUTPUT"])[0]
    other = read(fill(holed[0], OUTPUT=str(tmp_path / "b.tif"), **{**rough, **option})["OUTPUT"])[0]
    assert not np.array_equal(plain, other)


@pytest.mark.parametrize(
    ("name", "value"),
    [("L_MAP", 1), ("L_BU_MAP", 5), ("H_MAP", 0.1), ("R_S_MAP", 0.5), ("R_T_MAP", 0.7)],
)
def test_maps_reach_the_core(fill, holed, tmp_path, name, value):
    """Each changes the void inside, on whose side alone it has numbers; a layer or a file."""
    values = np.full((60, 80), np.nan, np.float32)
    values[:, 25:] = value
    path = make_raster(tmp_path / "map.tif", values)
    options = {"R_S": 0.2, "VARIANT": "weighted", "FLOAT": True}
    plain = read(fill(holed[0], **options)["OUTPUT"])[0]
    for given in (path, QgsRasterLayer(path, "map")):
        other = read(fill(holed[0], **options, **{name: given})["OUTPUT"])[0]
        assert (other != plain)[20:26, 30:38].any()
        assert (other == plain)[50:55, 0:2].all() or name == "L_BU_MAP"


@pytest.mark.parametrize("method", ["auto", "mcmd"])
@pytest.mark.parametrize(
    ("option", "left"), [({"INTERIOR_ONLY": True}, 10), ({"MAX_SIZE": 20}, 48), ({}, 0)]
)
def test_restrictions(fill, holed, tmp_path, option, left, method):
    source_map = str(tmp_path / "source.tif")
    result = fill(holed[0], SOURCE_MAP=source_map, METHOD=method, **option)
    assert (result["CELLS_FILLED"], result["CELLS_UNFILLED"]) == (58 - left, left)
    assert (read(result["OUTPUT"])[0] == VOID).sum() == left
    codes = read(result["SOURCE_MAP"])[0]
    by = [FILLED] if method == "mcmd" else SOURCE_OF_METHOD
    assert (codes == ORIGINAL).sum() == 60 * 80 - 58
    assert np.isin(codes, by).sum() == 58 - left
    assert (codes == LEFT).sum() == left


def test_uncertainty_is_written_and_reasons_are_told(fill, holed, tmp_path):
    class Feedback(QgsProcessingFeedback):
        def __init__(self):
            super().__init__()
            self.heard = []

        def pushInfo(self, text):
            self.heard.append(text)

    feedback, path = Feedback(), str(tmp_path / "sigma.tif")
    result = fill(holed[0], UNCERTAINTY=path, feedback=feedback)
    assert result["UNCERTAINTY"] == path
    sigma = read(path)[0]
    np.testing.assert_array_equal(sigma > 0, holed[1] == VOID)
    assert sum("%" in text and "cells" in text for text in feedback.heard) == 4


def test_methods_differ(fill, holed, tmp_path):
    auto, mcmd = (
        read(fill(holed[0], METHOD=method, OUTPUT=str(tmp_path / f"{method}.tif"))["OUTPUT"])[0]
        for method in ("auto", "mcmd")
    )
    assert (auto != mcmd).any()


def test_report_holds_the_table_of_voids(fill, holed, tmp_path):
    path = str(tmp_path / "report.json")
    result = fill(holed[0], REPORT=path)
    with open(path, encoding="utf-8") as file:
        report = json.load(file)
    assert result["REPORT"] == path
    assert sorted(row["cells"] for row in report["void_table"]) == [10, 48]


def test_floating_point_output(fill, holed):
    assert read(fill(holed[0], FLOAT=True)["OUTPUT"])[3] is np.float32


@pytest.mark.parametrize(
    "parameters", [{"NODATA": "7777, -5"}, {"ABOVE": 7000}, {"BELOW": 20}, {"MASK": True}]
)
def test_what_counts_as_void(fill, tmp_path, parameters):
    values = np.maximum(hills(), 100)
    values[10:14, 10:14] = 10 if "BELOW" in parameters else 7777
    if parameters.get("MASK"):
        mask = (values == 7777).astype(np.uint8)
        parameters = {"MASK": make_raster(tmp_path / "mask.tif", mask)}
    result = fill(make_raster(tmp_path / "marked.tif", values), **parameters)
    assert result["CELLS_FILLED"] == 16
    assert read(result["OUTPUT"])[0].max() < 7000
    assert read(result["OUTPUT"])[0].min() > 20


def test_second_band(fill, tmp_path):
    values = hills()
    bands = np.stack([np.zeros_like(values), values])
    bands[1, 5:8, 5:8] = VOID
    source = make_raster(tmp_path / "bands.tif", bands, nodata=VOID)
    result = fill(source, BAND=2)
    assert result["CELLS_FILLED"] == 9
    assert np.array_equal(read(result["OUTPUT"])[0][20:], values[20:])


def test_creation_options_win(fill, holed):
    from osgeo import gdal

    result = fill(holed[0], CREATION_OPTIONS="COMPRESS=LZW|TILED=NO")
    structure = gdal.Open(result["OUTPUT"]).GetMetadata("IMAGE_STRUCTURE")
    assert structure["COMPRESSION"] == "LZW"


def test_warnings_reach_the_log_and_the_output(fill, tmp_path):
    class Feedback(QgsProcessingFeedback):
        def __init__(self):
            super().__init__()
            self.heard = []

        def pushWarning(self, text):
            self.heard.append(text)

    feedback = Feedback()
    result = fill(make_raster(tmp_path / "whole.tif", hills()), feedback=feedback)
    assert feedback.heard
    assert result["WARNINGS"] == "\n".join(feedback.heard)
    assert "no voids" in result["WARNINGS"]


@pytest.mark.parametrize("target", ["temporary", "file"])
def test_layers_are_styled_when_loaded(plugin, holed, tmp_path, target):
    from demsmith.algorithms.styling import _Style

    before = len(_Style.alive)  # other tests leave layers that nobody loads
    project = QgsProject.instance()
    project.clear()
    where = "TEMPORARY_OUTPUT" if target == "temporary" else str(tmp_path / "loaded.tif")
    processing.runAndLoadResults(
        "demsmith:fillvoids",
        {"INPUT": holed[0], "OUTPUT": where, "SOURCE_MAP": "TEMPORARY_OUTPUT", "METHOD": "mcmd"},
    )
    kinds = {layer.renderer().type(): layer for layer in project.mapLayers().values()}
    terrain = kinds["singlebandpseudocolor"]
    values = read(terrain.source())[0]
    ramp = terrain.renderer().shader().rasterShaderFunction()
    stops = [item.value for item in ramp.colorRampItemList()]
    assert (stops[0], stops[-1]) == (values.min(), values.max())
    assert terrain.renderer().classificationMin() == values.min()
    assert terrain.renderer().classificationMax() == values.max()
    assert len(stops) == 7
    assert stops == sorted(stops)
    classes = kinds["paletted"].renderer().classes()
    assert [each.label for each in classes] == ["original", "interpolated by MCMD"]
    assert [each.value for each in classes] == [0, 1]
    assert len(_Style.alive) == before
    project.clear()


def test_flat_ground_can_be_styled(plugin, tmp_path):
    values = np.full((20, 20), 5, np.int16)
    values[4:6, 4:6] = VOID
    source = make_raster(tmp_path / "flat.tif", values, nodata=VOID)
    project = QgsProject.instance()
    project.clear()
    processing.runAndLoadResults(
        "demsmith:fillvoids", {"INPUT": source, "OUTPUT": "TEMPORARY_OUTPUT"}
    )
    (layer,) = project.mapLayers().values()
    assert layer.renderer().classificationMax() > layer.renderer().classificationMin()
    project.clear()


def test_in_a_model_the_next_step_takes_raster_and_numbers(plugin, holed, tmp_path):
    model = QgsProcessingModelAlgorithm("chain", "tests")
    model.addModelParameter(
        QgsProcessingParameterRasterLayer("DEM", "DEM"), QgsProcessingModelParameter("DEM")
    )
    source = QgsProcessingModelChildParameterSource
    first = QgsProcessingModelChildAlgorithm("demsmith:fillvoids")
    first.setChildId("fill")
    first.addParameterSources("INPUT", [source.fromModelParameter("DEM")])
    first.addParameterSources("VARIANT", [source.fromStaticValue("weighted")])
    model.addChildAlgorithm(first)
    second = QgsProcessingModelChildAlgorithm("native:rescaleraster")
    second.setChildId("rescale")
    second.addParameterSources("INPUT", [source.fromChildOutput("fill", "OUTPUT")])
    second.addParameterSources("MAXIMUM", [source.fromChildOutput("fill", "CELLS_FILLED")])
    result = QgsProcessingModelOutput("result")
    result.setChildId("rescale")
    result.setChildOutputName("OUTPUT")
    second.setModelOutputs({"result": result})
    model.addChildAlgorithm(second)
    assert model.childAlgorithms()["rescale"].algorithm() is not None
    path = str(tmp_path / "rescaled.tif")
    outputs = processing.run(model, {"DEM": holed[0], "rescale:result": path})
    rescaled = read(outputs["rescale:result"])[0]
    assert rescaled.max() == pytest.approx(58)
    assert rescaled.min() == pytest.approx(0)


def _rotated(tmp_path):
    turned = (500000, 30, 5, 5000000, 5, -30)
    return make_raster(tmp_path / "r.tif", hills(), geotransform=turned, crs="EPSG:32631")


def _holes_only(tmp_path):
    return make_raster(tmp_path / "n.tif", np.full((9, 9), VOID, np.int16), nodata=VOID)


def _truncated(tmp_path):
    make_hgt(tmp_path / "N42E001.hgt", np.zeros(700_000))
    return str(tmp_path / "N42E001.hgt")


def _plain(tmp_path):
    make_raster(tmp_path / "small.tif", np.zeros((4, 4), np.uint8))
    make_raster(tmp_path / "nines.tif", np.full((60, 80), 9, np.uint8))
    return make_raster(tmp_path / "plain.tif", hills())


@pytest.mark.parametrize(
    ("make", "parameters", "message"),
    [
        (_holes_only, {}, "every cell is a void"),
        (_rotated, {}, "rotated"),
        (_truncated, {}, "is truncated"),
        (_plain, {"BAND": 3}, "band 3 asked"),
        (_plain, {"NODATA": "low"}, "NODATA is 'low'; give numbers"),
        (_plain, {"MAX_SIZE": 0}, "MAX_SIZE"),
        (_plain, {"H_MAP": "{folder}/small.tif"}, "small.tif', has 4 × 4 cells"),
        (_plain, {"H_MAP": "{folder}/nines.tif"}, "map of h is 9 at row 0, column 0"),
        (_plain, {"L_MAP": "{folder}/nines.tif"}, "no such curve"),
        (_plain, {"R_T_MAP": "{folder}/none.tif"}, "R_T_MAP"),
        (_plain, {"R_S_MAP": "{folder}/nines.tif", "OUTPUT": "{folder}/nines.tif"}, "is an input"),
        (_plain, {"METHOD": "magic"}, "METHOD"),
        (_plain, {"METHOD": "mcmd", "UNCERTAINTY": "{folder}/s.tif"}, "needs the method auto"),
        (_plain, {"OUTPUT": "{folder}/filled.asc"}, ".asc” files are not supported"),
        (_plain, {"OUTPUT": "{folder}/none/filled.tif"}, "there is no folder"),
        (_plain, {"OUTPUT": "/proc/filled.tif"}, "cannot write"),
        (_plain, {"OUTPUT": "{folder}/plain.tif"}, "is an input"),
        (_plain, {"REPORT": "{folder}/filled.tif"}, "must be different files"),
        (_plain, {"CREATION_OPTIONS": "COMPRESS=MAGIC"}, "creation option refused"),
        (lambda folder: str(folder / "missing.tif"), {}, "does not exist"),
    ],
)
def test_errors_say_what_is_wrong_and_leave_nothing(fill, tmp_path, make, parameters, message):
    source = make(tmp_path)
    before = set(os.listdir(tmp_path))
    unchanged = digest(source) if os.path.exists(source) else None
    parameters = {
        key: value.format(folder=tmp_path) if isinstance(value, str) else value
        for key, value in parameters.items()
    }
    with pytest.raises(QgsProcessingException) as error:
        fill(source, **parameters)
    assert message in str(error.value)
    assert "Traceback" not in str(error.value)
    left = {name for name in os.listdir(tmp_path) if not name.endswith(".aux.xml")}
    assert left - before == set()
    assert unchanged is None or digest(source) == unchanged


def test_a_layer_that_is_no_file_is_refused(fill, holed):
    layer = QgsRasterLayer("type=xyz&url=file:///none/{z}/{x}/{y}.png&zmax=1", "tiles", "wms")
    assert layer.isValid()
    with pytest.raises(QgsProcessingException, match="'tiles' comes from 'wms', not from a file"):
        fill(layer)
    with pytest.raises(QgsProcessingException, match="R_S_MAP: layer 'tiles' comes from 'wms'"):
        fill(holed[0], R_S_MAP=layer)


def test_a_layer_with_open_options_is_refused(fill, holed):
    with pytest.raises(QgsProcessingException, match="NUM_THREADS=2"):
        fill(QgsRasterLayer(holed[0] + "|option:NUM_THREADS=2", "opened"))


def test_an_existing_output_is_replaced(fill, holed, tmp_path):
    (tmp_path / "filled.tif").write_bytes(b"old")
    _check_filled(*holed, fill(holed[0]))


def test_crs_is_kept(fill, holed):
    layer = QgsRasterLayer(fill(holed[0])["OUTPUT"], "filled")
    assert layer.crs() == QgsCoordinateReferenceSystem("EPSG:4326")


def test_canexecute_is_asked_again_when_running(fill, holed, monkeypatch, tmp_path):
    from demsmith.algorithms import dependencies

    monkeypatch.setattr(dependencies, "REQUIREMENTS", ("numba>=99",))
    tool = QgsApplication.processingRegistry().createAlgorithmById("demsmith:fillvoids")
    fine, message = tool.canExecute()
    assert not fine
    assert "numba>=99" in message
    with pytest.raises(QgsProcessingException, match="numba>=99"):
        tool.run(
            {"INPUT": holed[0], "OUTPUT": str(tmp_path / "x.tif")},
            QgsProcessingContext(), QgsProcessingFeedback(), catchExceptions=False,
        )  # fmt: skip
    assert not (tmp_path / "x.tif").exists()
