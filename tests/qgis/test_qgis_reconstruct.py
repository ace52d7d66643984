"""The tool *Reconstruct SRTM voids*: runs, and `qgis_process`."""

import json
import os

import numpy as np
import pytest
from gdal_reading import read
from qgis import processing
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsProject,
    QgsRasterLayer,
    QgsRasterRange,
    QgsVectorLayer,
)
from support import WGS84_3ARC, digest, hills, make_raster, shared_data

from demsmith.core.voids import FILLED, LEFT, ORIGINAL
from demsmith.core.voids.sources import NEIGHBOUR, WATER, auxiliary_code

VOID = -32768
HOLE = np.s_[90:130, 100:150]
COUNTS = (
    "VOIDS", "CELLS_FILLED", "CELLS_UNFILLED", "CELLS_FAULTY", "LARGEST_VOID", "SECONDS",
)  # fmt: skip


class Listening(QgsProcessingFeedback):
    """Keeps what a run told."""

    def __init__(self):
        super().__init__()
        self.infos, self.warnings = [], []

    def pushInfo(self, text):
        self.infos.append(text)

    def pushWarning(self, text):
        self.warnings.append(text)


@pytest.fixture
def reconstruct(plugin, tmp_path):
    """Run the tool by `processing.run`; returns its outputs."""

    def run(source, *, feedback=None, **parameters):
        parameters = {
            "INPUT": source, "METHOD": "mcmd", "OUTPUT": str(tmp_path / "filled.tif"), **parameters,
        }  # fmt: skip
        return processing.run("demsmith:reconstructsrtm", parameters, feedback=feedback)

    return run


def rugged(rows=260, columns=280):
    """Give ground that no interpolation knows over a large hole."""
    y, x = np.mgrid[:rows, :columns]
    return hills(rows, columns, dtype=np.float64) + 60 * np.sin(x / 5) * np.sin(y / 6)


@pytest.fixture
def pair(tmp_path):
    """Make a tile with a hole of 2000 cells; returns its path and the whole ground."""
    truth = np.rint(rugged()).astype(np.int16)
    values = truth.copy()
    values[HOLE] = VOID
    return make_raster(tmp_path / "tile.tif", values, nodata=VOID), truth


# --- runs ----------------------------------------------------------------------------------------


def test_fills_every_void_and_changes_nothing_else(reconstruct, holed):
    source, values = holed
    before = digest(source)
    result = reconstruct(source)
    filled, _, geotransform, kind = read(result["OUTPUT"])
    known = values != VOID
    assert np.array_equal(filled[known], values[known])
    assert filled[~known].min() >= values[known].min() - 200
    assert (geotransform, kind) == read(source)[2:]
    counts = dict(VOIDS=2, CELLS_FILLED=58, CELLS_UNFILLED=0, CELLS_FAULTY=0, LARGEST_VOID=48)
    assert {name: result[name] for name in counts} == counts
    assert set(result) == {"OUTPUT", "WARNINGS", *COUNTS}
    assert digest(source) == before


