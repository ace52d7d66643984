"""Void filling: every void of an array gets elevations, every known cell keeps its own."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.mcmd import Lattice, Maps, displacement_of, interpolate, relax_voids
from demsmith.core.options import options_from
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, Span
from demsmith.core.voids.accurate import (
    SOURCE_OF_METHOD,
    Choices,
    Model,
    estimate,
    learn,
    training_windows,
)
from demsmith.core.voids.labelling import Rims, Voids, find_voids, survey_rims
from demsmith.core.voids.options import FillOptions
from demsmith.core.voids.roughness import Roughness, roughen
from demsmith.core.voids.sources import FILLED, LEFT, ORIGINAL

_BLOCK_CELLS = 1 << 20


@dataclass(frozen=True)
class Filled:
    """A filled raster and what is known of its voids.

    Attributes
    ----------
    values : (H, W) array
        Elevations, in the data type of the input unless another was asked for. Voids that were
        left as they were keep the input's values.
    voids : Voids
    rims : Rims
    selected : (N,) int64 array
        The numbers of the voids that were filled.
    roughness : Roughness or None
        What natural roughness the voids were given, if any was asked for.
    tuned : demsmith.core.tuning.Tuned or None
        What tuning found, if it was asked for and there are voids.
    sigma : (H, W) float32 array or None
        Standard error [m] to be expected in the cells that were filled, 0 elsewhere; None if MCMD
        filled them.
    choices : demsmith.core.voids.accurate.Choices or None
        How each selected void was filled, and its expected error; None if all were by MCMD.
    model : demsmith.core.voids.accurate.Model or None
        What was learned of the ground for it.
    """

    values: np.ndarray
    voids: Voids
    rims: Rims
    selected: np.ndarray
    roughness: Roughness | None = None
    tuned: object = None
    sigma: np.ndarray | None = None
    choices: Choices | None = None
    model: Model | None = None

    @property
    def cells_filled(self):
        """Number of cells that were given an elevation."""
        return int(self.voids.cells[self.selected].sum())

    def source(self):
        """Map where each elevation comes from.

        Returns
        -------
        (H, W) uint8 array
            Codes of `demsmith.core.voids.sources`.
        """
        by_label = np.full(len(self.voids) + 1, LEFT, np.uint8)
        by_label[0] = ORIGINAL
        by_label[self.selected + 1] = self.source_by_void()
        return by_label[self.voids.labels]

    def source_by_void(self):
        """Give the source map's code of each selected void."""
        if self.choices is None:
            return np.full(self.selected.size, FILLED, np.uint8)
        return SOURCE_OF_METHOD[self.choices.method]

    def left(self):
        """Give the (H, W) bool mask of void cells that were left as they were."""
        by_label = np.ones(len(self.voids) + 1, bool)
        by_label[0] = False
        by_label[self.selected + 1] = False
        return by_label[self.voids.labels]


def fill_voids(
    values,
    void=None,
    *,
    options=None,
    maps=None,
    pixel_size=None,
    lattice=None,
    d_max=None,
    out=None,
    threads=None,
    progress=SILENT,
    **parameters,
):
    """Fill the voids of an elevation array.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array, optional
        True where there is no elevation. Cells that are not finite are voids in any case, and
        those of a masked array where this is not given.
    options : FillOptions, optional
        How to fill; its fields can as well be given as keywords of their own.
    maps : Maps, optional
        Options that change from cell to cell: ``l``, ``l_bu``, ``h``, ``r_s`` and ``r_t``.
    pixel_size : float, (float, float) or (array, array), optional
        Ground metres per cell: both ways, or east-west and north-south, each one number or one by
        row. Default: 1.
    lattice : Lattice, optional
        MCMD's lattice. Default: the smallest from the first cell. A tile of a mosaic names the
        mosaic's, so that it computes what the merged raster would.
    d_max : float, optional
        Distance [m] at which the curves of ``l`` and ``l_bu`` end. Default: the raster's diagonal.
    out : (H, W) array, optional
        Where to write, of the same type as ``values``; ``values`` itself fills in place.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress, optional

    Returns
    -------
    Filled

    Raises
    ------
    InputError
        If the arrays do not fit, nothing is known, or an option is out of range.
    Cancelled
        If ``progress`` asks to stop; ``out`` is then half filled.

    Examples
    --------
    A hole in a plane comes back as the plane:

    >>> z = np.add.outer(np.arange(9.0), 2 * np.arange(9.0))
    >>> holed = z.copy()
    >>> holed[3:6, 4:6] = np.nan
    >>> filled = fill_voids(holed)
    >>> bool(abs(filled.values - z).max() < 0.2)
    True
    >>> filled.cells_filled
    6
    """
    options = options_from(FillOptions, options, parameters, "fill_voids")
    values, void = checked(values, void)
    tuned = None
    if options.tune and void.any():
        from demsmith.core.tuning import tune_fill  # which fills

        tuned = tune_fill(
            values, void, options=options, maps=maps, pixel_size=pixel_size, d_max=d_max,
            threads=threads, progress=Span(progress, 0, 0.9),
        )  # fmt: skip
        options, progress = tuned.options, Span(progress, 0.9, 1)
    by_cell = (maps or Maps()).over(options, values.shape)
    _refuse_contradictions(options, by_cell)
    voids = find_voids(void, threads=threads, progress=Span(progress, 0, 0.1))
    if voids.cells.sum() == void.size:
        raise InputError("every cell is a void; there is nothing to fill from")
    work, out = _working_array(values, out, options)
    rims = survey_rims(work, void, voids, threads=threads, progress=Span(progress, 0.1, 0.2))
    selected = _selected(voids, rims, options)
    lattice = lattice or Lattice.covering(values.shape)
    filled = 0.5 if options.natural_roughness else 1
    fitting = dict(threads=threads, progress=Span(progress, 0.2, filled))
    sigma = choices = model = roughness = None
    if options.accurate and not _any_given(maps):
        sigma, choices, model = _fill_accurately(
            work, void, voids, selected, options, lattice, pixel_size, **fitting
        )
    else:
        fill = _fill_relaxed if options.variant == "relaxed" else _fill_by_passes
        fill(
            work, values, void, voids, rims, selected, options, by_cell, lattice=lattice,
            pixel_size=pixel_size, d_max=d_max, **fitting,
        )  # fmt: skip
    if options.natural_roughness:
        roughness = roughen(
            work, voids, selected, seed=options.seed, offsets=(-lattice.row, -lattice.column),
            threads=threads, progress=Span(progress, filled, 1),
        )  # fmt: skip
    if work is not out:
        _copy_cells(work, voids, selected, out)
    return Filled(out, voids, rims, selected, roughness, tuned, sigma, choices, model)


