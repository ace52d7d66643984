"""From file to file: the table, the report, and the uncertainty."""

import json

import numpy as np
import pytest
from scenes import disc, fractal, holed
from support import WGS84_3ARC, make_raster
from void_files import SHAPE, VOID, stored, tile

from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.voids import FillOptions, fill_file, fill_voids

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
