"""From file to file: types, tags, tables, reports, and all outputs or none."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from scenes import disc, fractal, holed, plane
from support import WGS84_3ARC, digest, make_raster

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.voids import FILLED, FillOptions, fill_file, fill_voids, job
from demsmith.core.voids.accurate import SOURCE_OF_METHOD

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

SHAPE = (60, 80)
VOID = disc(SHAPE, (30, 30), 9) | holed(SHAPE, (0, 3, 70, 76), (50, 52, 60, 61))


def tile(path, *, dtype="int16", nodata=-32768, ground=None, void=VOID, **options):
    """A raster with an interior void of 253 cells, one of 2, and one of 18 at the edge."""
    values = np.rint(fractal(SHAPE, seed=2)).astype(dtype) if ground is None else ground
    values = values.astype(dtype)
    values[void] = nodata
    return make_raster(path, values, nodata=nodata, **options)


every_method = pytest.mark.parametrize("method", ["auto", "mcmd"])


def source_map_is(path, filled, left, method):
    """Whether a source map tells these cells filled by the method, those left, the rest known."""
    codes = stored(path)[0]
    by = [FILLED] if method == "mcmd" else SOURCE_OF_METHOD
    inside = filled & ~left
    return (
        np.isin(codes[inside], by).all() and (codes[left] == 2).all()
        and (codes[~(filled | left)] == 0).all()
    )  # fmt: skip


def stored(path):
    """Values, void cells by GDAL's own mask, nodata tag."""
    dataset = gdal.Open(str(path))
    band = dataset.GetRasterBand(1)
    return band.ReadAsArray(), band.GetMaskBand().ReadAsArray() == 0, band.GetNoDataValue()


# --- values --------------------------------------------------------------------------------------


@every_method
def test_fill_as_the_array_function_does(tmp_path, method):
    source = tile(tmp_path / "in.tif")
    before = digest(source)
    result = fill_file(source, tmp_path / "out.tif", options=FillOptions(method=method))
    assert digest(source) == before
    read = raster.read(source)
    expected = fill_voids(
        read.values, read.void, method=method, pixel_size=read.grid.pixel_size_m()
    ).values
    values, void, nodata = stored(tmp_path / "out.tif")
    assert values.dtype == np.int16 and nodata == -32768
    np.testing.assert_array_equal(values, expected)
    assert not void.any()
    assert (result.voids, result.cells, result.largest_void) == (3, 4800, 253)
    assert (result.cells_void, result.cells_filled, result.cells_unfilled) == (273, 273, 0)
    assert result.output == str(tmp_path / "out.tif")
    assert result.source_map is None and result.uncertainty is None and result.report is None
    assert result.warnings == ()
    assert len(result.reasons) == (4 if method == "auto" else 0)


@pytest.mark.parametrize("driver", ["GTiff", "SRTMHGT", "AAIGrid", "ENVI"])
def test_what_is_read_may_be_of_any_kind(tmp_path, driver):
    if driver == "SRTMHGT":
        from support import make_hgt

        values = np.rint(fractal((1201, 1201), relief=900)).astype(np.int16)
        values[500:520, 600:630] = -32768
        source = make_hgt(tmp_path / "N10E020.hgt", values)
    else:
        source = tile(tmp_path / "in.asc", driver=driver)
    files = {path: digest(path) for path in Path(tmp_path).iterdir()}
    result = fill_file(source, tmp_path / "out.tif")
    assert {path: digest(path) for path in files} == files
    assert result.cells_unfilled == 0 and result.cells_filled > 200
    assert not stored(tmp_path / "out.tif")[1].any()


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "int32", "float32", "float64"])
def test_type_kept_or_float(tmp_path, dtype):
    nodata = 0 if dtype.startswith("u") else -9999
    ground = fractal(SHAPE, relief=200) + 20
    source = tile(tmp_path / "in.tif", dtype=dtype, nodata=nodata, ground=ground)
    fill_file(source, tmp_path / "same.tif")
    fill_file(source, tmp_path / "float.tif", options=FillOptions(float_output=True))
    same, real = stored(tmp_path / "same.tif")[0], stored(tmp_path / "float.tif")[0]
    assert same.dtype == dtype
    assert real.dtype == (dtype if dtype.startswith("f") else
                          "float64" if dtype == "int32" else "float32")  # fmt: skip
    if not dtype.startswith("f"):
        np.testing.assert_array_equal(same[VOID], np.rint(real[VOID]))
        assert (real[VOID] != np.rint(real[VOID])).any()
    np.testing.assert_array_equal(same[~VOID], ground.astype(dtype)[~VOID])


