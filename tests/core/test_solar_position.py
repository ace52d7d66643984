"""Where the sun is, from cells all over the Earth, against pvlib asked for each of them."""

import datetime

import numpy as np
import pytest

pd = pytest.importorskip("pandas", reason="pvlib is missing")
solarposition = pytest.importorskip("pvlib.solarposition", reason="pvlib is missing")

from demsmith.core.errors import InputError  # noqa: E402
from demsmith.core.raster import Grid, places_of  # noqa: E402
from demsmith.core.solar.days import instants_of, solar_noons  # noqa: E402
from demsmith.core.solar.lattice import lattice_of  # noqa: E402
from demsmith.core.solar.position import altitude_azimuth, sun_at  # noqa: E402

TIMES = np.array(
    ["2024-03-20T05", "2024-06-20T18:20", "2024-09-22T00:01", "2024-12-21T11:40", "1999-02-28T22"],
    "datetime64[ms]",
)  # fmt: skip

GRIDS = {
    "north": Grid((60, 70), (10.0, 0.01, 0, 60.0, 0, -0.01), "EPSG:4326"),
    "south": Grid((60, 70), (-70.0, 0.01, 0, -30.0, 0, -0.01), "EPSG:4326"),
    "south up": Grid((60, 70), (-70.0, 0.01, 0, -30.6, 0, 0.01), "EPSG:4326"),
    "equator": Grid((60, 70), (-0.3, 0.01, 0, 0.3, 0, -0.01), "EPSG:4326"),
    "beyond the polar circle": Grid((60, 70), (20.0, 0.02, 0, 80.0, 0, -0.01), "EPSG:4326"),
    "date line from the west": Grid((60, 70), (179.5, 0.02, 0, -16.0, 0, -0.02), "EPSG:4326"),
    "date line from the east": Grid((60, 70), (-180.5, 0.02, 0, -16.0, 0, -0.02), "EPSG:4326"),
    "utm": Grid((60, 70), (250000.0, 900.0, 0, 6900000.0, 0, -900.0), "EPSG:32632"),
    "feet": Grid((60, 70), (900000.0, 900.0, 0, 300000.0, 0, -900.0), "EPSG:2263"),
    "over the pole": Grid((61, 61), (-30500.0, 1000.0, 0, 30500.0, 0, -1000.0), "EPSG:3413"),
    "over the south pole": Grid((61, 61), (-30500.0, 1000.0, 0, 30500.0, 0, -1000.0), "EPSG:3031"),
    "coarse": Grid((9, 18), (-180.0, 20.0, 0, 90.0, 0, -20.0), "EPSG:4326"),
}


def by_pvlib(latitude, longitude):
    """Altitude and true azimuth at each time and place."""
    index = pd.DatetimeIndex(TIMES, tz="UTC")
    seen = [
        solarposition.get_solarposition(index, *place, method="nrel_numpy")
        for place in zip(latitude, longitude, strict=True)
    ]
    return tuple(
        np.stack([each[name] for each in seen], axis=1) for name in ("elevation", "azimuth")
    )


def interpolated(lattice, rows, columns):
    """Frames of cells between the nodes, bilinearly as the kernel does."""
    below = np.clip(np.searchsorted(lattice.rows, rows, "right"), 1, lattice.rows.size - 1)
    right = np.clip(np.searchsorted(lattice.columns, columns, "right"), 1, lattice.columns.size - 1)
    y0, y1 = lattice.rows[below - 1], lattice.rows[below]
    x0, x1 = lattice.columns[right - 1], lattice.columns[right]
    t = ((rows - y0) / (y1 - y0))[:, None, None]
    s = ((columns - x0) / (x1 - x0))[:, None, None]
    f = lattice.frame
    return (f[below - 1, right - 1] * (1 - s) + f[below - 1, right] * s) * (1 - t) + (
        f[below, right - 1] * (1 - s) + f[below, right] * s
    ) * t


@pytest.mark.parametrize("name", GRIDS)
def test_the_sun_is_where_pvlib_sees_it_from_each_cell(name):
    pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
    grid = GRIDS[name]
    rng = np.random.default_rng(1)
    rows, columns = (rng.integers(0, side, 12) for side in grid.shape)
    places = places_of(grid, rows, columns)
    expected_altitude, expected_azimuth = by_pvlib(places.latitude, places.longitude)
    expected_azimuth = expected_azimuth - places.convergence  # to the grid's frame
    for frame in (places.frame, interpolated(lattice_of(grid), rows, columns)):
        altitude, azimuth = altitude_azimuth(sun_at(TIMES), frame)
        np.testing.assert_allclose(altitude, expected_altitude, atol=0.002)
        apart = (azimuth - expected_azimuth + 180) % 360 - 180
        np.testing.assert_allclose(apart * np.cos(np.radians(altitude)), 0, atol=0.003)


def test_polar_day_and_night():
    frame = places_of(Grid((1, 1), (20.0, 1.0, 0, 80.5, 0, -1.0), "EPSG:4326"), 0, 0).frame
    hours = np.arange(24).astype("timedelta64[h]")
    for day, sign in (("2024-06-20", 1), ("2024-12-20", -1)):
        altitude, azimuth = altitude_azimuth(sun_at(np.datetime64(day) + hours), frame)
        assert (np.sign(altitude) == sign).all()
        assert np.ptp(azimuth) > 300


def test_the_distance_is_least_in_january():
    sun = sun_at(np.array(["2024-01-03", "2024-07-05"], "datetime64[ms]"))
    np.testing.assert_allclose(sun.distance, [0.98331, 1.01673], atol=2e-5)
    np.testing.assert_allclose(np.linalg.norm(sun.direction, axis=1), 1)


@pytest.mark.parametrize("longitude", [-180.0, -179.9, -3.5, 0.0, 123.4, 179.9])
def test_at_solar_noon_the_sun_is_over_the_meridian(longitude):
    days = [datetime.date(2024, month, 11) for month in (2, 5, 7, 11)]
    noons = solar_noons(days, longitude)
    apart = (sun_at(noons).longitude - longitude + 180) % 360 - 180
    np.testing.assert_allclose(apart, 0, atol=0.005)
    # In the local mean time of the place it is that date, near 12.
    local = noons + np.timedelta64(round(longitude / 15 * 3600), "s")
    middays = np.array(days, "datetime64[ms]") + np.timedelta64(12, "h")
    assert np.abs(local - middays).max() < np.timedelta64(17, "m")


def test_the_instants_of_a_day_are_the_middles_of_its_steps():
    days = [datetime.date(2024, 6, 20), datetime.date(2024, 6, 21)]
    instants, step = instants_of(days, 15.0, 0.5)
    assert (instants.size, step) == (96, 0.5)
    noon = solar_noons(days, 15.0)[0]
    assert instants[0] == noon - np.timedelta64(11 * 60 + 45, "m")
    assert instants[23] + (instants[24] - instants[23]) / 2 == noon
    # A step that does not divide the day is shortened.
    instants, step = instants_of(days[:1], 15.0, 5.0)
    assert (instants.size, step) == (5, 4.8)
    with pytest.raises(InputError, match="one day"):
        instants_of([], 15.0, 0.5)


@pytest.mark.parametrize("time", ["1699-12-31", "2200-01-01"])
def test_other_centuries_are_refused(time):
    with pytest.raises(InputError, match="1700 to 2199"):
        sun_at(np.array([time], "datetime64[ms]"))
