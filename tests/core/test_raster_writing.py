"""Writing: everything kept, whole or not at all, the same bytes every time."""

import contextlib
import os
import stat
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import WGS84_3ARC, digest, hills, make_raster

from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.raster import BandMeta, Grid, Raster, check_output, read, whole_or_nothing, write
from demsmith.core.raster.outputs import cannot_write

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")


def raster_of(values, void=None, *, crs="EPSG:4326", geotransform=WGS84_3ARC, **meta):
    void = np.zeros(values.shape, bool) if void is None else void
    meta = BandMeta(dtype=values.dtype, **meta)
    return Raster(values, void, Grid(values.shape, geotransform, crs), meta)


def names(folder):
    return sorted(entry.name for entry in Path(folder).iterdir())


def open_files():
    """Names of this process's open files; none where the system does not tell."""
    found = []
    for entry in Path("/proc/self/fd").glob("*"):
        with contextlib.suppress(OSError):
            found.append(os.readlink(entry))
    return found


def same_crs(one, other):
    from osgeo import osr

    first, second = osr.SpatialReference(), osr.SpatialReference()
    return not first.SetFromUserInput(one) and not second.SetFromUserInput(other) and bool(
        first.IsSame(second)
    )  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(
    dtype=st.sampled_from(
        ["uint8", "int8", "uint16", "int16", "uint32", "int32", "int64", "float32", "float64"]
    ),
    rows=st.integers(1, 40),
    columns=st.integers(1, 40),
    seed=st.integers(0, 2**32 - 1),
    south_up=st.booleans(),
)
def test_round_trip(tmp_path_factory, dtype, rows, columns, seed, south_up):
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 100, (rows, columns)).astype(dtype)
    void = rng.random((rows, columns)) < 0.2
    place = (10.0, 0.01, 0.0, 45.0, 0.0, 0.01 if south_up else -0.01)
    raster = raster_of(values, void, geotransform=place, nodata=120)
    path = tmp_path_factory.mktemp("trip") / "a.tif"
    written = write(path, values, like=raster, void=void)
    assert written == (str(path), 120)
    again = read(path)
    assert again.values.dtype == dtype
    np.testing.assert_array_equal(again.void, void)
    np.testing.assert_array_equal(again.values[~void], values[~void])
    assert again.grid.geotransform == pytest.approx(place)


@pytest.mark.parametrize("kind", ["Area", "Point"])
def test_all_properties_survive(tmp_path, kind):
    def setup(dataset):
        band = dataset.GetRasterBand(1)
        band.SetUnitType("ft")
        band.SetScale(0.5)
        band.SetOffset(10)
        band.SetDescription("bare ground")
        band.SetMetadata({"SENSOR": "lidar"})

    source = read(
        make_raster(
            tmp_path / "in.tif",
            hills(),
            nodata=-5,
            setup=setup,
            crs="EPSG:32633+5773",
            geotransform=(5e5, 30, 0, 4e6, 0, -30),
            metadata={"AREA_OR_POINT": kind, "BY": "me"},
        )
    )
    assert "EGM96" in source.grid.crs
    write(tmp_path / "out.tif", source.values, like=source)
    again = read(tmp_path / "out.tif")
    assert again.meta == source.meta
    assert again.grid == source.grid
    assert names(tmp_path) == ["in.tif", "out.tif"]


def test_ground_control_points_and_no_crs_survive(tmp_path):
    def setup(dataset):
        dataset.SetGCPs([gdal.GCP(10, 50, 3, 0, 0), gdal.GCP(11, 50, 0, 80, 0)], "")

    path = make_raster(tmp_path / "in.tif", hills(), crs="", geotransform=None, setup=setup)
    source = read(path)
    write(tmp_path / "out.tif", source.values, like=source)
    again = read(tmp_path / "out.tif")
    assert again.meta.gcps == source.meta.gcps
    assert not again.grid.georeferenced and again.grid.crs == ""


@pytest.mark.parametrize("crs", ["EPSG:4979", "EPSG:9518", "ESRI:102039", "IAU_2015:49900"])
def test_less_usual_crs(tmp_path, crs):
    write(tmp_path / "a.tif", hills(), like=raster_of(hills(), crs=crs))
    assert same_crs(read(tmp_path / "a.tif").grid.crs, crs)


