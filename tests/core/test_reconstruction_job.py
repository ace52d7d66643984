"""Reconstruction from file to file: outputs, neighbours, and all or nothing."""

import json
import os

import numpy as np
import pytest
from scenes import fractal, plane
from support import WGS84_3ARC, digest, make_raster, shared_data

import demsmith
from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.progress import SILENT
from demsmith.core.reconstruction import ReconstructOptions
from demsmith.core.voids.sources import FILLED, LEFT, NEIGHBOUR, ORIGINAL, auxiliary_code

GRID = raster.Grid((120, 150), WGS84_3ARC, "EPSG:4326")
OPTIONS = ReconstructOptions(method="mcmd", outliers=False, flat_water=False)
GROUND = fractal((120, 150)).astype(np.int16)


def write_part(path, rows, columns, values=GROUND, *, voids=(), **how):
    part = values[rows, columns].copy()
    for box in voids:
        part[slice(*box[:2]), slice(*box[2:])] = -32768
    grid = GRID.part(rows, columns)
    how = dict(geotransform=grid.geotransform, nodata=-32768) | how
    return make_raster(path, part, **how)


@pytest.fixture
def west(tmp_path):
    """The western part, with voids inside, over its eastern edge and along its southern one."""
    return write_part(
        tmp_path / "west.tif", slice(0, 80), slice(0, 80),
        voids=[(10, 20, 10, 20), (40, 50, 70, 80), (79, 80, 20, 40)],
    )  # fmt: skip


@pytest.fixture
def beside(tmp_path):
    """A folder with the tiles to the east and south, which share a column and a row with it."""
    folder = tmp_path / "beside"
    folder.mkdir()
    write_part(folder / "east.tif", slice(0, 80), slice(79, 150), voids=[(42, 48, 0, 5)])
    write_part(folder / "south.tif", slice(79, 120), slice(0, 80))
    return folder


def test_all_outputs(tmp_path, west):
    ogr = pytest.importorskip("osgeo.ogr", reason="GDAL is missing")
    before = digest(west)
    names = dict(source_map="source.tif", voids_layer="voids.gpkg", report="report.html")
    paths = {name: str(tmp_path / file) for name, file in names.items()}
    result = demsmith.reconstruct_file(west, tmp_path / "out.tif", options=OPTIONS, **paths)
    assert digest(west) == before
    made = raster.read(result.output)
    void = raster.read(west).void
    assert not made.void.any()
    assert made.values.dtype == np.int16
    np.testing.assert_array_equal(made.values[~void], GROUND[:80, :80][~void])
    sources = raster.read(result.source_map).values
    np.testing.assert_array_equal(sources, np.where(void, FILLED, ORIGINAL))
    layer = ogr.Open(result.voids_layer)
    assert layer.GetLayer(0).GetFeatureCount() == 3
    assert json.loads((tmp_path / "report.json").read_text())["void_table"][0]["cells"] == 100
    assert "<html" in (tmp_path / "report.html").read_text()
    assert (result.voids, result.cells_void, result.cells_filled) == (3, 220, 220)
    assert (result.cells_unfilled, result.largest_void, result.warnings) == (0, 100, ())
    assert json.loads(json.dumps(result.as_dict()))["cells_by_source"] == {
        "original": 6180, "interpolated by MCMD": 220,
    }  # fmt: skip


def test_voids_as_geojson_where_it_can_tell_the_crs(tmp_path, west):
    path = tmp_path / "voids.geojson"
    demsmith.reconstruct_file(west, tmp_path / "out.tif", options=OPTIONS, voids_layer=path)
    assert len(json.loads(path.read_text())["features"]) == 3
    nowhere = make_raster(tmp_path / "nowhere.tif", GROUND, crs="")
    with pytest.raises(InputError, match="cannot tell a CRS"):
        demsmith.reconstruct_file(
            nowhere, tmp_path / "o.tif", options=OPTIONS, voids_layer=tmp_path / "v.geojson"
        )


def test_uncertainty_is_of_filled_cells(tmp_path, west):
    path = tmp_path / "sigma.tif"
    demsmith.reconstruct_file(
        west, tmp_path / "out.tif", uncertainty=path,
        options=ReconstructOptions(outliers=False, interior_only=True),
    )  # fmt: skip
    sigma, void = raster.read(path), raster.read(west).void
    left = raster.read(tmp_path / "out.tif").void
    assert sigma.values.dtype == np.float32
    np.testing.assert_array_equal(sigma.void, left)
    assert (sigma.values[~void] == 0).all()
    assert (sigma.values[void & ~left] > 0).all()


