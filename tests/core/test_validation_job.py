"""Validation from file to file: what is read, what is written, and that it is all or nothing."""

import csv
import json
import os

import numpy as np
import pytest
from scenes import disc, fractal, holed
from support import digest, make_raster, shared_data

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.validation import ValidateOptions, errors_by_size, validate_file, void_shapes

QUICK = dict(methods=["mcmd", "gdal"], options=ValidateOptions(seeds=1))
VOID = -32768


class Stop:
    """A progress that asks to stop at a fraction."""

    def __init__(self, at):
        self.at, self.seen = at, 0.0

    def report(self, fraction):
        self.seen = fraction

    def cancelled(self):
        return self.seen >= self.at


def ground(rows=150, columns=160):
    return fractal((160, 160), relief=2000)[:rows, :columns].astype(np.int16)


@pytest.fixture
def tile(tmp_path):
    values = ground()
    values[disc(values.shape, (60, 70), 4)] = VOID
    values[holed(values.shape, (100, 102, 20, 25))] = VOID
    return make_raster(tmp_path / "tile.tif", values, nodata=VOID)


def test_what_is_told_and_written(tile, tmp_path):
    before = digest(tile)
    paths = {name: tmp_path / f"{name}.{kind}" for name, kind in
             (("output", "csv"), ("report", "json"), ("error_map", "tif"))}  # fmt: skip
    result = validate_file(tile, **QUICK, **paths)
    assert (result.output, result.error_map) == (str(paths["output"]), str(paths["error_map"]))
    assert (result.cells, result.cells_void) == (150 * 160, 49 + 10)
    assert result.shapes_from == "own" and result.warnings == ()
    told = json.loads(paths["report"].read_text(encoding="utf-8"))
    assert told["input"] == tile and told["options"]["seeds"] == 1
    assert told["scores"] == json.loads(json.dumps(result.as_dict()["scores"]))
    rows = list(csv.DictReader(paths["output"].read_text(encoding="utf-8").splitlines()))
    assert [(row["method"], row["size"]) for row in rows[:5]] == [
        ("mcmd", size) for size in ("1-16", "17-100", "101-1000", "> 1000", "all")
    ]
    assert float(rows[4]["rmse"]) == result.rmse and int(rows[4]["cells"]) == result.cells_hidden
    assert rows[4]["within_68"] == ""
    assert digest(tile) == before


def test_the_map_holds_the_errors_of_the_first_method(tile, tmp_path):
    path = tmp_path / "map.tif"
    options = ValidateOptions(seeds=1)
    result = validate_file(tile, methods=["gdal", "mcmd"], options=options, error_map=path)
    errors = raster.read(path)
    source = raster.read(tile)
    assert errors.grid == source.grid
    hidden = ~errors.void
    assert not (hidden & source.void).any()
    error = np.where(hidden, errors.values, 0)
    gdal = result.scores[0].errors
    scored = errors_by_size(source.values + error, source.values, hidden)
    assert scored[-1].rmse == pytest.approx(gdal[-1].rmse, rel=1e-5)
    assert [each.voids for each in scored] == [each.voids for each in gdal]


def test_shapes_from_another_raster(tile, tmp_path):
    values = ground(60, 60)
    values[20:23, 20:40] = VOID
    other = make_raster(tmp_path / "other.tif", values, nodata=VOID)
    path = tmp_path / "map.tif"
    result = validate_file(tile, voids_from=other, error_map=path, **QUICK)
    assert result.shapes_from == "other"
    shapes = void_shapes(np.pad(~raster.read(path).void, 1))
    assert {shape.size for shape in shapes} == {60}


def test_a_raster_without_voids_has_a_mixture_and_is_told_so(tmp_path):
    whole = make_raster(tmp_path / "whole.tif", ground())
    result = validate_file(whole, **QUICK)
    assert result.shapes_from == "mixture"
    assert f"'{whole}': no void lies inside" in result.warnings[0]
    with pytest.raises(InputError, match=f"no void lies inside '{whole}'"):
        validate_file(whole, voids_from=whole, **QUICK)


