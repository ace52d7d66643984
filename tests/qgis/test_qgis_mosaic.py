"""The tool *Reconstruct a mosaic*: runs, worker thread, `qgis_process`, cancel."""

import json
import os

import numpy as np
import pytest
from gdal_reading import read
from qgis import processing
from qgis.core import (
    QgsProcessingException,
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildAlgorithm,
    QgsProcessingModelChildParameterSource,
    QgsProcessingModelOutput,
    QgsProject,
    QgsRasterLayer,
    QgsRasterRange,
    QgsVectorLayer,
)
from qgis_runs import TaskRun
from support import WGS84_3ARC, digest, hills, make_raster

from demsmith.core.voids import FILLED, LEFT, ORIGINAL
from demsmith.core.voids.sources import auxiliary_code

VOID = -32768
SIDE = 80
COUNTS = (
    "TILES", "VOIDS", "CELLS_FILLED", "CELLS_UNFILLED", "CELLS_FAULTY", "LARGEST_VOID", "SECONDS",
)  # fmt: skip
SUMMARIES = {"mosaic.vrt", "mosaic.html", "mosaic.json"}


@pytest.fixture
def mosaic(plugin, tmp_path):
    """Run the tool by `processing.run`; returns its outputs."""

    def run(tiles, **parameters):
        parameters = {
            "INPUT": tiles, "METHOD": "mcmd", "OUTPUT": str(tmp_path / "out"), **parameters,
        }  # fmt: skip
        return processing.run("demsmith:reconstructmosaic", parameters)

    return run


def cut(folder, values, side=SIDE):
    """Write a raster as tiles without overlap; returns their paths in order."""
    folder.mkdir()
    paths = []
    for row in range(0, values.shape[0], side):
        for column in range(0, values.shape[1], side):
            x, width, _, y, _, height = WGS84_3ARC
            place = (x + column * width, width, 0, y + row * height, 0, height)
            part = values[row : row + side, column : column + side]
            path = folder / f"r{row:04}c{column:04}.tif"
            paths.append(make_raster(path, part, geotransform=place, nodata=VOID))
    return paths


def holed_ground(rows=2 * SIDE, columns=2 * SIDE):
    """Give ground with a hole over the corner of four tiles, and one at the edge."""
    values = hills(rows, columns)
    values[SIDE - 10 : SIDE + 12, SIDE - 8 : SIDE + 14] = VOID
    values[0:5, 20:30] = VOID
    return values


@pytest.fixture
def tiles(tmp_path):
    """Make four tiles; returns their paths and the ground they are cut from."""
    values = holed_ground()
    return cut(tmp_path / "tiles", values), values


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """Make nine tiles of half a million cells in all, with voids."""
    values = hills(750, 750)
    for at in range(20, 740, 24):
        values[at : at + 6, :] = np.where(np.arange(750) % 40 < 12, VOID, values[at : at + 6, :])
    return cut(tmp_path_factory.mktemp("many") / "tiles", values, side=250)


def names_in(folder):
    return {name for name in os.listdir(folder) if not name.endswith(".aux.xml")}


# --- runs ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["mcmd", "auto"])
def test_tiles_hold_what_the_merged_raster_would(mosaic, tiles, tmp_path, method):
    paths, values = tiles
    before = [digest(path) for path in paths]
    result = mosaic(paths, METHOD=method)
    merged = make_raster(tmp_path / "merged.tif", values, nodata=VOID)
    alone = processing.run(
        "demsmith:reconstructsrtm",
        {"INPUT": merged, "METHOD": method, "OUTPUT": str(tmp_path / "filled.tif")},
    )
    filled, whole = read(result["VRT"])[0], read(alone["OUTPUT"])[0]
    assert np.array_equal(filled, whole)
    assert np.array_equal(filled[values != VOID], values[values != VOID])
    counts = dict(TILES=4, VOIDS=2, CELLS_FILLED=22 * 22 + 50, CELLS_UNFILLED=0, LARGEST_VOID=484)
    assert {name: result[name] for name in counts} == counts
    assert set(result) == {"OUTPUT", "VRT", "REPORT", "WARNINGS", *COUNTS}
    assert names_in(result["OUTPUT"]) == SUMMARIES | {os.path.basename(path) for path in paths}
    assert [digest(path) for path in paths] == before


def test_folder_layers_and_both(mosaic, tiles, tmp_path):
    paths, _ = tiles
    layer = QgsRasterLayer(paths[0], "tile")
    QgsProject.instance().addMapLayer(layer)
    ways = (
        {"INPUT": None, "FOLDER": str(tmp_path / "tiles")},
        {"INPUT": [layer.id(), *paths[1:]]},
        {"INPUT": [layer], "FOLDER": str(tmp_path / "tiles")},
    )
    made = set()
    for number, way in enumerate(ways):
        result = mosaic(**{"tiles": None, "OUTPUT": str(tmp_path / str(number)), **way})
        made.add((result["TILES"], digest(os.path.join(result["OUTPUT"], "r0080c0080.tif"))))
    assert len(made) == 1
    assert made.pop()[0] == 4
    QgsProject.instance().clear()