def test_neighbours_fill_the_edges(tmp_path, west, beside):
    result = demsmith.reconstruct_file(
        west, tmp_path / "out.tif", options=OPTIONS, neighbours=beside,
        source_map=tmp_path / "source.tif",
    )  # fmt: skip
    made = raster.read(result.output)
    sources = raster.read(result.source_map).values
    assert [os.path.basename(path) for path in result.neighbours] == ["east.tif", "south.tif"]
    np.testing.assert_array_equal(made.values[79, 20:40], GROUND[79, 20:40])
    assert (sources[79, 20:40] == NEIGHBOUR).all()
    # Of the shared column, the eastern tile knows all but six cells.
    assert (sources[40:50, 79] == NEIGHBOUR).sum() == 4
    assert (sources[40:50, 70:79] == FILLED).all()
    alone = demsmith.reconstruct_file(west, tmp_path / "alone.tif", options=OPTIONS)
    truth = GROUND[40:50, 70:80].astype(float)
    error, blind = (
        np.abs(raster.read(path).values[40:50, 70:80] - truth).mean()
        for path in (result.output, alone.output)
    )
    assert error < 0.8 * blind
    assert "neighbouring tile" in result.cells_by_source
    inside = result.table.row[0], result.table.column[0]
    assert inside == (10, 10)


def test_shared_edges_agree_when_one_tile_follows_the_other(tmp_path, west, beside):
    made = tmp_path / "made"
    made.mkdir()
    demsmith.reconstruct_file(
        west, made / "west.tif", options=OPTIONS, neighbours=beside, source_map=None
    )
    demsmith.reconstruct_file(
        beside / "east.tif", tmp_path / "east.tif", options=OPTIONS, neighbours=made
    )
    np.testing.assert_array_equal(
        raster.read(made / "west.tif").values[:, 79],
        raster.read(tmp_path / "east.tif").values[:, 0],
    )


def test_what_is_no_neighbour_is_told(tmp_path, west, beside):
    write_part(beside / "copy.tif", slice(0, 80), slice(0, 80))
    write_part(beside / "far.tif", slice(0, 80), slice(0, 80), geotransform=(90, 1, 0, 9, 0, -1))
    (beside / "broken.tif").write_bytes(b"nothing")
    result = demsmith.reconstruct_file(
        west, tmp_path / "out.tif", options=OPTIONS, neighbours=beside
    )
    assert len(result.neighbours) == 2
    told = " ".join(result.warnings)
    assert all(name in told for name in ("copy.tif", "broken.tif", "far.tif"))
    lonely = tmp_path / "lonely"
    lonely.mkdir()
    write_part(lonely / "distant.tif", slice(0, 5), slice(0, 5), geotransform=(
        90.0, 1 / 1200, 0, 50.0, 0, -1 / 1200))  # fmt: skip
    result = demsmith.reconstruct_file(
        west, tmp_path / "out2.tif", options=OPTIONS, neighbours=lonely
    )
    assert "no neighbour" in result.warnings[-1]
    alone = demsmith.reconstruct_file(west, tmp_path / "alone.tif", options=OPTIONS)
    assert digest(result.output) == digest(alone.output)


