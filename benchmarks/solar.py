"""Sunlight against GRASS r.sun and SAGA: agreement, known shadows, time, memory.

Run it with ``make bench`` or ``.venv/bin/python benchmarks/solar.py``; with ``--write`` it puts its
section into ``benchmarks/RESULTS.md``. GRASS and SAGA must be installed.
"""

import argparse
import datetime
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import tiles
from fill import status_bytes
from osgeo import gdal
from results import provenance, table, write_section
from solar_peers import Grass, saga_day, versions
from solar_shapes import CELL, SHAPES, elevations, known_shadow, shadow_by_rays

import demsmith
from demsmith.core import raster
from demsmith.core.solar.position import altitude_azimuth, sun_at

gdal.UseExceptions()
SIDE = 1201
UTM = {"sierra_nevada": "EPSG:32630", "white_mountains": "EPSG:32619"}
TILES = (*UTM, "bigtujunga_utm")
YEAR, DAYS = 2024, (80, 172, 355)
# Day of the year, hours from solar noon.
INSTANTS = ((172, -5.0), (80, 3.0), (80, -5.0), (355, 0.0), (355, 3.5))
ALTITUDES = (45.0, 25.0, 10.0)
ROUNDS = 3
SAMPLE = 2000  # of the cells in which programs differ
INNER = np.s_[1:-1, 1:-1]  # r.sun's slopes at the border are one-sided in another way


def main():
    """Run all parts and print or write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update benchmarks/RESULTS.md")
    parser.add_argument("--quick", action="store_true", help="one tile, one round, no year")
    parser.add_argument("--peak", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.peak:
        print(peak_rise())
        return
    names = TILES[-1:] if arguments.quick else TILES
    grounds = {name: ground(name) for name in names}
    parts = [
        heading(),
        agreement(grounds),
        known_shapes(),
        speed(*next(iter(grounds.values())), 1 if arguments.quick else ROUNDS),
    ]
    if not arguments.quick:
        parts += [year(*grounds[TILES[0]]), memory()]
    text = "\n\n".join(parts) + "\n"
    if arguments.write:
        write_section(text)
    print(text)


def heading():
    """Say what was measured, when and where."""
    return (
        "## Sunlight (`solar`)\n\n"
        f"{provenance('numpy', 'numba', 'pvlib')} {versions()}. Repeat with "
        "`.venv/bin/python benchmarks/solar.py`. The tiles in degrees are warped to 1201 × 1201 "
        "cells of UTM (cubic) for all programs: in a geographic project r.sun 8.2 throws shadows "
        "where there are none. r.sun is given the Sun's true declination, and at instants its "
        "hour by the Sun; its defaults are ours: 0.5 h, Linke 3, albedo 0.2."
    )


def ground(name):
    """Give a void-free tile with square cells: elevations and grid."""
    if name not in UTM:
        tile = raster.read(tiles.DATA / tiles.VOID_FREE[name])
        return tile.values.astype(np.float32), tile.grid
    source = str(tiles.DATA / tiles.VOID_FREE[name])
    options = dict(dstSRS=UTM[name], resampleAlg="cubic", format="MEM", outputType=gdal.GDT_Float32)
    whole = gdal.Warp("", source, **options)
    x, width, _, y, _, height = whole.GetGeoTransform()
    middle = x + width * whole.RasterXSize / 2, y + height * whole.RasterYSize / 2
    half = 0.49 * min(whole.RasterXSize * width, whole.RasterYSize * -height) * 0.98
    bounds = [middle[0] - half, middle[1] - half, middle[0] + half, middle[1] + half]
    made = gdal.Warp("", source, outputBounds=bounds, width=SIDE, height=SIDE, **options)
    values = np.empty((SIDE, SIDE), np.float32)
    made.ReadAsArray(buf_obj=values)
    return values, raster.Grid(values.shape, made.GetGeoTransform(), UTM[name])


# --- agreement -----------------------------------------------------------------------------------


def agreement(grounds):
    """Compare daily sums and shadows with r.sun's."""
    days, shadows = [], []
    for name, (values, grid) in grounds.items():
        with Grass(values, grid) as grass:
            for day in DAYS:
                days.append([name, day, *_day_differences(grass, values, grid, day)])
            for day, hours in INSTANTS:
                shadows.append(
                    [name, day, f"{hours:+g} h", *_shadows(grass, values, grid, day, hours)]
                )
    return "\n\n".join(
        [
            "### A day: mean absolute difference from r.sun, by r.sun's mean [%]",
            table(["tile", "day", "global", "beam", "global, bias", "hours of sun [h]"], days),
            "### An instant: cells whose shadow is the same [%]",
            table(["tile", "day", "from noon", "Sun's altitude", "r.sun in shadow",
                   "Demsmith in shadow", "the same", "right by Demsmith where not"], shadows),
            "Cells of the columns within 0.1° of the tile's middle, for r.sun has the same hour by "
            "the Sun in all cells. *Right where not*: share of the cells that differ (at most "
            f"{SAMPLE}, at random) in which rays over the surface between the cells, bilinear and "
            "followed in steps of a 20th of a cell, side with Demsmith.",
        ]
    )  # fmt: skip