@every_method
def test_bytes_do_not_wrap_around(tmp_path, method):
    void = holed(SHAPE, (10, 40, 44, 60))
    ground = np.clip(plane(SHAPE, slope=(0, 5.0), height=40), 1, 255)
    source = tile(tmp_path / "in.tif", dtype="uint8", nodata=0, ground=ground, void=void)
    fill_file(source, tmp_path / "out.tif", options=FillOptions(method=method))
    values, left, _ = stored(tmp_path / "out.tif")
    assert not left.any()
    assert values[void].min() > 200


# --- nodata tags ---------------------------------------------------------------------------------


@every_method
def test_filled_ground_at_the_tags_value_is_ground(tmp_path, method):
    """Tag 0 on ground that crosses 0: the filled 0 must not read as a void."""
    ground = np.rint(plane(SHAPE, slope=(0, 1.0), height=-30))
    ground[ground == 0] = 1
    source = tile(tmp_path / "in.tif", nodata=0, ground=ground)
    result = fill_file(source, tmp_path / "out.tif", options=FillOptions(method=method))
    values, void, _ = stored(tmp_path / "out.tif")
    assert not void.any() and result.cells_unfilled == 0
    again = raster.read(tmp_path / "out.tif")
    assert not again.void.any()
    assert (values[VOID] == 0).any()


@every_method
def test_voids_left_are_tagged_whatever_their_tag(tmp_path, method):
    """A voids' tag that a filled cell would take gives way to another."""
    ground = np.rint(plane(SHAPE, slope=(0, 1.0), height=-30))
    ground[ground == 0] = 1
    source = tile(tmp_path / "in.tif", nodata=0, ground=ground)
    result = fill_file(
        source, tmp_path / "out.tif", source_map=tmp_path / "map.tif",
        options=FillOptions(method=method, interior_only=True),
    )  # fmt: skip
    values, void, nodata = stored(tmp_path / "out.tif")
    edge = holed(SHAPE, (0, 3, 70, 76))
    np.testing.assert_array_equal(void, edge)
    assert (values[VOID & ~edge] == 0).any() and nodata != 0
    assert (result.cells_filled, result.cells_unfilled) == (255, 18)
    assert source_map_is(tmp_path / "map.tif", VOID, edge, method)


@every_method
@pytest.mark.parametrize(
    ("options", "kept"),
    [
        (dict(max_size=252), disc(SHAPE, (30, 30), 9)),
        (dict(max_size=2), VOID & ~holed(SHAPE, (50, 52, 60, 61))),
        (dict(interior_only=True, max_size=100), VOID & ~holed(SHAPE, (50, 52, 60, 61))),
    ],
)
def test_voids_left_stay_nodata(tmp_path, options, kept, method):
    source = tile(tmp_path / "in.tif")
    result = fill_file(
        source, tmp_path / "out.tif", source_map=tmp_path / "map.tif",
        options=FillOptions(method=method, **options),
    )  # fmt: skip
    values, void, nodata = stored(tmp_path / "out.tif")
    assert nodata == -32768
    np.testing.assert_array_equal(void, kept)
    assert (values[kept] == -32768).all()
    source_map, unknown, tag = stored(tmp_path / "map.tif")
    assert source_map_is(tmp_path / "map.tif", VOID, kept, method)
    assert source_map.dtype == np.uint8 and tag is None and not unknown.any()
    assert result.cells_unfilled == kept.sum()
    assert [row["filled"] for row in result.table.rows()].count(False) >= 1


def test_float_voids_left_are_nodata(tmp_path):
    """Also NaN cells among tagged ones."""
    ground = fractal(SHAPE)
    source = tile(tmp_path / "in.tif", dtype="float32", nodata=-9999, ground=ground)
    fill_file(source, tmp_path / "out.tif", options=FillOptions(max_size=20))
    _, void, nodata = stored(tmp_path / "out.tif")
    assert nodata == -9999
    np.testing.assert_array_equal(void, disc(SHAPE, (30, 30), 9))


