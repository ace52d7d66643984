"""Terrain on a grid from the cells that are known, be they many, few or none."""

from dataclasses import fields

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.mcmd import (
    Lattice,
    Maps,
    McmdOptions,
    converge,
    displace,
    displacement_of,
    interpolate,
)
from demsmith.core.options import validate
from demsmith.core.progress import SILENT, Span
from demsmith.core.samples.presets import settled
from demsmith.core.voids import FillOptions, fill_voids


def reconstruct(
    values, known, *, options, maps=None, pixel_size=None, lattice=None, threads=None,
    progress=SILENT,
):  # fmt: skip
    """Give every cell an elevation from the known ones; from noise alone where none is known.

    Parameters
    ----------
    values : (H, W) float array
        Elevations [m]; only known cells are read.
    known : (H, W) bool array
        None need be.
    options : SampleOptions
        Variant and parameters. Where nothing is known, ``relief`` is needed and ``datum`` is the
        elevation about which the terrain rises and falls (default: 0).
    maps : Maps, optional
        Parameters that change from cell to cell.
    pixel_size : optional
        Ground metres per cell, see `demsmith.core.mcmd.lattice.metres`.
    lattice : Lattice, optional
        Default: the smallest from the first cell.
    threads : int, optional
    progress : Progress

    Returns
    -------
    (H, W) float32 or float64 array, as ``values``
        Known cells keep their elevations.

    Raises
    ------
    InputError
        If an option is out of range, or nothing is known and there is no relief or no noise.
    Cancelled
        If ``progress`` asks to stop.
    """
    validate(options)
    options = settled(options)
    common = dict(
        pixel_size=pixel_size, lattice=lattice or Lattice.covering(values.shape), threads=threads
    )
    if not known.any():
        made = _from_noise(known, options, maps, **common, progress=progress)
        return made.astype(values.dtype, copy=False)
    if options.variant == "converged":
        return _converged(values, known, options, maps, **common, progress=progress)
    own = _fill_options(options)
    return fill_voids(values, ~known, options=own, maps=maps, **common, progress=progress).values


def _fill_options(options, **changes):
    """Give the options of MCMD alone, as filling takes them."""
    own = {field.name: getattr(options, field.name) for field in fields(McmdOptions)}
    return FillOptions(method="mcmd", **{**own, **changes})


def _from_noise(known, options, maps, *, lattice, pixel_size, threads, progress):
    if options.relief is None:
        raise InputError("nothing is known; give the relief of the terrain to make")
    by_cell = (maps or Maps()).over(options, known.shape)
    displacement = displacement_of(options, by_cell, None, known, lattice)
    return interpolate(
        np.zeros(known.shape), known, l=by_cell.l, l_bu=by_cell.l_bu, scheme=options.scheme,
        datum=options.datum, displacement=displacement, pixel_size=pixel_size, lattice=lattice,
        threads=threads, progress=progress,
    )  # fmt: skip


def _converged(values, known, options, maps, *, lattice, pixel_size, threads, progress):
    by_cell = (maps or Maps()).over(options, known.shape)
    by_cell.refuse_curves(options.variant)
    # Noise comes last, or the energy's descent would smooth it away.
    start = fill_voids(
        values, ~known, options=_fill_options(options, variant="relaxed", r_s=0.0),
        pixel_size=pixel_size, lattice=lattice, threads=threads, progress=Span(progress, 0, 0.2),
    )  # fmt: skip
    found = converge(
        start.values, known, pixel_size=pixel_size, tension=options.tension,
        stiffness=options.stiffness, threads=threads, progress=Span(progress, 0.2, 0.9),
    ).astype(values.dtype, copy=False)  # fmt: skip
    displacement = displacement_of(options, by_cell, values, known, lattice)
    if displacement is not None:
        displace(
            found, start.voids, start.selected, displacement, (-lattice.row, -lattice.column),
            threads=threads, progress=Span(progress, 0.9, 1),
        )  # fmt: skip
    return found