def test_axes_of_a_crs_kept_in_a_sidecar(tmp_path):
    """Longitude stays the first coordinate, although EPSG:4326 calls latitude the first axis."""
    path = tmp_path / "a.tif"
    write(path, hills(), like=raster_of(hills()), creation_options=["PROFILE=BASELINE"])
    dataset = gdal.Open(str(path))
    assert dataset.GetSpatialRef().GetDataAxisToSRSAxisMapping() == [2, 1]


def test_scaling_belongs_to_the_same_quantity_only(tmp_path):
    source = raster_of(hills(), scale=0.5, unit="ft", description="ground", nodata=-5)
    write(
        tmp_path / "a.tif", np.zeros((60, 80), np.uint8), like=source, dtype="uint8", nodata=None,
        same_quantity=False, description="source", color_table={0: (0, 0, 0, 0), 1: (200, 30, 30)},
        categories=("original", "filled"),
    )  # fmt: skip
    meta = read(tmp_path / "a.tif").meta
    assert (meta.scale, meta.unit, meta.description, meta.nodata) == (1, "", "source", None)
    assert meta.color_table[0] == (0, 0, 0, 255)  # TIFF palettes have no transparency
    assert meta.color_table[1] == (200, 30, 30, 255)
    assert meta.categories == ("original", "filled")
    assert names(tmp_path) == ["a.tif", "a.tif.aux.xml"]


def test_color_table_needs_small_integers(tmp_path):
    with pytest.raises(InputError, match="colour table, not int16"):
        write(tmp_path / "a.tif", hills(), like=raster_of(hills()), color_table={0: (0, 0, 0)})


class TestRounding:
    def test_to_the_nearest_within_the_type(self, tmp_path):
        values = np.array([[1.4, 1.6, -3.0, 300.0, 2.5]])
        source = raster_of(values.astype(np.float32))
        write(tmp_path / "a.tif", values, like=source, dtype=np.uint8)
        assert read(tmp_path / "a.tif").values.tolist() == [[1, 2, 0, 255, 2]]

    def test_largest_integers(self, tmp_path):
        values = np.array([[3e9, -3e9]], np.float32)
        write(tmp_path / "a.tif", values, like=raster_of(values), dtype=np.int32)
        assert read(tmp_path / "a.tif").values.tolist() == [[2**31 - 1, -(2**31)]]

    def test_voids_may_hold_anything(self, tmp_path):
        values = np.array([[np.nan, 7.0]])
        void = np.array([[True, False]])
        source = raster_of(np.zeros((1, 2), np.int16), nodata=-32768)
        write(tmp_path / "a.tif", values, like=source, void=void)
        again = read(tmp_path / "a.tif")
        assert again.void.tolist() == [[True, False]]
        assert again.values.tolist() == [[-32768, 7]]

    def test_no_number_where_no_void_is(self, tmp_path):
        values = np.array([[np.nan, 7.0]])
        with pytest.raises(InputError, match="1 values are no finite numbers"):
            write(tmp_path / "a.tif", values, like=raster_of(np.zeros((1, 2), np.int16)))
        assert names(tmp_path) == []

    def test_the_values_given_stay_as_they_are(self, tmp_path):
        values, void = hills(), np.zeros((60, 80), bool)
        void[3, 4] = True
        before = values.copy()
        write(tmp_path / "a.tif", values, like=raster_of(values), void=void)
        np.testing.assert_array_equal(values, before)