def test_named_voids(tmp_path):
    """nodata, below, above and a mask raster add to the tag."""
    ground = np.full(SHAPE, 100)
    ground[5, 5], ground[8, 8], ground[11, 11] = -5, 4000, 777
    mask = np.zeros(SHAPE, np.uint8)
    mask[14, 14] = 1
    source = tile(tmp_path / "in.tif", ground=ground)
    over = make_raster(tmp_path / "mask.tif", mask)
    result = fill_file(source, tmp_path / "out.tif", nodata=(777,), below=-1, above=3000, mask=over)
    assert result.voids == 3 + 4
    assert (stored(tmp_path / "out.tif")[0] == 100).all()


# --- units ---------------------------------------------------------------------------------------


def test_scaled_rasters_mean_the_same(tmp_path):
    """Decimetres with an offset: as the metres, to the rounding; tables speak of metres."""
    real = np.rint(fractal(SHAPE)) / 10 + 100
    metres = tile(tmp_path / "m.tif", dtype="float64", nodata=-9999, ground=real)

    def scaled(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(100.0)

    deci = tile(tmp_path / "dm.tif", ground=np.rint((real - 100) * 10), nodata=-32768, setup=scaled)
    for options in (
        FillOptions(),
        FillOptions(method="mcmd"),
        FillOptions(variant="paper", l=1.0, l_bu=3.0, datum=90.0),
        FillOptions(variant="weighted", r_s=0.2, relief=40.0, seed=3),
        FillOptions(r_s=0.2, seed=3),
    ):
        one = fill_file(metres, tmp_path / "a.tif", options=options, overwrite=True)
        other = fill_file(deci, tmp_path / "b.tif", options=options, overwrite=True)
        a, b = stored(tmp_path / "a.tif")[0], stored(tmp_path / "b.tif")[0]
        np.testing.assert_allclose(b * 0.1 + 100, a, atol=0.051)
        for name in ("rim_low", "rim_mean", "rim_high", "rim_relief"):
            np.testing.assert_allclose(
                getattr(other.table, name), getattr(one.table, name), atol=1e-9
            )
    meta = raster.read(tmp_path / "b.tif").meta
    assert (meta.scale, meta.offset) == (0.1, 100.0)


def test_feet_stay_feet(tmp_path):
    def feet(dataset):
        dataset.GetRasterBand(1).SetUnitType("ft")

    source = tile(tmp_path / "in.tif", setup=feet)
    fill_file(source, tmp_path / "out.tif")
    fill_file(tile(tmp_path / "m.tif"), tmp_path / "metres.tif")
    assert raster.read(tmp_path / "out.tif").meta.unit == "ft"
    np.testing.assert_array_equal(
        stored(tmp_path / "out.tif")[0], stored(tmp_path / "metres.tif")[0]
    )


# --- table and report ----------------------------------------------------------------------------


def test_void_table(tmp_path):
    source = tile(tmp_path / "in.tif")
    table = fill_file(source, tmp_path / "out.tif", options=FillOptions(max_size=100)).table
    assert len(table) == 3
    assert table.id.tolist() == [1, 2, 3]
    assert list(zip(table.row.tolist(), table.column.tolist(), strict=True)) == [
        (0, 70), (21, 30), (50, 60),
    ]  # fmt: skip
    np.testing.assert_allclose(table.x, WGS84_3ARC[0] + (table.column + 0.5) / 1200)
    np.testing.assert_allclose(table.y, WGS84_3ARC[3] - (table.row + 0.5) / 1200)
    assert table.cells.tolist() == [18, 253, 2]
    assert table.touches_edge.tolist() == [True, False, False]
    assert table.filled.tolist() == [True, False, True]
    values = np.rint(fractal(SHAPE, seed=2)).astype(np.int16)
    last = [values[49, 60], values[52, 60], *values[50:52, [59, 61]].ravel()]
    assert (table.rim_low[2], table.rim_high[2]) == (min(last), max(last))
    assert table.rim_relief[2] == max(last) - min(last)
    assert table.rim_mean[2] == pytest.approx(np.mean(last))
    # 3″ × 3″ at 50° N is 92.7 m × 59.7 m, and wider to the south.
    np.testing.assert_allclose(table.area_m2, table.cells * 92.67 * 59.73, rtol=3e-3)
    cell = raster.read(source).grid.cell_area_m2()
    assert table.area_m2[2] == pytest.approx(cell[50] + cell[51])


def test_rim_of_nothing_known_is_none(tmp_path):
    """A void whose every neighbour is beyond the edge cannot be; a raster of one row can lack one
    side, and still has a rim.
    """
    values = np.array([[5, -1, -1, 7]], np.int16)
    source = make_raster(tmp_path / "in.tif", values, nodata=-1)
    rows = list(fill_file(source, tmp_path / "out.tif").table.rows())
    assert (rows[0]["rim_low"], rows[0]["rim_high"], rows[0]["touches_edge"]) == (5, 7, True)


def test_report_is_json_with_all_that_matters(tmp_path):
    source = tile(tmp_path / "in.tif")
    result = fill_file(
        source, tmp_path / "out.tif", source_map=tmp_path / "map.tif",
        report=tmp_path / "report.json", options=FillOptions(max_size=100, tension=500.0),
    )  # fmt: skip

    def refuse(token):
        raise AssertionError(token)

    report = json.loads((tmp_path / "report.json").read_text("utf-8"), parse_constant=refuse)
    assert report["input"] == source and report["band"] == 1
    assert report["output"] == str(tmp_path / "out.tif")
    assert report["source_map"] == str(tmp_path / "map.tif")
    assert report["options"]["max_size"] == 100 and report["options"]["tension"] == 500
    assert report["options"]["datum"] is None
    for name in ("voids", "cells", "cells_void", "cells_filled", "cells_unfilled", "largest_void"):
        assert report[name] == getattr(result, name)
    assert report["version"] and report["seconds"] > 0 and report["warnings"] == []
    assert [row["cells"] for row in report["void_table"]] == [18, 253, 2]
    assert set(report["void_table"][0]) == {
        "id", "row", "column", "x", "y", "cells", "area_m2", "rim_low", "rim_mean", "rim_high",
        "rim_relief", "touches_edge", "filled", "roughness_h", "roughness", "method",
        "expected_error", "reason",
    }  # fmt: skip
    assert report["uncertainty"] is None and report["options"]["method"] == "auto"
    assert report["reasons"] == list(result.reasons)
    json.dumps(result.as_dict(), allow_nan=False)


def test_no_voids_is_said_and_copied(tmp_path):
    source = make_raster(tmp_path / "in.tif", fractal(SHAPE).astype(np.float32))
    result = fill_file(source, tmp_path / "out.tif", report=tmp_path / "r.json")
    assert result.voids == 0 and len(result.table) == 0
    assert any("no voids" in warning for warning in result.warnings)
    np.testing.assert_array_equal(stored(tmp_path / "out.tif")[0], fractal(SHAPE).astype("f4"))
    assert json.loads((tmp_path / "r.json").read_text())["void_table"] == []


# --- all or nothing ------------------------------------------------------------------------------

OUTPUTS = ("out.tif", "map.tif", "sigma.tif", "report.json")


def outputs(folder):
    return dict(
        output=folder / "out.tif", source_map=folder / "map.tif", uncertainty=folder / "sigma.tif",
        report=folder / "report.json",
    )  # fmt: skip


def listing(folder):
    return {path.name: digest(path) for path in Path(folder).rglob("*") if path.is_file()}


def fail_at(monkeypatch, module, name, call):
    """Make the ``call``-th call of a function of the job fail."""
    real, calls = getattr(module, name), []

    def failing(*args, **kwargs):
        calls.append(1)
        if len(calls) == call:
            raise OutputError("the disk is full")
        return real(*args, **kwargs)

    monkeypatch.setattr(module, name, failing)


@pytest.mark.parametrize("older", [False, True])
@pytest.mark.parametrize(
    "where", ["write 1", "write 2", "write 3", "report", "cancel", "creation option"]
)
def test_all_outputs_or_none(tmp_path, monkeypatch, where, older):
    source = tile(tmp_path / "in.tif")
    folder = tmp_path / "out"
    folder.mkdir()
    if older:
        for name in OUTPUTS:
            (folder / name).write_bytes(b"older " + name.encode())
    before = listing(tmp_path)
    options, error = {}, OutputError
    if where.startswith("write"):
        fail_at(monkeypatch, raster, "write", int(where[-1]))
    elif where == "report":
        fail_at(monkeypatch, job, "_write_report", 1)
    elif where == "creation option":
        options, error = dict(creation_options=["COMPRESS=JPEG2001"]), (InputError, OutputError)
    else:
        options, error = dict(progress=StopAtTheEnd()), Cancelled
    with pytest.raises(error):
        fill_file(source, **outputs(folder), overwrite=older, **options)
    assert listing(tmp_path) == before
    assert sorted(os.listdir(folder)) == (sorted(OUTPUTS) if older else [])


class StopAtTheEnd:
    last = 0

    def report(self, fraction):
        self.last = fraction

    def cancelled(self):
        return self.last >= 0.97


@pytest.mark.parametrize("taken", OUTPUTS)
def test_nothing_is_overwritten_unasked(tmp_path, taken):
    source = tile(tmp_path / "in.tif")
    (tmp_path / taken).write_bytes(b"mine")
    before = listing(tmp_path)
    with pytest.raises(OutputError, match="exists already"):
        fill_file(source, **outputs(tmp_path))
    assert listing(tmp_path) == before
    fill_file(source, **outputs(tmp_path), overwrite=True)
    assert digest(tmp_path / taken) != before[taken]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(output="in.tif"), "is an input"),
        (dict(source_map="in.tif"), "is an input"),
        (dict(report="in.tif"), "is an input"),
        (dict(source_map="out.tif"), "different files"),
        (dict(report="map.tif"), "different files"),
        (dict(uncertainty="in.tif"), "is an input"),
        (dict(uncertainty="map.tif"), "different files"),
        (dict(uncertainty="missing/s.tif"), "no folder"),
        (dict(options=FillOptions(method="mcmd")), "an uncertainty needs the method auto"),
        (dict(options=FillOptions(r_s=0.1)), "an uncertainty needs the method auto"),
        (dict(options=FillOptions(tune=True)), "an uncertainty needs the method auto"),
        (dict(output="out.png"), "must be a GeoTIFF"),
        (dict(output="missing/out.tif"), "no folder"),
        (dict(report="missing/r.json"), "no folder"),
        (dict(band=2), "band"),
        (dict(threads=0), "threads"),
        (dict(options=FillOptions(h=7)), "h is 7"),
        (dict(options=FillOptions(l=1.0), uncertainty=None), "relaxed"),
        (
            dict(options=FillOptions(variant="paper", datum=1e5), uncertainty=None),
            r"in\.tif.*datum",
        ),
    ],
)
def test_refused_without_a_trace(tmp_path, changes, message):
    source = tile(tmp_path / "in.tif")
    before = listing(tmp_path)
    asked = outputs(tmp_path)
    for name, value in changes.items():
        asked[name] = tmp_path / value if name in asked and value else value
    with pytest.raises((InputError, OutputError), match=message):
        fill_file(source, **asked, overwrite=True)
    assert listing(tmp_path) == before


