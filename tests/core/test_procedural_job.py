"""Models in files: written whole, read back bit for bit, and refused where they are damaged."""

import os
import struct
import zlib

import numpy as np
import pytest
from support import WGS84_3ARC, digest, hills, make_raster, truncate

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.procedural import (
    OutputOptions,
    ProceduralizeOptions,
    proceduralize_file,
    read_terrain,
)
from demsmith.core.procedural.file import KIND
from demsmith.core.progress import SILENT
from demsmith.core.sectioned import open_sectioned, write_sectioned

QUICK = ProceduralizeOptions(candidates=200, atoms=30)


@pytest.fixture(scope="module")
def dem(tmp_path_factory):
    values = hills()
    values[10:13, 20:24] = -9999

    def describe(dataset):
        band = dataset.GetRasterBand(1)
        band.SetScale(0.5)
        band.SetOffset(100)
        band.SetUnitType("m")

    folder = tmp_path_factory.mktemp("dem")
    return make_raster(folder / "dem.tif", values, nodata=-9999, setup=describe)


@pytest.fixture(scope="module")
def model(dem, tmp_path_factory):
    path = tmp_path_factory.mktemp("model") / "model.dsp"
    proceduralize_file(dem, path, options=QUICK)
    return path


def model_of(dem, folder, **options):
    return proceduralize_file(dem, folder / "m.dsp", raster_output=folder / "m.tif",
                              options=QUICK, **options)  # fmt: skip


def test_a_model_and_its_raster(dem, tmp_path):
    before = digest(dem)
    result = model_of(dem, tmp_path)
    source, made = raster.read(dem), raster.read(tmp_path / "m.tif")
    assert made.grid == source.grid
    np.testing.assert_array_equal(made.void, source.void)
    assert (made.values.dtype, made.meta.unit, made.meta.scale) == (np.float32, "m", 1)
    real = source.meta.real(source.values.astype(float))
    error = (made.values - real)[~source.void]
    assert result.rmse == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-4)
    assert result.rmse < 0.03 * np.ptp(real[~source.void])
    assert result.psnr == pytest.approx(
        20 * np.log10(np.ptp(real[~source.void]) / result.rmse), abs=0.01
    )
    assert result.bytes == os.path.getsize(tmp_path / "m.dsp")
    assert (result.cells, result.cells_known, result.atoms) == (4800, 4788, 30)
    assert digest(dem) == before


def test_a_model_read_back_is_the_same(dem, tmp_path):
    model_of(dem, tmp_path)
    again = tmp_path / "again.tif"
    result = proceduralize_file(tmp_path / "m.dsp", raster_output=again)
    assert (result.output, result.bytes, result.rmse) == (None, None, None)
    one, other = raster.read(tmp_path / "m.tif"), raster.read(again)
    np.testing.assert_array_equal(one.values, other.values)
    assert (one.grid, str(one.meta)) == (other.grid, str(other.meta))  # nan is not nan


@pytest.mark.parametrize(("scale", "shape"), [(3, (180, 240)), (0.25, (15, 20)), (0.7, (42, 56))])
def test_any_resolution(dem, model, tmp_path, scale, shape):
    path = tmp_path / "scaled.tif"
    proceduralize_file(model, raster_output=path, outputs=OutputOptions(scale=scale))
    made, source = raster.read(path), raster.read(dem)
    assert tuple(made.grid.shape) == shape
    west, width, _, north, _, height = made.grid.geotransform
    assert (west, north) == (WGS84_3ARC[0], WGS84_3ARC[3])
    assert (width, height) == pytest.approx((WGS84_3ARC[1] / scale, WGS84_3ARC[5] / scale))
    row, column = 20, 50
    x, y = source.grid.xy(row, column)
    there = made.values[int((y - north) / height), int((x - west) / width)]
    assert there == pytest.approx(source.meta.real(float(source.values[row, column])), abs=60)