class TestNodataTag:
    """A tag must never hide a cell that was filled."""

    def write(self, tmp_path, values, void, **options):
        source = raster_of(np.asarray(values), nodata=options.pop("tag", 0))
        written = write(tmp_path / "a.tif", source.values, like=source, void=void, **options)
        again = read(tmp_path / "a.tif")
        np.testing.assert_array_equal(again.void, void)
        assert again.meta.nodata == written.nodata or np.isnan(written.nodata)
        return written.nodata

    def test_kept_where_it_hides_nothing(self, tmp_path):
        void = np.array([[False, True]])
        assert self.write(tmp_path, np.array([[5, 9]], np.int16), void) == 0
        assert self.write(
            tmp_path, np.array([[5, 9]], np.int16), void & False, overwrite=True
        ) == 0  # fmt: skip

    def test_left_out_where_it_would_hide_filled_cells(self, tmp_path):
        void = np.array([[False, False]])
        assert self.write(tmp_path, np.array([[0, 9]], np.int16), void) is None

    def test_replaced_where_voids_remain(self, tmp_path):
        void = np.array([[False, True]])
        assert self.write(tmp_path, np.array([[0, 9]], np.int16), void) == -32768
        floats = np.array([[0, 9]], np.float32)
        assert np.isnan(self.write(tmp_path, floats, void, overwrite=True))

    def test_chosen_where_there_was_none(self, tmp_path):
        void = np.array([[False, True]])
        assert self.write(tmp_path, np.array([[255, 9]], np.uint8), void, tag=None) == 0

    def test_none_left(self, tmp_path):
        values = np.array([[255, 0, 9]], np.uint8)
        void = np.array([[False, False, True]])
        with pytest.raises(OutputError, match="no value left"):
            write(tmp_path / "a.tif", values, like=raster_of(values), void=void)
        assert names(tmp_path) == []

    def test_rounding_may_meet_the_tag(self, tmp_path):
        source = raster_of(np.zeros((1, 2), np.int16), nodata=0)
        values, void = np.array([[0.3, 9.0]]), np.zeros((1, 2), bool)
        assert write(tmp_path / "a.tif", values, like=source, void=void).nodata is None


class TestStorage:
    def structure(self, path):
        dataset = gdal.Open(str(path))
        found = dataset.GetMetadata("IMAGE_STRUCTURE"), dataset.GetRasterBand(1).GetBlockSize()
        del dataset
        return found

    @pytest.mark.parametrize(("dtype", "predictor"), [("int16", "2"), ("float32", "3")])
    def test_tiled_and_compressed(self, tmp_path, dtype, predictor):
        ground = hills(300, 300, dtype=dtype)
        write(tmp_path / "a.tif", ground, like=raster_of(ground))
        structure, block = self.structure(tmp_path / "a.tif")
        assert structure["COMPRESSION"] in ("ZSTD", "DEFLATE")
        assert structure.get("PREDICTOR", predictor) == predictor
        assert block == [256, 256]

    def test_the_users_options_win(self, tmp_path):
        options = ["tiled=no", "COMPRESS=LZW", "BLOCKYSIZE=7"]
        ground = hills(300, 300)
        write(tmp_path / "a.tif", ground, like=raster_of(ground), creation_options=options)
        structure, block = self.structure(tmp_path / "a.tif")
        assert structure["COMPRESSION"] == "LZW"
        assert block == [300, 7]
        np.testing.assert_array_equal(read(tmp_path / "a.tif").values, ground)

    def test_sidecars_asked_for_come_along(self, tmp_path):
        write(tmp_path / "a.tif", hills(), like=raster_of(hills()), creation_options=["TFW=YES"])
        assert names(tmp_path) == ["a.tfw", "a.tif"]

    @pytest.mark.parametrize(
        ("option", "complaint"),
        [("COMPRESS", "KEY=VALUE"), ("COMPRES=LZW", "COMPRES"), ("COMPRESS=FOO", "FOO")],
    )
    def test_wrong_options_are_refused(self, tmp_path, capfd, option, complaint):
        with pytest.raises(InputError, match=complaint):
            write(tmp_path / "a.tif", hills(), like=raster_of(hills()), creation_options=[option])
        assert names(tmp_path) == []
        assert capfd.readouterr() == ("", "")

    def test_the_same_bytes_whatever_the_threads_and_the_cache(self, tmp_path):
        ground = hills(1500, 1100, dtype=np.float32)
        source = raster_of(ground)
        digests = set()
        cache = gdal.GetCacheMax()
        for number, (threads, megabytes) in enumerate([(1, 64), (2, 64), (4, 1), (None, 64)]):
            gdal.SetCacheMax(megabytes << 20)
            path = tmp_path / f"{number}.tif"
            write(path, ground, like=source, threads=threads)
            digests.add(digest(path))
        gdal.SetCacheMax(cache)
        assert len(digests) == 1

    def test_permissions_are_those_of_any_new_file(self, tmp_path):
        (tmp_path / "plain").touch()
        write(tmp_path / "a.tif", hills(), like=raster_of(hills()))
        assert stat.S_IMODE((tmp_path / "a.tif").stat().st_mode) == stat.S_IMODE(
            (tmp_path / "plain").stat().st_mode
        )


