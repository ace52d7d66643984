"""Tables without geometry: written as text and as layers."""

import csv
import os

import numpy as np
import pytest
from support import make_raster

from demsmith.core.errors import InputError, OutputError
from demsmith.core.raster import check_rows_output, write_rows

ROWS = [
    {"name": "a, b", "count": 3, "share": 0.1, "limit": None},
    {"name": "ü", "count": 4, "share": None, "limit": 17},
]


def test_text_keeps_every_value(tmp_path):
    path = write_rows(tmp_path / "rows.csv", ROWS)
    with open(path, encoding="utf-8", newline="") as file:
        assert list(csv.reader(file)) == [
            ["name", "count", "share", "limit"], ["a, b", "3", "0.1", ""], ["ü", "4", "", "17"],
        ]  # fmt: skip


@pytest.mark.parametrize("kind", ["gpkg", "geojson"])
def test_layers_keep_every_value_and_type(tmp_path, kind):
    ogr = pytest.importorskip("osgeo.ogr", reason="GDAL is missing")
    source = ogr.Open(write_rows(tmp_path / f"rows.{kind}", ROWS))
    layer = source.GetLayer(0)
    rows = [{name: row.GetField(name) for name in ROWS[0]} for row in layer]
    assert rows == ROWS
    assert isinstance(rows[0]["count"], int) and isinstance(rows[0]["share"], float)
    assert all(row.GetGeometryRef() is None for row in source.GetLayer(0))


def test_an_existing_file_is_replaced_only_if_allowed(tmp_path):
    path = tmp_path / "rows.csv"
    path.write_text("precious")
    with pytest.raises(OutputError, match="exists already"):
        write_rows(path, ROWS)
    assert path.read_text() == "precious"
    write_rows(path, ROWS, overwrite=True)
    assert path.read_text(encoding="utf-8").startswith("name,")
    assert os.listdir(tmp_path) == ["rows.csv"]


def test_bad_places_are_refused(tmp_path):
    with pytest.raises(InputError, match="must end in one of"):
        check_rows_output(tmp_path / "rows.xls")
    with pytest.raises(OutputError, match="there is no folder"):
        check_rows_output(tmp_path / "none" / "rows.csv")
    source = make_raster(tmp_path / "dem.gpkg", np.ones((9, 9), np.int16), driver="GPKG")
    with pytest.raises(InputError, match="is an input"):
        check_rows_output(source, inputs=[source], overwrite=True)