def test_all_that_can_be_written(mosaic, tiles):
    paths, values = tiles
    result = mosaic(
        paths, METHOD="auto", INTERIOR_ONLY=True, WITH_SOURCE_MAPS=True, WITH_UNCERTAINTIES=True,
        WITH_VOIDS_LAYER=True,
    )  # fmt: skip
    folder = result["OUTPUT"]
    stems = [os.path.splitext(os.path.basename(path))[0] for path in paths]
    wanted = {f"{stem}{end}.tif" for stem in stems for end in ("", "_source", "_uncertainty")}
    assert names_in(folder) == SUMMARIES | wanted | {"voids.gpkg"}
    codes = read(os.path.join(folder, f"{stems[0]}_source.tif"))[0]
    void = values[:SIDE, :SIDE] == VOID
    assert np.array_equal(codes == ORIGINAL, ~void)
    assert (codes == LEFT).sum() == 50
    sigma = read(os.path.join(folder, f"{stems[0]}_uncertainty.tif"))[0]
    assert np.array_equal(sigma > 0, void & (codes != LEFT))
    layer = QgsVectorLayer(result["VOIDS_LAYER"], "voids")
    assert sorted(row["cells"] for row in layer.getFeatures()) == [50, 484]
    with open(result["REPORT"], encoding="utf-8") as page:
        assert page.read().startswith("<!DOCTYPE html>")
    del layer


def test_auxiliary_of_another_crs(mosaic, tmp_path):
    y, x = np.mgrid[: 3 * SIDE, : 3 * SIDE]
    ground = hills(3 * SIDE, 3 * SIDE, dtype=np.float64) + 60 * np.sin(x / 5) * np.sin(y / 6)
    values = np.rint(ground).astype(np.int16)
    hole = np.s_[SIDE - 20 : SIDE + 20, SIDE - 20 : SIDE + 20]
    values[hole] = VOID
    paths = cut(tmp_path / "tiles", values)
    from osgeo import gdal

    other = make_raster(tmp_path / "g.tif", ground.astype(np.float32))
    aux = str(tmp_path / "utm.tif")
    gdal.Warp(aux, other, dstSRS="EPSG:32632", resampleAlg="cubic", dstNodata=-9999).FlushCache()
    result = mosaic(
        paths, METHOD="auto", AUXILIARIES=[QgsRasterLayer(aux, "aux")], WITH_SOURCE_MAPS=True
    )
    codes = read(os.path.join(result["OUTPUT"], "r0000c0000_source.tif"))[0]
    assert (codes[SIDE - 20 :, SIDE - 20 :] == auxiliary_code(1)).all()
    assert np.abs(read(result["VRT"])[0][hole] - ground[hole]).max() < 8


@pytest.mark.parametrize(
    ("option", "told"),
    [
        ({"MAX_SIZE": 100}, {"CELLS_UNFILLED": 484}),
        ({"NODATA": "-7, 77"}, {"VOIDS": 4}),
        ({"ABOVE": 5000}, {"VOIDS": 4}),
        ({"OUTLIERS": False}, {"CELLS_FAULTY": 0}),
        ({}, {"CELLS_FAULTY": 1, "VOIDS": 3}),
    ],
)
def test_options_reach_the_core(mosaic, tmp_path, option, told):
    values = holed_ground()
    values[100:105, 20:25] = 77 if "NODATA" in option else values[100:105, 20:25]
    values[120:128, 20:28] = 6000 if "ABOVE" in option else values[120:128, 20:28]
    values[130, 130] += 700  # a spike
    result = mosaic(cut(tmp_path / "tiles", values), **option)
    assert {name: result[name] for name in told} == told


def test_additional_nodata_of_a_project_layer_is_given_as_such(mosaic, tmp_path):
    values = holed_ground()
    values[100:108, 20:28] = 0
    layers = [QgsRasterLayer(path, "tile") for path in cut(tmp_path / "tiles", values)]
    for layer in layers:
        layer.dataProvider().setUserNoDataValue(1, [QgsRasterRange(0, 0)])
    QgsProject.instance().addMapLayers(layers)
    assert mosaic(layers)["VOIDS"] == 2
    assert mosaic(layers, NODATA="0", OVERWRITE=True)["VOIDS"] == 3
    QgsProject.instance().clear()


