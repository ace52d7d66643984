"""`.sct` files: what they keep, what a window gives, and that no file is trusted."""

import struct
import zlib
from pathlib import Path

import msgpack
import numpy as np
import pytest
from support import hills

from demsmith.core.errors import InputError
from demsmith.core.raster import BandMeta, Grid, Raster
from demsmith.core.sct import CompressOptions, open_sct
from demsmith.core.sct.coding import coded
from demsmith.core.sct.file import KIND, stored_size, write_sct
from demsmith.core.sectioned import DICTIONARY, TERRAIN, open_sectioned, write_sectioned

UTM = (500000.0, 30.0, 0.0, 4600000.0, 0.0, -30.0)
VOID = -9999


def source(values=None, void=None, *, grid=None, **meta):
    values = hills(300, 290) if values is None else values
    void = np.zeros(values.shape, bool) if void is None else void
    grid = grid or Grid(values.shape, UTM, "EPSG:32631")
    return Raster(values, void, grid, BandMeta(dtype=values.dtype, **meta))


def written(tmp_path, raster, **options):
    path = str(tmp_path / "x.sct")
    made = coded(raster, CompressOptions(effort="low", **options))
    write_sct(path, **made.parts())
    return path


def holed(dtype=np.int16):
    values = hills(300, 290, dtype=dtype)
    void = np.zeros(values.shape, bool)
    void[100:140, 200:270] = void[250:, :3] = True
    values[void] = VOID
    return values, void


@pytest.mark.parametrize(
    "dtype", ["uint8", "uint16", "int16", "uint32", "int32", "int64", "float32", "float64"]
)
def test_lossless(tmp_path, dtype):
    values = hills(70, 90, dtype=np.float64) / 5
    values = (np.rint(values * 10) / 10 if dtype[0] == "f" else np.rint(values)).astype(dtype)
    raster = source(values)
    with open_sct(written(tmp_path, raster, max_error=0)) as file:
        np.testing.assert_array_equal(file.read().values, values, strict=True)
        assert (file.made.max_error, file.made.psnr) == (0, None)


@pytest.mark.parametrize("max_error", [0.5, 1, 3.7, 50])
@pytest.mark.parametrize("dtype", ["int16", "float32", "float64"])
def test_the_bound_holds_and_voids_are_exact(tmp_path, dtype, max_error):
    values, void = holed(dtype)
    if dtype[0] == "f":
        values[~void] += np.random.default_rng(0).random(np.count_nonzero(~void))
    raster = source(values, void, nodata=VOID)
    with open_sct(written(tmp_path, raster, max_error=max_error)) as file:
        read = file.read()
        np.testing.assert_array_equal(read.void, void)
        np.testing.assert_array_equal(read.values[void], values[void])
        wrong = np.abs(read.values.astype(np.float64) - values)[~void]
        assert wrong.max() == pytest.approx(file.made.max_error, rel=1e-12)
        assert wrong.max() <= max_error
        assert np.sqrt(np.mean(wrong**2)) == pytest.approx(file.made.rmse)
        assert not (read.values[~void] == VOID).any()


def test_any_window_is_a_part_of_the_whole(tmp_path):
    values, void = holed()
    values[void & (np.arange(290) % 3 == 0)] = -32768  # a second kind of void
    with open_sct(written(tmp_path, source(values, void, nodata=VOID), max_error=2)) as file:
        whole = file.read()
        np.testing.assert_array_equal(whole.values[void], values[void])
        rng = np.random.default_rng(3)
        for _ in range(25):
            rows = slice(*sorted(rng.choice(301, 2, replace=False).tolist()))
            columns = slice(*sorted(rng.choice(291, 2, replace=False).tolist()))
            part = file.read(rows, columns)
            np.testing.assert_array_equal(part.values, whole.values[rows, columns])
            np.testing.assert_array_equal(part.void, whole.void[rows, columns])
            assert part.grid == whole.grid.part(rows, columns)