def test_the_same_bytes_whatever_the_threads(dem, tmp_path):
    digests = set()
    for threads in (1, 3):
        model_of(dem, tmp_path, threads=threads, overwrite=True)
        digests.add((digest(tmp_path / "m.dsp"), digest(tmp_path / "m.tif")))
    assert len(digests) == 1


def test_a_raster_alone_needs_no_model(dem, tmp_path):
    result = proceduralize_file(dem, raster_output=tmp_path / "m.tif", options=QUICK)
    assert os.listdir(tmp_path) == ["m.tif"]
    assert result.bytes is None
    assert result.rmse > 0


def test_a_placeless_raster_stays_so(tmp_path):
    path = make_raster(tmp_path / "a.tif", hills(30, 30), geotransform=None, crs="")
    proceduralize_file(path, tmp_path / "m.dsp", options=QUICK)
    proceduralize_file(
        tmp_path / "m.dsp", raster_output=tmp_path / "m.tif", outputs=OutputOptions(scale=2)
    )
    made = raster.read(tmp_path / "m.tif")
    assert not made.grid.georeferenced
    assert made.grid.shape == (60, 60)


@pytest.mark.parametrize(
    ("call", "error", "said"),
    [
        (lambda dem, folder: proceduralize_file(dem), InputError, "nothing to make"),
        (lambda dem, folder: proceduralize_file(dem, folder / "m.tif"), InputError, "in .dsp"),
        (lambda dem, folder: proceduralize_file(dem, raster_output=folder / "m.dsp"),
         InputError, "GeoTIFF"),
        (lambda dem, folder: proceduralize_file(dem, folder / "none" / "m.dsp"),
         OutputError, "no folder"),
        (lambda dem, folder: proceduralize_file(folder / "n.dsp", raster_output=folder / "m.tif"),
         InputError, "n.dsp"),
        (lambda dem, folder: proceduralize_file(dem, folder / "m.dsp", below=9e9),
         InputError, "every cell is a void"),
        (lambda dem, folder: proceduralize_file(dem, folder / "m.dsp",
                                                outputs=OutputOptions(scale=-1)),
         InputError, "scale"),
    ],
)  # fmt: skip
def test_refused_and_nothing_left(dem, tmp_path, call, error, said):
    with pytest.raises(error, match=said):
        call(dem, tmp_path)
    assert os.listdir(tmp_path) == []


def test_a_model_of_a_model_is_refused(model, tmp_path):
    with pytest.raises(InputError, match="model already"):
        proceduralize_file(model, tmp_path / "m.dsp")


def test_an_existing_model_stays(dem, tmp_path):
    (tmp_path / "m.dsp").write_text("precious")
    with pytest.raises(OutputError, match="exists already"):
        model_of(dem, tmp_path)
    assert (tmp_path / "m.dsp").read_text() == "precious"


def test_cancelled_leaves_nothing(dem, tmp_path):
    class Stop:
        def __init__(self, at):
            self.at, self.heard = at, 0.0

        def report(self, fraction):
            assert fraction >= self.heard - 1e-9
            self.heard = fraction

        def cancelled(self):
            return self.heard >= self.at

    for at in (0.0, 0.3, 0.65, 0.95):
        with pytest.raises(Cancelled):
            model_of(dem, tmp_path, progress=Stop(at))
        assert os.listdir(tmp_path) == []


# --- hostile files -------------------------------------------------------------------------------


def parts_of(path):
    with open_sectioned(path, KIND) as file:
        return file.header, {name: [file.part(name, 0)] for name in file.counts}


def changed(model, folder, *, header=None, sections=None):
    """Write a file whose checksums are right but whose contents are not."""
    told, parts = parts_of(model)
    path = folder / "changed.dsp"
    write_sectioned(
        path, KIND, header={**told, **(header or {})}, sections={**parts, **(sections or {})}
    )
    return path


