"""Sunlight that falls on terrain: at an instant, on a day, on the mean of days."""

import datetime
from dataclasses import dataclass
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.options import options_from
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.raster import north_up
from demsmith.core.relief.gradient import gradient
from demsmith.core.solar.atmosphere import sky_table
from demsmith.core.solar.days import instants_of
from demsmith.core.solar.lattice import Lattice, lattice_of
from demsmith.core.solar.options import SolarOptions
from demsmith.core.solar.position import PARALLAX, Sun, altitude_azimuth, sun_at
from demsmith.core.solar.sectors import Sector, sectors_of

_CELLS_AT_ONCE = 1 << 17
_INSTANTS_AT_ONCE = 128
_AZIMUTHS_AT_ONCE = 1 << 18


@dataclass(frozen=True, eq=False)
class Irradiance:
    """Light on the ground; (H, W) float32 arrays, NaN in voids.

    Attributes
    ----------
    total, beam, diffuse, reflected : array
        All of it, and its parts: straight from the sun, from the sky, and from the ground around.
        On a square metre of the sloping ground itself. W/m² of an instant; Wh/m² a day of days, the
        mean of them.
    hours : array or None
        Hours a day in which the sun shines on the cell, mean of the days; None of an instant.
    shadow : (H, W) bool array or None
        Of an instant, where the sun does not shine on the cell: terrain hides it, the ground faces
        away from it, or it is below the horizontal. False in voids. None of days.
    unit : str
        ``W/m²`` or ``Wh/m²/day``.
    instants : int
        How many were looked at, of those with the sun up somewhere in the raster.
    """

    total: np.ndarray
    beam: np.ndarray
    diffuse: np.ndarray
    reflected: np.ndarray
    hours: np.ndarray | None
    shadow: np.ndarray | None
    unit: str
    instants: int


def solar_irradiance(
    values, void=None, *, grid, instant=None, days=None, options=None, threads=None,
    progress=SILENT, **parameters,
):  # fmt: skip
    """Compute the sunlight on terrain under a clear sky.

    At each instant, the sun's place is that of NREL's algorithm for each cell's own latitude and
    longitude (`demsmith.core.solar.position`), its true altitude without refraction. The beam is
    what the air lets through (`demsmith.core.solar.atmosphere`) by the cosine of its incidence
    on the slope, if the terrain's horizon in its direction is not higher. Light of the sky falls on
    slopes by Muneer (1990) or evenly from all of the sky, and light of the ground around by the
    albedo and the slope, as Hofierka and Šúri (2002) put it together for r.sun. There is no light
    before sunrise and after sunset.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array, optional
        True where there is no elevation. Cells that are not finite are voids in any case, and
        those of a masked array where this is not given. They throw no shadow.
    grid : Grid
        The raster's place on the Earth, with a CRS. Its rows may run either way.
    instant : datetime.datetime, optional
        UTC if it has no time zone.
    days : sequence of datetime.date, optional
        Instead of an instant: a day, or days whose mean is wanted. A day is the 24 hours around the
        true solar noon of the raster's middle, its date that of the local mean time there, with
        longitudes from -180° to below 180°. It is looked at in the middles of ``options.step``.
    options : SolarOptions, optional
        Its fields can as well be given as keywords of their own.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress, optional

    Returns
    -------
    Irradiance

    Raises
    ------
    InputError
        If the arrays do not fit, nothing is known, the raster has no place on the Earth, or an
        option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    A south slope of 30° in Bavaria has twice the winter light of level ground:

    >>> from demsmith import Grid
    >>> grid = Grid((3, 3), (11.0, 0.001, 0.0, 48.0, 0.0, -0.001), "EPSG:4326")
    >>> level = np.zeros((3, 3))
    >>> slope = level - np.tan(np.radians(30)) * grid.pixel_size_m().dy[0] * np.arange(3)[:, None]
    >>> light = [
    ...     solar_irradiance(z, grid=grid, days=[datetime.date(2024, 12, 21)]).total[1, 1]
    ...     for z in (level, slope)
    ... ]
    >>> print(f"{light[0]:.0f} and {light[1]:.0f} Wh/m²")
    1431 and 3407 Wh/m²
    """
    options = options_from(SolarOptions, options, parameters, "solar_irradiance")
    values, void = checked(values, void)
    if values.shape != grid.shape:
        raise InputError(f"the grid has shape {tuple(grid.shape)}, values {values.shape}")
    if void.all():
        raise InputError("every cell is a void; there is no ground for the sun to shine on")
    if (instant is None) == (days is None):
        raise InputError("give either an instant or days")
    terrain = _Terrain.of(values, void, grid, threads, Span(progress, 0, 0.02))
    if instant is not None:
        times, step, shares = _utc(instant), 1.0, 1
    else:
        times, step = instants_of(days, terrain.lattice.longitude, options.step)
        shares = len(days)
    sums, instants = _sum(terrain, times, step / shares, options, threads, Span(progress, 0.02, 1))
    return _irradiance(terrain, sums, instants, instant is not None)


