"""Reports as files: whole, self-contained, escaped, with the same numbers as their JSON."""

import json
import xml.etree.ElementTree as ET
from html.parser import HTMLParser

import numpy as np
import pytest

from demsmith.core.errors import Cancelled, OutputError
from demsmith.core.report import (
    Comparison,
    Facts,
    Note,
    Numbers,
    Report,
    Scene,
    Section,
    comparison_blocks,
    expected_error,
    reconstruction_report,
    striking_voids,
    table_of,
)
from demsmith.core.report.charts import bars, calibration, ramp, scatter, shares
from demsmith.core.report.markup import element
from demsmith.core.report.numbers import plain, written

pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

HOSTILE = (
    """</title></td><script>alert(1)</script><img src=x onerror="alert('2')">&amp;\u202e\x00"""
)
VOID_TAGS = {"meta", "img", "rect", "circle", "line", "polyline", "stop", "br"}


class Page(HTMLParser):
    """Every tag with its attributes, and the text; complains of tags that do not match."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.text, self._open = [], "", []
        self.feed(text)
        self.close()
        assert not self._open

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in VOID_TAGS:
            self._open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        self.text += data

    def all(self, name):
        return [attributes for tag, attributes in self.tags if tag == name]


COMPARISON = Comparison(
    classes=("1–16 cells", "> 16 cells"),
    rmse={"ours": [2.0, 9.0], "theirs": [3.0, float("nan")]},
    voids=(17, 3),
    bias={"ours": [-0.5, 0.1], "theirs": [0.2, 0.3]},
    nominal=(0.68, 0.95),
    held={"1–16 cells": [0.7, 0.94], "> 16 cells": [None, 0.9]},
)


def voids_of(count=40):
    return [
        {
            "id": number, "x": 10.0 + number, "y": 50.0, "cells": number, "area_m2": 900.0 * number,
            "rim_relief": None, "touches_edge": False, "method": HOSTILE,
            "expected_error": float(number),
        }
        for number in range(1, count + 1)
    ]  # fmt: skip


def report_of(*, progress=None, **more):
    source = np.zeros((60, 80), np.uint8)
    source[20:30, 20:40], source[40:45, 60:70] = 5, 2
    values = np.random.default_rng(0).normal(size=source.shape).cumsum(axis=0)
    scene = Scene(values, source, (30.0, 30.0), np.where(source, 3.0, np.nan))
    voids = voids_of()
    options = {} if progress is None else {"progress": progress}
    return reconstruction_report(
        facts={"Input": HOSTILE, HOSTILE: "out.tif"}, voids=voids,
        cells_by_source={0: 4550, 5: 200, 2: 50}, scene=scene,
        close_ups=[(voids[-1], scene.window_around((20, 30), (20, 40)))],
        warnings=[HOSTILE], faults=[{HOSTILE: HOSTILE, "cells": 3}],
        auxiliaries=[{"name": HOSTILE, "accepted": True, "shift_east_m": np.float64(1.25)}],
        options={"method": HOSTILE}, title=HOSTILE, **options, **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def written_report(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    report = report_of(validation=COMPARISON)
    report.write_html(folder / "report.html")
    report.write_json(folder / "report.json")
    page = Page((folder / "report.html").read_text(encoding="utf-8"))
    return page, json.loads((folder / "report.json").read_text(encoding="utf-8"))


def test_hostile_names_are_text(written_report):
    page, _ = written_report
    assert not page.all("script")
    assert all("onerror" not in attributes for _, attributes in page.tags)
    assert page.text.count("<script>alert(1)</script>") >= 8
    assert "\u202e" not in page.text and "\x00" not in page.text


def test_the_page_needs_nothing_else(written_report):
    page, _ = written_report
    for _, attributes in page.tags:
        for name in ("src", "href", "data", "srcset"):
            assert attributes.get(name, "data:").startswith(("data:", "#"))
    assert not page.all("link") and not page.all("iframe")
    assert len(page.all("style")) == 1
    assert "url(" not in page.text and "@import" not in page.text


def test_the_page_can_be_read_without_eyes(written_report):
    page, _ = written_report
    assert len(page.all("img")) == 6
    assert all(len(each["alt"]) > 20 for each in page.all("img"))
    drawings = [each for each in page.all("svg") if "aria-hidden" not in each]
    assert drawings and all(each["role"] == "img" for each in drawings)
    assert all(each.get("scope") in ("col", "row") for each in page.all("th"))
    assert page.all("html")[0]["lang"] == "en"
    assert len(page.all("h1")) == 1


def test_page_and_json_tell_the_same(written_report):
    page, data = written_report
    error = expected_error(voids_of())
    assert error == pytest.approx(np.sqrt(sum(n**3 for n in range(1, 41)) / 820))
    assert data["expected_error"] == pytest.approx(error)
    assert f"±\u00a0{written(error)}\u00a0m" in page.text
    assert data["cells_by_source"] == {
        "original": 4550, "void left as it was": 50, "interpolated by learned covariance": 200,
    }  # fmt: skip
    assert "80.0 %" in page.text and "20.0 %" in page.text
    assert [each["voids"] for each in data["expected_error_by_size"]] == [16, 24, 0, 0, 40]
    assert data["validation"]["rmse"] == {"ours": [2, 9], "theirs": [3, None]}
    assert data["auxiliaries"][0]["shift_east_m"] == 1.25
    assert len(data["void_table"]) == 40
    assert "25 largest of 40" in page.text


def test_an_unvoided_raster_has_a_report_too(tmp_path):
    source = np.zeros((5, 7), np.uint8)
    report = reconstruction_report(
        facts={"Input": "a.tif"}, voids=[], cells_by_source={0: 35},
        scene=Scene(np.zeros((5, 7)), source, (1.0, 1.0), np.zeros((5, 7))),
    )  # fmt: skip
    report.write_html(tmp_path / "a.html")
    page = Page((tmp_path / "a.html").read_text(encoding="utf-8"))
    assert "How wrong" not in page.text
    assert len(page.all("img")) == 4


def test_drawing_can_be_cancelled():
    class Cancelling:
        def __init__(self):
            self.seen = []

        def report(self, fraction):
            self.seen.append(fraction)

        def cancelled(self):
            return bool(self.seen) and self.seen[-1] > 0.3

    with pytest.raises(Cancelled):
        report_of(progress=Cancelling())


def test_files_are_not_overwritten_unasked(tmp_path):
    report = Report("a", "b", [Section("c", [Note("d")])], {"e": float("inf")})
    path = tmp_path / "a.html"
    report.write_html(path)
    with pytest.raises(OutputError, match="exists already"):
        report.write_html(path)
    with pytest.raises(OutputError, match="no folder"):
        report.write_json(tmp_path / "none" / "a.json")
    report.write_json(tmp_path / "a.json")
    assert json.loads((tmp_path / "a.json").read_text()) == {"e": None}
    before = path.read_text()
    broken = Report("a", "b", [object()], {"e": 1})
    with pytest.raises(AttributeError):
        broken.write_html(path, overwrite=True)
    assert path.read_text() == before
    assert sorted(part.name for part in tmp_path.iterdir()) == ["a.html", "a.json"]


def test_names_that_are_no_text_do_not_stop_a_report(tmp_path):
    name = b"a\xff.tif".decode("utf-8", "surrogateescape")
    report = Report(name, name, [Section(name, [Facts({name: name})])], {"input": name})
    report.write_html(tmp_path / "a.html")
    report.write_json(tmp_path / "a.json")
    assert "a" in Page((tmp_path / "a.html").read_text(encoding="utf-8")).text
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))["input"] == "a?.tif"


# --- charts and tables ---------------------------------------------------------------------------


def shapes(drawing, name):
    tree = ET.fromstring(f"<p>{drawing}</p>".replace(' xmlns="http://www.w3.org/2000/svg"', ""))
    return [each.attrib for each in tree.iter(name)]


def test_bars_are_as_high_as_their_values():
    drawing = bars(["a", "b"], {"x": [1, 4], "y": [2, None]}, unit="m", description="d")
    drawn = [each for each in shapes(drawing, "rect") if "x" in each]
    heights = [float(each["height"]) for each in drawn]
    np.testing.assert_allclose(np.array(heights) / heights[0], [1, 2, 4], rtol=1e-4)
    bases = {round(float(each["y"]) + float(each["height"]), 2) for each in drawn}
    assert len(bases) == 1


def test_scatter_has_every_point_and_higher_is_worse():
    drawing = scatter(
        {"m": ([1, 10, 100], [1.0, 2.0, 30.0], "#000000")}, across="cells", up="e", unit="m",
        description="d",
    )  # fmt: skip
    dots = shapes(drawing, "circle")
    y = [float(each["cy"]) for each in dots]
    assert len(dots) == 3 and y == sorted(y, reverse=True)


def test_calibrated_points_lie_on_the_line():
    drawing = calibration([0.5, 0.9], {"a": [0.5, 0.9], "b": [None, 0.5]}, description="d")
    diagonal = np.array(
        [corner.split(",") for corner in shapes(drawing, "polyline")[0]["points"].split()], float
    )
    dots = [(float(each["cx"]), float(each["cy"])) for each in shapes(drawing, "circle")]
    (x0, y0), (x1, y1) = diagonal
    off = [(x - x0) / (x1 - x0) - (y - y0) / (y1 - y0) for x, y in dots]
    assert off[:2] == pytest.approx([0, 0], abs=1e-3)
    assert len(off) == 3 and off[2] == pytest.approx(0.4, abs=1e-3)  # held less than promised


def test_shares_fill_the_bar():
    drawing = shares([("a", 30, "#111111"), ("b", 10, "#222222")], description="d")
    widths = [float(each["width"]) for each in shapes(drawing, "rect")[:2]]
    assert widths[0] == pytest.approx(3 * widths[1], rel=1e-4)
    assert "a: 75.0 %" in drawing


def test_charts_of_nothing_are_drawn():
    assert shapes(bars([], {}, unit="m", description="d"), "svg")
    assert shapes(bars(["a"], {"x": [None]}, unit="m", description="d"), "svg")
    assert shapes(bars(["a"], {"x": [0.0]}, unit="m", description="d"), "svg")
    assert shapes(shares([], description="d"), "svg")
    assert shapes(ramp([(0, (0, 0, 0)), (1, (255, 0, 0))], 0, 5, "m"), "stop")


def test_the_best_of_each_class_is_marked():
    table = comparison_blocks(COMPARISON)[1]
    assert table.best == {(0, "1–16 cells"), (0, "> 16 cells")}
    bias = comparison_blocks(COMPARISON)[2]
    assert bias.best == {(1, "1–16 cells"), (0, "> 16 cells")}
    assert "★ <strong>2.00</strong>" in table.markup()
    assert table.rows[2] == {"method": "(voids)", "1–16 cells": 17, "> 16 cells": 3}
    held = comparison_blocks(COMPARISON)[4].markup()
    assert "68 % interval" in held and "94.0" in held


def test_table_aligns_numbers_and_dashes_what_is_missing():
    markup = table_of([{"a": 1.0, "b": "x"}, {"a": None, "b": True}]).markup()
    assert '<td class="number">–</td>' in markup
    assert "<td>yes</td>" in markup
    assert Numbers([("Voids", "3", None)]).markup().count("<dd") == 1


def test_striking_voids_are_the_largest_then_the_most_uncertain():
    voids = [{"cells": n, "expected_error": e} for n, e in ((5, 1), (9, 2), (1, 9), (2, 8), (3, 0))]
    assert striking_voids(voids, largest=2, uncertain=2) == [1, 0, 2, 3]
    assert striking_voids([]) == []


def test_elements_and_numbers():
    assert element("p", None, ["a", 2, element("b", "<")]) == "<p>a2<b>&lt;</b></p>"
    assert element("img", alt='"<') == '<img alt="&quot;&lt;"/>'
    assert written({"a": [1, None]}) == "a 1, –"
    assert written(-0.5) == "−0.500" and written(1e-9) == "0.000000"
    assert written(float("-inf")) == "−∞"
    assert plain({1: np.arange(2), "b": np.float32("nan"), "c": {1}}) == {
        "1": [0, 1], "b": None, "c": "{1}",
    }  # fmt: skip