def test_scaled_bands(tmp_path):
    stored = (GROUND[:80, :80].astype(np.int32) * 10 + 7).astype(np.int32)
    stored[10:20, 10:20] = -32768

    def scale(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(-0.7)

    path = make_raster(tmp_path / "dm.tif", stored, nodata=-32768, setup=scale)
    result = demsmith.reconstruct_file(path, tmp_path / "out.tif", options=OPTIONS)
    made = raster.read(result.output)
    assert (made.meta.scale, made.meta.offset, made.meta.dtype) == (0.1, -0.7, np.int32)
    truth = GROUND[10:20, 10:20]
    assert np.abs(made.meta.real(made.values[10:20, 10:20]) - truth).max() < 100
    known = ~raster.read(path).void
    np.testing.assert_array_equal(made.values[known], stored[known])


def in_feet(dataset):
    dataset.GetRasterBand(1).SetUnitType("ft")


def test_an_outliers_height_is_in_metres_whatever_the_unit(tmp_path):
    values = plane((60, 60)).astype(np.float32)
    values[20, 20] += 20
    values[40, 40] += 50
    kept = []
    for unit in ("m", "ft"):
        setup = in_feet if unit == "ft" else None
        path = make_raster(tmp_path / f"{unit}.tif", values, setup=setup)
        made = demsmith.reconstruct_file(
            path, tmp_path / f"out_{unit}.tif", options=ReconstructOptions(method="mcmd")
        )
        made = raster.read(made.output).values
        kept.append([bool(made[at] == values[at]) for at in ((20, 20), (40, 40))])
    assert kept == [[False, False], [True, False]]


@pytest.fixture
def pair(tmp_path):
    """A raster in feet with a void, the ground in feet, and an auxiliary 10 m above it."""
    truth = fractal((260, 260), exponent=1.7, relief=2000).astype(np.float32)
    holed = truth.copy()
    holed[90:130, 100:150] = -9999
    target = make_raster(tmp_path / "feet.tif", holed, nodata=-9999, setup=in_feet)

    def in_metres(unknown=np.s_[:0]):
        values = truth * np.float32(0.3048) + 10
        values[unknown] = -9999
        return make_raster(
            tmp_path / "metres.tif", values, nodata=-9999,
            setup=lambda dataset: dataset.GetRasterBand(1).SetUnitType("m"),
        )  # fmt: skip

    return target, truth, in_metres


def test_an_auxiliary_in_another_unit(tmp_path, pair):
    target, truth, in_metres = pair
    result = demsmith.reconstruct_file(
        target, tmp_path / "out.tif", auxiliaries=[in_metres()], source_map=tmp_path / "source.tif"
    )
    assert np.abs(raster.read(result.output).values - truth).max() < 1
    assert abs(result.auxiliaries[0]["bias"] - 10) < 0.1
    assert (raster.read(result.source_map).values[90:130, 100:150] == auxiliary_code(1)).all()


def test_an_auxiliary_that_ends_within_a_void_is_used_as_far_as_it_goes(tmp_path, pair):
    target, truth, in_metres = pair
    result = demsmith.reconstruct_file(
        target, tmp_path / "out.tif", auxiliaries=[in_metres(np.s_[:, 135:])],
        source_map=tmp_path / "source.tif",
    )  # fmt: skip
    codes = raster.read(result.source_map).values[90:130, 100:150]
    assert (codes[:, :35] == auxiliary_code(1)).all()
    assert (codes[:, 35:] < auxiliary_code(1)).all()
    error = raster.read(result.output).values - truth
    assert np.abs(error[90:130, 100:125]).mean() < 5


def test_what_an_auxiliary_does_not_know_meets_what_it_does(tmp_path, pair):
    target, truth, in_metres = pair
    result = demsmith.reconstruct_file(
        target, tmp_path / "out.tif", auxiliaries=[in_metres(np.s_[106:114, 110:140])]
    )
    alone = demsmith.reconstruct_file(target, tmp_path / "alone.tif")
    middle = np.s_[107:113, 111:139]
    error, blind = (
        np.abs(raster.read(each.output).values - truth)[middle].mean() for each in (result, alone)
    )
    assert error < 0.5 * blind


def test_left_voids_stay_nodata(tmp_path, west):
    options = ReconstructOptions(method="mcmd", max_size=50, outliers=False)
    result = demsmith.reconstruct_file(
        west, tmp_path / "out.tif", options=options, source_map=tmp_path / "source.tif"
    )
    np.testing.assert_array_equal(
        raster.read(result.output).void, raster.read(result.source_map).values == LEFT
    )
    assert result.cells_unfilled == 200


def test_no_voids(tmp_path):
    path = write_part(tmp_path / "full.tif", slice(0, 40), slice(0, 40))
    result = demsmith.reconstruct_file(path, tmp_path / "out.tif", options=OPTIONS)
    assert result.voids == 0
    assert "has no voids" in result.warnings[0]


@pytest.mark.parametrize(
    ("how", "said"),
    [
        (dict(report="report.txt"), "must end in one of .html, .json"),
        (dict(source_map="out.tif"), "different files"),
        (dict(voids_layer="voids.shp"), "shapefile"),
        (dict(source_map="source.png"), "GeoTIFF"),
        (dict(below=99999), "every cell is a void"),
        (dict(band=3), "band 3"),
        (dict(uncertainty="sigma.tif"), "an uncertainty needs the method auto"),
        (dict(neighbours="nowhere"), "nowhere"),
        (dict(auxiliaries=["a.tif"]), "an auxiliary needs the method auto"),
        (dict(auxiliaries=["a.tif"] * 10, options=ReconstructOptions()), "at most 9"),
        (dict(options=ReconstructOptions(max_size=0)), "max_size is 0"),
    ],
)
def test_refused(tmp_path, west, how, said):
    folder = tmp_path / "out"
    folder.mkdir()
    how = {name: folder / value if isinstance(value, str) else value for name, value in how.items()}
    with pytest.raises((InputError, OutputError), match=said):
        demsmith.reconstruct_file(west, folder / "out.tif", **{"options": OPTIONS, **how})
    assert os.listdir(folder) == []


def test_cancelled_run_leaves_nothing(tmp_path, west):
    class Late:
        def report(self, fraction):
            self.fraction = fraction

        def cancelled(self):
            return getattr(self, "fraction", 0) > 0.9

    folder = tmp_path / "out"
    folder.mkdir()
    with pytest.raises(Cancelled):
        demsmith.reconstruct_file(
            west, folder / "out.tif", options=OPTIONS, source_map=folder / "source.tif",
            progress=Late(),
        )  # fmt: skip
    assert os.listdir(folder) == []
    demsmith.reconstruct_file(west, folder / "out.tif", options=OPTIONS, progress=SILENT)


def test_real_neighbours(tmp_path):
    folder = tmp_path / "tiles"
    folder.mkdir()
    for name in ("pyrenees_raw/N42E001.hgt", "catalonia_raw/N41E001.hgt"):
        os.symlink(shared_data(name), folder / os.path.basename(name))
    result = demsmith.reconstruct_file(
        folder / "N42E001.hgt", tmp_path / "out.tif", neighbours=folder,
        options=ReconstructOptions(method="mcmd"),
    )  # fmt: skip
    assert [os.path.basename(path) for path in result.neighbours] == ["N41E001.hgt"]
    assert result.cells_unfilled == 0
    np.testing.assert_array_equal(
        raster.read(result.output).values[-1], raster.read(folder / "N41E001.hgt").values[0]
    )
