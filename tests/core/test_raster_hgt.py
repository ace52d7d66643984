"""SRTM's .hgt tiles under any name and in zip archives."""

import shutil
import zipfile

import numpy as np
import pytest
from support import hills, make_hgt, make_raster, truncate

from demsmith.core.errors import InputError
from demsmith.core.raster import read
from demsmith.core.raster.hgt import in_memory

pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

PLACE = (0.9995833333333334, 1 / 1200, 0.0, 43.000416666666666, 0.0, -1 / 1200)


@pytest.fixture(scope="module")
def tile(tmp_path_factory):
    values = hills(1201, 1201)
    values[10:13, 20:25] = -32768
    return make_hgt(tmp_path_factory.mktemp("hgt") / "N42E001.hgt", values)


def zipped(path, *members):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for source, inner in members:
            archive.write(source, inner)
    return str(path)


def check(raster):
    assert raster.values.shape == (1201, 1201)
    assert raster.values.dtype == np.int16
    assert raster.void.sum() == 15
    assert raster.grid.geotransform == pytest.approx(PLACE, abs=1e-12)
    assert "4326" in raster.grid.crs
    assert raster.meta.area_or_point == "Point"
    assert raster.notes == ()


@pytest.mark.parametrize(
    "name", ["N42E001.hgt", "n42e001.hgt", "N42E001.HGT", "srtm_N42E001_v2 é.hgt", "N42E001.3.hgt"]
)
def test_any_name_that_tells_the_place(tile, tmp_path, name):
    path = tmp_path / name
    shutil.copy(tile, path)
    check(read(path))


@pytest.mark.parametrize(
    ("archive", "inner"),
    [
        ("N42E001.hgt.zip", "N42E001.hgt"),
        ("anything at all.zip", "N42E001.hgt"),
        ("N42E001.SRTMGL3.hgt.zip", "N42E001.hgt"),
        ("x.zip", "folder/deep/n42e001.HGT"),
        ("n42e001.zip", "data.hgt"),
        ("brace{.zip", "tile (N42E001).hgt"),
    ],
)
def test_zip_by_its_inner_name(tile, tmp_path, archive, inner):
    check(read(zipped(tmp_path / archive, (tile, inner))))


def test_gdal_path_into_a_zip(tile, tmp_path):
    path = zipped(tmp_path / "two.zip", (tile, "N42E001.hgt"), (tile, "old_N42E001.hgt"))
    check(read(f"/vsizip/{path}/N42E001.hgt"))
    check(read(f"/vsizip/{path}/old_N42E001.hgt"))


def test_zip_of_several_lists_them(tile, tmp_path):
    path = zipped(tmp_path / "two.zip", (tile, "N42E001.hgt"), (tile, "N43E001.hgt"))
    with pytest.raises(InputError, match=r"holds 2 rasters.*/vsizip/.*two.zip/N42E001.hgt"):
        read(path)


def test_shadow_files_of_macos_do_not_count(tile, tmp_path):
    path = zipped(tmp_path / "mac.zip", (tile, "N42E001.hgt"), (tile, "__MACOSX/._N42E001.hgt"))
    check(read(path))


def test_zip_of_another_raster(tmp_path):
    inner = make_raster(tmp_path / "dem.tif", hills())
    raster = read(zipped(tmp_path / "a {b}.zip", (inner, "sub/dem.tif"), (__file__, "readme.txt")))
    assert raster.values.shape == (60, 80)


def test_zip_without_raster(tmp_path):
    with pytest.raises(InputError, match="holds no raster"):
        read(zipped(tmp_path / "a.zip", (__file__, "readme.txt")))


def test_truncated_tile_is_called_truncated(tile, tmp_path):
    path = tmp_path / "N42E001.hgt"
    shutil.copy(tile, path)
    truncate(path, 0.7)
    with pytest.raises(
        InputError, match=r"N42E001.hgt' is truncated: .*2884802.*this file has 2019361"
    ):
        read(path)


def test_truncated_tile_in_a_zip(tile, tmp_path):
    short = tmp_path / "short"
    shutil.copy(tile, short)
    truncate(short, 0.5)
    with pytest.raises(InputError, match=r"a.zip: N42E001.hgt' is truncated"):
        read(zipped(tmp_path / "a.zip", (str(short), "N42E001.hgt")))


@pytest.mark.parametrize("fraction", [0.9, 0.3, 0.001])
def test_truncated_zip(tile, tmp_path, fraction):
    path = truncate(zipped(tmp_path / "N42E001.hgt.zip", (tile, "N42E001.hgt")), fraction)
    with pytest.raises(InputError, match="truncated or damaged"):
        read(path)


def test_damaged_zip_is_found_by_its_checksum(tile, tmp_path):
    path = zipped(tmp_path / "a.zip", (tile, "N42E001.hgt"))
    with open(path, "r+b") as file:
        file.seek(100_000)
        file.write(b"damage" * 10)
    with pytest.raises(InputError, match="truncated or damaged"):
        read(path)


def test_tile_without_place_in_its_name(tile, tmp_path):
    path = tmp_path / "my.hgt"
    shutil.copy(tile, path)
    with pytest.raises(InputError, match="my.hgt' does not tell where it lies.*N42E001.hgt"):
        read(path)
    with pytest.raises(InputError, match="a.zip: my.hgt' does not tell where it lies"):
        read(zipped(tmp_path / "a.zip", (str(path), "my.hgt")))


def test_wrong_size_is_no_tile(tmp_path):
    path = tmp_path / "N42E001.hgt"
    path.write_bytes(b"\0" * 30_000_000)
    with pytest.raises(InputError, match="is no .hgt tile"):
        read(path)


def test_one_by_two_arc_seconds(tmp_path):
    raster = read(make_hgt(tmp_path / "old_N60E010.hgt", hills(3601, 1801)))
    assert raster.values.shape == (3601, 1801)
    assert raster.grid.geotransform[1] == pytest.approx(2 / 3600)


def test_nothing_stays_in_gdals_memory():
    from osgeo import gdal

    with in_memory(b"bytes", "N42E001.hgt") as name:
        assert gdal.VSIStatL(name).size == 5
    assert gdal.VSIStatL(name) is None
