"""Drainage from file to file: units, orientations, voids, every output, and all or none."""

import os
from itertools import pairwise

import numpy as np
import pytest
from gdal_reading import read
from scenes import disc, fractal
from support import digest, make_raster

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.hydrology import DrainageOptions, drainage_area, drainage_file
from demsmith.core.voids import FillOptions, fill_file

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

SHAPE = (40, 50)
SQUARE = (500_000.0, 10.0, 0.0, 4_700_000.0, 0.0, -10.0)
UTM31 = "EPSG:32631"
FEET = "EPSG:2229"  # California zone 5 in US survey feet
VOID = disc(SHAPE, (12, 30), 4)
GROUND = np.rint(fractal(SHAPE, seed=3, relief=400)).astype(np.int16)
DEGREES = (10.0, 0.01, 0.0, 60.0, 0.0, -0.01)


def tile(path, values=GROUND, *, void=VOID, nodata=-32768, **options):
    values = values.copy()
    values[void] = nodata
    options = {"geotransform": SQUARE, "crs": UTM31, **options}
    return make_raster(path, values, nodata=nodata, **options)


def slope(path, **options):
    """Make ground that falls row by row in every column."""
    falls = np.repeat(np.arange(SHAPE[0], 0, -1)[:, None], SHAPE[1], axis=1).astype(np.float32)
    return tile(path, falls, void=np.zeros(SHAPE, bool), **options)


def area_of(path):
    """Values, NaN where nodata."""
    values, tag, _, _ = read(path)
    return np.where(values == tag, np.nan, values.astype(np.float64))


def lines(path):
    dataset = gdal.OpenEx(str(path), gdal.OF_VECTOR)
    layer = dataset.GetLayer(0)
    found = [(np.array(each.GetGeometryRef().GetPoints()), each.items()) for each in layer]
    layer = dataset = None
    return found


# --- area on the ground --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("crs", "geotransform", "cell"),
    [
        (UTM31, SQUARE, 100.0),
        (FEET, SQUARE, 100 * (1200 / 3937) ** 2),
        ("", SQUARE, 100.0),
        ("", None, 1.0),
        ("EPSG:4326", DEGREES, None),
    ],
)
def test_areas_add_up_down_a_slope(tmp_path, crs, geotransform, cell):
    source = slope(tmp_path / "in.tif", crs=crs, geotransform=geotransform)
    drainage_file(source, tmp_path / "out.tif", directions=tmp_path / "codes.tif")
    cells = raster.read_grid(source).cell_area_m2()
    if cell is not None:
        np.testing.assert_allclose(cells, cell, rtol=1e-12)
    else:
        assert cells[-1] > 1.01 * cells[0]
    expected = np.repeat(np.cumsum(cells)[:, None], SHAPE[1], axis=1)
    np.testing.assert_allclose(area_of(tmp_path / "out.tif"), expected, rtol=1e-12)
    codes = read(tmp_path / "codes.tif")[0]
    assert (codes[:-1] == 4).all()
    assert (codes[-1] == 0).all()


@pytest.mark.parametrize("flipped", [(0,), (1,), (0, 1)])
def test_rasters_that_begin_in_another_corner(tmp_path, flipped):
    names = ("area", "codes", "mask", "flags", "specific")
    outputs = {}
    for way in ((), flipped):
        x, width, _, y, _, height = SQUARE
        if 0 in way:
            y, height = y + SHAPE[0] * height, -height
        if 1 in way:
            x, width = x + SHAPE[1] * width, -width
        source = tile(
            tmp_path / "in.tif", np.flip(GROUND, way), void=np.flip(VOID, way),
            geotransform=(x, width, 0, y, 0, height),
        )  # fmt: skip
        drainage_file(
            source, tmp_path / "area.tif", directions=tmp_path / "codes.tif",
            stream_mask=tmp_path / "mask.tif", flags=tmp_path / "flags.tif",
            specific=tmp_path / "specific.tif", streams=tmp_path / "streams.gpkg",
            options=DrainageOptions(threshold=4000), overwrite=True,
        )  # fmt: skip
        rasters = [np.flip(read(tmp_path / f"{name}.tif")[0], way) for name in names]
        outputs[way] = rasters, lines(tmp_path / "streams.gpkg")
    for plain, other in zip(outputs[()][0], outputs[flipped][0], strict=True):
        np.testing.assert_array_equal(plain, other)
    for (plain, told), (other, too) in zip(outputs[()][1], outputs[flipped][1], strict=True):
        np.testing.assert_allclose(plain, other, rtol=0, atol=1e-6)
        assert told == too


