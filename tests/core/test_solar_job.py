"""Sunlight from file to file: values, units, orientation, every output, and all of them or none."""

import datetime
import os

import numpy as np
import pytest
from gdal_reading import read
from support import WGS84_3ARC, digest, hills, make_raster

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.solar import SolarOptions, When, solar_file, solar_irradiance
from demsmith.core.solar.place import placed

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

ROWS, COLUMNS = SHAPE = 48, 64
JUNE, DECEMBER = When(date="2024-06-20"), When(date="2024-12-21")
MORNING = When(instant="2024-12-21T08:30Z")
COARSE = SolarOptions(step=2)
VOID = np.zeros(SHAPE, bool)
VOID[10:14, 20:25] = True


def ground():
    """Mountains between about 0 and 3000 m."""
    return 4 * hills(*SHAPE, seed=4) - 800


def tile(path, *, values=None, **more):
    values = ground() if values is None else values
    return make_raster(
        path, np.where(VOID, -9999, values).astype(values.dtype), nodata=-9999, **more
    )


def wall(path, *, height=400, **more):
    """Level ground with a wall from north to south at two thirds of the way east."""
    values = np.zeros(SHAPE, np.int16)
    values[:, 43] = height
    return make_raster(path, values, **more)


def stored(path):
    values, tag, _, _ = read(path)
    return np.where(values == tag, np.nan, values)


def light_of(source, **more):
    tif = raster.read(source)
    return solar_irradiance(tif.values, tif.void, grid=tif.grid, options=COARSE, **more)


# --- what is written -----------------------------------------------------------------------------


def test_a_day_as_the_array_function_gives_it(tmp_path):
    source = tile(tmp_path / "in.tif")
    before = digest(source)
    parts = {name: tmp_path / f"{name}.tif" for name in ("beam", "diffuse", "reflected", "hours")}
    result = solar_file(source, tmp_path / "out.tif", when=JUNE, options=COARSE, **parts)
    light = light_of(source, days=[datetime.date(2024, 6, 20)])
    for name, path in {"total": tmp_path / "out.tif", **parts}.items():
        made, tag, geotransform, _ = read(path)
        assert (tag, made.dtype) == (-9999, np.float32)
        assert geotransform == read(source)[2]
        np.testing.assert_array_equal(stored(path), getattr(light, name))
    dataset = gdal.Open(str(tmp_path / "out.tif"))
    band = dataset.GetRasterBand(1)
    assert band.GetDescription() == "global irradiation [Wh/m²/day]"
    assert band.GetUnitType() == "Wh/m²/day"
    assert (result.cells, result.cells_void, result.unit) == (SHAPE[0] * SHAPE[1], 20, "Wh/m²/day")
    assert result.instants == light.instants > 5
    total = light.total[~VOID]
    assert (result.minimum, result.maximum) == (total.min(), total.max())
    assert result.mean == pytest.approx(total.mean(), rel=1e-5)
    assert digest(source) == before


def test_an_instant_with_its_shadows(tmp_path):
    source = tile(tmp_path / "in.tif")
    shadow = tmp_path / "shadow.tif"
    result = solar_file(source, tmp_path / "out.tif", when=MORNING, shadow=shadow)
    light = light_of(source, instant=datetime.datetime(2024, 12, 21, 8, 30, tzinfo=datetime.UTC))
    assert (result.unit, result.instants) == ("W/m²", 1)
    np.testing.assert_array_equal(stored(tmp_path / "out.tif"), light.total)
    mask, tag, _, _ = read(shadow)
    assert (mask.dtype, tag) == (np.uint8, 255)
    np.testing.assert_array_equal(mask, np.where(VOID, 255, light.shadow))
    assert 0.01 < light.shadow.mean() < 0.99
    dataset = gdal.Open(str(shadow))
    band = dataset.GetRasterBand(1)
    dataset.GetMetadata()  # makes GDAL look into the sidecar
    assert band.GetCategoryNames() == ["sun", "shadow"]
    assert band.GetColorTable().GetColorEntry(0) == (255, 236, 150, 255)