def test_types_and_bands(mosaic, tmp_path):
    values = holed_ground()
    paths = [
        make_raster(tmp_path / f"{number}.tif", np.stack([0 * values, values]), nodata=VOID,
                    geotransform=(10 + number * 160 / 1200, *WGS84_3ARC[1:]))
        for number in range(2)
    ]  # fmt: skip
    result = mosaic(paths, BAND=2, FLOAT=True)
    assert result["CELLS_FILLED"] == 2 * (484 + 50)
    assert read(os.path.join(result["OUTPUT"], "0.tif"))[3] is np.float32


def test_the_mosaic_is_opened_and_styled_when_asked(plugin, tiles, tmp_path):
    project = QgsProject.instance()
    for load in (False, True):
        project.clear()
        processing.runAndLoadResults(
            "demsmith:reconstructmosaic",
            {"INPUT": tiles[0], "METHOD": "mcmd", "OUTPUT": str(tmp_path / f"out{load}"),
             "WITH_VOIDS_LAYER": True, "LOAD": load},
        )  # fmt: skip
        layers = {layer.name(): layer for layer in project.mapLayers().values()}
        assert set(layers) == ({"Mosaic", "Voids"} if load else set())
    values = read(layers["Mosaic"].source())[0]
    assert layers["Mosaic"].source().endswith("mosaic.vrt")
    stops = layers["Mosaic"].renderer().shader().rasterShaderFunction().colorRampItemList()
    assert (stops[0].value, stops[-1].value, len(stops)) == (values.min(), values.max(), 7)
    categories = layers["Voids"].renderer().categories()
    assert [each.value() for each in categories] == ["interpolated by MCMD"]
    project.clear()


def test_tiles_of_several_types_have_no_common_raster(plugin, tmp_path):
    project = QgsProject.instance()
    project.clear()
    values = holed_ground()
    cut(tmp_path / "tiles", values)
    place = (10 + 160 / 1200, *WGS84_3ARC[1:])
    make_raster(tmp_path / "tiles" / "z.tif", hills().astype(np.float32), geotransform=place)
    outputs = processing.runAndLoadResults(
        "demsmith:reconstructmosaic",
        {"FOLDER": str(tmp_path / "tiles"), "METHOD": "mcmd", "OUTPUT": str(tmp_path / "out")},
    )
    assert "VRT" not in outputs
    assert "no '" in outputs["WARNINGS"]
    assert not project.mapLayers()


def test_in_a_model_the_next_step_takes_the_mosaic_and_numbers(plugin, tiles, tmp_path):
    source = QgsProcessingModelChildParameterSource
    model = QgsProcessingModelAlgorithm("chain", "tests")
    first = QgsProcessingModelChildAlgorithm("demsmith:reconstructmosaic")
    first.setChildId("fill")
    for name, value in (
        ("FOLDER", str(tmp_path / "tiles")), ("METHOD", "mcmd"), ("OUTPUT", str(tmp_path / "out")),
    ):  # fmt: skip
        first.addParameterSources(name, [source.fromStaticValue(value)])
    model.addChildAlgorithm(first)
    second = QgsProcessingModelChildAlgorithm("native:rescaleraster")
    second.setChildId("rescale")
    second.addParameterSources("INPUT", [source.fromChildOutput("fill", "VRT")])
    second.addParameterSources("MAXIMUM", [source.fromChildOutput("fill", "CELLS_FILLED")])
    result = QgsProcessingModelOutput("result")
    result.setChildId("rescale")
    result.setChildOutputName("OUTPUT")
    second.setModelOutputs({"result": result})
    model.addChildAlgorithm(second)
    outputs = processing.run(model, {"rescale:result": str(tmp_path / "rescaled.tif")})
    assert read(outputs["rescale:result"])[0].max() == pytest.approx(534)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"INPUT": None}, "there are no tiles: give INPUT or FOLDER"),
        ({"INPUT": ["{folder}/none.tif"]}, "none.tif' does not exist"),
        ({"INPUT": None, "FOLDER": "{folder}/empty"}, "holds no elevation rasters"),
        ({"FOLDER": "{folder}/missing"}, "missing' "),
        ({"INPUT": ["{tile}", "{folder}/beside.tif"]}, "beside the grid"),
        ({"INPUT": ["{tile}", "{folder}/utm.tif"]}, "has another CRS"),
        ({"BAND": 2}, "band 2 asked"),
        ({"NODATA": "low"}, "NODATA is 'low'; give numbers"),
        ({"BELOW": 99999}, "every cell is a void"),
        ({"METHOD": "mcmd", "WITH_UNCERTAINTIES": True}, "uncertainty needs the method auto"),
        ({"METHOD": "mcmd", "AUXILIARIES": ["{tile}"]}, "auxiliary needs the method auto"),
        ({"AUXILIARIES": ["{folder}/none.tif"]}, "none.tif' does not exist"),
        ({"OUTPUT": "{folder}/tiles"}, "is in the output folder"),
        ({"OUTPUT": "{tile}"}, "cannot make the output folder"),
        ({"OUTPUT": "{folder}/full"}, "exists"),
        ({"CREATION_OPTIONS": "COMPRESS=MAGIC"}, "creation option refused"),
    ],
)
def test_errors_say_what_is_wrong_and_leave_nothing(mosaic, tiles, tmp_path, parameters, message):
    paths, values = tiles
    for name in ("empty", "full"):
        (tmp_path / name).mkdir()
    (tmp_path / "full" / "mosaic.html").write_text("the user's")
    make_raster(tmp_path / "beside.tif", values, geotransform=(10.0003, *WGS84_3ARC[1:]))
    utm = (500_000, 90, 0, 5_000_000, 0, -90)
    make_raster(tmp_path / "utm.tif", values, geotransform=utm, crs="EPSG:32632")

    def everything():
        return {
            os.path.join(folder, name): digest(os.path.join(folder, name))
            for folder, _, names in os.walk(tmp_path)
            for name in [".", *names]
            if name != "." and not name.endswith(".aux.xml")
        } | {folder: "" for folder, _, _ in os.walk(tmp_path)}

    def placed(value):
        if isinstance(value, list):
            return [placed(each) for each in value]
        return value.format(folder=tmp_path, tile=paths[0]) if isinstance(value, str) else value

    before = everything()
    with pytest.raises(QgsProcessingException) as error:
        mosaic(
            **{
                "tiles": paths, "METHOD": "auto",
                **{key: placed(value) for key, value in parameters.items()},
            }
        )  # fmt: skip
    assert message in str(error.value)
    assert "Traceback" not in str(error.value)
    assert everything() == before