@pytest.mark.parametrize(("unit", "factor"), [("m2", 100), ("km2", 1e-4), ("cells", 1)])
@pytest.mark.parametrize("method", ["d8", "mfd"])
def test_units(tmp_path, unit, factor, method):
    source = tile(tmp_path / "in.tif")
    options = DrainageOptions(unit=unit, method=method)
    result = drainage_file(
        source, tmp_path / "out.tif", coarse=tmp_path / "coarse.tif", options=options,
        stream_mask=tmp_path / "mask.tif",
    )  # fmt: skip
    cells = drainage_area(GROUND, VOID, pixel_size=10, unit="cells", method=method)
    area = area_of(tmp_path / "out.tif")
    np.testing.assert_allclose(area, factor * cells.area, rtol=1e-12)
    assert result.largest_area == np.nanmax(area)
    assert raster.read(tmp_path / "out.tif").meta.unit == unit
    # Streams are told in square metres by D8, whatever is asked for.
    by_d8 = drainage_area(GROUND, VOID, pixel_size=10, method="d8")
    expected = np.where(VOID, 255, by_d8.area >= 1e6)
    np.testing.assert_array_equal(read(tmp_path / "mask.tif")[0], expected)


# --- heights -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("unit", "scale", "metres"), [("m", 1, 1), ("ft", 1, 0.3048), ("m", 0.1, 0.1), ("m", -1, 1)]
)
@pytest.mark.parametrize("deep", [True, False])
def test_the_deepest_filling_is_in_metres(tmp_path, unit, scale, metres, deep):
    def describe(dataset):
        band = dataset.GetRasterBand(1)
        band.SetScale(scale)
        band.SetOffset(5)
        band.SetUnitType(unit)

    pit = np.full((7, 7), 50 * np.sign(scale), np.int16)
    pit[3, 3] = 40 * np.sign(scale)
    source = make_raster(tmp_path / "in.tif", pit, geotransform=SQUARE, crs=UTM31, setup=describe)
    options = DrainageOptions(max_depth=10 * metres * (1.001 if deep else 0.999))
    result = drainage_file(
        source, tmp_path / "out.tif", conditioned=tmp_path / "filled.tif", options=options
    )
    filled = raster.read(tmp_path / "filled.tif")
    expected = pit * scale + 5.0
    if deep:
        expected[3, 3] = 50 * abs(scale) + 5
    np.testing.assert_allclose(filled.values, expected, rtol=1e-6)
    assert (filled.meta.unit, filled.meta.scale, filled.meta.offset) == (unit, 1, 0)
    assert result.cells_changed == int(deep)


def test_scaled_heights_drain_as_what_they_mean(tmp_path):
    def depth(dataset):
        dataset.GetRasterBand(1).SetScale(-0.5)
        dataset.GetRasterBand(1).SetOffset(1000.0)

    tile(tmp_path / "plain.tif", 1000 - GROUND / np.float32(2))
    tile(tmp_path / "scaled.tif", setup=depth)
    for name in ("plain", "scaled"):
        drainage_file(
            tmp_path / f"{name}.tif", tmp_path / f"{name}_area.tif",
            options=DrainageOptions(method="mfd"),
        )  # fmt: skip
    np.testing.assert_array_equal(
        area_of(tmp_path / "plain_area.tif"), area_of(tmp_path / "scaled_area.tif")
    )


