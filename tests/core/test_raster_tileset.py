"""Tiles of one grid read as one raster, and windows of single files."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import WGS84_3ARC, hills, make_raster

from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.raster.crs import same_crs

GRID = raster.Grid((60, 80), WGS84_3ARC, "EPSG:4326")


def cut(folder, ground, boxes, **how):
    """Write windows of ground, ``{name: (first row, end row, first column, end column)}``."""
    paths = []
    for name, (top, bottom, left, right) in boxes.items():
        part = GRID.part(slice(top, bottom), slice(left, right))
        paths.append(
            make_raster(
                folder / name, ground[top:bottom, left:right], geotransform=part.geotransform, **how
            )
        )
    return paths


@pytest.fixture
def ground():
    ground = hills()
    ground[20:40, 30:50] = -9999
    return ground


@settings(max_examples=40, deadline=None)
@given(st.tuples(*[st.integers(0, 60)] * 2), st.tuples(*[st.integers(0, 80)] * 2))
def test_any_window_is_that_part_of_the_file(tmp_path_factory, rows, columns):
    path = tmp_path_factory.getbasetemp() / "window.tif"
    if not path.exists():
        make_raster(path, hills(), nodata=int(hills()[3, 4]), options=["TILED=YES"])
    whole = raster.read(path)
    rows, columns = slice(*rows), slice(*columns)
    if rows.start >= rows.stop or columns.start >= columns.stop:
        with pytest.raises(InputError, match="no part of 60 × 80"):
            raster.read(path, window=(rows, columns))
        return
    part = raster.read(path, window=(rows, columns))
    np.testing.assert_array_equal(part.values, whole.values[rows, columns])
    np.testing.assert_array_equal(part.void, whole.void[rows, columns])
    assert part.grid.xy(0, 0) == pytest.approx(whole.grid.xy(rows.start, columns.start))


def test_window_of_a_masked_file_and_of_a_mask(tmp_path):
    mask = np.zeros((60, 80), np.uint8)
    mask[10:20, 10:20] = 1
    mask = make_raster(tmp_path / "mask.tif", mask)

    def add_mask(dataset):
        dataset.CreateMaskBand(2)
        valid = np.full((60, 80), 255, np.uint8)
        valid[30:40] = 0
        dataset.GetRasterBand(1).GetMaskBand().WriteRaster(0, 0, 80, 60, valid)

    path = make_raster(tmp_path / "dem.tif", hills(), setup=add_mask)
    part = raster.read(path, mask=mask, window=(slice(15, 35), slice(5, 15)))
    expected = np.zeros((20, 10), bool)
    expected[:5, 5:] = expected[15:] = True
    np.testing.assert_array_equal(part.void, expected)


@pytest.mark.parametrize("shared", [0, 1])
def test_tiles_are_read_as_the_raster_they_were_cut_from(tmp_path, ground, shared):
    boxes = {
        "d.tif": (30 - shared, 60, 40 - shared, 80), "b.tif": (0, 30, 40 - shared, 80),
        "c.tif": (30 - shared, 60, 0, 40), "a.tif": (0, 30, 0, 40),
    }  # fmt: skip
    tiles = raster.open_tiles(cut(tmp_path, ground, boxes, nodata=-9999))
    assert tiles.shape == (60, 80)
    assert tiles.grid.geotransform == pytest.approx(WGS84_3ARC)
    assert (tiles.tiles[0].row, tiles.tiles[0].column) == (30 - shared, 40 - shared)
    values, void = tiles.read(slice(15, 55), slice(3, 77))
    np.testing.assert_array_equal(void, ground[15:55, 3:77] == -9999)
    np.testing.assert_array_equal(values[~void], ground[15:55, 3:77][~void])
    assert values.dtype == np.float32
    assert tiles.covered(slice(0, 60), slice(0, 80)).all()


def test_gaps_are_void_and_not_covered(tmp_path, ground):
    boxes = {"a.tif": (0, 30, 0, 40), "d.tif": (35, 60, 45, 80)}
    tiles = raster.open_tiles(cut(tmp_path, ground, boxes, nodata=-9999))
    _, void = tiles.read(slice(0, 60), slice(0, 80))
    covered = tiles.covered(slice(0, 60), slice(0, 80))
    expected = np.zeros((60, 80), bool)
    expected[:30, :40] = expected[35:, 45:] = True
    np.testing.assert_array_equal(covered, expected)
    np.testing.assert_array_equal(void, ~expected | (ground == -9999))


def test_the_first_that_knows_a_cell_gives_it(tmp_path):
    low, high = np.full((60, 80), 10, np.int16), np.full((60, 80), 20, np.int16)
    low[:, :5] = -9999
    paths = [
        make_raster(tmp_path / name, values, nodata=-9999)
        for name, values in (("low.tif", low), ("high.tif", high))
    ]
    values, void = raster.open_tiles(paths).read(slice(0, 60), slice(0, 80))
    assert not void.any()
    assert (values[:, :5] == 20).all()
    assert (values[:, 5:] == 10).all()


def test_elevations_are_real_ones_whatever_the_type(tmp_path, ground):
    known = ground.clip(0)
    decimetres = (10 * known.astype(np.int32))[:, 40:]
    paths = cut(tmp_path, known, {"a.tif": (0, 60, 0, 40)})
    paths.append(
        make_raster(
            tmp_path / "b.tif", decimetres,
            geotransform=GRID.part(slice(0, 60), slice(40, 80)).geotransform,
            setup=lambda dataset: dataset.GetRasterBand(1).SetScale(0.1),
        )
    )  # fmt: skip
    values, _ = raster.open_tiles(paths).read(slice(0, 60), slice(0, 80))
    assert values.dtype == np.float64
    np.testing.assert_allclose(values, known, atol=1e-9)


def test_refused_tiles_are_named(tmp_path, ground):
    (first,) = cut(tmp_path, ground, {"first.tif": (0, 30, 0, 40)})
    x, width, _, y, _, height = WGS84_3ARC
    made = {
        "finer.tif": dict(geotransform=(x, width / 3, 0, y, 0, height / 3)),
        "beside.tif": dict(geotransform=(x + 0.5 * width, width, 0, y, 0, height)),
        "utm.tif": dict(geotransform=(500000, 90, 0, 5e6, 0, -90), crs="EPSG:32631"),
        "nowhere.tif": dict(geotransform=None, crs=None),
        "feet.tif": dict(setup=lambda dataset: dataset.GetRasterBand(1).SetUnitType("ft")),
        "south_up.tif": dict(geotransform=(x, width, 0, y, 0, -height)),
    }  # fmt: skip
    (metres,) = cut(
        tmp_path, ground, {"metres.tif": (0, 30, 0, 40)},
        setup=lambda dataset: dataset.GetRasterBand(1).SetUnitType("m"),
    )  # fmt: skip
    for name, how in made.items():
        path = make_raster(tmp_path / name, ground, **how)
        with pytest.raises(InputError, match=name):
            raster.open_tiles([metres if name == "feet.tif" else first, path])
    with pytest.raises(InputError, match="no tiles"):
        raster.open_tiles([])


def test_crs_are_the_same_whatever_they_say_of_heights():
    assert same_crs("EPSG:4326+5773", "EPSG:4326")
    assert not same_crs("EPSG:4269", "EPSG:4326")
    assert not same_crs("", "EPSG:4326")


def test_paths_of_folder_list_pattern_and_vrt(tmp_path, ground):
    gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
    boxes = {"b.tif": (0, 30, 40, 80), "a.tif": (0, 30, 0, 40)}
    b, a = cut(tmp_path, ground, boxes)
    for name in ("readme.md", ".hidden.tif", "a.tif.aux.xml"):
        (tmp_path / name).write_text("no raster")
    assert raster.tile_paths(tmp_path) == [a, b]
    assert raster.tile_paths(b, tmp_path) == [b, a]
    assert raster.tile_paths(tmp_path / "*.tif") == [a, b]
    (tmp_path / "list.txt").write_text(f"# tiles\nb.tif\n\n{a}\n")
    assert raster.tile_paths(tmp_path / "list.txt") == [b, a]
    vrt = str(tmp_path / "all.vrt")
    dataset = gdal.BuildVRT(vrt, [a, b])
    del dataset
    assert raster.tile_paths(vrt) == [a, b]
    (tmp_path / "b.tif").unlink()
    with pytest.raises(InputError, match=r"names 2 files, of which 1 are missing"):
        raster.tile_paths(vrt)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="empty' holds no elevation rasters"):
        raster.tile_paths(tmp_path / "empty")


def test_vrt_finds_its_tiles_wherever_the_folder_goes(tmp_path, ground):
    folder = tmp_path / "made"
    folder.mkdir()
    paths = cut(folder, ground, {"a.tif": (0, 60, 0, 40), "b.tif": (0, 60, 40, 80)})
    assert raster.write_vrt(str(folder / "all.vrt"), paths) is None
    moved = folder.rename(tmp_path / "moved")
    np.testing.assert_array_equal(raster.read(moved / "all.vrt").values, ground)


def test_vrt_of_several_types_is_not_written(tmp_path, ground):
    paths = cut(tmp_path, ground, {"a.tif": (0, 60, 0, 40)})
    paths += cut(tmp_path, ground.astype(np.float32), {"b.tif": (0, 60, 40, 80)})
    assert "all.vrt" in raster.write_vrt(str(tmp_path / "all.vrt"), paths)
    assert not (tmp_path / "all.vrt").exists()
