"""Drainage of an elevation array: depressions, directions, upstream area, and what follows."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.hydrology.accumulation import accumulate_d8, accumulate_dinf, accumulate_mfd
from demsmith.core.hydrology.breaching import breach_depressions
from demsmith.core.hydrology.contamination import contamination
from demsmith.core.hydrology.depressions import fill_depressions
from demsmith.core.hydrology.directions import d8_directions
from demsmith.core.hydrology.flats import resolve_flats
from demsmith.core.hydrology.options import DrainageOptions
from demsmith.core.hydrology.particles import drop_particles
from demsmith.core.hydrology.specific import specific_area, specific_area_of_shares
from demsmith.core.hydrology.streams import find_streams
from demsmith.core.hydrology.surfaces import surface
from demsmith.core.hydrology.traversal import Surface
from demsmith.core.options import options_from
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.strips import strips

_IN_UNIT = {"m2": 1.0, "km2": 1e-6}


@dataclass(frozen=True, eq=False)
class Drainage:
    """How a raster drains.

    Attributes
    ----------
    area : (H, W) float64 array
        Upstream area in the options' unit, or the sum of the weights upstream, of the cell itself
        too; NaN at voids.
    standard_error : (H, W) float32 array or None
        Of the area, by method particles; NaN at voids.
    directions : (H, W) uint8 array
        Where each cell drains to by D8: ESRI's code (1 east, 2 south-east, 4 south, ... 128
        north-east, if the next row is south), 0 for out of the raster, into a void or nowhere,
        247 at voids.
    conditioned : (H, W) float array
        Elevations after the treatment of depressions; at voids, anything.
    void : (H, W) bool array
    options : DrainageOptions
    """

    area: np.ndarray
    standard_error: np.ndarray | None
    directions: np.ndarray
    conditioned: np.ndarray
    void: np.ndarray
    options: DrainageOptions
    _flat: np.ndarray | None
    _values: np.ndarray
    _sizes: tuple
    _cell_area: np.ndarray
    _weighted: bool

    @property
    def unit(self):
        """The unit of the area: ``m2``, ``km2``, ``cells``, or empty for that of weights."""
        return "" if self._weighted else self.options.unit

    def changed(self):
        """Tell which cells the treatment of depressions raised or lowered: (H, W) bool array."""
        changed = np.empty(self.void.shape, bool)
        for rows in strips(self.void.shape):
            np.not_equal(self.conditioned[rows], self._values[rows], out=changed[rows])
            changed[rows] &= ~self.void[rows]
        return changed

    def log(self, *, progress=SILENT):
        """Give the common logarithm of the area: (H, W) float32 array, NaN where that is 0."""
        log = np.empty(self.area.shape, np.float32)
        for rows in strips(log.shape):
            checkpoint(progress, rows.start / len(log))
            area = self.area[rows]
            log[rows] = np.log10(np.where(area > 0, area, np.nan))
        return log

    def specific(self, *, threads=None, progress=SILENT):
        """Give the specific catchment area: upstream area by width of the flow's cross section.

        Returns
        -------
        (H, W) float32 array
            Square metres a metre, or the weights' unit a metre; NaN at voids.

        Raises
        ------
        InputError
            If the area is in cells.
        """
        if self.unit == "cells":
            raise InputError("a specific catchment area needs unit m2 or km2, not cells")
        running = dict(threads=threads, progress=progress)
        if self.options.method == "d8":
            specific = specific_area(self.area, self.directions, *self._sizes, **running)
        else:
            specific = specific_area_of_shares(
                self.area, self.conditioned, self._flat, self.void, *self._sizes,
                exponent=self._exponent, **running,
            )  # fmt: skip
        if self.unit:
            specific /= np.float32(_IN_UNIT[self.unit])
        return specific

    def flags(self, filled=None, *, threads=None, progress=SILENT):
        """Tell what is known of the catchment of each cell.

        Parameters
        ----------
        filled : (H, W) bool array, optional
            Cells whose elevations were filled earlier.

        Returns
        -------
        (H, W) uint8 array
            Sum of 1 where the catchment touches the raster's edge or a void, so that there may be
            more of it; 2 where it holds a filled cell; 4 where it holds a cell that the treatment
            of depressions changed.
        """
        receivers = self._receivers(threads, Span(progress, 0, 0.3))
        return contamination(
            receivers, self.void, filled=filled, changed=self.changed(), threads=threads,
            progress=Span(progress, 0.3, 1),
        )  # fmt: skip

    def _receivers(self, threads, progress):
        """Give the sum of the codes of all neighbours that each cell drains to by the method."""
        if self.options.method == "d8":
            return self.directions
        ground = Surface(self.conditioned, self._flat, self.void, *self._sizes)
        return ground.receivers(self._exponent, threads=threads, progress=progress)

    @property
    def _exponent(self):
        """The exponent of MFD; None for D-infinity."""
        return None if self.options.method == "dinf" else self.options.exponent

    def streams(self, *, threads=None, progress=SILENT):
        """Find the streams: cells whose upstream area by D8, in m², reaches the threshold.

        Returns
        -------
        demsmith.core.hydrology.Streams
            Whatever the method, unit and weights, for the area of D8 alone never shrinks downstream
            along its directions, so that no stream breaks off.
        """
        area = self._ground_area(threads, Span(progress, 0, 0.5))
        return find_streams(
            self.directions, area, threshold=self.options.threshold, pixel_size=self._sizes,
            threads=threads, progress=Span(progress, 0.5, 1),
        )  # fmt: skip

    def _ground_area(self, threads, progress):
        """Give the area by D8 in m²."""
        if self.options.method == "d8" and self.unit == "m2":
            return self.area
        return accumulate_d8(self.directions, self._cell_area, threads=threads, progress=progress)


def drainage_area(
    values, void=None, *, pixel_size=None, cell_area=None, weights=None, options=None,
    threads=None, progress=SILENT, **parameters,
):  # fmt: skip
    """Tell how much ground drains through each cell.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations [m]; the next row is the southern one.
    void : (H, W) bool array, optional
        True where there is no elevation. Cells that are not finite are voids in any case, and
        those of a masked array where this is not given. Water may leave into voids and over the
        raster's edge.
    pixel_size : float, (float, float) or (array, array), optional
        Ground metres per cell: both ways, or east-west and north-south, each one number or one by
        row. Default: 1.
    cell_area : float or (H,) array, optional
        Ground area of the cells, of each row [m²]. Default: the product of the sides.
    weights : (H, W) array, optional
        What each cell adds instead of its area, such as runoff: 0 or more, in any unit. NaN adds
        nothing.
    options : DrainageOptions, optional
        Method, depressions, unit and more; its fields can as well be given as keywords of their
        own.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress, optional

    Returns
    -------
    Drainage

    Raises
    ------
    InputError
        If the arrays do not fit, every cell is a void, a weight is negative, or an option is out of
        range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    A valley that falls to the south; the last row drains everything:

    >>> row, column = np.mgrid[:4, :5]
    >>> drained = drainage_area(abs(column - 2) - 0.1 * row, pixel_size=10)
    >>> drained.area[:, 2]
    array([ 500., 1000., 1500., 2000.])
    >>> drained.directions[0]
    array([ 1,  1,  4, 16, 16], dtype=uint8)
    """
    options = options_from(DrainageOptions, options, parameters, "drainage_area")
    values, void = checked(values, void)
    if void.all():
        raise InputError("every cell is a void; no water flows")
    sizes = metres(values.shape, pixel_size)
    cell_area = _cell_areas(cell_area, sizes)
    weights = None if weights is None else _checked_weights(weights, void)
    conditioned, flat = _conditioned(values, void, sizes, options, threads, Span(progress, 0, 0.5))
    added = _shares(cell_area, options.unit) if weights is None else weights
    ground = (conditioned, flat, void, *sizes)
    # In the order that needs the least memory at once.
    if options.method == "d8":
        directions = d8_directions(*ground, threads=threads, progress=Span(progress, 0.5, 0.6))
        ground, flat, error = None, None, None  # the directions tell all that flat does
        area = accumulate_d8(directions, added, threads=threads, progress=Span(progress, 0.6, 1))
    else:
        area, error = _parted(ground, added, options, threads, Span(progress, 0.5, 0.9))
        directions = d8_directions(*ground, threads=threads, progress=Span(progress, 0.9, 1))
    for made in (area, error):
        if made is not None:
            np.copyto(made, np.nan, where=void)
    checkpoint(progress, 1)
    return Drainage(
        area, error, directions, conditioned, void, options, _flat=flat,
        _values=values, _sizes=sizes, _cell_area=cell_area, _weighted=weights is not None,
    )  # fmt: skip


def _cell_areas(cell_area, sizes):
    """Give the area of the cells of each row, checked."""
    dx, dy = sizes
    if cell_area is None:
        return dx * dy
    area = np.asarray(cell_area, np.float64)
    if area.ndim and area.shape != dx.shape:
        raise InputError(f"cell_area by row has shape {area.shape} for {dx.size} rows")
    if not np.all(np.isfinite(area)) or np.any(area <= 0):
        raise InputError("cell_area must be positive and finite")
    return np.broadcast_to(area, dx.shape).copy()


def _shares(cell_area, unit):
    """Give what the cells of each row add."""
    return np.ones_like(cell_area) if unit == "cells" else cell_area * _IN_UNIT[unit]


def _checked_weights(weights, void):
    weights = np.asarray(weights)
    if weights.shape != void.shape:
        raise InputError(f"weights has shape {weights.shape}, values {void.shape}")
    weights = np.where(void | np.isnan(weights), 0.0, weights).astype(np.float64, copy=False)
    wrong = ~np.isfinite(weights) | (weights < 0)
    if wrong.any():
        raise InputError(
            f"{np.count_nonzero(wrong)} weights are negative or infinite, such as "
            f"{weights[wrong][0]:g}; they must be 0 or more"
        )
    return weights


def _conditioned(values, void, sizes, options, threads, progress):
    """Treat depressions; give elevations, and what leads over the flats of these."""
    z, void = surface(values, void)
    if options.depressions == "breach":
        z = breach_depressions(
            z, void, *sizes, max_depth=options.max_depth, max_length=options.max_length,
            threads=threads, progress=Span(progress, 0, 0.4),
        )  # fmt: skip
    if options.depressions != "keep":
        z = fill_depressions(
            z, void, max_depth=options.max_depth if options.depressions == "fill" else None,
            threads=threads, progress=Span(progress, 0.4, 0.8),
        )  # fmt: skip
    flat = resolve_flats(z, void, threads=threads, progress=Span(progress, 0.8, 1))
    return z, flat


def _parted(ground, weights, options, threads, progress):
    """Give the upstream sum of the weights where flow parts and, by particles, its error."""
    running = dict(threads=threads, progress=progress)
    if options.method == "dinf":
        return accumulate_dinf(*ground, weights, **running), None
    if options.method == "mfd":
        return accumulate_mfd(*ground, weights, exponent=options.exponent, **running), None
    return drop_particles(
        *ground, weights, exponent=options.exponent, particles=options.particles,
        seed=options.seed, **running,
    )  # fmt: skip