# --- outputs -------------------------------------------------------------------------------------


def test_every_raster_is_that_of_the_array_function(tmp_path):
    source = tile(tmp_path / "in.tif")
    before = digest(source)
    options = DrainageOptions(threshold=3000, coarse_factor=7)
    names = ("log", "specific", "directions", "flags", "conditioned", "stream_mask", "coarse")
    paths = {name: tmp_path / f"{name}.tif" for name in names}
    result = drainage_file(source, tmp_path / "area.tif", options=options, **paths)
    drained = drainage_area(GROUND, VOID, pixel_size=10, options=options)
    area = area_of(tmp_path / "area.tif")
    np.testing.assert_array_equal(area, drained.area)
    np.testing.assert_array_equal(np.isnan(area), VOID)
    np.testing.assert_allclose(area_of(paths["log"]), np.log10(area), rtol=1e-6)
    np.testing.assert_array_equal(area_of(paths["specific"]), drained.specific())
    for name, expected in (
        ("directions", drained.directions),
        ("flags", np.where(VOID, 255, drained.flags())),
        ("stream_mask", np.where(VOID, 255, drained.streams().mask)),
    ):
        np.testing.assert_array_equal(read(paths[name])[0], expected)
    np.testing.assert_array_equal(
        area_of(paths["conditioned"]), np.where(VOID, np.nan, drained.conditioned)
    )
    assert (drained.directions[VOID] == 247).all()
    assert read(paths["directions"])[1] == 247
    for name in names:
        grid = raster.read_grid(paths[name])
        if name != "coarse":
            assert grid == raster.read_grid(source)
    assert result.output == str(tmp_path / "area.tif")
    assert (result.cells, result.cells_void) == (GROUND.size, VOID.sum())
    changed = ~VOID & (drained.conditioned != GROUND)
    assert result.cells_changed == changed.sum() > 0
    assert result.links == len(drained.streams()) > 5
    assert result.as_dict()["log"] == str(paths["log"])
    assert digest(source) == before


def test_a_coarse_cell_has_the_largest_area_of_its_cells(tmp_path):
    source = tile(tmp_path / "in.tif")
    options = DrainageOptions(coarse_factor=8)
    drainage_file(source, tmp_path / "area.tif", coarse=tmp_path / "coarse.tif", options=options)
    area, coarse = area_of(tmp_path / "area.tif"), area_of(tmp_path / "coarse.tif")
    assert coarse.shape == (5, 7)
    for row, column in np.ndindex(coarse.shape):
        block = area[8 * row : 8 * row + 8, 8 * column : 8 * column + 8]
        assert coarse[row, column] == np.nanmax(block)
    assert read(tmp_path / "coarse.tif")[2] == (500_000, 80, 0, 4_700_000, 0, -80)


def test_streams_run_from_centre_to_centre_along_the_codes(tmp_path):
    source = tile(tmp_path / "in.tif", crs="EPSG:4326", geotransform=DEGREES)
    drainage_file(
        source, tmp_path / "area.tif", streams=tmp_path / "streams.gpkg",
        options=DrainageOptions(threshold=2e7),
    )  # fmt: skip
    grid = raster.read_grid(source)
    drained = drainage_area(
        GROUND, VOID, pixel_size=grid.pixel_size_m(), cell_area=grid.cell_area_m2(), threshold=2e7
    )
    streams = drained.streams()
    found = lines(tmp_path / "streams.gpkg")
    assert len(found) == len(streams) > 5
    x, y = grid.xy(streams.cells[:, 0], streams.cells[:, 1])
    np.testing.assert_allclose(np.vstack([place for place, _ in found]), np.column_stack([x, y]))
    for name, column in streams.columns.items():
        np.testing.assert_array_equal([told[name] for _, told in found], column)
    # A degree of longitude is half as long there: the ellipsoid tells.
    from geographiclib.geodesic import Geodesic

    for places, told in found[:5]:
        length = sum(
            Geodesic.WGS84.Inverse(b[1], b[0], a[1], a[0])["s12"] for a, b in pairwise(places)
        )
        assert told["length_m"] == pytest.approx(length, rel=1e-4)