def _day_differences(grass, values, grid, day):
    declination = _Below(np.datetime64(_date(day), "ms") + np.timedelta64(12, "h")).declination
    theirs = grass.day(day, declination, wanted=("total", "beam", "hours")).layers
    ours = demsmith.solar_irradiance(values, grid=grid, days=[_date(day)])
    for name in ("total", "beam"):
        difference = (getattr(ours, name) - theirs[name])[INNER]
        yield f"{100 * abs(difference).mean() / theirs[name][INNER].mean():.2f}"
    bias = (ours.total - theirs["total"])[INNER].mean() / theirs["total"][INNER].mean()
    yield f"{100 * bias:+.2f}"
    yield f"{ours.hours[INNER].mean():.2f}, r.sun {theirs['hours'][INNER].mean():.2f}"


def _shadows(grass, values, grid, day, hours):
    place = raster.places_of(grid, (grid.shape.rows - 1) / 2, (grid.shape.columns - 1) / 2)
    when = _instant(day, hours, place.longitude[0])
    theirs = grass.instant(day, _Below(when).declination, 12 + hours).layers["beam"] <= 0
    ours = demsmith.solar_irradiance(values, grid=grid, instant=when.item()).shadow
    middle = _middle(grid, place.longitude[0])
    angles = altitude_azimuth(sun_at(when[None]), place.frame[0])
    altitude, azimuth = (float(angle[0]) for angle in angles)
    yield f"{altitude:.1f}°"
    yield f"{100 * theirs[middle].mean():.1f}"
    yield f"{100 * ours[middle].mean():.1f}"
    yield f"{100 * (ours == theirs)[middle].mean():.2f}"
    differ = np.argwhere((ours != theirs) & middle)
    differ = np.random.default_rng(0).permutation(differ)[:SAMPLE]
    true = shadow_by_rays(values, grid.geotransform[1], *differ.T, altitude, azimuth)
    yield f"{100 * (ours[tuple(differ.T)] == true).mean():.1f}"