class TestWhere:
    def test_unicode_and_spaces(self, tmp_path):
        folder = tmp_path / "Höhen modelle"
        folder.mkdir()
        write(folder / "Größe 高.TIFF", hills(), like=raster_of(hills()))
        np.testing.assert_array_equal(read(folder / "Größe 高.TIFF").values, hills())

    def test_relative_path(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        write("a.tif", hills(), like=raster_of(hills()))
        assert names(tmp_path) == ["a.tif"]

    @pytest.mark.parametrize("name", ["a.asc", "a", "a.tif.gz"])
    def test_only_geotiff(self, tmp_path, name):
        with pytest.raises(InputError, match=r"end its name in \.tif"):
            check_output(tmp_path / name)

    def test_folder_missing_or_a_file(self, tmp_path):
        with pytest.raises(OutputError, match="there is no folder"):
            check_output(tmp_path / "no" / "a.tif")
        (tmp_path / "file").touch()
        with pytest.raises(OutputError, match="there is no folder|is a file, not a folder"):
            check_output(tmp_path / "file" / "a.tif")
        (tmp_path / "folder.tif").mkdir()
        with pytest.raises(OutputError, match="it is a folder"):
            check_output(tmp_path / "folder.tif")

    def test_folder_that_cannot_be_written(self, tmp_path, monkeypatch):
        monkeypatch.setattr(os, "access", lambda path, mode: False)
        with pytest.raises(OutputError, match="is not writable"):
            check_output(tmp_path / "a.tif")

    @pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="needs Linux's /proc")
    def test_folder_that_refuses_new_files(self):
        with pytest.raises(OutputError, match="cannot write '/proc/self/a.tif'"):
            write("/proc/self/a.tif", hills(), like=raster_of(hills()))

    def test_existing_file(self, tmp_path):
        path = tmp_path / "a.tif"
        path.write_text("precious")
        with pytest.raises(OutputError, match="exists already.*--overwrite"):
            write(path, hills(), like=raster_of(hills()))
        assert path.read_text() == "precious"
        write(path, hills(), like=raster_of(hills()), overwrite=True)
        assert read(path).values.shape == (60, 80)

    def test_what_spoke_of_the_overwritten_file_goes(self, tmp_path):
        path = tmp_path / "a.tif"
        write(path, hills(), like=raster_of(hills()))
        dataset = gdal.Open(str(path))
        dataset.GetRasterBand(1).ComputeStatistics(False)
        dataset.BuildOverviews("NEAREST", [2])
        del dataset
        assert names(tmp_path) == ["a.tif", "a.tif.aux.xml", "a.tif.ovr"]
        write(path, hills(), like=raster_of(hills()), overwrite=True)
        assert names(tmp_path) == ["a.tif"]

    @pytest.mark.parametrize("alias", ["same", "link", "dots"])
    def test_never_over_the_input(self, tmp_path, alias):
        path = make_raster(tmp_path / "in.tif", hills())
        before = digest(path)
        target = {"same": tmp_path / "in.tif", "link": tmp_path / "link.tif",
                  "dots": tmp_path / ".." / tmp_path.name / "in.tif"}[alias]  # fmt: skip
        if alias == "link":
            target.symlink_to(path)
        source = read(path)
        with pytest.raises(InputError, match="is an input"):
            write(target, source.values, like=source, overwrite=True)
        assert digest(path) == before

    def test_never_over_a_source_of_the_input(self, tmp_path):
        inner = make_raster(tmp_path / "inner.tif", hills())
        vrt = str(tmp_path / "dem.vrt")
        made = gdal.Translate(vrt, inner, format="VRT")
        del made
        with pytest.raises(InputError, match="is an input"):
            check_output(inner, inputs=[vrt], overwrite=True)

    def test_an_input_that_is_gone_is_no_hindrance(self, tmp_path):
        path = make_raster(tmp_path / "out.tif", hills())
        check_output(path, inputs=[tmp_path / "gone.tif"], overwrite=True)