def test_layers_that_are_no_files_are_refused(mosaic, tiles):
    layer = QgsRasterLayer("type=xyz&url=file:///none/{z}/{x}/{y}.png&zmax=1", "web", "wms")
    with pytest.raises(QgsProcessingException, match="INPUT: layer 'web' comes from 'wms'"):
        mosaic([layer])
    with pytest.raises(QgsProcessingException, match="AUXILIARIES: layer 'web' comes from 'wms'"):
        mosaic(tiles[0], AUXILIARIES=[layer])


# --- worker thread -------------------------------------------------------------------------------


def test_the_window_stays_responsive(plugin, many, tmp_path):
    run = TaskRun("reconstructmosaic", {"INPUT": many, "OUTPUT": str(tmp_path / "out")})
    assert run.fine
    assert (run.outputs["TILES"], run.outputs["CELLS_UNFILLED"]) == (9, 0)
    assert max(run.gaps) < 0.5
    assert len(run.progress) >= 5
    assert run.progress == sorted(run.progress)
    assert run.progress[-1] == 100


@pytest.mark.parametrize("percent", [4, 20, 50, 85])
def test_a_cancelled_run_goes_on_where_it_was(plugin, many, tmp_path, percent):
    folder = tmp_path / "out"
    parameters = {"INPUT": many, "METHOD": "mcmd", "OUTPUT": str(folder)}
    run = TaskRun("reconstructmosaic", parameters, cancel_at=percent)
    assert run.cancelled_at is not None
    assert run.ended_at - run.cancelled_at < 1
    assert not run.fine
    assert "what is done is kept in" in run.feedback.textLog()
    for name in names_in(folder) - {".demsmith-mosaic"}:  # those that are there are whole
        assert not (read(str(folder / name))[0] == VOID).any()
    kept = {name: os.stat(folder / name).st_mtime_ns for name in names_in(folder)}
    again = TaskRun("reconstructmosaic", parameters)
    assert again.fine
    assert names_in(folder) == SUMMARIES | {os.path.basename(path) for path in many}
    for name in set(kept) - {".demsmith-mosaic"}:
        assert os.stat(folder / name).st_mtime_ns == kept[name]


# --- qgis_process --------------------------------------------------------------------------------


def test_in_qgis_process(qgis_process, tiles, tmp_path):
    paths, values = tiles
    done = qgis_process(
        "--json", "run", "demsmith:reconstructmosaic", f"--INPUT={paths[0]}",
        f"--INPUT={paths[1]}", f"--INPUT={paths[2]}", f"--INPUT={paths[3]}", "--METHOD=mcmd",
        "--WITH_SOURCE_MAPS=true", f"--OUTPUT={tmp_path / 'out'}",
    )  # fmt: skip
    results = json.loads(done.stdout)["results"]
    assert (results["TILES"], results["CELLS_FILLED"]) == (4, 534)
    assert results["VRT"] == str(tmp_path / "out" / "mosaic.vrt")
    codes = read(str(tmp_path / "out" / "r0080c0080_source.tif"))[0]
    assert np.array_equal(codes == FILLED, values[SIDE:, SIDE:] == VOID)