def test_all_outputs_tell_of_the_same_voids(reconstruct, holed, tmp_path):
    paths = {
        "SOURCE_MAP": "source.tif", "UNCERTAINTY": "sigma.tif", "VOIDS_LAYER": "voids.gpkg",
        "REPORT": "report.html",
    }  # fmt: skip
    paths = {name: str(tmp_path / file) for name, file in paths.items()}
    source, values = holed
    result = reconstruct(source, METHOD="auto", INTERIOR_ONLY=True, **paths)
    assert {name: result[name] for name in paths} == paths
    left = np.zeros(values.shape, bool)
    left[50:55, 0:2] = True
    codes, sigma = read(paths["SOURCE_MAP"])[0], read(paths["UNCERTAINTY"])[0]
    assert np.array_equal(codes == LEFT, left)
    assert np.array_equal(codes == ORIGINAL, values != VOID)
    assert np.array_equal(sigma > 0, (values == VOID) & ~left)
    layer = QgsVectorLayer(paths["VOIDS_LAYER"], "voids")
    rows = {row["cells"]: row for row in layer.getFeatures()}
    assert set(rows) == {10, 48}
    assert rows[48]["expected_error"] > 0
    assert rows[48].geometry().area() == pytest.approx(48 / 1200**2)
    assert layer.crs() == QgsCoordinateReferenceSystem("EPSG:4326")
    assert (tmp_path / "report.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    report = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert sorted(row["cells"] for row in report["void_table"]) == [10, 48]
    del layer


def test_auxiliary_layers_of_another_crs_in_their_order(reconstruct, pair, tmp_path):
    """The first, in another CRS, lacks a part of the hole; the second is 40 m too high."""
    source, truth = pair
    partial = rugged()
    partial[100:120, 115:135] = -9999
    geographic = make_raster(tmp_path / "g.tif", partial.astype(np.float32), nodata=-9999)
    warped = str(tmp_path / "utm.tif")
    from osgeo import gdal

    gdal.Warp(warped, geographic, dstSRS="EPSG:32632", resampleAlg="cubic").FlushCache()
    whole = make_raster(tmp_path / "high.tif", (rugged() + 40).astype(np.float32))
    first, second = QgsRasterLayer(warped, "first"), QgsRasterLayer(whole, "second")
    QgsProject.instance().addMapLayer(first)
    feedback, path = Listening(), str(tmp_path / "source.tif")
    result = reconstruct(
        source, METHOD="auto", AUXILIARIES=[first.id(), second], SOURCE_MAP=path, feedback=feedback
    )
    codes = read(path)[0][HOLE]
    assert (codes[12:18, 17:33] == auxiliary_code(2)).all()
    codes[5:35, 10:40] = auxiliary_code(1)
    assert (codes == auxiliary_code(1)).all()
    error = read(result["OUTPUT"])[0][HOLE] - truth[HOLE]
    assert np.sqrt((error.astype(float) ** 2).mean()) < 4
    told = "\n".join(feedback.infos)
    assert f"auxiliary 1, {warped}: aligned" in told
    assert f"auxiliary 2, {whole}: aligned" in told
    QgsProject.instance().clear()


def test_an_auxiliary_that_does_not_fit_is_refused_and_told(reconstruct, pair, tmp_path):
    other = hills(260, 280, seed=9).astype(np.float32)
    path = make_raster(tmp_path / "other.tif", other)
    feedback = Listening()
    result = reconstruct(
        pair[0], METHOD="auto", AUXILIARIES=path, feedback=feedback,
        OUTPUT=str(tmp_path / "with.tif"),
    )  # fmt: skip
    alone = reconstruct(pair[0], METHOD="auto", OUTPUT=str(tmp_path / "alone.tif"))
    assert np.array_equal(read(result["OUTPUT"])[0], read(alone["OUTPUT"])[0])
    assert any("refused" in text for text in feedback.infos)


def test_neighbours_give_the_ground_beyond_the_edge(reconstruct, tmp_path):
    ground = hills(60, 100)
    west, folder = ground[:, :60].copy(), tmp_path / "tiles"
    folder.mkdir()
    west[20:30, 50:60] = VOID
    source = make_raster(tmp_path / "west.tif", west, nodata=VOID)
    beside = list(WGS84_3ARC)
    beside[0] += 59 * beside[1]
    make_raster(folder / "east.tif", ground[:, 59:], geotransform=tuple(beside), nodata=VOID)
    path = str(tmp_path / "source.tif")
    result = reconstruct(source, NEIGHBOURS=str(folder), SOURCE_MAP=path)
    codes = read(path)[0]
    assert (codes[20:30, 59] == NEIGHBOUR).all()
    assert (codes[20:30, 50:59] == FILLED).all()
    assert np.array_equal(read(result["OUTPUT"])[0][:, 59], ground[:, 59])


@pytest.mark.parametrize(
    ("option", "told"),
    [
        ({}, {"CELLS_FAULTY": 1, "LARGEST_VOID": 48, "CELLS_UNFILLED": 0}),
        ({"OUTLIERS": False}, {"CELLS_FAULTY": 0}),
        ({"OUTLIER_HEIGHT": 900}, {"CELLS_FAULTY": 0}),
        ({"OUTLIER_FACTOR": 1e5}, {"CELLS_FAULTY": 0}),
        ({"ERODE": 1}, {"LARGEST_VOID": 80}),
        ({"NOISY_RIMS": True}, {"LARGEST_VOID": 51}),  # the cell and those beside it
        ({"MAX_SIZE": 20}, {"CELLS_UNFILLED": 48}),
        ({"INTERIOR_ONLY": True}, {"CELLS_UNFILLED": 10}),
    ],
)
def test_options_reach_the_core(reconstruct, holed, tmp_path, option, told):
    values = holed[1].copy()
    values[10, 60] += 700  # a spike
    values[19, 33] += 9  # noise beside a void
    source = make_raster(tmp_path / "spiked.tif", values, nodata=VOID)
    result = reconstruct(source, **option)
    assert {name: result[name] for name in told} == told


def test_water_is_held_flat_unless_unwanted(reconstruct, tmp_path):
    values = hills(120, 120)
    values[30:90, 30:90] = 3
    values[50:60, 50:70] = VOID
    source, path = make_raster(tmp_path / "lake.tif", values, nodata=VOID), str(tmp_path / "s.tif")
    ways = (({}, WATER), ({"FLAT_WATER": False}, FILLED), ({"WATER_AREA": 1e9}, FILLED))
    for option, code in ways:
        reconstruct(source, SOURCE_MAP=path, **option)
        assert (read(path)[0][50:60, 50:70] == code).all()


def test_methods_and_types(reconstruct, pair, tmp_path):
    made = [
        read(reconstruct(pair[0], OUTPUT=str(tmp_path / f"{number}.tif"), **option)["OUTPUT"])
        for number, option in enumerate(({}, {"METHOD": "auto"}, {"FLOAT": True}))
    ]
    assert (made[0][0] != made[1][0]).any()
    assert [each[3] for each in made] == [np.int16, np.int16, np.float32]


def test_threads_do_not_matter(reconstruct, pair, tmp_path):
    made = set()
    for threads in (1, 2):
        result = reconstruct(
            pair[0], METHOD="auto", THREADS=threads, OUTPUT=str(tmp_path / f"{threads}.tif")
        )
        made.add(digest(result["OUTPUT"]))
    assert len(made) == 1


@pytest.mark.parametrize(
    "parameters", [{"NODATA": "7777, -5"}, {"ABOVE": 7000}, {"BELOW": 20}, {"MASK": True}]
)
def test_what_counts_as_void(reconstruct, tmp_path, parameters):
    values = np.maximum(hills(), 100)
    values[10:18, 10:18] = 10 if "BELOW" in parameters else 7777
    if parameters.get("MASK"):
        parameters = {"MASK": make_raster(tmp_path / "m.tif", (values == 7777).astype(np.uint8))}
    result = reconstruct(make_raster(tmp_path / "marked.tif", values), **parameters)
    assert result["CELLS_FILLED"] == 64


def test_additional_nodata_of_a_project_layer_is_given_as_such(reconstruct, tmp_path):
    values = hills()
    values[10:18, 10:18] = 0
    layer = QgsRasterLayer(make_raster(tmp_path / "sea.tif", values), "sea")
    layer.dataProvider().setUserNoDataValue(1, [QgsRasterRange(0, 0)])
    QgsProject.instance().addMapLayer(layer)
    assert reconstruct(layer.id())["CELLS_FILLED"] == 0
    assert reconstruct(layer.id(), NODATA="0")["CELLS_FILLED"] == 64
    QgsProject.instance().clear()


def test_second_band(reconstruct, tmp_path):
    bands = np.stack([np.zeros((60, 80), np.int16), hills()])
    bands[1, 5:8, 5:8] = VOID
    source = make_raster(tmp_path / "bands.tif", bands, nodata=VOID)
    assert reconstruct(source, BAND=2)["CELLS_FILLED"] == 9


def test_warnings_reach_the_log_and_the_output(reconstruct, tmp_path):
    feedback = Listening()
    result = reconstruct(make_raster(tmp_path / "whole.tif", hills()), feedback=feedback)
    assert result["WARNINGS"] == "\n".join(feedback.warnings)
    assert "no voids" in result["WARNINGS"]


def test_real_tile(reconstruct):
    source = shared_data("pyrenees_raw/N42E001.hgt")
    before = set(os.listdir(os.path.dirname(source)))
    result = reconstruct(source, METHOD="auto")
    values, filled = read(source)[0], read(result["OUTPUT"])[0]
    for name in set(os.listdir(os.path.dirname(source))) - before:
        os.remove(os.path.join(os.path.dirname(source), name))
    assert result["CELLS_UNFILLED"] == 0
    assert result["CELLS_FILLED"] == 7652 + result["CELLS_FAULTY"]
    assert (filled != values).sum() <= result["CELLS_FILLED"]


def test_layers_are_styled_when_loaded(plugin, holed):
    project = QgsProject.instance()
    project.clear()
    names = ("OUTPUT", "SOURCE_MAP", "UNCERTAINTY", "VOIDS_LAYER")
    temporary = dict.fromkeys(names, "TEMPORARY_OUTPUT")
    processing.runAndLoadResults("demsmith:reconstructsrtm", {"INPUT": holed[0], **temporary})
    layers = {layer.name(): layer for layer in project.mapLayers().values()}
    assert set(layers) == {"Reconstructed", "Source map", "Uncertainty", "Voids as polygons"}
    terrain, sigma = (
        layers[name].renderer().shader().rasterShaderFunction().colorRampItemList()
        for name in ("Reconstructed", "Uncertainty")
    )
    values = read(layers["Reconstructed"].source())[0]
    assert (terrain[0].value, terrain[-1].value) == (values.min(), values.max())
    assert len(terrain) == 7
    assert terrain[0].color.name() != sigma[0].color.name()
    assert sigma[0].value == 0 < sigma[-1].value
    classes = layers["Source map"].renderer().classes()
    codes = np.unique(read(layers["Source map"].source())[0])
    assert [each.value for each in classes] == list(codes)
    categories = layers["Voids as polygons"].renderer().categories()
    assert [each.value() for each in categories] == [each.label for each in classes[1:]]
    project.clear()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"BAND": 3}, "band 3 asked"),
        ({"NODATA": "low"}, "NODATA is 'low'; give numbers"),
        ({"BELOW": 99999}, "every cell is a void"),
        ({"ERODE": 17}, "ERODE"),
        ({"METHOD": "magic"}, "METHOD"),
        ({"AUXILIARIES": ["{folder}/none.tif"]}, "none.tif' does not exist"),
        ({"AUXILIARIES": ["{folder}/text.txt"]}, "is not a raster in a format"),
        ({"AUXILIARIES": ["{source}"], "METHOD": "mcmd"}, "auxiliary needs the method auto"),
        ({"AUXILIARIES": ["{source}"]}, "is the input itself"),
        ({"OUTPUT": "{source}"}, "is an input"),
        ({"NEIGHBOURS": "{folder}/none"}, "is no folder to look for neighbours in"),
        ({"UNCERTAINTY": "{folder}/s.tif", "METHOD": "mcmd"}, "uncertainty needs the method auto"),
        ({"VOIDS_LAYER": "{folder}/voids.csv"}, "must end in one of .gpkg, .geojson"),
        ({"VOIDS_LAYER": "{folder}/voids.shp"}, "VOIDS_LAYER"),
        ({"REPORT": "{folder}/report.pdf"}, "must end in one of .html, .json"),
        ({"OUTPUT": "{folder}/filled.asc"}, "not supported"),
        ({"OUTPUT": "{folder}/none/filled.tif"}, "there is no folder"),
        ({"SOURCE_MAP": "{folder}/filled.tif"}, "must be different files"),
        ({"CREATION_OPTIONS": "COMPRESS=MAGIC"}, "creation option refused"),
    ],
)
def test_errors_say_what_is_wrong_and_leave_nothing(
    reconstruct, holed, tmp_path, parameters, message
):
    (tmp_path / "text.txt").write_text("no raster")
    before, unchanged = set(os.listdir(tmp_path)), digest(holed[0])

    def placed(value):
        if isinstance(value, list):
            return [placed(each) for each in value]
        return value.format(folder=tmp_path, source=holed[0]) if isinstance(value, str) else value

    with pytest.raises(QgsProcessingException) as error:
        reconstruct(
            holed[0],
            **{"METHOD": "auto", **{key: placed(value) for key, value in parameters.items()}},
        )
    assert message in str(error.value)
    assert "Traceback" not in str(error.value)
    assert {name for name in os.listdir(tmp_path) if not name.endswith(".aux.xml")} == before
    assert digest(holed[0]) == unchanged