@dataclass(frozen=True, eq=False)
class _Terrain:
    """A raster turned so that its first row is northern and its first column western."""

    z: np.ndarray
    void: np.ndarray
    east: np.ndarray
    north: np.ndarray
    dx: np.ndarray
    dy: np.ndarray
    lattice: Lattice
    order: tuple

    @classmethod
    def of(cls, values, void, grid, threads, progress):
        order, grid = north_up(grid)
        lattice = lattice_of(grid)
        dx, dy = grid.pixel_size_m()
        void = np.ascontiguousarray(void[order])
        # Single precision tells heights of mountains to the millimetre.
        z = np.ascontiguousarray(values[order], np.float32)
        lattice.check(void)
        east, north = gradient(z, void, dx, dy, threads=threads, progress=progress)
        return cls(z, void, east, north, dx, dy, lattice, order)

    def relief(self):
        """Lowest and highest elevation."""
        known = ~self.void
        return (
            float(self.z.min(where=known, initial=np.inf)),
            float(self.z.max(where=known, initial=-np.inf)),
        )


def _utc(instant):
    if instant.tzinfo is not None:
        instant = instant.astimezone(datetime.UTC).replace(tzinfo=None)
    return np.array([instant], "datetime64[ms]")


def _sum(terrain, times, hours, options, threads, progress):
    """Sum light over instants that count ``hours`` each; four arrays, and how many had sun."""
    lowest, highest = terrain.relief()
    table = sky_table(options.atmosphere, options.linke, lowest, highest)
    checkpoint(progress, 0.0)
    sun, sectors = _plan(terrain, sun_at(times), highest - lowest, options.shadows, progress)
    sums = [np.zeros(terrain.z.shape, np.float32) for _ in range(4)]
    view = _sky_view(terrain, options, threads, Span(progress, 0, 0.1 if options.hidden_sky else 0))
    ranges = terrain.lattice.ranges(terrain.z, terrain.void)
    add = partial(_add, terrain, ranges, sun, hours, table, options, view, sums, threads)
    progress = Span(progress, 0.1 if options.hidden_sky else 0, 1)
    tangent = _sweep(terrain, options, threads) if options.shadows else None
    horizons = {}
    for number, sector in enumerate(sectors):
        span = Span(progress, number / len(sectors), (number + 1) / len(sectors))
        # Neighbouring sectors share an edge.
        horizons = {edge: horizons[edge] for edge in sector.edges if edge in horizons}
        missing = [edge for edge in sector.edges if options.shadows and edge not in horizons]
        for done, edge in enumerate(missing):
            start, stop = (0.5 * at / len(missing) for at in (done, done + 1))
            horizons[edge] = tangent(edge, progress=Span(span, start, stop))
        add(sector, horizons, Span(span, 0.5, 1))
    checkpoint(progress, 1.0)
    return sums, len(sun.distance)


