"""Terrain on a grid from samples, a sketch, or nothing but noise."""

from dataclasses import dataclass

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.options import options_from
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.raster.grid import Grid
from demsmith.core.samples.contours import with_sides
from demsmith.core.samples.gridding import to_cells
from demsmith.core.samples.grids import extent_of
from demsmith.core.samples.options import SampleOptions
from demsmith.core.samples.presets import PRESETS, from_noise, settled, with_preset
from demsmith.core.samples.reconstruction import reconstruct
from demsmith.core.samples.samples import Samples

_BLOCK_CELLS = 1 << 17


@dataclass(frozen=True, eq=False)
class Reconstructed:
    """Terrain made from samples.

    Attributes
    ----------
    values : (H, W) array
        Elevations [m], float32; float64 where ``Samples.cells`` need it.
    known : (H, W) bool array
        Cells that hold a sample; ``values`` has its elevation there.
    grid : Grid
    samples, samples_outside : int
        Points, vertices and known cells in the grid, and beyond it; all vertices of a line that
        has a cell of the grid count as in it.
    notes : tuple of str
        What is odd, one sentence each.
    tuned : demsmith.core.tuning.Tuned or None
        What tuning found, if it was asked for.
    """

    values: np.ndarray
    known: np.ndarray
    grid: Grid
    samples: int
    samples_outside: int
    notes: tuple
    tuned: object = None

    @property
    def cells_known(self):
        """Number of cells that hold a sample."""
        return int(np.count_nonzero(self.known))


def from_samples(
    samples, grid, *, options=None, sketch=None, maps=None, lattice=None, threads=None,
    progress=SILENT, **parameters,
):  # fmt: skip
    """Make terrain from samples.

    Cells with a sample keep its elevation (`demsmith.core.samples.to_cells` tells which and
    whose); all others are made by MCMD. Without any sample the terrain is fractal noise.

    Parameters
    ----------
    samples : Samples, (N, 3) array-like or None
        Points alone as rows of x, y, elevation [m], in the coordinates of the grid's CRS.
    grid : Grid
        The cells to make.
    options : SampleOptions, optional
        How; its fields can as well be given as keywords of their own.
    sketch : (h, w) float array, optional
        Painted elevations, as of `demsmith.core.samples.read_sketch`; stretched over the grid.
    maps : Maps, optional
        Parameters that change from cell to cell.
    lattice : Lattice, optional
        MCMD's lattice. Default: the smallest from the first cell.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress, optional

    Returns
    -------
    Reconstructed

    Raises
    ------
    InputError
        If samples or a sketch are given and none is usable and in the grid, or an option is out
        of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> from demsmith.core.raster import Grid
    >>> grid = Grid.of_extent((0, 0, 90, 90), 10)
    >>> terrain = from_samples([(5, 5, 100), (85, 5, 180), (5, 85, 100), (85, 85, 180)], grid)
    >>> float(terrain.values[8, 8]), terrain.cells_known
    (180.0, 4)
    """
    options = with_preset(options_from(SampleOptions, options, parameters, "from_samples"))
    held = samples if isinstance(samples, Samples) else Samples(() if samples is None else samples)
    gridded = to_cells(held, grid, sketch, progress=Span(progress, 0, 0.1))
    if not gridded.known.any():
        if samples is not None or sketch is not None:
            raise InputError(_why_none(held, gridded, grid, sketch))
        options = from_noise(options)
    options = settled(options)
    surroundings = dict(pixel_size=grid.pixel_size_m(), lattice=lattice, threads=threads)
    tuned = None
    if options.tune:
        tuned = _tune(gridded, options, maps, grid, threads, Span(progress, 0.1, 0.8))
        options = tuned.options
    done = 0.8 if tuned else 0.1
    values = _surface(gridded, options, maps, surroundings, Span(progress, done, 0.95))
    if options.preset != "none" and PRESETS[options.preset].median:
        values = _median(values, gridded.known, threads, Span(progress, 0.95, 1))
    checkpoint(progress, 1.0)
    return Reconstructed(
        values.astype(gridded.values.dtype, copy=False), gridded.known, grid, gridded.used,
        gridded.outside, _notes(gridded), tuned,
    )  # fmt: skip


def _why_none(samples, gridded, grid, sketch):
    if not len(samples) and sketch is not None:
        return "no cell of the grid is painted on the sketch; a finer resolution may help"
    if not len(samples):
        return "there are no samples (None makes terrain from noise alone)"
    if not gridded.outside:
        return f"none of {len(samples)} samples has finite coordinates and elevation"
    vertices = samples.vertices()
    low, high = np.nanmin(vertices, axis=0), np.nanmax(vertices, axis=0)
    xmin, ymin, xmax, ymax = extent_of(grid)
    return (
        f"none of {len(samples)} samples lies in the grid: they are at x {low[0]:.10g} to "
        f"{high[0]:.10g}, y {low[1]:.10g} to {high[1]:.10g}, the grid at x {xmin:.10g} to "
        f"{xmax:.10g}, y {ymin:.10g} to {ymax:.10g}; check their CRS and the extent"
    )


def _tune(gridded, options, maps, grid, threads, progress):
    from demsmith.core.tuning import tune_samples  # which makes terrain

    return tune_samples(
        gridded.values, gridded.known, options=options, maps=maps,
        pixel_size=grid.pixel_size_m(), threads=threads, progress=progress,
    )  # fmt: skip


def _surface(gridded, options, maps, surroundings, progress):
    values, known = gridded.values, gridded.known
    # The surface of least bending has two sides to a contour; the other variants, void by void
    # or pass by pass, have not.
    if gridded.contour is not None and options.variant != "converged":
        values, known = with_sides(
            values, known, gridded.contour, options=options,
            progress=Span(progress, 0, 0.5), **surroundings,
        )  # fmt: skip
        progress = Span(progress, 0.5, 1)
    return reconstruct(values, known, options=options, maps=maps, progress=progress, **surroundings)


def _median(values, known, threads, progress):
    """Give unknown cells the median of their 3 × 3 neighbourhood."""
    from scipy.ndimage import median_filter

    out = values.copy()
    rows, step = values.shape[0], max(1, _BLOCK_CELLS // values.shape[1])

    def smooth(begin):
        end, above = min(begin + step, rows), max(begin - 1, 0)
        block = median_filter(values[above : end + 1], size=3, mode="nearest")
        inner = block[begin - above : end - above]
        np.copyto(out[begin:end], inner, where=~known[begin:end])

    parallel.run(
        [lambda begin=begin: smooth(begin) for begin in range(0, rows, step)],
        threads=threads, progress=progress,
    )  # fmt: skip
    return out


def _notes(gridded):
    notes = []
    total = gridded.used + gridded.outside + gridded.unusable
    if gridded.outside:
        notes.append(f"{gridded.outside} of {total} samples lie outside the grid; left out")
    if gridded.unusable:
        notes.append(
            f"{gridded.unusable} of {total} samples have no finite coordinates and elevation; "
            "left out"
        )
    if gridded.deviation > 0:
        cells = "1 cell holds" if gridded.shared == 1 else f"{gridded.shared} cells hold"
        notes.append(
            f"{cells} several points; the mean is taken, from which these are up to "
            f"{gridded.deviation:.4g} m"
        )
    return tuple(notes)