def _any_given(maps):
    return maps is not None and any(each is not None for each in vars(maps).values())


def _refuse_contradictions(options, by_cell):
    if options.variant == "relaxed":
        by_cell.refuse_curves(options.variant)
    if options.natural_roughness and np.any(by_cell.r_s):
        raise InputError(
            "natural_roughness finds the displacements that r_s would set; give one of them"
        )


def _working_array(values, out, options):
    """Give the float array to work in and the array to return, the same where possible."""
    dtype = values.dtype
    if options.float_output and dtype.kind != "f":
        dtype = _float_type(dtype)
    if out is None:
        out = np.empty(values.shape, dtype)
    elif out.shape != values.shape or out.dtype != dtype:
        raise InputError(f"out is {out.dtype} {out.shape}; it must be {dtype} {values.shape}")
    if out is not values:
        np.copyto(out, values, casting="unsafe")
    if dtype in (np.float32, np.float64) and out.flags.c_contiguous:  # in native byte order
        return out, out
    return np.array(values, _float_type(values.dtype), order="C"), out


def _float_type(dtype):
    """Give the float type that holds every number of a type, or nearly."""
    small = dtype.itemsize <= 2 or dtype.newbyteorder("=") == np.float32
    return np.dtype(np.float32 if small else np.float64)


def _selected(voids, rims, options):
    wanted = np.ones(len(voids), bool)
    if options.interior_only:
        wanted &= ~rims.touches_edge
    if options.max_size is not None:
        wanted &= voids.cells <= options.max_size
    return np.flatnonzero(wanted)


def _fill_accurately(
    work, void, voids, selected, options, lattice, pixel_size, *, threads, progress
):
    pixel_size = metres(work.shape, pixel_size)
    model = None
    if selected.size:
        model = learn(
            training_windows(work, void, pixel_size), tension=options.tension, threads=threads,
            progress=Span(progress, 0, 0.4),
        )  # fmt: skip
    sigma = np.zeros(work.shape, np.float32)
    choices = estimate(
        work, void, voids, selected, model, sigma=sigma, pixel_size=pixel_size,
        tension=options.tension, lattice=lattice, threads=threads, progress=Span(progress, 0.4, 1),
    )  # fmt: skip
    return sigma, choices, model


def _fill_relaxed(
    work, values, void, voids, rims, selected, options, by_cell, *, lattice, pixel_size, d_max,
    threads, progress,
):  # fmt: skip
    # d_max belongs to the curves, which this variant does not have.
    relax_voids(
        work, voids, selected, rims.mean[selected], pixel_size=pixel_size,
        tension=options.tension,
        displacement=displacement_of(options, by_cell, values, ~void, lattice),
        lattice=lattice, threads=threads, progress=progress,
    )  # fmt: skip


def _fill_by_passes(
    work, values, void, voids, rims, selected, options, by_cell, *, lattice, pixel_size, d_max,
    threads, progress,
):  # fmt: skip
    filled = interpolate(
        values, ~void, variant=options.variant, scheme=options.scheme, l=by_cell.l,
        l_bu=by_cell.l_bu, datum=options.datum, d_max=d_max,
        displacement=displacement_of(options, by_cell, values, ~void, lattice),
        pixel_size=pixel_size, lattice=lattice, threads=threads, progress=progress,
    )  # fmt: skip
    _copy_cells(filled, voids, selected, work)


def _copy_cells(source, voids, selected, target):
    """Copy the selected voids' cells, rounded and cut to the range of the target's type."""
    chosen = np.zeros(len(voids) + 1, bool)
    chosen[selected + 1] = True
    whole = target.dtype.kind in "iu"
    limits = np.iinfo(target.dtype) if whole else np.finfo(target.dtype)
    step = max(1, _BLOCK_CELLS // target.shape[1])
    for row in range(0, target.shape[0], step):
        rows = slice(row, row + step)
        block = np.clip(source[rows], float(limits.min), float(limits.max))
        if whole:
            np.rint(block, out=block)
        np.copyto(target[rows], block, where=chosen[voids.labels[rows]], casting="unsafe")
