"""MCMD with relaxed generations: the most accurate variant, void by void.

The paper's bottom-up pass lets a void's coarse lattice points take the elevations of cells that
lie off to one side, and the top-down pass then hangs straight strings between them, so slopes
break at the rim. Here every generation of midpoints, after it is predicted from its ascendants,
is relaxed against the known ground around it to the surface of least bending (with a little
tension for large voids, after Smith and Wessel 1990, "Gridding with continuous curvature splines
in tension", Geophysics 55), by successive over-relaxation. The sweeps double with each coarser
level while the points quarter, so the work stays proportional to the number of void cells.
"""

from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.mcmd.lattice import Lattice
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, Span, checkpoint

FINEST_SWEEPS = 4
OMEGA = 1.7
TENSION_CELLS = 12.0
_LARGE = 200_000
_BLOCK = 4_000_000
_SPAN = 50_000


def relax_voids(
    values,
    voids,
    selected,
    starts,
    *,
    pixel_size=None,
    tension=None,
    displacement=None,
    lattice=None,
    threads=None,
    progress=SILENT,
):
    """Fill voids in place by MCMD with relaxed generations.

    Each void's surface depends on the known ground around it, the lattice's origin and the
    options alone: on no other void, nor on the number of threads.

    Parameters
    ----------
    values : (H, W) float32 or float64 array, C order
        Elevations; the cells of the selected voids are overwritten.
    voids : demsmith.core.voids.Voids
        All voids of the raster.
    selected : (N,) int array
        The numbers of those to fill.
    starts : (N,) float64 array
        The elevation each begins with, such as its rim's mean.
    pixel_size : optional
        Ground metres per cell, see `demsmith.core.mcmd.lattice.metres`.
    tension : float, optional
        Distance [m] over which bending gives way to stretching; default: 12 rows.
    displacement : Displacement, optional
        Random roughness to add; default: none.
    lattice : Lattice, optional
        Default: one that begins at the raster's first cell.

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop; ``values`` is then half filled.
    """
    from demsmith.core.mcmd._relaxed import make_stencils

    if not selected.size:
        return
    lattice = lattice or Lattice.covering(values.shape)
    offsets = (-lattice.row, -lattice.column)
    dx, dy = metres(values.shape, pixel_size)
    length = TENSION_CELLS * dy if tension is None else tension
    levels = max(values.shape).bit_length()
    stencils = make_stencils((dy / dx) ** 2, (dy / length) ** 2, OMEGA, levels)

    cells = voids.cells[selected]
    large = cells > _LARGE
    relaxing = progress if displacement is None else Span(progress, 0, 0.7)
    share = float(cells[large].sum() / cells.sum())
    _fill_large(
        values, voids, selected[large], starts[large], stencils, offsets, Span(relaxing, 0, share)
    )
    _fill_small(
        values, voids, selected[~large], starts[~large], stencils, offsets,
        threads, Span(relaxing, share, 1),
    )  # fmt: skip
    if displacement is not None:
        rest = Span(progress, 0.7, 1)
        displace(values, voids, selected, displacement, offsets, threads, rest)


def _fill_small(values, voids, selected, starts, stencils, offsets, threads, progress):
    from demsmith.core.mcmd._relaxed import fill_voids

    def fill(span):
        fill_voids(
            values, voids.labels, voids.runs, voids.first_run, selected[span], starts[span],
            stencils, OMEGA, *offsets, FINEST_SWEEPS,
        )  # fmt: skip

    _over_spans(voids.cells[selected], fill, threads, progress)


def _over_spans(cells, work, threads, progress):
    """Call ``work`` with slices of the voids, side by side."""
    # Small enough for progress and an even load, large enough that starting one costs nothing.
    parts = max(4 * parallel.thread_count(threads), int(cells.sum()) // _SPAN)
    spans = parallel.even_spans(cells, parts)
    parallel.run(
        [partial(work, slice(begin, end)) for begin, end in spans],
        weights=[cells[begin:end].sum() for begin, end in spans],
        threads=threads,
        progress=progress,
    )


def _fill_large(values, voids, selected, starts, stencils, offsets, progress):
    """Fill voids one by one, sweep by sweep, so that progress and cancel come in between."""
    for i, (void, start) in enumerate(zip(selected, starts, strict=True)):
        part = Span(progress, i / selected.size, (i + 1) / selected.size)
        _fill_one(values, voids, int(void), start, stencils, offsets, part)


def _fill_one(values, voids, void, start, stencils, offsets, progress):
    from demsmith.core.mcmd import _points as points
    from demsmith.core.mcmd._relaxed import predict, relax

    a, b = int(voids.first_run[void]), int(voids.first_run[void + 1])
    segments = np.empty((b - a, points.COLUMNS), np.int64)
    bits = np.empty(int(voids.cells[void]), np.int16)
    points.flood(values, voids.runs, a, b, start)
    # A level has a quarter of the next finer one's points and twice its sweeps.
    done = 0.0
    for level in range(points.coarsest_level(voids.runs, a, b), -1, -1):
        count = points.gather(
            voids.labels, voids.runs, a, b, void + 1, level, *offsets, segments, bits
        )
        if level:
            points.pin(values, voids.labels, segments, count, bits, level)
        checkpoint(progress, done)
        predict(values, segments, count, bits, level)
        sweeps = FINEST_SWEEPS << level
        lengths = segments[:count, points.LENGTH]
        blocks = parallel.even_spans(lengths, int(lengths.sum()) // _BLOCK + 1)
        # The coarse levels' many sweeps over few points go in bundles of about a block's work.
        bundle = max(1, _BLOCK // max(int(lengths.sum()), 1) // 2 * 2)
        for sweep in range(0, sweeps, bundle):
            last = min(sweep + bundle, sweeps)
            for low, high in blocks if sweep % 2 == 0 else reversed(blocks):
                relax(values, segments, low, high, bits, level, stencils, OMEGA, sweep, last)
                checkpoint(progress, done + 0.5 ** (level + 1) * last / sweeps)
        done += 0.5 ** (level + 1)


def displace(values, voids, selected, displacement, offsets, threads=None, progress=SILENT):
    """Add random roughness that dies away at the rim to filled voids, in place.

    Parameters
    ----------
    values : (H, W) float32 or float64 array, C order
    voids : demsmith.core.voids.Voids
    selected : (N,) int array
        The numbers of the voids.
    displacement : Displacement
    offsets : (int, int)
        Added to a cell's row and column they count from the lattice's corner.
    threads : int, optional
    progress : Progress

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop; ``values`` is then half displaced.
    """
    from demsmith.core.mcmd._displacement import displace_voids

    sums = np.zeros(values.shape)
    noise = displacement.noise(values.shape)

    def add(span):
        displace_voids(
            values, voids.labels, voids.runs, voids.first_run, selected[span], sums,
            noise, *offsets,
        )  # fmt: skip

    _over_spans(voids.cells[selected], add, threads, progress)