def test_watts_are_the_mean_power_of_the_day(tmp_path):
    source = tile(tmp_path / "in.tif")
    for name, watts in (("sum", False), ("mean", True)):
        result = solar_file(
            source, tmp_path / f"{name}.tif", when=JUNE, options=COARSE, watts=watts,
            beam=tmp_path / f"{name}-beam.tif",
        )  # fmt: skip
    assert result.unit == "W/m²"
    for name in ("", "-beam"):
        sums, means = (stored(tmp_path / f"{kind}{name}.tif") for kind in ("sum", "mean"))
        np.testing.assert_allclose(means, sums / 24, rtol=1e-6)


def test_a_range_is_the_mean_of_its_days(tmp_path):
    source = tile(tmp_path / "in.tif")
    solar_file(
        source, tmp_path / "mean.tif", when=When(range=("2024-06-20", "2024-12-18"), every=180),
        options=COARSE,
    )  # fmt: skip
    days = []
    for date in ("2024-08-04", "2024-11-03"):
        solar_file(source, tmp_path / f"{date}.tif", when=When(date=date), options=COARSE)
        days.append(stored(tmp_path / f"{date}.tif"))
    np.testing.assert_allclose(stored(tmp_path / "mean.tif"), np.mean(days, axis=0), rtol=1e-4)


def test_sky_view_and_horizons(tmp_path):
    source = wall(tmp_path / "in.tif")
    sky, horizons = tmp_path / "sky.tif", tmp_path / "horizons.tif"
    solar_file(
        source, tmp_path / "out.tif", when=JUNE, sky_view=sky, horizons=horizons,
        options=SolarOptions(step=2, directions=8),
    )  # fmt: skip
    dataset = gdal.Open(str(horizons))
    assert dataset.RasterCount == 8
    assert dataset.GetRasterBand(3).GetDescription() == "horizon at azimuth 90° [°]"
    assert dataset.GetRasterBand(3).GetUnitType() == "°"
    angles = np.frombuffer(dataset.ReadRaster(), np.float32).reshape(8, *SHAPE)
    dx = raster.read(source).grid.pixel_size_m().dx[20]
    # Cells west of the wall see it in the east and nothing in the west; cells east of it see the
    # opposite.
    np.testing.assert_allclose(angles[2, 20, 38], np.degrees(np.arctan(400 / (5 * dx))), atol=0.05)
    assert angles[6, 20, 38] == 0
    np.testing.assert_allclose(angles[6, 20, 46], np.degrees(np.arctan(400 / (3 * dx))), atol=0.05)
    factor = stored(sky)
    assert factor.max() <= 1
    assert factor[20, 2] > 0.98 > 0.9 > factor[20, 42]


# --- what is read --------------------------------------------------------------------------------


def test_rows_may_begin_in_the_south(tmp_path):
    x, width, _, y, _, height = WGS84_3ARC
    south = (x, width, 0.0, y + ROWS * height, 0.0, -height)
    sources = {
        "north": tile(tmp_path / "north-up.tif"),
        "south": make_raster(
            tmp_path / "south-up.tif", np.where(VOID, -9999, ground())[::-1].astype(np.int16),
            nodata=-9999, geotransform=south,
        ),
    }  # fmt: skip
    made = {}
    for name, source in sources.items():
        others = {
            part: tmp_path / f"{name}-{part}.tif" for part in ("shadow", "sky_view", "horizons")
        }
        solar_file(
            source, tmp_path / f"{name}.tif", when=MORNING, **others,
            options=SolarOptions(directions=4),
        )  # fmt: skip
        made[name] = [stored(path) for path in (tmp_path / f"{name}.tif", *others.values())]
    for north, south in zip(made["north"], made["south"], strict=True):
        assert np.nanstd(north) > 0
        np.testing.assert_allclose(south[..., ::-1, :], north, rtol=1e-4, atol=1e-4)