def test_ends_of_a_window_may_be_open_or_counted_from_the_last(plain):
    with open_sct(plain) as file:
        whole = file.read(slice(None), slice(None)).values
        assert whole.shape == (300, 290)
        for rows, columns in (
            (slice(250, None), slice(None, 7)),
            (slice(-10, -2), slice(-290, None, 1)),
            (slice(np.int64(4), np.int32(9)), None),
        ):
            part = file.read(rows, columns).values
            np.testing.assert_array_equal(part, whole[rows, columns or slice(None)])


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (3, "rows is 3; give a slice"),
        ((0, 5), "give a slice"),
        (slice(0, 10, 2), "no step"),
        (slice(10, 0, -1), "no step"),
        (slice(0.0, 5.0), "whole numbers"),
        (slice(0, 301), "rows 0 to 301 and columns"),
        (slice(-301, None), "rows -301 to 300"),
        (slice(5, 5), "rows 5 to 5"),
    ],
)
def test_other_windows_are_refused(plain, rows, said):
    with open_sct(plain) as file, pytest.raises(InputError, match=said):
        file.read(rows)


def test_a_closed_file_says_so(plain):
    with open_sct(plain) as file:
        pass
    with pytest.raises(InputError, match=r"x\.sct' is closed"):
        file.read()


@pytest.mark.parametrize(
    ("kind", "name"), [(DICTIONARY, "dictionary"), (TERRAIN, "procedural terrain")]
)
def test_other_files_of_ours_are_told_by_name(tmp_path, kind, name):
    write_sectioned(tmp_path / "x", kind, header={}, sections={})
    said = rf"x' is a {name} \(.*\); what is read here is a Sparse Construction Tree \(.sct\)"
    with pytest.raises(InputError, match=said):
        open_sct(tmp_path / "x")


def test_threads_change_nothing(tmp_path):
    values, void = holed()
    made = [
        coded(source(values, void, nodata=VOID), CompressOptions(), threads=threads)
        for threads in (1, 2)
    ]
    assert made[0].encoded.params == made[1].encoded.params
    assert made[0].encoded.sections == made[1].encoded.sections
    path = str(tmp_path / "x.sct")
    write_sct(path, **made[0].parts())
    with open_sct(path, threads=1) as one, open_sct(path, threads=2) as two:
        np.testing.assert_array_equal(one.read().values, two.read().values)


def test_what_a_raster_tells_is_kept(tmp_path):
    meta = dict(
        nodata=VOID, scale=0.5, offset=-10.0, unit="ft", description="Höhe",
        area_or_point="Point", dataset_metadata={"SOURCE": "ĉu", "EMPTY": ""},
        band_metadata={"a": "b"}, categories=("sea", "land"), epoch=2020.5,
        gcps=((0.5, 1.5, 10.0, 50.0, 3.0), (9.0, 8.0, 11.0, 51.0, 4.0)),
        gcp_crs='GEOGCS["x"]', rpc={"LINE_OFF": "12"},
        color_table={0: (1, 2, 3, 4), 7: (9, 8, 7, 6)},
    )  # fmt: skip
    raster = source(hills(20, 30, dtype=np.uint8), **meta | {"nodata": 3})
    with open_sct(written(tmp_path, raster)) as file:
        assert file.meta == raster.meta
        assert file.grid == raster.grid


@pytest.mark.parametrize("nodata", [None, np.nan, -9999.9, -3.4028234663852886e38, 0.0])
def test_the_nodata_tag_is_kept(tmp_path, nodata):
    raster = source(hills(20, 30, dtype=np.float32), nodata=nodata)
    with open_sct(written(tmp_path, raster)) as file:
        np.testing.assert_equal(file.meta.nodata, nodata)


