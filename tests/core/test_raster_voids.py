"""Which cells count as voids, and what is said of odd ones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import hills, make_raster

from demsmith.core.errors import InputError
from demsmith.core.raster import BandMeta, read
from demsmith.core.raster.nodata import VoidFinder

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")


def place(values, *odd):
    """Put odd values into the first row, from its second cell on."""
    values[0, 1 : 1 + len(odd)] = odd
    return values


def voids(raster):
    return [tuple(int(term) for term in cell) for cell in np.argwhere(raster.void)]


def test_nodata_tag(tmp_path):
    raster = read(make_raster(tmp_path / "a.tif", place(hills(), -3, -4, -3), nodata=-3))
    assert voids(raster) == [(0, 1), (0, 3)]
    assert raster.notes == ()


def test_user_values_add_to_the_tag(tmp_path):
    path = make_raster(tmp_path / "a.tif", place(hills(), -3, -4, -5), nodata=-3)
    assert voids(read(path, nodata=[-4, 1e9, 0.5])) == [(0, 1), (0, 2)]
    assert voids(read(path, nodata=-4)) == [(0, 1), (0, 2)]


def test_untagged_sentinels_of_integers(tmp_path):
    path = make_raster(tmp_path / "a.tif", place(hills(), -32768, -32767, -32766, -9999))
    raster = read(path)
    assert voids(raster) == [(0, 1), (0, 2)]
    notes = " | ".join(raster.notes)
    assert "1 cell holds -32768, a common void mark, though the band has no nodata tag" in notes
    assert "1 cell holds -32767" in notes
    assert "2 cells hold values from -32766 to -9999" in notes


def test_wrong_tag_does_not_hide_sentinels(tmp_path):
    path = make_raster(tmp_path / "a.tif", place(hills(), -32768, -9999), nodata=-9999)
    raster = read(path)
    assert voids(raster) == [(0, 1), (0, 2)]
    assert raster.meta.nodata == -9999
    (note,) = raster.notes
    assert "though the band is tagged with nodata -9999; counted as voids" in note


def test_sentinels_in_floats_are_left_to_the_user(tmp_path):
    path = make_raster(tmp_path / "a.tif", place(hills(dtype=np.float32), -32768, -32768))
    raster = read(path)
    assert voids(raster) == []
    assert "add --nodata -32768" in raster.notes[0]
    assert "2 cells hold the value -32768" in raster.notes[0]
    assert len(voids(read(path, nodata=[-32768]))) == 2


def test_unreal_floats(tmp_path):
    odd = (np.nan, np.inf, -np.inf, -3.4028235e38, 1e38)
    path = make_raster(tmp_path / "a.tif", place(hills(dtype=np.float32), *odd))
    raster = read(path)
    assert voids(raster) == [(0, column) for column in range(1, 6)]
    assert "2 cells hold values beyond 1e30; counted as voids" in raster.notes[0]
    tagged = read(
        make_raster(tmp_path / "b.tif", place(hills(dtype=np.float32), 1e38), nodata=1e38)
    )
    assert (len(voids(tagged)), tagged.notes) == (1, ())


def test_inexact_float_tag(tmp_path):
    path = make_raster(tmp_path / "a.tif", place(hills(dtype=np.float32), -9999.9), nodata=-9999.9)
    raster = read(path)
    assert voids(raster) == [(0, 1)]


def test_nan_tag_and_zero_tag_with_nan(tmp_path):
    ground = place(hills(dtype=np.float32), np.nan, 0)
    assert len(voids(read(make_raster(tmp_path / "a.tif", ground, nodata=float("nan"))))) == 1
    assert len(voids(read(make_raster(tmp_path / "b.tif", ground, nodata=0)))) == 2


def test_tag_that_the_type_cannot_hold(tmp_path):
    path = make_raster(tmp_path / "a.tif", hills().astype(np.uint16), nodata=-9999)
    raster = read(path)
    assert raster.meta.nodata is None
    assert "nodata -9999, which uint16 cannot hold" in raster.notes[0]
    assert not raster.void.any()


def test_thresholds_are_of_real_heights(tmp_path):
    def setup(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(100)

    stored = np.array([[0, 1000, 2000, 3000]], np.int16)  # 100, 200, 300, 400 m
    path = make_raster(tmp_path / "a.tif", stored, setup=setup)
    assert read(path, below=200).void.tolist() == [[True, True, False, False]]
    assert read(path, above=300).void.tolist() == [[False, False, True, True]]
    assert read(path, below=100, above=400).void.tolist() == [[True, False, False, True]]


def test_all_void_is_still_read(tmp_path):
    raster = read(make_raster(tmp_path / "a.tif", np.full((4, 5), -1, np.int16), nodata=-1))
    assert raster.void.all()


def test_mask_bands(tmp_path):
    valid = np.full((60, 80), 255, np.uint8)
    valid[2, 3:6] = 0

    def setup(dataset):
        gdal.SetConfigOption("GDAL_TIFF_INTERNAL_MASK", "YES")
        dataset.CreateMaskBand(gdal.GMF_PER_DATASET)
        gdal.SetConfigOption("GDAL_TIFF_INTERNAL_MASK", None)
        dataset.GetRasterBand(1).GetMaskBand().WriteRaster(0, 0, 80, 60, valid)

    raster = read(make_raster(tmp_path / "a.tif", hills(), setup=setup))
    np.testing.assert_array_equal(raster.void, valid == 0)


def test_mask_band_in_a_sidecar_and_large(tmp_path):
    valid = np.full((2500, 1100), 255, np.uint8)
    valid[2400:, 7] = 0

    def setup(dataset):
        dataset.CreateMaskBand(gdal.GMF_PER_DATASET)
        dataset.GetRasterBand(1).GetMaskBand().WriteRaster(0, 0, 1100, 2500, valid)

    raster = read(make_raster(tmp_path / "a.tif", hills(2500, 1100), setup=setup))
    np.testing.assert_array_equal(raster.void, valid == 0)


def test_alpha_band(tmp_path):
    bands = np.stack([hills() % 250, np.full((60, 80), 255)]).astype(np.uint8)
    bands[1, 4, 4] = 0
    path = make_raster(tmp_path / "a.tif", bands, options=["ALPHA=YES"])
    assert voids(read(path)) == [(4, 4)]


class TestMaskRaster:
    def test_non_zero_valid_cells_are_voids(self, tmp_path):
        mask = np.zeros((60, 80), np.uint8)
        mask[0, :4] = [1, 255, 9, 0]
        dem = make_raster(tmp_path / "a.tif", place(hills(), 0, 0, 0, -1), nodata=-1)
        path = make_raster(tmp_path / "mask.tif", mask, nodata=9)
        assert voids(read(dem, mask=path)) == [(0, 0), (0, 1), (0, 4)]

    def test_masked_cells_are_no_longer_odd(self, tmp_path):
        mask = np.zeros((60, 80), np.uint8)
        mask[0, 1] = 1
        dem = make_raster(tmp_path / "a.tif", place(hills(), -9999))
        raster = read(dem, mask=make_raster(tmp_path / "mask.tif", mask))
        assert (voids(raster), raster.notes) == ([(0, 1)], ())

    def test_floats_and_nan(self, tmp_path):
        mask = np.zeros((60, 80), np.float32)
        mask[0, :3] = [0.5, np.nan, -1]
        dem = make_raster(tmp_path / "a.tif", hills())
        path = make_raster(tmp_path / "mask.tif", mask)
        assert voids(read(dem, mask=path)) == [(0, 0), (0, 2)]

    def test_other_size_is_refused(self, tmp_path):
        dem = make_raster(tmp_path / "a.tif", hills())
        path = make_raster(tmp_path / "mask.tif", np.zeros((60, 81), np.uint8))
        with pytest.raises(InputError, match="mask.tif' has 60 × 81 cells, .*a.tif' 60 × 80"):
            read(dem, mask=path)

    def test_other_place_is_refused(self, tmp_path):
        dem = make_raster(tmp_path / "a.tif", hills())
        path = make_raster(
            tmp_path / "mask.tif", np.zeros((60, 80), np.uint8),
            geotransform=(11.0, 1 / 1200, 0.0, 50.0, 0.0, -1 / 1200),
        )  # fmt: skip
        with pytest.raises(InputError, match="mask.tif' lies elsewhere than '.*a.tif'"):
            read(dem, mask=path)


class TestImplausibleHeights:
    def note(self, tmp_path, *odd, unit="m", dtype=np.int16, **options):
        def setup(dataset):
            dataset.GetRasterBand(1).SetUnitType(unit)

        values = place(hills(dtype=dtype), *odd)
        raster = read(make_raster(tmp_path / "a.tif", values, setup=setup, **options))
        assert not raster.void.any()
        return " | ".join(raster.notes)

    def test_one_value_is_named_with_its_remedy(self, tmp_path):
        note = self.note(tmp_path, -9999, -9999)
        assert "2 cells hold the value -9999, outside the -500 to 9000 m of land on Earth" in note
        assert "left as they are: if they are voids, add --nodata -9999" in note

    def test_a_range_is_named_with_thresholds(self, tmp_path):
        note = self.note(tmp_path, -600, -700, 12000)
        assert "3 cells hold values from -700 to 12000" in note
        assert "add --below -500 --above 9000" in note

    def test_the_land_of_the_earth_is_plausible(self, tmp_path):
        assert self.note(tmp_path, -430, 8849) == ""

    def test_feet(self, tmp_path):
        assert self.note(tmp_path, 29000, unit="ft") == ""
        assert self.note(tmp_path, 14000, unit="").count("unless they are feet") == 1
        assert "30000" in self.note(tmp_path, 30000, unit="us-ft")

    def test_feet_of_a_compound_crs(self, tmp_path):
        options = dict(crs="EPSG:2263+6360", geotransform=(9e5, 30, 0, 2e5, 0, -30), unit="")
        assert self.note(tmp_path, 29000, **options) == ""

    def test_other_planets(self, tmp_path):
        assert self.note(tmp_path, 21000, -8000, crs="IAU_2015:49900") == ""

    def test_a_threshold_silences(self, tmp_path):
        path = make_raster(tmp_path / "a.tif", place(hills(), -9999))
        raster = read(path, below=-500)
        assert (voids(raster), raster.notes) == ([(0, 1)], ())


@settings(max_examples=60, deadline=None)
@given(
    dtype=st.sampled_from(["int16", "int32", "uint8", "float32", "float64"]),
    rows=st.integers(1, 9),
    seed=st.integers(0, 2**32 - 1),
    cut=st.integers(1, 9),
)
def test_blocks_do_not_change_what_is_found(dtype, rows, seed, cut):
    rng = np.random.default_rng(seed)
    pool = [0, 1, 100, 200]
    if dtype != "uint8":
        pool += [-32768, -32767, -9999, 9500]
    if dtype.startswith("float"):
        pool += [np.nan, np.inf, 1e31]
    values = rng.choice(np.array(pool), size=(rows, 7)).astype(dtype)
    meta = BandMeta(dtype=np.dtype(dtype), nodata=1)
    found = []
    for step in (rows, cut):
        void = np.zeros(values.shape, bool)
        finder = VoidFinder(meta, nodata=[200], above=9400)
        for start in range(0, rows, step):
            finder.find(values[start : start + step], void[start : start + step])
        found.append((void.tolist(), finder.notes()))
    assert found[0] == found[1]
    expected = np.isin(values, [1, 200, 9500]) | ~(np.abs(values.astype(float)) < 1e30)
    if dtype.startswith("int"):
        expected |= np.isin(values, [-32768, -32767])
    assert found[0][0] == expected.tolist()
