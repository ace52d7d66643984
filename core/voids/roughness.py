"""Natural roughness: filled ground made as rough as the ground around each void.

A fill is smoother than ground. What it lacks is measured by the structure function of second
differences, ``E[(z(p - h) - 2 z(p) + z(p + h))**2]``, of the known ground around the void: slopes,
which a fill has, do not count in it, as they would in ``E[(z(p + h) - z(p))**2]``. It is added as
random displacements (Belhadj 2007, equation 1), whose exponent and amplitude make the void's own
structure function at lags of 1 to 8 cells that of its surroundings.
"""

from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from demsmith.core import parallel
from demsmith.core.mcmd import Displacement, displace
from demsmith.core.progress import SILENT, Span

LAGS = (1, 2, 4, 8)
"""Distances [cells] at which the roughness is matched."""

# The kinds tried in each void: exponent, and whether smoothed. Displacements alone have creases
# along the lattice and at most the exponent of a broken line, which suits noisy plains; mountains
# seen by radar are smoother from cell to cell.
_KINDS = tuple((h, smooth) for smooth in (False, True) for h in (0.15, 0.45, 0.75))
# How many of the finest levels are displaced: broader forms are the fill's own.
_LEVELS = 4
# The ground within so many cells of a void's bounding box is its surroundings.
_MARGIN = 12
# A cell beside known ground takes half of its displacement, so that the step across the rim is no
# larger than those inside.
_RIM_SHARE = 0.5
_PART_CELLS = 50_000


@dataclass(frozen=True)
class Roughness:
    """What roughness each void was given: arrays of length V.

    Attributes
    ----------
    h : float64
        The paper's H of the displacements.
    amplitude : float64
        Their largest at the finest level, in the unit of the elevations; 0 where the ground
        around is no rougher than the fill, or the void too small to tell.
    """

    h: np.ndarray
    amplitude: np.ndarray


def roughen(values, voids, selected, *, seed=0, offsets=(0, 0), threads=None, progress=SILENT):
    """Add natural roughness to filled voids, in place.

    Each void's roughness depends on itself and the known ground around it, the seed and the
    lattice's origin alone.

    Parameters
    ----------
    values : (H, W) float array, C order
        Filled elevations.
    voids : Voids
    selected : (N,) int array
        The numbers of the filled voids.
    seed : int
    offsets : (int, int)
        Added to a cell's row and column they count from the lattice's corner.
    threads : int, optional
    progress : Progress

    Returns
    -------
    Roughness

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop.
    """
    work = _Work(voids, offsets, threads)
    wanted = np.full((len(voids), len(LAGS)), np.nan)
    wanted[selected] = work.around(values, Span(progress, 0, 0.2))[selected]
    there = work.within(values, Span(progress, 0.2, 0.3))
    fits = []
    for kind, part in zip(_KINDS, _parts(progress, 0.3, 0.7), strict=True):
        noise = work.displaced(selected, kind, seed, Span(part, 0, 0.7))
        fits.append(_fit(wanted, there, work.within(noise, Span(part, 0.7, 1))))
    best = np.argmin([misfit for _, misfit in fits], axis=0)
    amplitude = np.array([amplitude for amplitude, _ in fits])[best, np.arange(best.size)]
    # Noise is made anew rather than kept: memory for one field, not for each kind.
    for n, part in enumerate(_parts(progress, 0.7, 1)):
        chosen = np.flatnonzero((best == n) & (amplitude > 0))
        if chosen.size:
            noise = work.displaced(chosen, _KINDS[n], seed, part)
            work.add(values, noise, np.where(best == n, amplitude, 0.0))
    return Roughness(np.array([h for h, _ in _KINDS])[best], amplitude)


def _parts(progress, start, stop):
    """Cut a part of the progress into one for each kind."""
    edges = np.linspace(start, stop, len(_KINDS) + 1)
    return [Span(progress, a, b) for a, b in pairwise(edges)]


def _fit(wanted, there, noise):
    """Find the noise's amplitude for which the structure functions agree best.

    All are (V, lags) mean squares; noise and fill are independent, so theirs add up. The misfit is
    relative to what is wanted; lags that a void is too small for do not count.

    Returns
    -------
    amplitude, misfit : (V,) arrays
    """
    known = np.isfinite(wanted) & np.isfinite(there) & np.isfinite(noise) & (wanted > 0)
    weight = np.where(known, 1 / np.where(known, wanted, 1) ** 2, 0)
    lacking = np.where(known, wanted - there, 0)
    noise = np.where(known, noise, 0)
    power = (weight * noise**2).sum(axis=1)
    square = np.maximum((weight * lacking * noise).sum(axis=1), 0) / np.where(power > 0, power, 1)
    misfit = (weight * (lacking - square[:, None] * noise) ** 2).sum(axis=1)
    return np.sqrt(square), misfit


class _Work:
    """The voids of a raster, and what is done to them side by side."""

    def __init__(self, voids, offsets, threads):
        self.voids, self.offsets, self.threads = voids, offsets, threads
        self.noise = np.zeros(voids.labels.shape)

    def around(self, values, progress):
        """Give the structure function of the ground around each void, (V, lags)."""
        from demsmith.core.voids._roughness import squares_around

        out = np.empty((len(self.voids), len(LAGS)))
        self._run(squares_around, values, np.array(LAGS), out, _MARGIN, progress=progress)
        return out

    def within(self, values, progress):
        """Give that of each void's own cells."""
        from demsmith.core.voids._roughness import squares_within

        out = np.empty((len(self.voids), len(LAGS)))
        self._run(squares_within, values, np.array(LAGS), out, progress=progress)
        return out

    def displaced(self, selected, kind, seed, progress):
        """Give displacements of amplitude 1 at the finest level, quieter at the rim."""
        from demsmith.core.voids._roughness import smooth, soften_rims

        h, smoothed = kind
        displacement = Displacement(2.0 ** (2 * h * _LEVELS), h, 0.0, seed, _LEVELS)
        self.noise[self.voids.labels > 0] = 0.0
        displace(
            self.noise, self.voids, selected, displacement, self.offsets, self.threads,
            Span(progress, 0, 0.9),
        )  # fmt: skip
        if smoothed:
            self._run(smooth, self.noise)
        self._run(soften_rims, self.noise, _RIM_SHARE, progress=Span(progress, 0.9, 1))
        return self.noise

    def add(self, values, noise, amplitude):
        """Add noise, of each void by its amplitude."""
        from demsmith.core.voids._roughness import add_scaled

        self._run(add_scaled, values, noise, amplitude)

    def _run(self, kernel, values, *more, progress=SILENT):
        voids = self.voids
        parts = int(voids.cells.sum()) // _PART_CELLS + 1
        parallel.run(
            [
                partial(
                    kernel, begin, end, values, voids.labels, voids.runs, voids.first_run, *more
                )
                for begin, end in parallel.even_spans(voids.cells, parts)
            ],
            threads=self.threads,
            progress=progress,
        )