class TestNothingLeft:
    def test_cancelled_midway(self, tmp_path, capfd):
        class Impatient:
            asked = 0

            def report(self, fraction):
                pass

            def cancelled(self):
                self.asked += 1
                return self.asked > 1

        ground = hills(5000, 1000)
        progress = Impatient()
        (tmp_path / "a.tif").write_text("precious")
        with pytest.raises(Cancelled) as caught:
            write(
                tmp_path / "a.tif", ground, like=raster_of(ground), overwrite=True,
                progress=progress,
            )  # fmt: skip
        assert progress.asked == 2
        # Even while the exception is held, the file is closed: GDAL would go on writing it.
        assert caught.value is not None
        assert [name for name in open_files() if ".demsmith" in name] == []
        assert names(tmp_path) == ["a.tif"]
        assert (tmp_path / "a.tif").read_text() == "precious"
        assert capfd.readouterr() == ("", "")

    def test_values_of_another_shape(self, tmp_path):
        with pytest.raises(InputError, match="grid's shape"):
            write(tmp_path / "a.tif", hills(3, 3), like=raster_of(hills()))
        assert names(tmp_path) == []

    def test_a_type_geotiff_lacks(self, tmp_path):
        with pytest.raises(InputError, match="cannot hold float16"):
            write(tmp_path / "a.tif", hills(), like=raster_of(hills()), dtype=np.float16)

    @pytest.mark.skipif(sys.platform == "win32", reason="needs resource limits")
    @pytest.mark.parametrize("limit", [0, 300, 20_000, 400_000])
    @pytest.mark.parametrize("options", [(), ("COMPRESS=NONE", "TILED=NO")])
    def test_full_disk(self, tmp_path, limit, options):
        """A file size limit fails writes just like a full disk does."""
        code = f"""if True:
            import resource, numpy as np
            from demsmith.core.errors import OutputError
            from demsmith.core.raster import Grid, Raster, BandMeta, write
            resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))
            values = np.random.default_rng(1).integers(0, 2**15, (1200, 1000)).astype(np.int16)
            like = Raster(values, values < 0, Grid(values.shape), BandMeta(dtype=values.dtype))
            try:
                write("a.tif", values, like=like, creation_options={options!r})
            except OutputError as error:
                print("refused:", error)
        """
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
        )
        assert done.stdout.startswith("refused: cannot write 'a.tif': ")
        assert done.stdout.count("\n") == 1
        assert ".demsmith" not in done.stdout
        # From GDAL 3.10 on, libtiff prints a line of its own, past every handler.
        printed = [line for line in done.stderr.splitlines() if not line.startswith("_tiff")]
        assert printed == []
        assert names(tmp_path) == []


def test_work_within_unfinished_work_speaks_of_the_final_path(tmp_path):
    final = tmp_path / "a.tif"
    with (
        pytest.raises(OutputError) as caught,
        whole_or_nothing(final) as outer,
        whole_or_nothing(outer) as inner,
    ):
        raise cannot_write(inner, f"{inner}: disk full")
    assert str(caught.value) == f"cannot write '{final}': {final}: disk full"
    assert names(tmp_path) == []


def test_written_where_gdal_raises_exceptions(tmp_path):
    before = gdal.GetUseExceptions()
    gdal.UseExceptions()
    try:
        write(tmp_path / "a.tif", hills(), like=raster_of(hills()))
        with pytest.raises(InputError):
            write(tmp_path / "b.tif", hills(), like=raster_of(hills()), creation_options=["X=1"])
    finally:
        if not before:
            gdal.DontUseExceptions()
    assert names(tmp_path) == ["a.tif"]


def test_raster_of_unequal_shapes_is_refused():
    raster = raster_of(hills())
    with pytest.raises(InputError, match="differ in shape"):
        replace(raster, void=np.zeros((2, 2), bool))