def test_all_void_is_refused(tmp_path):
    source = make_raster(tmp_path / "in.tif", np.full((5, 6), -1, np.int16), nodata=-1)
    with pytest.raises(InputError, match=r"in\.tif.*every cell is a void"):
        fill_file(source, tmp_path / "out.tif")
    assert not (tmp_path / "out.tif").exists()


def test_progress_of_the_whole_job(tmp_path):
    fractions = []

    class Show:
        def report(self, fraction):
            fractions.append(fraction)

        def cancelled(self):
            return False

    fill_file(tile(tmp_path / "in.tif"), **outputs(tmp_path), progress=Show())
    assert (np.diff(fractions) >= 0).all()
    assert fractions[0] >= 0 and fractions[-1] == 1


@pytest.mark.parametrize(
    "options", [{}, dict(variant="relaxed", r_s=0.1), dict(variant="paper", r_s=0.1)]
)
def test_outputs_do_not_depend_on_threads(tmp_path, options):
    source = tile(tmp_path / "in.tif")
    names = ("output", "source_map") if options else ("output", "source_map", "uncertainty")
    for threads in (1, 2, 5):
        paths = {name: tmp_path / f"{threads}{name}.tif" for name in names}
        fill_file(source, **paths, threads=threads, options=FillOptions(**options))
    for name in names:
        assert len({digest(tmp_path / f"{threads}{name}.tif") for threads in (1, 2, 5)}) == 1