def test_layers_that_are_no_files_are_refused(reconstruct, holed):
    layer = QgsRasterLayer("type=xyz&url=file:///none/{z}/{x}/{y}.png&zmax=1", "tiles", "wms")
    with pytest.raises(QgsProcessingException, match="AUXILIARIES: layer 'tiles' comes from 'wms'"):
        reconstruct(holed[0], AUXILIARIES=[layer])


# --- qgis_process --------------------------------------------------------------------------------


def test_in_qgis_process(qgis_process, pair, tmp_path):
    source, truth = pair
    aux = make_raster(tmp_path / "aux.tif", (rugged() + 20).astype(np.float32))
    target, codes = str(tmp_path / "filled.tif"), str(tmp_path / "codes.tif")
    done = qgis_process(
        "--json", "run", "demsmith:reconstructsrtm", f"--INPUT={source}", f"--AUXILIARIES={aux}",
        f"--OUTPUT={target}", f"--SOURCE_MAP={codes}",
    )  # fmt: skip
    results = json.loads(done.stdout)["results"]
    assert (results["OUTPUT"], results["CELLS_FILLED"]) == (target, 2000)
    assert (read(codes)[0][HOLE] == auxiliary_code(1)).all()
    assert np.abs(read(target)[0][HOLE] - truth[HOLE]).max() <= 3