@pytest.mark.parametrize("method", ["dinf", "mfd", "particles"])
def test_streams_of_other_methods_do_not_break_off(tmp_path, method):
    source = tile(tmp_path / "in.tif")
    for name in ("d8", method):
        options = DrainageOptions(method=name, threshold=3000, particles=1000)
        drainage_file(
            source, tmp_path / f"{name}.tif", streams=tmp_path / f"{name}.gpkg", options=options
        )
    assert [told for _, told in lines(tmp_path / "d8.gpkg")] == [
        told for _, told in lines(tmp_path / f"{method}.gpkg")
    ]
    assert (area_of(tmp_path / "d8.tif") != area_of(tmp_path / f"{method}.tif")).sum() > 1000


def test_particles_have_a_standard_error(tmp_path):
    source = tile(tmp_path / "in.tif")
    errors = []
    for particles in (10_000, 40_000):
        drainage_file(
            source, tmp_path / "area.tif", standard_error=tmp_path / "error.tif", overwrite=True,
            options=DrainageOptions(method="particles", particles=particles, seed=5),
        )  # fmt: skip
        error = area_of(tmp_path / "error.tif")
        np.testing.assert_array_equal(np.isnan(error), VOID)
        errors.append(np.nanmean(error[area_of(tmp_path / "area.tif") > 3000]))
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.1)


def test_options_without_a_meaning_are_refused(tmp_path):
    source = tile(tmp_path / "in.tif")
    for options, said in (
        (DrainageOptions(max_length=5), "ask for depressions breach"),
        (DrainageOptions(depressions="keep", max_depth=5), "not kept"),
    ):
        with pytest.raises(InputError, match=said):
            drainage_file(source, tmp_path / "out.tif", options=options)
    assert not (tmp_path / "out.tif").exists()


def test_the_sea_is_named(tmp_path):
    coast = np.maximum(GROUND - np.median(GROUND), 0)
    source = make_raster(tmp_path / "in.tif", coast, geotransform=SQUARE, crs=UTM31)
    drained = drainage_file(source, tmp_path / "land.tif")
    assert any("lie at 0, as the sea does" in warning for warning in drained.warnings)
    drained = drainage_file(source, tmp_path / "voids.tif", below=0)
    assert not any("sea" in warning for warning in drained.warnings)


# --- weights and filled cells --------------------------------------------------------------------


def test_weights_are_summed_instead_of_areas(tmp_path):
    source = tile(tmp_path / "in.tif")
    runoff = np.random.default_rng(1).integers(0, 100, SHAPE).astype(np.int16)
    runoff[3, 4] = -1

    def tenths(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)

    weights = make_raster(
        tmp_path / "runoff.tif", runoff, geotransform=SQUARE, crs=UTM31, nodata=-1, setup=tenths
    )
    result = drainage_file(source, tmp_path / "out.tif", weights=weights, log=tmp_path / "log.tif")
    real = np.where(runoff < 0, 0, 0.1 * runoff)
    expected = drainage_area(GROUND, VOID, pixel_size=10, weights=real).area
    area = area_of(tmp_path / "out.tif")
    np.testing.assert_allclose(area, expected, rtol=1e-12)
    assert "1 cells have an elevation but no weight" in result.warnings[-1]
    log = area_of(tmp_path / "log.tif")
    np.testing.assert_array_equal(np.isnan(log), ~(area > 0))
    # All that falls leaves: what outlets have is the sum.
    codes = drainage_area(GROUND, VOID, pixel_size=10).directions
    assert area[codes == 0].sum() == pytest.approx(real[~VOID].sum(), rel=1e-9)