@pytest.mark.parametrize(
    "header",
    [
        {"shape": [60]}, {"shape": [0, 80]}, {"shape": [60, "80"]}, {"shape": [1 << 29, 1 << 29]},
        {"shape": [61, 80]}, {"side": [0, 10]}, {"side": [10**6, 10]}, {"step": [11, 5]},
        {"step": None}, {"atoms": 31}, {"atoms": 1 << 40}, {"atoms": True}, {"terms": 0},
        {"terms": 9}, {"sparsity": 3}, {"sparsity": -1}, {"cell": [0.0, 1.0]},
        {"cell": [float("nan"), 1.0]}, {"cell": "ab"}, {"geotransform": [0.0] * 6},
        {"geotransform": [1.0] * 5}, {"crs": 3}, {"unit": "m" * 70_000}, {"area_or_point": None},
    ],
    ids=str,
)  # fmt: skip
def test_headers_that_lie_are_found_out(model, tmp_path, header):
    with pytest.raises(InputError, match="damaged"):
        read_terrain(changed(model, tmp_path, header=header))


def array(section, model, kind):
    return np.frombuffer(zlib.decompress(parts_of(model)[1][section][0]), kind).copy()


@pytest.mark.parametrize(
    ("section", "kind", "place", "value"),
    [
        ("functions", "<f8", 0, 3.0), ("functions", "<f8", 0, -1.0), ("functions", "<f8", 0, 0.5),
        ("functions", "<f8", 1, 2.0**48), ("functions", "<f8", 1, np.nan),
        ("functions", "<f8", 2, np.inf), ("functions", "<f8", 3, 0.0),
        ("functions", "<f8", 4, 1e300), ("functions", "<f8", 6, 0.0),
        ("functions", "<f8", 6, -2.0), ("heights", "<f4", 7, np.nan),
        ("heights", "<f4", 7, np.inf), ("indices", "<u2", 9, 30),
        ("coefficients", "<f4", 3, np.nan),
    ],
    ids=str,
)  # fmt: skip
def test_arrays_that_lie_are_found_out(model, tmp_path, section, kind, place, value):
    numbers = array(section, model, kind)
    numbers[place] = value
    packed = {section: [zlib.compress(numbers.tobytes())]}
    with pytest.raises(InputError, match="damaged"):
        read_terrain(changed(model, tmp_path, sections=packed))


def test_a_bomb_is_not_unpacked(model, tmp_path):
    bomb = zlib.compress(bytes(50 << 20), 9)
    with pytest.raises(InputError, match="another size"):
        read_terrain(changed(model, tmp_path, sections={"heights": [bomb]}))
    for junk in (b"", b"junk", zlib.compress(b"short")):
        with pytest.raises(InputError, match="damaged"):
            read_terrain(changed(model, tmp_path, sections={"void": [junk]}))


def test_damaged_bytes_are_found_out(model, tmp_path):
    data = bytearray(model.read_bytes())
    rng = np.random.default_rng(0)
    path = tmp_path / "damaged.dsp"
    for _ in range(300):
        place = int(rng.integers(len(data)))
        old, data[place] = data[place], data[place] ^ int(rng.integers(1, 256))
        path.write_bytes(data)
        data[place] = old
        with pytest.raises(InputError):
            read_terrain(path)
    path.write_bytes(data)
    assert read_terrain(path).raster(progress=SILENT).values.shape == (60, 80)
    for share in (0, 0.01, 0.5, 0.99):
        path.write_bytes(data)
        with pytest.raises(InputError):
            read_terrain(truncate(path, share))


def test_a_newer_version_is_told(model, tmp_path):
    data = bytearray(model.read_bytes())
    struct.pack_into("<H", data, 4, 9)
    (tmp_path / "new.dsp").write_bytes(data)
    with pytest.raises(InputError, match="version 9"):
        read_terrain(tmp_path / "new.dsp")
