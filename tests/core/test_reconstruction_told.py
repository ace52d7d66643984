"""What a reconstruction tells of its work: removed cells, reasons, auxiliaries."""

import json
from html.parser import HTMLParser

import numpy as np
import pytest
from scenes import fractal, holed
from support import WGS84_3ARC, make_raster

import demsmith
from demsmith.core import raster
from demsmith.core.raster import BandMeta, Grid, Raster
from demsmith.core.reconstruction import ReconstructOptions, removed
from demsmith.core.reconstruction.removed import largest_changes, removed_cells

FAST = ReconstructOptions(method="mcmd")
SPIKE, WELL = (30, 40), (60, 90)


@pytest.fixture(scope="module")
def ground():
    """Ground with a void, a spike and a well."""
    values = fractal((100, 120)).astype(np.int16) + 500
    values[SPIKE] += 900
    values[WELL] -= 400
    values[20:24, 60:70] = -32768
    return values


def rows_of(page):
    """The texts of all tables' rows."""

    class Rows(HTMLParser):
        def __init__(self):
            super().__init__()
            self.rows = []

        def handle_starttag(self, tag, attributes):
            if tag == "tr":
                self.rows.append([])
            elif tag in ("td", "th") and self.rows:
                self.rows[-1].append("")

        def handle_data(self, data):
            if self.rows and self.rows[-1]:
                self.rows[-1][-1] += data

    parser = Rows()
    parser.feed(page)
    return parser.rows


def test_every_removed_cell_is_listed(tmp_path, ground):
    path = make_raster(tmp_path / "dem.tif", ground, nodata=-32768)
    result = demsmith.reconstruct_file(
        path, tmp_path / "out.tif", options=FAST, report=tmp_path / "r.html"
    )
    made = raster.read(result.output)
    told = json.loads((tmp_path / "r.json").read_text())
    x, step, _, y, *_ = WGS84_3ARC
    for listed, (row, column), reason in zip(
        told["removed_cells"], (SPIKE, WELL), ("spike", "well"), strict=True
    ):
        assert (listed["row"], listed["column"], listed["reason"]) == (row, column, reason)
        assert listed["x"] == pytest.approx(x + (column + 0.5) * step)
        assert listed["y"] == pytest.approx(y - (row + 0.5) * step)
        assert (listed["before"], listed["after"]) == (
            ground[row, column],
            made.values[row, column],
        )
    assert [row["cells"] for row in told["faults"]] == [1, 1]
    assert result.cells_faulty == 2
    shown = [row for row in rows_of((tmp_path / "r.html").read_text()) if row[-1] == "spike"]
    assert [row[:2] for row in shown] == [["30", "40"]]


def test_cells_at_rims_are_told_apart_from_outliers(tmp_path, ground):
    path = make_raster(tmp_path / "dem.tif", ground, nodata=-32768)
    options = ReconstructOptions(method="mcmd", erode=1)
    report = tmp_path / "r.json"
    demsmith.reconstruct_file(path, tmp_path / "out.tif", options=options, report=report)
    told = json.loads(report.read_text())
    reasons = [row["reason"] for row in told["removed_cells"]]
    # Around the void 6 by 12 less 4 by 10, and around both outliers.
    assert {each: reasons.count(each) for each in set(reasons)} == {
        "spike": 1, "well": 1, "rim of a void": 32 + 8 + 8,
    }  # fmt: skip


def test_a_mosaic_lists_them_with_their_tiles(tmp_path, ground):
    tiles = tmp_path / "tiles"
    tiles.mkdir()
    x, step, _, y, *_ = WGS84_3ARC
    for name, left, right in (("west", 0, 70), ("east", 70, 120)):
        make_raster(
            tiles / f"{name}.tif", ground[:, left:right], nodata=-32768,
            geotransform=(x + left * step, step, 0, y, 0, -step),
        )  # fmt: skip
    result = demsmith.reconstruct_mosaic(tiles, tmp_path / "out", options=FAST, workers=0)
    told = json.loads((tmp_path / "out" / "mosaic.json").read_text())
    found = [(row["tile"], row["row"], row["column"]) for row in told["removed_cells"]]
    assert found == [("west.tif", *SPIKE), ("east.tif", WELL[0], WELL[1] - 70)]
    assert result.cells_faulty == 2


def test_lists_are_bounded_and_begin_with_the_largest_change(monkeypatch):
    monkeypatch.setattr(removed, "MOST", 3)
    before = np.arange(20.0).reshape(4, 5)
    own = Raster(before, np.zeros((4, 5), bool), Grid((4, 5)), BandMeta(np.dtype(float), scale=2.0))
    found = removed_cells(own, np.zeros((4, 5)), before > 9, np.array([[3, 4]]))
    assert found.counts() == {"rim of a void": 9, "spike": 1}
    rows = found.rows(own.grid)
    assert [row["before"] for row in rows] == [38, 36, 34]
    assert [row["reason"] for row in rows] == ["spike", "rim of a void", "rim of a void"]
    assert [row["before"] for row in largest_changes([rows[1:], rows[:2]])] == [38, 36, 36]


def test_water_and_refused_auxiliaries_are_reasons(tmp_path):
    rising = np.clip((np.arange(200) - 80) / 60, 0, 1)  # a lake, and hills beyond it
    values = (10 + rising * fractal((200, 200), exponent=1.7)).astype(np.float32)
    void = holed(values.shape, (50, 60, 30, 40), (100, 112, 130, 150))
    target = make_raster(tmp_path / "t.tif", np.where(void, -9999, values), nodata=-9999)
    others = [
        make_raster(tmp_path / "other.tif", fractal((200, 200), seed=5)),
        make_raster(tmp_path / "noise.tif", np.random.default_rng(0).normal(0, 9, (200, 200))),
        make_raster(tmp_path / "good.tif", values + 3),
    ]
    result = demsmith.reconstruct_file(
        target, tmp_path / "out.tif", auxiliaries=others, report=tmp_path / "r.html"
    )
    lake, hill = result.table.reason
    assert result.cells_by_source["water held flat"] == 100
    assert lake == "Nearly all of its rim is level water."
    told = [hill.find(f"auxiliary {number}: ") for number in (1, 2, 3)]
    assert told[0] == 0 and told == sorted(told)
    assert "auxiliary 3: It was used." in hill
    page = rows_of((tmp_path / "r.html").read_text())
    header, first, *_ = [row for row in page if row[0] in ("Auxiliary", "auxiliary 1")]
    for title in ("Tilt east [m/km]", "Vertical scale", "Blur north [m]", "Correlation"):
        assert title in header
    assert len(first) == len(header)
    assert all(first)