def test_flags_tell_edges_and_filled_cells(tmp_path):
    source = tile(tmp_path / "in.tif")
    fill_file(
        source, tmp_path / "filled.tif", options=FillOptions(method="mcmd"),
        source_map=tmp_path / "sources.tif",
    )  # fmt: skip
    drainage_file(
        tmp_path / "filled.tif", tmp_path / "area.tif", flags=tmp_path / "flags.tif",
        filled_mask=tmp_path / "sources.tif", directions=tmp_path / "codes.tif",
    )  # fmt: skip
    flags, codes = read(tmp_path / "flags.tif")[0], read(tmp_path / "codes.tif")[0]
    assert (flags[VOID] & 2 > 0).all()
    edge = np.ones(SHAPE, bool)
    edge[1:-1, 1:-1] = False
    assert (flags[edge] & 1 > 0).all()
    for code, (row, column) in {1: (0, 1), 4: (1, 0), 64: (-1, 0), 16: (0, -1)}.items():
        here = np.argwhere(codes == code)
        below = here + np.array([row, column])
        # Whatever a cell has, the one below it has.
        lost = flags[tuple(here.T)] & ~flags[tuple(below.T)]
        assert not lost.any()
    assert {0, 1} <= set(np.unique(flags & 1))
    assert {0, 2} <= set(np.unique(flags & 2))
    drainage_file(
        tmp_path / "filled.tif", tmp_path / "area.tif", flags=tmp_path / "flags.tif",
        overwrite=True,
    )  # fmt: skip
    assert not (read(tmp_path / "flags.tif")[0] & 2).any()


# --- odd rasters ---------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(1, 1), (1, 6), (5, 1), (2, 2)])
@pytest.mark.parametrize("method", ["d8", "dinf", "mfd", "particles"])
def test_small_rasters(tmp_path, shape, method):
    values = np.arange(shape[0] * shape[1], dtype=np.float32).reshape(shape)
    source = make_raster(tmp_path / "in.tif", values, geotransform=SQUARE, crs=UTM31)
    result = drainage_file(
        source, tmp_path / "out.tif", options=DrainageOptions(method=method, particles=100),
        streams=tmp_path / "streams.gpkg", coarse=tmp_path / "coarse.tif",
        flags=tmp_path / "flags.tif", specific=tmp_path / "specific.tif",
    )  # fmt: skip
    assert result.largest_area <= 100 * values.size * 1.0001
    assert (read(tmp_path / "flags.tif")[0] & 1).all()


@pytest.mark.parametrize("depressions", ["fill", "breach", "keep"])
def test_depressions(tmp_path, depressions):
    source = tile(tmp_path / "in.tif")
    options = DrainageOptions(depressions=depressions)
    result = drainage_file(
        source, tmp_path / "out.tif", conditioned=tmp_path / "z.tif",
        directions=tmp_path / "codes.tif", options=options,
    )  # fmt: skip
    z, codes = area_of(tmp_path / "z.tif"), read(tmp_path / "codes.tif")[0]
    moved = z - np.where(VOID, np.nan, GROUND)
    sinks = codes[1:-1, 1:-1] == 0
    beside = sum(np.roll(VOID, (r, c), (0, 1)) for r in (-1, 0, 1) for c in (-1, 0, 1)) > 0
    inner = sinks & ~beside[1:-1, 1:-1]
    assert (result.cells_changed > 0) == (depressions != "keep")
    assert inner.any() == (depressions == "keep")
    assert (np.nanmax(moved) > 0) or depressions != "fill"
    assert (np.nanmin(moved) < 0) == (depressions == "breach")


