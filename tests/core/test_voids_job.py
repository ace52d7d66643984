"""From file to file: values, types, nodata tags, units."""

from pathlib import Path

import numpy as np
import pytest
from scenes import disc, fractal, holed, plane
from support import digest, make_raster
from void_files import SHAPE, VOID, every_method, source_map_is, stored, tile

from demsmith.core import raster
from demsmith.core.voids import FillOptions, fill_file, fill_voids

# --- values --------------------------------------------------------------------------------------


@every_method
def test_fill_as_the_array_function_does(tmp_path, method):
    source = tile(tmp_path / "in.tif")
    before = digest(source)
    result = fill_file(source, tmp_path / "out.tif", options=FillOptions(method=method))
    assert digest(source) == before
    read = raster.read(source)
    expected = fill_voids(
        read.values, read.void, method=method, pixel_size=read.grid.pixel_size_m()
    ).values
    values, void, nodata = stored(tmp_path / "out.tif")
    assert values.dtype == np.int16 and nodata == -32768
    np.testing.assert_array_equal(values, expected)
    assert not void.any()
    assert (result.voids, result.cells, result.largest_void) == (3, 4800, 253)
    assert (result.cells_void, result.cells_filled, result.cells_unfilled) == (273, 273, 0)
    assert result.output == str(tmp_path / "out.tif")
    assert result.source_map is None and result.uncertainty is None and result.report is None
    assert result.warnings == ()
    assert len(result.reasons) == (4 if method == "auto" else 0)


@pytest.mark.parametrize("driver", ["GTiff", "SRTMHGT", "AAIGrid", "ENVI"])
def test_what_is_read_may_be_of_any_kind(tmp_path, driver):
    if driver == "SRTMHGT":
        from support import make_hgt

        values = np.rint(fractal((1201, 1201), relief=900)).astype(np.int16)
        values[500:520, 600:630] = -32768
        source = make_hgt(tmp_path / "N10E020.hgt", values)
    else:
        source = tile(tmp_path / "in.asc", driver=driver)
    files = {path: digest(path) for path in Path(tmp_path).iterdir()}
    result = fill_file(source, tmp_path / "out.tif")
    assert {path: digest(path) for path in files} == files
    assert result.cells_unfilled == 0 and result.cells_filled > 200
    assert not stored(tmp_path / "out.tif")[1].any()


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "int32", "float32", "float64"])
def test_type_kept_or_float(tmp_path, dtype):
    nodata = 0 if dtype.startswith("u") else -9999
    ground = fractal(SHAPE, relief=200) + 20
    source = tile(tmp_path / "in.tif", dtype=dtype, nodata=nodata, ground=ground)
    fill_file(source, tmp_path / "same.tif")
    fill_file(source, tmp_path / "float.tif", options=FillOptions(float_output=True))
    same, real = stored(tmp_path / "same.tif")[0], stored(tmp_path / "float.tif")[0]
    assert same.dtype == dtype
    assert real.dtype == (dtype if dtype.startswith("f") else
                          "float64" if dtype == "int32" else "float32")  # fmt: skip
    if not dtype.startswith("f"):
        np.testing.assert_array_equal(same[VOID], np.rint(real[VOID]))
        assert (real[VOID] != np.rint(real[VOID])).any()
    np.testing.assert_array_equal(same[~VOID], ground.astype(dtype)[~VOID])


@every_method
def test_bytes_do_not_wrap_around(tmp_path, method):
    void = holed(SHAPE, (10, 40, 44, 60))
    ground = np.clip(plane(SHAPE, slope=(0, 5.0), height=40), 1, 255)
    source = tile(tmp_path / "in.tif", dtype="uint8", nodata=0, ground=ground, void=void)
    fill_file(source, tmp_path / "out.tif", options=FillOptions(method=method))
    values, left, _ = stored(tmp_path / "out.tif")
    assert not left.any()
    assert values[void].min() > 200


# --- nodata tags ---------------------------------------------------------------------------------


@every_method
def test_filled_ground_at_the_tags_value_is_ground(tmp_path, method):
    """Tag 0 on ground that crosses 0: the filled 0 must not read as a void."""
    ground = np.rint(plane(SHAPE, slope=(0, 1.0), height=-30))
    ground[ground == 0] = 1
    source = tile(tmp_path / "in.tif", nodata=0, ground=ground)
    result = fill_file(source, tmp_path / "out.tif", options=FillOptions(method=method))
    values, void, _ = stored(tmp_path / "out.tif")
    assert not void.any() and result.cells_unfilled == 0
    again = raster.read(tmp_path / "out.tif")
    assert not again.void.any()
    assert (values[VOID] == 0).any()