@pytest.mark.parametrize(
    ("crs", "kept"),
    [("", ""), ("EPSG:4326", "EPSG:4326"), ("EPSG:32631+5773", None), ("EPSG:9518", "EPSG:9518")],
)
def test_the_crs_is_kept(tmp_path, crs, kept):
    pytest.importorskip("osgeo.osr")
    from osgeo import osr

    raster = source(hills(20, 30), grid=Grid((20, 30), UTM, crs))
    with open_sct(written(tmp_path, raster)) as file:
        if kept is not None:
            assert file.grid.crs == kept
            return
        mine, other = osr.SpatialReference(), osr.SpatialReference()
        mine.SetFromUserInput(file.grid.crs)
        other.SetFromUserInput(crs)
        assert mine.IsSame(other)
        assert mine.IsVertical()


def test_without_georeference(tmp_path):
    raster = source(hills(20, 30), grid=Grid((20, 30)))
    with open_sct(written(tmp_path, raster)) as file:
        assert not file.grid.georeferenced


@pytest.mark.parametrize("shape", [(1, 1), (1, 700), (300, 1), (257, 256)])
def test_odd_shapes(tmp_path, shape):
    values = hills(*shape)
    with open_sct(written(tmp_path, source(values), max_error=0)) as file:
        np.testing.assert_array_equal(file.read().values, values)


def test_overhead_is_small(tmp_path):
    values, void = holed()
    made = coded(source(values, void, nodata=VOID), CompressOptions(max_error=5))
    path = str(tmp_path / "x.sct")
    write_sct(path, **made.parts())
    with open_sct(path) as file:
        assert file.size == stored_size(**made.parts())
        assert sum(file.bytes_by_section().values()) == file.size
        assert file.bytes_by_section()["header"] < 500


# --- not trusted ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    values, void = holed()
    return written(tmp_path_factory.mktemp("plain"), source(values, void, nodata=VOID))


def changed(plain, path, **changes):
    """Write the file with other fields, whose checksums are right."""
    with open_sectioned(plain, KIND) as file:
        header = file.header
        sections = {
            name: [file.part(name, index) for index in range(count)]
            for name, count in file.counts.items()
        }
    for name, value in changes.items():
        if name in ("codec", "raster") and isinstance(value, dict):
            header[name] |= value
        elif name == "sections":
            sections = value(sections)
        else:
            header[name] = value
    write_sectioned(path, KIND, header=header, sections=sections)
    return path


def _with_marks(sections):
    return sections | {"marks": [b""]}


@pytest.mark.parametrize(
    "changes",
    [
        {"raster": None},
        {"codec": []},
        {"by": 3},
        {"raster": {"shape": [300, 291]}},
        {"raster": {"shape": [0, 290]}},
        {"raster": {"shape": [1 << 40, 290]}},
        {"raster": {"shape": [300.0, 290]}},
        {"raster": {"type": "complex64"}},
        {"raster": {"type": "O"}},
        {"raster": {"geotransform": [0, 0, 0, 0, 0, 0]}},
        {"raster": {"geotransform": [0, 1, 0, 0, 0, float("nan")]}},
        {"raster": {"geotransform": "abcdef"}},
        {"raster": {"crs": "https://example.org/crs"}},
        {"raster": {"crs": "/etc/passwd"}},
        {"raster": {"gcp_crs": "file.prj"}},
        {"raster": {"crs": 4326}},
        {"raster": {"steps": [0.0, 1.0, 0]}},
        {"raster": {"steps": [1.0, 1.0, 1 << 63]}},
        {"raster": {"steps": [1.0, 1.0, 0.5]}},
        {"raster": {"steps": [float("inf"), 1.0, 0]}},
        {"raster": {"nodata": "low"}},
        {"raster": {"nodata": 1 << 20}},
        {"raster": {"marks": [1 << 20]}},
        {"raster": {"marks": [0] * 300}},
        {"raster": {"marks": [None]}},
        {"raster": {"made": ["max-error", 1.0]}},
        {"raster": {"made": ["magic", 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 3, 1.0]}},
        {"raster": {"made": ["ratio", 1.0, 1.0, float("nan"), 1.0, 0.0, 1.0, 3, 1.0]}},
        {"raster": {"dataset_metadata": {"a": 1}}},
        {"raster": {"categories": [1]}},
        {"raster": {"colors": b"123"}},
        {"raster": {"gcps": b"123"}},
        {"raster": {"scale": float("inf")}},
        {"raster": {"unit": b"m"}},
        {"sections": _with_marks},
    ],
    ids=lambda changes: "marks" if "sections" in changes else repr(changes),
)
def test_a_header_that_lies_is_refused(plain, tmp_path, changes):
    path = changed(plain, str(tmp_path / "bad.sct"), **changes)
    with pytest.raises(InputError, match=r"bad\.sct' is damaged: "):
        open_sct(path)