def _middle(grid, longitude):
    """Give the cells where it is the hour of the tile's middle, within half a minute."""
    columns = np.arange(grid.shape.columns)
    found = raster.places_of(grid, grid.shape.rows // 2, columns).longitude
    middle = np.zeros(grid.shape, bool)
    middle[INNER] = abs(found - longitude)[1:-1] < 0.1
    return middle


class _Below:
    """Declination [rad] and longitude [degrees] of the point under the Sun."""

    def __init__(self, when):
        found = sun_at(np.atleast_1d(when))
        self.declination = float(np.arcsin(found.direction[0, 2]))
        self.longitude = float(found.longitude[0])


def _date(day):
    return datetime.date(YEAR, 1, 1) + datetime.timedelta(days=day - 1)


def _instant(day, hours, longitude):
    """Give an instant by the hours from solar noon of a longitude, UTC."""
    when = np.datetime64(_date(day), "ms") + np.timedelta64(
        round((12 - longitude / 15) * 3.6e6), "ms"
    )
    late = (_Below(when).longitude - longitude + 180) % 360 - 180  # the Sun has yet to go
    return when + np.timedelta64(round((late / 15 + hours) * 3.6e6), "ms")


# --- shapes whose shadows are known --------------------------------------------------------------


def known_shapes():
    """Score both programs on shadows that geometry tells."""
    rows = []
    for shape in SHAPES:
        values = elevations(shape)
        grid = _shapes_grid(values.shape)
        place = raster.places_of(grid, values.shape[0] // 2, values.shape[1] // 2)
        with Grass(values, grid) as grass:
            for wanted in ALTITUDES:
                when = _afternoon(wanted, place)
                altitude, azimuth = (
                    float(angle[0])
                    for angle in altitude_azimuth(sun_at(when[None]), place.frame[0])
                )
                shadow, scored = known_shadow(shape, altitude, azimuth)
                below = _Below(when)
                hour = 12 + (place.longitude[0] - below.longitude) / 15
                theirs = grass.instant(111, below.declination, hour).layers["beam"] <= 0
                ours = demsmith.solar_irradiance(values, grid=grid, instant=when.item()).shadow
                wrong = [np.count_nonzero((made != shadow) & scored) for made in (theirs, ours)]
                rows.append([
                    shape.name, f"{altitude:.1f}°", f"{azimuth:.1f}°",
                    np.count_nonzero(shadow & scored), np.count_nonzero(~shadow & scored), *wrong,
                ])  # fmt: skip
    return (
        "### Shadows that are known: a wall 300 m high and a pyramid 900 m high on a plain\n\n"
        f"{CELL:g} m cells; the true shadow by rays over the shape itself. Cells are counted that "
        "are not beside the shape or the shadow's edge.\n\n"
        + table(
            ["shape", "Sun's altitude", "azimuth", "cells in shadow", "in the sun",
             "wrong by r.sun", "wrong by Demsmith"], rows,
        )
    )  # fmt: skip


def _shapes_grid(shape):
    """Give a grid on the middle meridian of UTM 32, where grid north is north."""
    half = shape[0] * CELL / 2
    return raster.Grid(
        shape, (500_000 - half, CELL, 0.0, 5_200_000 + half, 0.0, -CELL), "EPSG:32632"
    )


def _afternoon(altitude, place):
    """Give the instant of 20 April's afternoon with the Sun at an altitude."""
    minutes = _instant(111, 0, place.longitude[0]) + np.arange(0, 600).astype("timedelta64[m]")
    altitudes = altitude_azimuth(sun_at(minutes), place.frame[0])[0]
    return minutes[abs(altitudes - altitude).argmin()]


# --- time and memory -----------------------------------------------------------------------------


def speed(values, grid, rounds):
    """Time a day by every program, in turn."""
    rows = []
    dates = [_date(day) for day in DAYS]
    latitude = raster.places_of(grid, grid.shape.rows // 2, 0).latitude[0]
    with Grass(values, grid) as grass:
        for day, date in zip(DAYS, dates, strict=True):
            declination = _Below(np.datetime64(date, "ms") + np.timedelta64(12, "h")).declination
            ours, theirs, saga = [], [], []
            for _ in range(rounds):
                ours.append(_ours(values, grid, [date]))
                made = grass.day(day, declination)
                theirs.append((made.seconds, made.cpu_seconds))
                ours.append(_ours(values, grid, [date]))
            made = saga_day(values, grid, date, latitude)
            saga = made.seconds, made.cpu_seconds
            ours, theirs = (np.min(times, axis=0) for times in (ours, theirs))
            rows.append([
                day, *(f"{wall:.2f} ({cpu:.2f})" for wall, cpu in (ours, theirs, saga)),
                f"**{theirs[0] / ours[0]:.1f}**", f"{theirs[1] / ours[1]:.1f}",
            ])  # fmt: skip
    return (
        f"### A day in steps of 0.5 h, {grid.shape.rows} × {grid.shape.columns} cells: seconds "
        f"(CPU seconds), least of {rounds} rounds, SAGA once\n\n"
        "Demsmith with 2 threads: beam, diffuse, reflected light, hours; r.sun with nprocs=2: "
        "global and beam, without its slope and aspect; SAGA with 2 cores, its lumped "
        "atmosphere.\n\n"
        + table(["day", "Demsmith", "r.sun", "SAGA", "r.sun ÷ Demsmith", "by CPU"], rows)
    )


def _ours(values, grid, days):
    begin, spent = time.perf_counter(), time.process_time()
    demsmith.solar_irradiance(values, grid=grid, days=days, threads=2)
    return time.perf_counter() - begin, time.process_time() - spent


def year(values, grid):
    """Time a year."""
    days = [_date(day) for day in range(1, 366)]
    every = [_ours(values, grid, days[::stride]) for stride in (1, 5)]
    return (
        f"### A year, the same tile\n\n365 days in steps of 0.5 h: **{every[0][0]:.0f} s** "
        f"({every[0][1]:.0f} s of CPU); every fifth day: {every[1][0]:.0f} s."
    )


def memory():
    """Measure, in a process of its own, how far a warm run raises the peak memory."""
    rise = subprocess.run(
        [sys.executable, __file__, "--peak"], capture_output=True, text=True, check=True
    ).stdout.strip()
    return (
        "### Memory\n\nRise of the peak resident memory over a warm call for a day, large (3601 × "
        f"3601), bytes per cell: **{rise}**, of which 20 are its result."
    )


def peak_rise():
    """Give the rise in bytes per cell."""
    values, _ = tiles.large()
    grid = raster.Grid(values.shape, (-4.0, 1 / 1200, 0.0, 39.0, 0.0, -1 / 1200), "EPSG:4326")
    day = [_date(80)]
    demsmith.solar_irradiance(
        values[:99, :99].copy(), grid=grid.part(slice(0, 99), slice(0, 99)), days=day, threads=2
    )
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far
    before = status_bytes("VmRSS")
    light = demsmith.solar_irradiance(values, grid=grid, days=day, threads=2)
    return f"{(status_bytes('VmHWM') - before) / light.total.size:.1f}"


if __name__ == "__main__":
    main()
