"""Light on terrain: against the formulas cell by cell, known shadows, and all over the Earth."""

import datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import hills

pytest.importorskip("pvlib", reason="pvlib is missing")
pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.raster import Grid, north_up, places_of
from demsmith.core.relief.gradient import gradient
from demsmith.core.solar import irradiance, sectors, solar_irradiance
from demsmith.core.solar.atmosphere import clear_sky
from demsmith.core.solar.horizon import horizon_tangent
from demsmith.core.solar.position import altitude_azimuth, sun_at

ALPS = Grid((90, 110), (8.0, 1 / 1200, 0, 46.5, 0, -1 / 1200), "EPSG:4326")
UTM = Grid((90, 110), (300000.0, 80.0, 0, 5150000.0, 0, -80.0), "EPSG:32632")
MORNING = datetime.datetime(2024, 10, 5, 7, 20)
NOON = datetime.datetime(2024, 10, 5, 11, 15)
DAY = [datetime.date(2024, 10, 5)]
PARTS = ("total", "beam", "diffuse", "reflected")


def ground(grid=ALPS):
    """Steep ground: slopes up to some 60°."""
    return 1500 + 9 * (hills(*grid.shape, dtype=np.float32) - 500)


def expected(z, grid, instant, *, linke=3.0, albedo=0.2):
    """The light of an instant by plain formulas in double precision, and where the sun shines."""
    rows, columns = np.indices(z.shape)
    places = places_of(grid, rows, columns)
    sun = sun_at(np.array([instant], "datetime64[ms]"))
    altitude, azimuth = (
        np.radians(angle[0].reshape(z.shape)) for angle in altitude_azimuth(sun, places.frame)
    )
    sizes, none = grid.pixel_size_m(), np.zeros(z.shape, bool)
    east, north = (part.astype(float) for part in gradient(z, none, *sizes))
    slope, sine = np.arctan(np.hypot(east, north)), np.sin(altitude)
    facing = sine - np.cos(altitude) * (np.sin(azimuth) * east + np.cos(azimuth) * north)
    facing *= np.cos(slope)
    middle = np.degrees(azimuth[z.shape[0] // 2, z.shape[1] // 2])
    lit = (facing > 0) & (
        horizon_tangent(z, none, *sizes, middle, refraction=0.0) <= np.tan(altitude)
    )
    extra = 1367 / sun.distance[0] ** 2
    through, scattered = clear_sky("linke", sine, z, linke)
    # Muneer 1990, as Hofierka and Šúri 2002 write it: equations 24 to 31.
    bend = np.sin(slope) - slope * np.cos(slope) - np.pi * np.sin(slope / 2) ** 2
    sky = (1 + np.cos(slope)) / 2
    even = (0.00263 - 0.712 * through - 0.6883 * through**2) * bend + sky
    level = (facing - sine * np.cos(slope)) / np.cos(altitude)
    around = np.where(altitude >= 0.1, facing / sine, level / (0.1 - 0.008 * altitude))
    bright = np.where(lit, even * (1 - through) + through * around, sky + 0.252271 * bend)
    direct = np.where(lit, through, 0)
    return lit, {
        "beam": extra * direct * facing,
        "diffuse": extra * scattered * bright,
        "reflected": extra * albedo * (direct * sine + scattered) * (1 - sky),
    }


# --- an instant ----------------------------------------------------------------------------------


@pytest.mark.parametrize("instant", [MORNING, NOON], ids=["low sun", "noon"])
@pytest.mark.parametrize("grid", [ALPS, UTM], ids=["degrees", "utm"])
def test_an_instant_is_what_the_formulas_say(grid, instant):
    z = ground(grid)
    light = solar_irradiance(z, grid=grid, instant=instant)
    lit, parts = expected(z, grid, instant)
    assert light.unit == "W/m²" and light.instants == 1 and light.hours is None
    same = light.shadow == ~lit
    assert same.mean() > 0.995  # the azimuth of the sun is not quite the same in all cells
    assert (0.2 if instant is MORNING else 0) <= light.shadow.mean() < 0.7
    for name, values in parts.items():
        np.testing.assert_allclose(getattr(light, name)[same], values[same], rtol=2e-3, atol=0.05)
    np.testing.assert_allclose(light.total, light.beam + light.diffuse + light.reflected, rtol=1e-5)


def test_level_ground_has_beam_and_sky():
    z = np.full(ALPS.shape, 800.0)
    light = solar_irradiance(z, grid=ALPS, instant=NOON.replace(tzinfo=datetime.UTC), linke=4.0)
    _, parts = expected(z.astype(np.float32), ALPS, NOON, linke=4.0)
    for name in ("beam", "diffuse"):
        np.testing.assert_allclose(getattr(light, name), parts[name], rtol=3e-4)
    assert (light.reflected == 0).all() and not light.shadow.any()


def test_an_instant_with_a_zone_is_that_in_utc():
    zone = datetime.timezone(datetime.timedelta(hours=-7))
    instants = NOON, NOON.replace(tzinfo=datetime.UTC).astimezone(zone)
    one, other = (solar_irradiance(ground(), grid=ALPS, instant=each) for each in instants)
    np.testing.assert_array_equal(one.total, other.total)


def test_at_night_there_is_no_light():
    light = solar_irradiance(ground(), grid=ALPS, instant=datetime.datetime(2024, 10, 5, 23))
    assert light.instants == 0 and light.shadow.all()
    assert all((getattr(light, name) == 0).all() for name in PARTS)


@pytest.mark.parametrize("shadows", [True, False])
def test_the_shadow_of_a_wall_is_as_long_as_it_should(shadows):
    # In the middle of a UTM zone grid north is true north; the wall runs along it.
    grid = Grid((60, 200), (499000.0, 10.0, 0, 5150000.0, 0, -10.0), "EPSG:32632")
    z = np.zeros(grid.shape)
    z[:, 100] = 150.0
    light = solar_irradiance(z, grid=grid, instant=MORNING, shadows=shadows)
    middle = places_of(grid, 30, 100)
    sun = sun_at(np.array([MORNING], "datetime64[ms]"))
    altitude, azimuth = (np.radians(angle[0, 0]) for angle in altitude_azimuth(sun, middle.frame))
    length = 150 / np.tan(altitude) * np.sin(azimuth)  # across the wall, which runs north
    shaded = light.shadow[5, :99].sum()  # the sun is in the south-east: off the wall's other end
    assert 20 < length / 10 < 70
    assert shaded == (pytest.approx(length / 10, abs=1.5) if shadows else 0)
    assert not light.shadow[30, 102:].any()


# --- days ----------------------------------------------------------------------------------------


def test_a_day_is_the_sum_of_its_instants():
    from demsmith.core.solar.days import instants_of

    z = ground()
    day = solar_irradiance(z, grid=ALPS, days=DAY, step=1.0)
    times, step = instants_of(DAY, places_of(ALPS, 44.5, 54.5).longitude[0], 1.0)
    lights = [solar_irradiance(z, grid=ALPS, instant=time.item()) for time in times]
    assert day.unit == "Wh/m²/day" and day.shadow is None
    assert day.instants == sum(light.instants for light in lights)
    for name in PARTS:
        total = sum(getattr(light, name).astype(float) for light in lights) * step
        np.testing.assert_allclose(getattr(day, name), total, rtol=1e-4, atol=1e-2)
    shone = sum(~light.shadow for light in lights) * step
    np.testing.assert_allclose(day.hours, shone, atol=1e-4)


def test_days_are_their_mean():
    z = ground()[:40, :50]
    grid = Grid((40, 50), ALPS.geotransform, ALPS.crs)
    days = [datetime.date(2024, 1, 10), datetime.date(2024, 7, 3)]
    both = solar_irradiance(z, grid=grid, days=days)
    each = [solar_irradiance(z, grid=grid, days=[day]) for day in days]
    for name in (*PARTS, "hours"):
        mean = sum(getattr(light, name).astype(float) for light in each) / 2
        np.testing.assert_allclose(getattr(both, name), mean, rtol=1e-5, atol=1e-3)


def test_sectors_around_the_circle_give_what_those_of_each_instant_do(monkeypatch):
    z = ground()
    own = solar_irradiance(z, grid=ALPS, days=DAY)
    monkeypatch.setattr(irradiance, "sectors_of", lambda low, high, _: sectors._circle(low, high))
    around = solar_irradiance(z, grid=ALPS, days=DAY)
    assert np.abs(own.hours - around.hours).mean() < 0.02
    assert np.abs(own.total - around.total).mean() < 0.002 * own.total.mean()
    np.testing.assert_allclose(np.quantile(own.total / around.total, [0.02, 0.98]), 1, rtol=2e-3)


@settings(max_examples=60, deadline=None)
@given(
    lowest=st.lists(st.integers(-400, 400), min_size=1, max_size=6),
    width=st.floats(0.01, 359.9), reach=st.floats(0, 3000), many=st.booleans(),
)  # fmt: skip
def test_every_azimuth_of_every_instant_is_in_one_sector(lowest, width, reach, many):
    lowest = np.repeat(lowest, 200 if many else 1) + 0.3
    found = sectors.sectors_of(lowest, lowest + width, np.full(lowest.size, reach))
    azimuths = (
        lowest + width * np.array([[0.00137], [0.17171], [0.41423], [0.73207], [0.99863]])
    ) % 360
    times = np.zeros(azimuths.shape, int)
    for sector in found:
        if len(sector.edges) == 1:
            times[:, sector.instants] += 1
            continue
        start, stop = sector.edges
        assert 0 < stop - start <= 30 + 1e-6
        inside = (azimuths[:, sector.instants] - start) % 360 < stop - start
        times[:, sector.instants] += inside
    assert (times == 1).all()


# --- all over the Earth --------------------------------------------------------------------------


def mound(grid, height=600.0):
    """A round hill on level ground."""
    rows, columns = grid.shape
    y, x = np.mgrid[:rows, :columns]
    size = min(rows, columns) / 6
    return height * np.exp(-((y - rows // 2) ** 2 + (x - columns // 2) ** 2) / (2 * size**2))


@pytest.mark.parametrize(("latitude", "sunny"), [(47.0, "south"), (-33.0, "north")])
def test_slopes_towards_the_equator_have_more_sun(latitude, sunny):
    grid = Grid((61, 61), (150.0, 0.001, 0, latitude, 0, -0.001), "EPSG:4326")
    light = solar_irradiance(mound(grid), grid=grid, days=[datetime.date(2024, 3, 20)])
    north, south = light.total[20, 30], light.total[40, 30]
    assert (south > 1.2 * north) if sunny == "south" else (north > 1.2 * south)
    # East and west have the same of a day; a day is that of the raster's own noon.
    assert light.total[30, 20] == pytest.approx(light.total[30, 40], rel=0.02)


def test_polar_day_and_night():
    grid = Grid((21, 31), (15.0, 0.01, 0, 78.5, 0, -0.005), "EPSG:4326")
    level = np.zeros(grid.shape)
    summer = solar_irradiance(level, grid=grid, days=[datetime.date(2024, 6, 20)])
    np.testing.assert_allclose(summer.hours, 24, rtol=1e-6)
    assert (summer.total > 5000).all()
    winter = solar_irradiance(mound(grid), grid=grid, days=[datetime.date(2024, 12, 20)])
    assert winter.instants == 0 and (winter.total == 0).all() and (winter.hours == 0).all()


def test_over_the_pole_no_direction_is_preferred():
    grid = Grid((81, 81), (-8100.0, 200.0, 0, 8100.0, 0, -200.0), "EPSG:3413")
    z = mound(grid)
    light = solar_irradiance(z, grid=grid, days=[datetime.date(2024, 5, 10)], step=0.25)
    np.testing.assert_allclose(light.hours[0], 24, rtol=1e-6)
    for turned in (np.rot90(light.total), light.total[::-1]):
        np.testing.assert_allclose(turned, light.total, rtol=0.01)
    assert light.total[30, 40] != pytest.approx(light.total[40, 40], rel=0.01)


def test_across_the_date_line_nothing_happens():
    z, days = ground(), [datetime.date(2024, 2, 1)]
    west, east = (
        Grid(z.shape, (x, 1 / 1200, 0, -16.0, 0, -1 / 1200), "EPSG:4326")
        for x in (180 - 50 / 1200, -180 - 50 / 1200)
    )
    one, other = (solar_irradiance(z, grid=grid, days=days) for grid in (west, east))
    np.testing.assert_allclose(one.total, other.total, rtol=1e-4)
    inland = solar_irradiance(
        z, grid=Grid(z.shape, (170.0, 1 / 1200, 0, -16.0, 0, -1 / 1200), "EPSG:4326"), days=days
    )
    assert np.abs(one.total - inland.total).mean() < 0.005 * one.total.mean()


def test_utm_and_degrees_see_the_same_sun_though_the_grid_is_turned():
    """Ground that rises true south: in UTM, 2° off, its gradient is turned against the grid."""
    rise = np.tan(np.radians(30))
    light = []
    for grid in (
        Grid((41, 41), (6.2, 1e-4, 0, 49.6, 0, -1e-4), "EPSG:4326"),
        Grid((41, 41), (297000.0, 10.0, 0, 5497000.0, 0, -10.0), "EPSG:32632"),
    ):
        places = places_of(grid, np.arange(41)[:, None], np.arange(41))
        north = np.radians(places.latitude - 49.6).reshape(41, 41) * 6.371e6
        east = (
            np.radians(places.longitude - 6.2).reshape(41, 41) * 6.371e6 * np.cos(np.radians(49.6))
        )
        slope = (east - north) * rise / np.sqrt(2)
        light.append(solar_irradiance(slope, grid=grid, instant=MORNING, shadows=False))
    middles = [each.beam[20, 20] for each in light]
    # Turned by the 2° of convergence, the beam would differ by more than a percent.
    assert middles[0] == pytest.approx(middles[1], rel=3e-3)


@pytest.mark.parametrize("flip", [(True, False), (False, True), (True, True)])
def test_rows_and_columns_may_run_either_way(flip):
    z = ground()
    order = tuple(slice(None, None, -1 if back else None) for back in flip)
    x, width, _, y, _, height = ALPS.geotransform
    geotransform = (
        x + 110 * width if flip[1] else x, -width if flip[1] else width, 0.0,
        y + 90 * height if flip[0] else y, 0.0, -height if flip[0] else height,
    )  # fmt: skip
    turned = Grid(ALPS.shape, geotransform, ALPS.crs)
    assert north_up(turned)[0] == order
    straight = solar_irradiance(z, grid=ALPS, instant=MORNING)
    back = solar_irradiance(z[order], grid=turned, instant=MORNING)
    np.testing.assert_allclose(back.total[order], straight.total, rtol=1e-4, atol=1e-3)


# --- options -------------------------------------------------------------------------------------


def test_without_air_there_is_but_the_beam():
    light = solar_irradiance(ground(), grid=ALPS, instant=NOON, atmosphere="none", albedo=0.0)
    assert (light.diffuse == 0).all() and (light.reflected == 0).all()
    assert 1200 < light.beam.max() < 1361.1 * 1.04


def test_ineichen_is_another_sky():
    z, models = ground(), ("linke", "ineichen")
    days = [solar_irradiance(z, grid=ALPS, days=DAY, atmosphere=model) for model in models]
    assert days[1].total.mean() == pytest.approx(days[0].total.mean(), rel=0.1)
    assert np.abs(days[1].beam - days[0].beam).mean() > 10


def test_light_of_the_ground_is_by_albedo():
    z = ground()
    dark, bright = (solar_irradiance(z, grid=ALPS, days=DAY, albedo=each) for each in (0.2, 0.8))
    np.testing.assert_allclose(bright.reflected, 4 * dark.reflected, rtol=1e-4)


def test_an_even_sky_and_one_hidden_by_hills():
    grid = Grid((61, 61), (8.0, 0.001, 0, 46.5, 0, -0.001), "EPSG:4326")
    pit = -mound(grid, 1500.0)
    options = dict(grid=grid, instant=NOON, diffuse_model="isotropic")
    open_sky = solar_irradiance(pit, **options)
    hidden = solar_irradiance(pit, **options, hidden_sky=True)
    slope = np.arctan(np.hypot(*gradient(pit, np.zeros(pit.shape, bool), *grid.pixel_size_m())))
    level = open_sky.diffuse[0, 0]
    share = open_sky.diffuse[20, 20] / level
    assert share == pytest.approx((1 + np.cos(slope[20, 20])) / 2, rel=0.02)
    assert hidden.diffuse[30, 30] < 0.9 * open_sky.diffuse[30, 30]
    assert hidden.diffuse[0, 0] == pytest.approx(level, rel=0.01)
    np.testing.assert_array_equal(hidden.reflected, open_sky.reflected)
    np.testing.assert_array_equal(hidden.beam, open_sky.beam)
    muneer = solar_irradiance(pit, grid=grid, instant=NOON, hidden_sky=True)
    assert (
        muneer.diffuse[30, 30]
        < 0.95 * solar_irradiance(pit, grid=grid, instant=NOON).diffuse[30, 30]
    )


# --- rasters as they come ------------------------------------------------------------------------


def test_voids_are_nan_and_whatever_they_hold_does_not_matter():
    z = ground()
    void = np.zeros(z.shape, bool)
    void[30:50, 40:60] = True
    lights = []
    for value in (np.nan, 9000.0, -32768.0):
        holed = np.where(void, np.float32(value), z)
        lights.append(solar_irradiance(holed, void, grid=ALPS, instant=MORNING))
    for light in lights:
        for name in PARTS:
            np.testing.assert_array_equal(np.isnan(getattr(light, name)), void)
        assert not light.shadow[void].any()
        np.testing.assert_array_equal(light.total, lights[0].total)


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (2, 2), (65, 66), (129, 3)])
def test_any_shape_will_do(shape):
    grid = Grid(shape, ALPS.geotransform, ALPS.crs)
    light = solar_irradiance(np.full(shape, 500, np.int16), grid=grid, days=DAY)
    assert light.total.shape == shape and light.total.dtype == np.float32
    whole = solar_irradiance(np.full(ALPS.shape, 500), grid=ALPS, days=DAY)
    np.testing.assert_allclose(light.total, whole.total[0, 0], rtol=1e-2)


def test_coarse_cells_have_each_their_own_sun():
    grid = Grid((6, 12), (-180.0, 30.0, 0, 90.0, 0, -30.0), "EPSG:4326")
    light = solar_irradiance(
        np.zeros(grid.shape), grid=grid, instant=datetime.datetime(2024, 3, 20, 12)
    )
    altitude, _ = altitude_azimuth(
        sun_at(np.array(["2024-03-20T12"], "M8[ms]")),
        places_of(grid, *np.indices(grid.shape)).frame,
    )
    np.testing.assert_array_equal(light.shadow, (altitude[0] <= 0).reshape(grid.shape))


def test_threads_do_not_change_a_byte():
    z = ground()
    one, three = (solar_irradiance(z, grid=ALPS, days=DAY, threads=n) for n in (1, 3))
    for name in (*PARTS, "hours"):
        assert getattr(one, name).tobytes() == getattr(three, name).tobytes()


class Recorder:
    def __init__(self, cancel_after=None):
        self.fractions, self.cancel_after = [], cancel_after

    def report(self, fraction):
        self.fractions.append(fraction)

    def cancelled(self):
        return self.cancel_after is not None and len(self.fractions) >= self.cancel_after


def test_progress_goes_on_and_cancel_is_heard():
    show = Recorder()
    solar_irradiance(ground(), grid=ALPS, days=DAY, progress=show)
    assert show.fractions == sorted(show.fractions)
    assert show.fractions[-1] == 1 and len(show.fractions) > 30
    with pytest.raises(Cancelled):
        solar_irradiance(ground(), grid=ALPS, days=DAY, progress=Recorder(cancel_after=20))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"grid": Grid(ALPS.shape)}, "where on the Earth"),
        ({"grid": Grid((3, 3), ALPS.geotransform, ALPS.crs)}, "shape"),
        ({"void": np.ones(ALPS.shape, bool)}, "every cell is a void"),
        ({"instant": NOON}, "either an instant or days"),
        ({"days": None}, "either an instant or days"),
        ({"days": []}, "one day"),
        ({"albedo": 1.5}, "albedo"),
        ({"atmosphere": "thick"}, "atmosphere"),
        ({"turbidity": 3}, "turbidity"),
    ],
)
def test_what_cannot_be_is_refused(change, told):
    with pytest.raises(InputError, match=told):
        solar_irradiance(ground(), **{"grid": ALPS, "days": DAY, **change})


def test_ground_beyond_the_globe_is_refused():
    grid = Grid((20, 20), (-1e7, 1e6, 0, 1e7, 0, -1e6), "+proj=ortho +lat_0=45 +datum=WGS84")
    with pytest.raises(InputError, match="no place on the Earth"):
        solar_irradiance(np.zeros(grid.shape), grid=grid, instant=NOON)