def test_elevations_are_brought_to_metres(tmp_path):
    def feet(dataset):
        dataset.GetRasterBand(1).SetUnitType("ft")

    def decimetres(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(100.0)

    metres = ground().astype(np.float32)
    sources = [
        tile(tmp_path / "m.tif", values=metres),
        tile(tmp_path / "ft.tif", values=(metres / 0.3048).astype(np.float32), setup=feet),
        tile(
            tmp_path / "dm.tif", values=(10 * (metres - 100)).astype(np.float32), setup=decimetres
        ),
    ]
    made = []
    for source in sources:
        solar_file(source, tmp_path / "out.tif", when=DECEMBER, options=COARSE, overwrite=True)
        made.append(stored(tmp_path / "out.tif"))
    for other in made[1:]:
        np.testing.assert_allclose(other, made[0], rtol=1e-4)


def test_voids_named_by_the_user_are_none_in_the_output(tmp_path):
    source = tile(tmp_path / "in.tif")
    solar_file(source, tmp_path / "out.tif", when=JUNE, options=COARSE, above=1500)
    np.testing.assert_array_equal(np.isnan(stored(tmp_path / "out.tif")), VOID | (ground() >= 1500))


@pytest.mark.parametrize("georeferenced", [True, False])
def test_a_raster_without_crs_lies_where_it_is_told(tmp_path, georeferenced):
    """As the same ground in UTM, on its middle meridian."""
    cells = (500_000 - COLUMNS / 2, 1.0, 0.0, 5_200_000 + ROWS / 2, 0.0, -1.0)
    utm = tile(tmp_path / "utm.tif", geotransform=cells, crs="EPSG:32632")
    bare = tile(tmp_path / "bare.tif", geotransform=cells if georeferenced else None, crs="")
    place = raster.places_of(raster.read(utm).grid, (ROWS - 1) / 2, (COLUMNS - 1) / 2)
    when = When(instant="2024-03-01T09:00Z")
    solar_file(utm, tmp_path / "1.tif", when=when)
    solar_file(
        bare,
        tmp_path / "2.tif",
        when=when,
        latitude=place.latitude[0],
        longitude=place.longitude[0],
    )
    np.testing.assert_allclose(
        stored(tmp_path / "2.tif"), stored(tmp_path / "1.tif"), rtol=2e-3, atol=0.2
    )
    assert raster.read(tmp_path / "2.tif").grid == raster.read(bare).grid


def test_the_place_of_a_raster_that_has_one_is_its_own():
    grid = raster.Grid((4, 5), WGS84_3ARC, "EPSG:4326")
    assert placed(grid) is grid
    with pytest.raises(InputError, match="itself tells"):
        placed(grid, latitude=10)


@pytest.mark.parametrize("place", [{}, {"longitude": 5}, {"latitude": 91}, {"latitude": np.nan}])
def test_no_place_on_the_earth(place):
    with pytest.raises(InputError, match="latitude|longitude"):
        placed(raster.Grid((4, 5)), **place)


# --- when ----------------------------------------------------------------------------------------


def test_choices_of_when():
    assert When(day=60).times() == {"days": [datetime.date(2024, 2, 29)]}
    assert When(day=60, year=2023).times() == {"days": [datetime.date(2023, 3, 1)]}
    assert When(date="2021-07-04").times() == {"days": [datetime.date(2021, 7, 4)]}
    assert len(When(annual=True).days()) == 366
    assert When(annual=True, year=2023, every=100).days() == [
        datetime.date(2023, 1, 1) + datetime.timedelta(days=n) for n in (45, 136, 228, 319)
    ]
    assert len(When(range=("2023-12-30", "2024-01-02")).days()) == 4
    instant = When(instant="2024-06-20T09:30+02:00").times()["instant"]
    assert instant == datetime.datetime(2024, 6, 20, 7, 30, tzinfo=datetime.UTC)
    assert When(instant="2024-06-20T09:30").times()["instant"].tzinfo == datetime.UTC


@pytest.mark.parametrize(
    ("choice", "said"),
    [
        (dict(), "nothing is given"),
        (dict(day=3, annual=True), "day and annual are given"),
        (dict(day=0), "1 to 366"),
        (dict(day=366, year=2023), "1 to 365"),
        (dict(date="2024-13-01"), "is no date"),
        (dict(date="2024-06-20", year=2023), "year goes with"),
        (dict(range=("2024-06-20", "2024-06-19")), "before it begins"),
        (dict(day=3, every=2), "every goes with"),
        (dict(annual=True, every=0), "every is 0"),
        (dict(annual=True, year=0), "year is 0"),
        (dict(instant="2024-06-20"), "no date and time"),
        (dict(instant="noon"), "no date and time"),
    ],
)  # fmt: skip
def test_wrong_choices_of_when(choice, said):
    with pytest.raises(InputError, match=said):
        When(**choice).times()


# --- all or nothing ------------------------------------------------------------------------------


class Stop:
    """Cancels at a fraction of the way."""

    def __init__(self, at):
        self.at, self.last = at, 0

    def report(self, fraction):
        assert fraction >= self.last - 1e-9
        self.last = fraction

    def cancelled(self):
        return self.last >= self.at


@pytest.mark.parametrize("older", [False, True])
@pytest.mark.parametrize("at", [0.03, 0.3, 0.7, 0.9, 1.0])
def test_cancelled_leaves_nothing(tmp_path, older, at):
    source = tile(tmp_path / "in.tif")
    folder = tmp_path / "out"
    folder.mkdir()
    outputs = {name: folder / f"{name}.tif" for name in ("output", "sky_view", "horizons")}
    if older:
        for path in outputs.values():
            path.write_text("older")
    with pytest.raises(Cancelled):
        solar_file(
            source, when=JUNE, options=SolarOptions(step=2, directions=8), overwrite=older,
            progress=Stop(at), **outputs,
        )  # fmt: skip
    assert sorted(os.listdir(folder)) == (sorted(p.name for p in outputs.values()) if older else [])
    assert all(path.read_text() == "older" for path in outputs.values() if older)


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        (dict(output="out.png"), InputError, "must be a GeoTIFF"),
        (dict(beam="in.tif"), InputError, "is an input"),
        (dict(hours="out.tif"), InputError, "two outputs"),
        (dict(output="none/out.tif"), OutputError, "no folder"),
        (dict(shadow="shadow.tif"), InputError, "shadow mask is of an instant"),
        (dict(when=MORNING, hours="hours.tif"), InputError, "hours of sun"),
        (dict(when=MORNING, watts=True), InputError, "watts in any case"),
        (dict(band=2), InputError, "band 2"),
        (dict(below=1e5), InputError, "in.tif': every cell is a void"),
        (dict(latitude=5.0), InputError, "in.tif': latitude is given"),
        (dict(options=SolarOptions(step=9)), InputError, "step is 9"),
        (dict(creation_options=["COMPRESS=MAGIC"]), InputError, "creation option"),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_said_and_leaves_nothing(tmp_path, arguments, error, said):
    source = tile(tmp_path / "in.tif")
    arguments = {"output": "out.tif", "when": JUNE, "options": COARSE, **arguments}
    for name in ("output", "beam", "hours", "shadow"):
        if name in arguments:
            arguments[name] = tmp_path / arguments[name]
    with pytest.raises(error, match=said):
        solar_file(source, overwrite=True, **arguments)
    assert os.listdir(tmp_path) == ["in.tif"]


def test_threads_do_not_matter(tmp_path):
    source = tile(tmp_path / "in.tif")
    digests = set()
    for threads in (1, 3):
        outputs = [tmp_path / f"{name}{threads}.tif" for name in ("out", "sky", "horizons")]
        solar_file(
            source, outputs[0], sky_view=outputs[1], horizons=outputs[2], when=JUNE,
            options=SolarOptions(step=2, directions=4), threads=threads,
        )  # fmt: skip
        digests.add(tuple(digest(path) for path in outputs))
    assert len(digests) == 1