def test_scale_and_offset_are_applied(tmp_path):
    """Feet by a hundred, stored: errors are those of the real elevations."""
    values = ground()
    values[50:54, 60:66] = VOID
    plain = make_raster(tmp_path / "plain.tif", values, nodata=VOID)

    def scaled(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(-500)

    scaled = make_raster(tmp_path / "scaled.tif", values, nodata=VOID, setup=scaled)
    one, other = (validate_file(path, **QUICK) for path in (plain, scaled))
    assert other.rmse == pytest.approx(one.rmse / 10, rel=1e-4)


def test_gpkg_and_html(tile, tmp_path):
    ogr = pytest.importorskip("osgeo.ogr", reason="GDAL is missing")
    table, page = tmp_path / "errors.gpkg", tmp_path / "report.html"
    result = validate_file(tile, output=table, report=page, **QUICK)
    layer = ogr.Open(str(table))
    assert layer.GetLayer(0).GetFeatureCount() == 10
    row = layer.GetLayer(0).GetFeature(5)
    assert row.GetField("size") == "all"
    assert row.GetField("rmse") == result.rmse
    assert row.GetField("within_95") is None
    text = page.read_text(encoding="utf-8")
    assert "GDAL FillNodata" in text and "shapes of the raster" in text
    assert "<script" not in text and "http" not in text.replace("http://www.w3.org", "")


@pytest.mark.parametrize("at", [0.02, 0.12, 0.3, 0.6, 0.9, 0.97])
def test_cancel_leaves_nothing(tile, tmp_path, at):
    folder = tmp_path / "out"
    folder.mkdir()
    paths = dict(output=folder / "a.csv", report=folder / "b.html", error_map=folder / "c.tif")
    with pytest.raises(Cancelled):
        validate_file(tile, **QUICK, **paths, progress=Stop(at))
    assert os.listdir(folder) == []


@pytest.mark.parametrize(
    ("options", "error", "said"),
    [
        ({"output": "errors.xls"}, InputError, "must end in one of .gpkg, .geojson, .csv"),
        ({"report": "report.pdf"}, InputError, "must end in .html or .json"),
        ({"error_map": "map.png"}, InputError, "must be a GeoTIFF"),
        ({"output": "none/errors.csv"}, OutputError, "there is no folder"),
        ({"output": "same.json.csv", "report": "tile.tif"}, InputError, "must end in"),
        ({"error_map": "tile.tif", "overwrite": True}, InputError, "is an input"),
        ({"error_map": "tile.tif"}, InputError, "is an input"),
        ({"voids_from": "nothing.tif"}, InputError, "nothing.tif"),
        ({"methods": ["kriging"]}, InputError, "no method 'kriging'"),
        ({"options": ValidateOptions(share=0.0)}, InputError, "share is 0"),
        ({"band": 2}, InputError, "band 2 asked"),
    ],
)
def test_refused_before_any_work(tile, tmp_path, monkeypatch, options, error, said):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("demsmith.core.validation.job.validate", None)
    before = {name: digest(tmp_path / name) for name in os.listdir(tmp_path)}
    with pytest.raises(error, match=said):
        validate_file(tile, **options)
    assert {name: digest(tmp_path / name) for name in os.listdir(tmp_path)} == before


def test_odd_rasters_of_the_shared_data():
    with pytest.raises(InputError, match="every cell is a void"):
        validate_file(shared_data("edge/all_nodata.tif"), **QUICK)
    tiny = validate_file(shared_data("edge/tiny_6x4.tif"), **QUICK)
    assert 1 <= tiny.cells_hidden <= 4
    skinny = validate_file(shared_data("edge/skinny_8x160.tif"), **QUICK)
    assert skinny.cells_hidden > 10


def test_the_pyrenees_own_voids():
    """MCMD beats GDAL in every class, as it does on masks of the SRTM's kind."""
    result = validate_file(shared_data("pyrenees_raw/N42E001.hgt"), **QUICK)
    mcmd, gdal = (score.errors for score in result.scores)
    for one, other in zip(mcmd, gdal, strict=True):
        assert one.voids >= 20
        assert one.rmse < other.rmse
        assert one.slope_rmse < other.slope_rmse