@every_method
def test_voids_left_are_tagged_whatever_their_tag(tmp_path, method):
    """A voids' tag that a filled cell would take gives way to another."""
    ground = np.rint(plane(SHAPE, slope=(0, 1.0), height=-30))
    ground[ground == 0] = 1
    source = tile(tmp_path / "in.tif", nodata=0, ground=ground)
    result = fill_file(
        source, tmp_path / "out.tif", source_map=tmp_path / "map.tif",
        options=FillOptions(method=method, interior_only=True),
    )  # fmt: skip
    values, void, nodata = stored(tmp_path / "out.tif")
    edge = holed(SHAPE, (0, 3, 70, 76))
    np.testing.assert_array_equal(void, edge)
    assert (values[VOID & ~edge] == 0).any() and nodata != 0
    assert (result.cells_filled, result.cells_unfilled) == (255, 18)
    assert source_map_is(tmp_path / "map.tif", VOID, edge, method)


@every_method
@pytest.mark.parametrize(
    ("options", "kept"),
    [
        (dict(max_size=252), disc(SHAPE, (30, 30), 9)),
        (dict(max_size=2), VOID & ~holed(SHAPE, (50, 52, 60, 61))),
        (dict(interior_only=True, max_size=100), VOID & ~holed(SHAPE, (50, 52, 60, 61))),
    ],
)
def test_voids_left_stay_nodata(tmp_path, options, kept, method):
    source = tile(tmp_path / "in.tif")
    result = fill_file(
        source, tmp_path / "out.tif", source_map=tmp_path / "map.tif",
        options=FillOptions(method=method, **options),
    )  # fmt: skip
    values, void, nodata = stored(tmp_path / "out.tif")
    assert nodata == -32768
    np.testing.assert_array_equal(void, kept)
    assert (values[kept] == -32768).all()
    source_map, unknown, tag = stored(tmp_path / "map.tif")
    assert source_map_is(tmp_path / "map.tif", VOID, kept, method)
    assert source_map.dtype == np.uint8 and tag is None and not unknown.any()
    assert result.cells_unfilled == kept.sum()
    assert [row["filled"] for row in result.table.rows()].count(False) >= 1


def test_float_voids_left_are_nodata(tmp_path):
    """Also NaN cells among tagged ones."""
    ground = fractal(SHAPE)
    source = tile(tmp_path / "in.tif", dtype="float32", nodata=-9999, ground=ground)
    fill_file(source, tmp_path / "out.tif", options=FillOptions(max_size=20))
    _, void, nodata = stored(tmp_path / "out.tif")
    assert nodata == -9999
    np.testing.assert_array_equal(void, disc(SHAPE, (30, 30), 9))


def test_named_voids(tmp_path):
    """nodata, below, above and a mask raster add to the tag."""
    ground = np.full(SHAPE, 100)
    ground[5, 5], ground[8, 8], ground[11, 11] = -5, 4000, 777
    mask = np.zeros(SHAPE, np.uint8)
    mask[14, 14] = 1
    source = tile(tmp_path / "in.tif", ground=ground)
    over = make_raster(tmp_path / "mask.tif", mask)
    result = fill_file(source, tmp_path / "out.tif", nodata=(777,), below=-1, above=3000, mask=over)
    assert result.voids == 3 + 4
    assert (stored(tmp_path / "out.tif")[0] == 100).all()


# --- units ---------------------------------------------------------------------------------------


def test_scaled_rasters_mean_the_same(tmp_path):
    """Decimetres with an offset: as the metres, to the rounding; tables speak of metres."""
    real = np.rint(fractal(SHAPE)) / 10 + 100
    metres = tile(tmp_path / "m.tif", dtype="float64", nodata=-9999, ground=real)

    def scaled(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(100.0)

    deci = tile(tmp_path / "dm.tif", ground=np.rint((real - 100) * 10), nodata=-32768, setup=scaled)
    for options in (
        FillOptions(),
        FillOptions(method="mcmd"),
        FillOptions(variant="paper", l=1.0, l_bu=3.0, datum=90.0),
        FillOptions(variant="weighted", r_s=0.2, relief=40.0, seed=3),
        FillOptions(r_s=0.2, seed=3),
    ):
        one = fill_file(metres, tmp_path / "a.tif", options=options, overwrite=True)
        other = fill_file(deci, tmp_path / "b.tif", options=options, overwrite=True)
        a, b = stored(tmp_path / "a.tif")[0], stored(tmp_path / "b.tif")[0]
        np.testing.assert_allclose(b * 0.1 + 100, a, atol=0.051)
        for name in ("rim_low", "rim_mean", "rim_high", "rim_relief"):
            np.testing.assert_allclose(
                getattr(other.table, name), getattr(one.table, name), atol=1e-9
            )
    meta = raster.read(tmp_path / "b.tif").meta
    assert (meta.scale, meta.offset) == (0.1, 100.0)


def test_feet_stay_feet(tmp_path):
    def feet(dataset):
        dataset.GetRasterBand(1).SetUnitType("ft")

    source = tile(tmp_path / "in.tif", setup=feet)
    fill_file(source, tmp_path / "out.tif")
    fill_file(tile(tmp_path / "m.tif"), tmp_path / "metres.tif")
    assert raster.read(tmp_path / "out.tif").meta.unit == "ft"
    np.testing.assert_array_equal(
        stored(tmp_path / "out.tif")[0], stored(tmp_path / "metres.tif")[0]
    )