def test_threads_do_not_matter(tmp_path):
    source = tile(tmp_path / "in.tif")
    made = []
    for threads in (1, 2):
        folder = tmp_path / str(threads)
        folder.mkdir()
        drainage_file(
            source, folder / "area.tif", specific=folder / "s.tif", flags=folder / "f.tif",
            streams=folder / "s.geojson", options=DrainageOptions(method="mfd", threshold=3000),
            threads=threads,
        )  # fmt: skip
        made.append([digest(folder / name) for name in ("area.tif", "s.tif", "f.tif")])
        made[-1].append(lines(folder / "s.geojson")[0][1])
    assert made[0] == made[1]


class Stop:
    """Cancels at a fraction of the way."""

    def __init__(self, at):
        self.at, self.last = at, 0

    def report(self, fraction):
        assert fraction >= self.last
        self.last = fraction

    def cancelled(self):
        return self.last >= self.at


@pytest.mark.parametrize("older", [False, True])
@pytest.mark.parametrize("at", [0.1, 0.4, 0.69, 0.85, 1.0])
def test_cancelled_leaves_nothing(tmp_path, older, at):
    source = tile(tmp_path / "in.tif")
    folder = tmp_path / "out"
    folder.mkdir()
    paths = {
        "output": folder / "area.tif", "streams": folder / "s.gpkg", "flags": folder / "f.tif",
        "coarse": folder / "c.tif",
    }  # fmt: skip
    if older:
        for path in paths.values():
            path.write_text("older")
    with pytest.raises(Cancelled):
        drainage_file(source, **paths, overwrite=older, progress=Stop(at))
    assert len(os.listdir(folder)) == (4 if older else 0)
    assert all((folder / name).read_text() == "older" for name in os.listdir(folder))


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        (dict(output="out.png"), InputError, "must be a GeoTIFF"),
        (dict(output="in.tif"), InputError, "is an input"),
        (dict(output="none/out.tif"), OutputError, "no folder"),
        (dict(log="out.tif"), InputError, "two outputs"),
        (dict(streams="streams.shp"), InputError, "shapefile"),
        (dict(streams="none/streams.gpkg"), OutputError, "no folder"),
        (dict(standard_error="error.tif"), InputError, "d8 has no standard error"),
        (
            dict(specific="s.tif", options=DrainageOptions(unit="cells")), InputError,
            "needs unit m2 or km2",
        ),
        (dict(filled_mask="in.tif"), InputError, "for the flags"),
        (dict(filled_mask="other.tif", flags="f.tif"), InputError, "other.tif', has 5 × 5 cells"),
        (dict(weights="other.tif"), InputError, "other.tif', has 5 × 5 cells"),
        (dict(weights="negative.tif"), InputError, "1 weights are negative .* such as -4"),
        (dict(weights="absent.tif"), InputError, "absent.tif"),
        (dict(band=2), InputError, "band 2"),
        (dict(below=1e5), InputError, "in.tif': every cell is a void"),
        (dict(options=DrainageOptions(exponent=-1)), InputError, "exponent is -1"),
        (dict(options=DrainageOptions(method="d9")), InputError, "d9"),
        (dict(creation_options=["COMPRESS=MAGIC"]), InputError, "creation option"),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_said_and_leaves_nothing(tmp_path, arguments, error, said):
    tile(tmp_path / "in.tif")
    make_raster(tmp_path / "other.tif", np.ones((5, 5), np.float32))
    negative = np.zeros(SHAPE, np.float32)
    negative[2, 3] = -4
    make_raster(tmp_path / "negative.tif", negative, geotransform=SQUARE, crs=UTM31)
    before = sorted(os.listdir(tmp_path))
    arguments = {"output": "out.tif", "overwrite": True, **arguments}
    for name, value in arguments.items():
        if isinstance(value, str):
            arguments[name] = tmp_path / value
    with pytest.raises(error, match=said):
        drainage_file(tmp_path / "in.tif", **arguments)
    assert sorted(os.listdir(tmp_path)) == before