# --- uncertainty ---------------------------------------------------------------------------------


def test_uncertainty_is_of_the_filled_cells(tmp_path):
    source = tile(tmp_path / "in.tif")
    result = fill_file(
        source, tmp_path / "out.tif", uncertainty=tmp_path / "sigma.tif",
        options=FillOptions(max_size=100),
    )  # fmt: skip
    assert result.uncertainty == str(tmp_path / "sigma.tif")
    sigma, unknown, nodata = stored(tmp_path / "sigma.tif")
    left = disc(SHAPE, (30, 30), 9)
    assert sigma.dtype == np.float32 and nodata == -1
    np.testing.assert_array_equal(unknown, left)
    assert (sigma[left] == -1).all() and (sigma[VOID & ~left] > 0).all()
    assert (sigma[~VOID] == 0).all()
    read = raster.read(source)
    filled = fill_voids(
        read.values, read.void, max_size=100, pixel_size=read.grid.pixel_size_m()
    )  # fmt: skip
    np.testing.assert_array_equal(sigma[~left], filled.sigma[~left])


def test_uncertainty_and_table_speak_the_rasters_unit(tmp_path):
    """Decimetres stored, metres told: sigma and expected errors as of the same ground in metres."""
    real = np.rint(fractal(SHAPE)) / 10 + 100

    def scaled(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(100.0)

    metres = tile(tmp_path / "m.tif", dtype="float64", nodata=-9999, ground=real)
    deci = tile(tmp_path / "dm.tif", ground=np.rint((real - 100) * 10), setup=scaled)
    one, other = (
        fill_file(path, f"{path}.out.tif", uncertainty=f"{path}.sigma.tif")
        for path in (metres, deci)
    )
    a, b = (stored(result.uncertainty)[0] for result in (one, other))
    np.testing.assert_allclose(b[VOID], a[VOID], rtol=0.02)
    np.testing.assert_allclose(other.table.expected_error, one.table.expected_error, rtol=0.02)
    assert one.table.expected_error == pytest.approx(
        [np.sqrt((a[own].astype(float) ** 2).mean()) for own in (
            holed(SHAPE, (0, 3, 70, 76)), disc(SHAPE, (30, 30), 9), holed(SHAPE, (50, 52, 60, 61))
        )], rel=1e-5,
    )  # fmt: skip


def test_table_tells_method_and_reason(tmp_path):
    source = tile(tmp_path / "in.tif")
    table = fill_file(source, tmp_path / "a.tif", options=FillOptions(max_size=100)).table
    assert table.method[1] == "" and table.reason[1] == "" and np.isnan(table.expected_error[1])
    for n in (0, 2):
        assert table.method[n].startswith("interpolated ")
        assert "%" in table.reason[n] and table.expected_error[n] > 0
    table = fill_file(source, tmp_path / "b.tif", options=FillOptions(method="mcmd")).table
    assert set(table.method) == {"interpolated by MCMD"} and set(table.reason) == {""}
    assert np.isnan(table.expected_error).all()


def test_uncertainty_without_voids_is_none(tmp_path):
    source = make_raster(tmp_path / "in.tif", fractal(SHAPE).astype(np.float32))
    result = fill_file(source, tmp_path / "out.tif", uncertainty=tmp_path / "sigma.tif")
    assert not stored(tmp_path / "sigma.tif")[0].any()
    assert result.reasons == ()


def test_uncertainty_beside_maps_is_refused(tmp_path):
    source = tile(tmp_path / "in.tif")
    rough = make_raster(tmp_path / "rough.tif", np.full(SHAPE, 0.1, np.float32))
    with pytest.raises(InputError, match="an uncertainty needs the method auto"):
        fill_file(source, tmp_path / "out.tif", uncertainty=tmp_path / "s.tif", maps={"r_s": rough})