def _plan(terrain, sun, relief, shadows, progress):
    """Keep the instants with the sun up somewhere, and part them into sectors."""
    frame = terrain.lattice.frame.reshape(-1, 3, 3)
    frame = frame[np.isfinite(frame).all(axis=(1, 2))]
    step = max(1, _AZIMUTHS_AT_ONCE // max(len(frame), 1))
    kept, ranges = [], []
    for start in range(0, len(sun.distance), step):
        checkpoint(progress, 0.0)
        part = Sun(sun.direction[start : start + step], sun.distance[start : start + step])
        altitude, azimuth = altitude_azimuth(part, frame)
        up = (altitude > 0).any(axis=1)
        kept.append(start + np.flatnonzero(up))
        ranges.append(_ranges(altitude[up], azimuth[up]))
    kept = np.concatenate(kept)
    sun = Sun(sun.direction[kept], sun.distance[kept])
    lowest, highest, altitude = np.concatenate(ranges, axis=1)
    if not shadows:
        return sun, [Sector((0.0,), np.arange(len(kept)))]
    side = min(terrain.dx.min(), terrain.dy.min())
    reach = relief / np.tan(np.radians(np.maximum(altitude, 0.1))) / side
    return sun, sectors_of(lowest, highest, np.minimum(reach, np.hypot(*terrain.z.shape)))


def _ranges(altitude, azimuth):
    """Range of azimuth over the places [degrees] and lowest altitude of each instant."""
    first = azimuth[:, :1]
    apart = (azimuth - first + 180) % 360 - 180
    lowest, highest = first[:, 0] + apart.min(axis=1), first[:, 0] + apart.max(axis=1)
    # Where the sun is overhead somewhere, or the places are all around the Earth.
    everywhere = (highest - lowest > 170) | (altitude.max(axis=1) > 89)
    margin = 1e-4
    return np.stack(
        [
            np.where(everywhere, 0.0, lowest - margin),
            np.where(everywhere, 360.0, highest + margin),
            altitude.min(axis=1),
        ]
    )


def _sweep(terrain, options, threads):
    """Give the function that finds the horizon towards an azimuth."""
    from demsmith.core.solar.horizon import HorizonSweep

    sweep = HorizonSweep(
        terrain.z, terrain.void, terrain.dx, terrain.dy, curvature=options.curvature,
        refraction=0.0,  # as the sun's altitude has none
    )  # fmt: skip
    return partial(sweep.tangent, threads=threads)


def _sky_view(terrain, options, threads, progress):
    """Give what the terrain leaves of each slope's sky; one cell of 1 if it is not asked for."""
    if not options.hidden_sky:
        return np.ones((1, 1), np.float32)
    from demsmith.core.solar.sky_view import sky_view_factor

    view = sky_view_factor(
        terrain.z, terrain.void, terrain.dx, terrain.dy, azimuths=options.directions,
        curvature=options.curvature, threads=threads, progress=progress,
    )  # fmt: skip
    slope = np.hypot(terrain.east, terrain.north)
    return np.minimum(view * 2 / (1 + 1 / np.sqrt(1 + slope * slope)), 1)


def _add(
    terrain, ranges, sun, hours, table, options, view, sums, threads, sector, horizons, progress
):  # fmt: skip
    """Add the light of a sector's instants."""
    from demsmith.core.solar._integration import add_light

    azimuths = np.radians([sector.edges[0], sector.edges[-1]])
    edges = np.stack([np.sin(azimuths), np.cos(azimuths)], axis=1)
    first, second = (horizons.get(sector.edges[at], terrain.z) for at in (0, -1))
    lattice = terrain.lattice

    def add(rows, instants):
        direction, distance = sun.direction[instants], sun.distance[instants]
        add_light(
            rows, ranges, terrain.z, terrain.east, terrain.north, first, second, view,
            lattice.frame, lattice.rows, lattice.columns, edges, options.shadows, direction,
            (table.constant * hours / distance**2).astype(np.float32),
            np.full(len(distance), hours, np.float32), np.float32(PARALLAX), table.beam,
            table.diffuse, table.lowest, 1 / table.level, np.float32(options.albedo),
            options.diffuse_model == "muneer", *sums,
        )  # fmt: skip

    blocks = _blocks(lattice.rows, terrain.z.shape[1])
    for start in range(0, len(sector.instants), _INSTANTS_AT_ONCE):
        instants = sector.instants[start : start + _INSTANTS_AT_ONCE]
        parallel.run(
            [partial(add, rows, instants) for rows in blocks], threads=threads,
            progress=Span(
                progress, start / len(sector.instants),
                min(start + _INSTANTS_AT_ONCE, len(sector.instants)) / len(sector.instants),
            ),
        )  # fmt: skip


def _blocks(nodes, width):
    """Rows of patches that make up about as many cells as are done at once."""
    count = max(len(nodes) - 1, 1)
    patch = int(nodes[1] - nodes[0]) if len(nodes) > 1 else 1
    step = max(1, _CELLS_AT_ONCE // (patch * width))
    return [(start, min(start + step, count)) for start in range(0, count, step)]


def _irradiance(terrain, sums, instants, is_instant):
    for array in sums:
        array[terrain.void] = np.nan
    beam, diffuse, reflected, sunny = (np.ascontiguousarray(array[terrain.order]) for array in sums)
    void = terrain.void[terrain.order]
    return Irradiance(
        total=beam + diffuse + reflected,
        beam=beam,
        diffuse=diffuse,
        reflected=reflected,
        hours=None if is_instant else sunny,
        shadow=(sunny == 0) & ~void if is_instant else None,
        unit="W/m²" if is_instant else "Wh/m²/day",
        instants=instants,
    )
