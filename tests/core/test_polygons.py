"""Outlines of voids: on the cells' edges, whole, with holes; as a layer with attributes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from support import WGS84_3ARC

from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.raster import Grid, polygons_of, write_polygons
from demsmith.core.voids import fill_voids, find_voids
from demsmith.core.voids.table import tabulate

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
from osgeo import ogr  # noqa: E402

UTM31 = "EPSG:32631"


def grid_of(void, crs=UTM31):
    return Grid(void.shape, (500_000.0, 30.0, 0.0, 4_700_000.0, 0.0, -20.0), crs)


def outlines(void, grid):
    wkbs = polygons_of(find_voids(void), grid)
    # An exported polygon has to outlive its bytes.
    return [ogr.CreateGeometryFromWkb(wkb) for wkb in wkbs]


def columns_of(voids):
    count = len(voids)
    return {
        "id": np.arange(1, count + 1),
        "cells": voids.cells,
        "error": np.where(np.arange(count) == 0, np.nan, 2.5),
        "edge": np.arange(count) % 2 == 0,
        "method": np.array(["<b>blend</b>"] * count),
    }


def features(path):
    dataset = gdal.OpenEx(str(path), gdal.OF_VECTOR)
    layer = dataset.GetLayer(0)
    found = [feature.Clone() for feature in layer]
    reference = layer.GetSpatialRef().Clone()
    layer = dataset = None
    return found, reference


def test_a_ring_of_cells_is_a_polygon_with_a_hole():
    void = np.zeros((7, 9), bool)
    void[1:6, 2:7] = True
    void[3, 4] = False
    (polygon,) = outlines(void, grid_of(void))
    assert polygon.GetGeometryCount() == 2
    hole = polygon.GetGeometryRef(1)
    assert hole.GetEnvelope() == (500_120, 500_150, 4_699_920, 4_699_940)
    assert polygon.GetEnvelope() == (500_060, 500_210, 4_699_880, 4_699_980)


def test_touching_corners_stay_two_voids_and_one_void_may_touch_itself():
    void = np.array([[1, 0], [0, 1]], bool)
    assert len(outlines(void, grid_of(void))) == 2
    pinched = np.array([[1, 1, 1], [1, 0, 1], [0, 1, 1]], bool)  # hole's corner on the outline
    (polygon,) = outlines(pinched, grid_of(pinched))
    assert polygon.IsValid()
    assert polygon.GetArea() == 7 * 600


def test_many_and_far_voids_are_outlined_in_groups(monkeypatch):
    void = np.random.default_rng(5).random((40, 50)) < 0.3
    void[:, 20] = True  # one void as high as the raster
    whole = [polygon.ExportToWkt() for polygon in outlines(void, grid_of(void))]
    monkeypatch.setattr("demsmith.core.raster.polygons._MOST_VOIDS", 7)
    monkeypatch.setattr("demsmith.core.raster.polygons._MOST_CELLS", 60)
    assert [polygon.ExportToWkt() for polygon in outlines(void, grid_of(void))] == whole


@given(void=arrays(bool, st.tuples(st.integers(1, 14), st.integers(1, 14))))
def test_polygons_cover_just_the_cells_of_their_voids(void):
    voids = find_voids(void)
    grid = grid_of(void)
    polygons = outlines(void, grid)
    assert [polygon.GetArea() for polygon in polygons] == (voids.cells * 600.0).tolist()
    for number, polygon in enumerate(polygons, start=1):
        assert polygon.IsValid()
        covered = np.zeros(void.shape, bool)
        for row, column in np.ndindex(void.shape):
            centre = ogr.CreateGeometryFromWkt("POINT ({} {})".format(*grid.xy(row, column)))
            covered[row, column] = polygon.Contains(centre)
        np.testing.assert_array_equal(covered, voids.labels == number)


@pytest.mark.parametrize("extension", ["gpkg", "geojson"])
def test_layer_has_geometry_and_attributes(tmp_path, extension):
    void = np.zeros((20, 30), bool)
    void[2:5, 3:9] = void[10, 12] = void[15:, 25:] = True
    voids = find_voids(void)
    path = write_polygons(tmp_path / f"voids.{extension}", voids, grid_of(void), columns_of(voids))
    found, reference = features(path)
    assert reference.GetAuthorityCode(None) == "32631"
    assert [feature.GetField("id") for feature in found] == [1, 2, 3]
    assert [feature.GetField("cells") for feature in found] == [18, 1, 25]
    assert [feature.GetField("error") for feature in found] == [None, 2.5, 2.5]
    assert [feature.GetField("edge") for feature in found] == [1, 0, 1]
    assert found[0].GetField("method") == "<b>blend</b>"
    definition = found[0].GetFieldDefnRef("edge")
    assert (definition.GetType(), definition.GetSubType()) == (ogr.OFTInteger, ogr.OFSTBoolean)
    assert [feature.GetGeometryRef().GetArea() for feature in found] == [10800, 600, 15000]
    assert [part.name for part in tmp_path.iterdir()] == [f"voids.{extension}"]


def test_the_table_of_a_fill_is_a_layer(tmp_path):
    rng = np.random.default_rng(3)
    values = np.add.outer(np.arange(50.0), np.arange(60.0)) + rng.normal(size=(50, 60))
    void = rng.random(values.shape) < 0.1
    grid = Grid(values.shape, WGS84_3ARC, "EPSG:4326")
    filled = fill_voids(values, void, pixel_size=grid.pixel_size_m())
    from demsmith.core.raster import BandMeta

    table = tabulate(filled, grid, BandMeta(dtype=values.dtype))
    path = write_polygons(tmp_path / "voids.gpkg", filled.voids, grid, vars(table))
    found, _ = features(path)
    assert len(found) == len(table)
    for row, feature in zip(table.rows(), found, strict=True):
        x, y = row["x"], row["y"]
        assert feature.GetGeometryRef().Contains(ogr.CreateGeometryFromWkt(f"POINT ({x} {y})"))
        assert {name: feature.GetField(name) for name in row} == row


def test_south_up_and_no_voids(tmp_path):
    void = np.zeros((4, 4), bool)
    path = write_polygons(
        tmp_path / "none.gpkg", find_voids(void), grid_of(void), columns_of(find_voids(void))
    )
    assert features(path)[0] == []
    void[0, 1] = True
    (polygon,) = outlines(void, Grid((4, 4), (0.0, 1.0, 0.0, 10.0, 0.0, 2.0)))
    assert polygon.GetEnvelope() == (1, 2, 10, 12)


class CancelAt:
    def __init__(self, fraction):
        self.fraction, self.seen = fraction, 0.0

    def report(self, fraction):
        self.seen = fraction

    def cancelled(self):
        return self.seen >= self.fraction


def test_cancelled_writing_leaves_the_old_file(tmp_path):
    void = np.zeros((120, 120), bool)
    void[::2, ::2] = True
    voids = find_voids(void)
    path = tmp_path / "voids.gpkg"
    path.write_text("old")
    with pytest.raises(Cancelled):
        write_polygons(
            path, voids, grid_of(void), columns_of(voids), overwrite=True, progress=CancelAt(0.5)
        )
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_refused_outputs(tmp_path):
    void = np.ones((2, 2), bool)
    voids, grid = find_voids(void), grid_of(void)
    with pytest.raises(InputError, match=r"shapefile.*\.gpkg"):
        write_polygons(tmp_path / "a.shp", voids, grid, {})
    with pytest.raises(InputError, match="must end in one of .gpkg, .geojson$"):
        write_polygons(tmp_path / "a.csv", voids, grid, {})
    with pytest.raises(InputError, match="'cells' must have a value for each of 1 voids"):
        write_polygons(tmp_path / "a.gpkg", voids, grid, {"cells": [1, 2]})
    with pytest.raises(InputError, match="EPSG code; write .gpkg"):
        write_polygons(tmp_path / "a.geojson", voids, grid_of(void, ""), {})
    with pytest.raises(OutputError, match="no folder"):
        write_polygons(tmp_path / "none" / "a.gpkg", voids, grid, {})
    assert not list(tmp_path.iterdir())
    write_polygons(tmp_path / "a.gpkg", voids, grid, {})
    with pytest.raises(OutputError, match="exists already"):
        write_polygons(tmp_path / "a.gpkg", voids, grid, {})
