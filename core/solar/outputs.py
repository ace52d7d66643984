"""The files of a run, written one after another."""

import numpy as np

from demsmith.core import raster
from demsmith.core.progress import Muted, Span, checkpoint

_NODATA = -9999.0
_SHADOW_NODATA = 255
_SHADOW_NAMES = ("sun", "shadow")
_SHADOW_COLORS = {0: (255, 236, 150, 255), 1: (40, 44, 84, 255)}
_SWEPT = ("sky_view", "horizons")


def write_outputs(paths, light, values, grid, options, *, progress, **writing):
    """Write everything that is asked for.

    Parameters
    ----------
    paths : mapping of str to str
        By name: ``output`` and those of ``beam``, ``diffuse``, ``reflected``, ``hours``,
        ``shadow``, ``sky_view`` and ``horizons`` that are wanted.
    light : Irradiance
    values : (H, W) float array
        Elevations [m].
    grid : Grid
        Their place.
    options : SolarOptions
    progress : Progress
    writing
        ``like``, ``creation_options`` and ``threads`` of `demsmith.core.raster.write`.

    Raises
    ------
    OutputError
        If one cannot be written to its end.
    Cancelled
        If ``progress`` asks to stop.
    """
    writing["overwrite"] = True
    wanted = [name for name, path in paths.items() if path]
    # Writing takes about as long as two sweeps.
    ends = np.cumsum([options.directions if name in _SWEPT else 2 for name in wanted])
    for name, start, end in zip(wanted, [0, *ends], ends, strict=False):
        span = Span(progress, start / ends[-1], end / ends[-1])
        if name in _SWEPT:
            sweeps = _Sweeps(values, writing["like"].void, grid, options, writing["threads"])
            write = _write_horizons if name == "horizons" else _write_sky_view
            write(paths[name], sweeps, span, writing)
        elif name == "shadow":
            _write_shadow(paths[name], light.shadow, span, writing)
        elif name == "hours":
            _write_layer(paths[name], light.hours, "hours of sun", "h/day", span, writing)
        else:
            kind, part = ("global", "total") if name == "output" else (name, name)
            _write_layer(
                paths[name], getattr(light, part), f"{kind} irradiation", light.unit, span, writing
            )


def _write_layer(path, layer, title, unit, progress, writing):
    raster.write(
        path, layer, void=writing["like"].void, dtype="float32", nodata=_NODATA,
        description=f"{title} [{unit}]" if unit else title, unit=unit, same_quantity=False,
        progress=progress, **writing,
    )  # fmt: skip


def _write_shadow(path, shadow, progress, writing):
    void = writing["like"].void
    raster.write(
        path, shadow.astype(np.uint8), void=void, dtype="uint8",
        nodata=_SHADOW_NODATA if void.any() else None, description="shadow", same_quantity=False,
        color_table=_SHADOW_COLORS, categories=_SHADOW_NAMES, progress=progress, **writing,
    )  # fmt: skip


def _write_sky_view(path, sweeps, progress, writing):
    factor = sweeps.sky_view(Span(progress, 0, 0.95))
    _write_layer(path, factor, "sky-view factor", "", Span(progress, 0.95, 1), writing)


def _write_horizons(path, sweeps, progress, writing):
    raster.write_bands(
        path, sweeps.horizons(progress), nodata=_NODATA, void=writing["like"].void, unit="°",
        descriptions=[f"horizon at azimuth {azimuth:g}° [°]" for azimuth in sweeps.azimuths],
        progress=Muted(progress), **writing,
    )  # fmt: skip
    checkpoint(progress, 1.0)


class _Sweeps:
    """What is swept from the terrain, in the order of the file's cells."""

    def __init__(self, values, void, grid, options, threads):
        self._order, grid = raster.north_up(grid)
        turned = (np.ascontiguousarray(array[self._order]) for array in (values, void))
        self._terrain = (*turned, *grid.pixel_size_m())
        self._curvature, self._threads = options.curvature, threads
        self.azimuths = 360.0 * np.arange(options.directions) / options.directions

    def sky_view(self, progress):
        from demsmith.core.solar.sky_view import sky_view_factor

        factor = sky_view_factor(
            *self._terrain, azimuths=len(self.azimuths), curvature=self._curvature,
            threads=self._threads, progress=progress,
        )  # fmt: skip
        return factor[self._order]

    def horizons(self, progress):
        """Yield the elevation of the horizon [degrees] at each azimuth."""
        from demsmith.core.solar.horizon import HorizonSweep

        sweep = HorizonSweep(*self._terrain, curvature=self._curvature)
        count = len(self.azimuths)
        for number, azimuth in enumerate(self.azimuths):
            span = Span(progress, number / count, (number + 0.8) / count)
            tangent = sweep.tangent(azimuth, threads=self._threads, progress=span)
            yield np.degrees(np.arctan(tangent))[self._order]
