"""Sunlight from file to file, as the command line and QGIS do it."""

import time
from dataclasses import dataclass, fields, replace

import numpy as np

import demsmith
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.options import validate
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.solar.irradiance import solar_irradiance
from demsmith.core.solar.options import SolarOptions
from demsmith.core.solar.outputs import write_outputs
from demsmith.core.solar.place import placed

OUTPUTS = (
    "output", "beam", "diffuse", "reflected", "hours", "shadow", "sky_view", "horizons",
)  # fmt: skip


@dataclass(frozen=True)
class SolarResult:
    """What a run did.

    Attributes
    ----------
    output, beam, diffuse, reflected, hours, shadow, sky_view, horizons : str or None
        Paths of what was written.
    seconds : float
    version : str
        Demsmith's.
    cells, cells_void : int
        Number of cells, and of those without an elevation.
    unit : str
        Of the irradiation: ``W/m²`` or ``Wh/m²/day``.
    instants : int
        With the sun up, that were looked at.
    minimum, mean, maximum : float
        Of the output's cells.
    warnings : tuple of str
        One sentence each.
    """

    output: str
    beam: str | None
    diffuse: str | None
    reflected: str | None
    hours: str | None
    shadow: str | None
    sky_view: str | None
    horizons: str | None
    seconds: float
    version: str
    cells: int
    cells_void: int
    unit: str
    instants: int
    minimum: float
    mean: float
    maximum: float
    warnings: tuple

    def as_dict(self):
        """Give everything as a dict that JSON can hold."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def solar_file(
    input, output, *, when, options=None, watts=False, latitude=None, longitude=None,  # noqa: A002
    beam=None, diffuse=None, reflected=None, hours=None, shadow=None, sky_view=None, horizons=None,
    band=1, nodata=(), below=None, above=None, mask=None, threads=None, overwrite=False,
    creation_options=(), progress=SILENT,
):  # fmt: skip
    """Compute the sunlight on the terrain of a raster file.

    Everything asked for is written, or nothing is; the input is never changed.

    Parameters
    ----------
    input : path
        Anything `demsmith.read_raster` reads, which also explains ``band``, ``nodata``,
        ``below``, ``above`` and ``mask``. Its elevations are brought to metres by its unit.
    output : path
        GeoTIFF (float32, as all but the shadow) of the light from the sun, the sky and the
        ground together: W/m² of an instant, Wh/m² a day of days.
    when : When
    options : SolarOptions, optional
    watts : bool
        Whether the mean power over a day's 24 hours is wanted [W/m²] instead of its sum.
    latitude, longitude : float, optional
        Of the middle of a raster without CRS [degrees]: see `demsmith.core.solar.place.placed`.
    beam, diffuse, reflected : path, optional
        The output's parts: light from the sun, the sky and the ground.
    hours : path, optional
        Hours of sun a day.
    shadow : path, optional
        Of an instant, bytes: 1 where terrain hides the sun, the ground faces away from it, or it
        has set; 0 where it shines.
    sky_view : path, optional
        Sky-view factor, 0 to 1.
    horizons : path, optional
        A band of the horizon's elevation [degrees] for each of ``options.directions`` azimuths
        of the grid, clockwise from its north.
    threads : int, optional
        Default: one for each core. The outputs do not depend on it.
    overwrite : bool
        Whether existing outputs may be replaced.
    creation_options : iterable of str
        GDAL's for GeoTIFF, ``KEY=VALUE``.
    progress : Progress

    Returns
    -------
    SolarResult

    Raises
    ------
    InputError
        If the input cannot be used, has nothing but voids, or an option is out of range.
    OutputError
        If an output cannot be written.
    Cancelled
        If ``progress`` asks to stop.
    """
    begin = time.perf_counter()
    options = options or SolarOptions()
    validate(options)
    times = when.times()
    _check_wanted(times, hours, shadow, watts)
    wanted = (output, beam, diffuse, reflected, hours, shadow, sky_view, horizons)
    paths = raster.check_outputs(
        dict(zip(OUTPUTS, wanted, strict=True)),
        inputs=[path for path in (input, mask) if path is not None], overwrite=overwrite,
    )  # fmt: skip
    source = raster.read(
        input, band=band, nodata=nodata, below=below, above=above, mask=mask,
        progress=Span(progress, 0, 0.05),
    )  # fmt: skip
    values = raster.elevations_m(source)
    try:
        grid = placed(source.grid, latitude, longitude)
        light = solar_irradiance(
            values, source.void, grid=grid, **times, options=options, threads=threads,
            progress=Span(progress, 0.05, 0.6),
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"'{source.source}': {error}") from None
    if watts:
        light = _mean_power(light)
    with raster.all_or_nothing(paths) as part:
        write_outputs(
            part, light, values, grid, options, like=source, threads=threads,
            creation_options=creation_options, progress=Span(progress, 0.6, 1),
        )  # fmt: skip
        checkpoint(progress, 1.0)
    known = light.total[~source.void]
    return SolarResult(
        **paths,
        seconds=round(time.perf_counter() - begin, 3),
        version=demsmith.__version__,
        cells=source.values.size,
        cells_void=source.values.size - known.size,
        unit=light.unit,
        instants=light.instants,
        minimum=float(known.min()),
        mean=float(known.mean(dtype=np.float64)),
        maximum=float(known.max()),
        warnings=source.notes,
    )


def _check_wanted(times, hours, shadow, watts):
    if "instant" in times:
        if hours:
            raise InputError("hours of sun are of a day, not of an instant")
        if watts:
            raise InputError("the light of an instant is given in watts in any case")
    elif shadow:
        raise InputError("a shadow mask is of an instant: say so by instant, not by a day")


def _mean_power(light):
    """Give light summed over days as its mean power."""
    parts = ("total", "beam", "diffuse", "reflected")
    return replace(light, unit="W/m²", **{name: getattr(light, name) / 24 for name in parts})