def test_a_small_file_cannot_be_of_a_huge_raster(plain, tmp_path):
    shape = [1 << 20, 1 << 20]
    path = changed(
        plain, str(tmp_path / "bad.sct"),
        raster={"shape": shape}, codec={"rows": shape[0], "columns": shape[1]},
    )  # fmt: skip
    with pytest.raises(InputError, match=r"bad\.sct' is damaged: \d+ bytes are too few"):
        open_sct(path)


def test_a_huge_plain_has_room(tmp_path, monkeypatch):
    monkeypatch.setattr("demsmith.core.sct.file.CELLS_PER_BYTE", 16)
    monkeypatch.setattr("demsmith.core.sct.file._FREE_CELLS", 0)
    values = np.full((300, 290), 7, np.int16)
    with open_sct(written(tmp_path, source(values))) as file:
        assert file.size >= values.size / 16
        assert file.bytes_by_section()["room"] > 1000
        np.testing.assert_array_equal(file.read().values, values)


def test_no_section_at_all(plain, tmp_path):
    path = changed(plain, str(tmp_path / "bad.sct"), sections=lambda _: {})
    with pytest.raises(InputError, match=r"bad\.sct' is damaged"), open_sct(path) as file:
        file.read()


def test_damaged_marks_are_told(plain, tmp_path):
    path = changed(
        plain, str(tmp_path / "bad.sct"),
        sections=lambda sections: sections | {"marks": [b"x", b"", b"", zlib.compress(b"y")]},
    )  # fmt: skip
    with open_sct(path) as file:
        assert file.read(slice(0, 256), slice(256, 290)).values.shape == (256, 34)
        for rows, columns in ((slice(0, 5), slice(0, 5)), (slice(290, 300), slice(280, 290))):
            with pytest.raises(InputError, match=r"bad\.sct' is damaged: the values of its voids"):
                file.read(rows, columns)


def test_every_byte_matters(plain, tmp_path):
    whole = Path(plain).read_bytes()
    path = tmp_path / "bad.sct"
    for place in np.linspace(0, len(whole) - 1, 60).astype(int):
        data = bytearray(whole)
        data[place] ^= 0x10
        path.write_bytes(data)
        with pytest.raises(InputError), open_sct(path) as file:
            file.read()


def test_the_preamble_is_as_documented(plain):
    data = Path(plain).read_bytes()
    magic, version, zero, header, _, table, _ = struct.unpack_from("<4sHHIIII", data)
    assert (magic, version, zero) == (b"\x93SCT", 1, 0)
    start = struct.calcsize("<4sHHIIII") + 4
    shape, fields = msgpack.unpackb(zlib.decompress(data[start : start + header], -15))
    assert set(fields) == {"by", "codec", "raster"}
    assert fields["raster"]["shape"] == [300, 290]
    assert {"voids", "residual"} <= {name for name, _ in shape}
    assert zlib.crc32(data[28 : 28 + header + table], zlib.crc32(data[:24])) == int.from_bytes(
        data[24:28], "little"
    )
