"""Delta surface fill: voids take the shape of an auxiliary raster, and meet their rims.

Grohman, Kroenung and Strebeck 2006, "Filling SRTM voids: the delta surface fill method": the
difference between the target and the auxiliary is filled over the void from the void's rim, and
added to the auxiliary. Here the auxiliary is first made to resemble the target (`align`), and the
difference is filled by the engine that fills voids without an auxiliary.
"""

from dataclasses import dataclass

import numpy as np

from demsmith.core.mcmd.lattice import Lattice
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.voids.labelling import find_voids

NOT_ASKED, USED, REFUSED, UNKNOWN, UNLIKE, WORSE = range(6)
"""What became of an auxiliary in a void."""

VERDICTS = (
    "It was not asked.",
    "It was used.",
    "It was refused as a whole.",
    "It knows nothing of the void, or of the ground around.",
    "It disagrees with the ground around the void.",
    "Interpolation is expected to be better.",
)
"""The same as sentences."""

_RIM = 3
"""Cells around a void where the delta is looked at."""

_SPREADS, _SHARE = 2.0, 0.9
"""An auxiliary disagrees with a rim where the delta is farther from a plane than so many spreads
of the training ground's, and than this share of what the ground itself is. On real pairs it was
no better than interpolation there, and better everywhere else."""

_IN_DOUBT = 1.15
"""Expected errors are known to some 15 % in small voids; within that the auxiliary is preferred,
for it has seen the ground."""


@dataclass(frozen=True)
class AuxiliaryFill:
    """What was filled from auxiliaries: arrays by void of the window.

    Attributes
    ----------
    surface : (V,) int64 array
        Number of the auxiliary that was used, from 1; 0: none. The first of them, where a second
        one filled what the first does not know.
    verdict : (S, V) uint8 array
        What became of each auxiliary in each void: index into `VERDICTS`.
    error : (V,) float64 array
        Expected root mean square error [m]; NaN where none was used.
    source : (H, W) uint8 array
        Number of the auxiliary by cell; 0: not filled here.
    """

    surface: np.ndarray
    verdict: np.ndarray
    error: np.ndarray
    source: np.ndarray


def fill_from_auxiliaries(
    work, void, voids, selected, surfaces, *, engine, model=None, place=(0, 0),
    interpolation_error=None, sigma=None, pixel_size=None, lattice=None, threads=None,
    progress=SILENT,
):  # fmt: skip
    """Fill voids from auxiliaries, in place, where they promise to do better than interpolation.

    Parameters
    ----------
    work : (H, W) float array
        Elevations of a window. Cells of the selected voids are overwritten where an auxiliary
        is used; where none is, they stay as they are, such as interpolated before.
    void : (H, W) bool array
    voids : demsmith.core.voids.Voids
        Of ``void``.
    selected : (N,) int64 array
        Numbers of the voids to fill.
    surfaces : sequence of Surface
        In order of trust: the first that is not refused for a void fills it, as far as it knows
        its cells; the next ones what is left.
    engine : module
        With ``margin`` and ``estimate``: `demsmith.core.voids.accurate`.
    model : object, optional
        What the engine learned from the target itself. Cells of voids that no auxiliary knows,
        though it filled the rest of the void, are interpolated anew to meet that.
    place : (int, int)
        Absolute row and column of the window's first cell.
    interpolation_error : (V,) float64 array, optional
        What is expected of interpolation [m], by void; an auxiliary that promises clearly more
        error is refused there.
    sigma : (H, W) float32 array, optional
        Receives the 1-sigma uncertainty [m] of the cells filled.
    pixel_size, lattice
        As in `demsmith.fill_voids`.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    AuxiliaryFill

    Raises
    ------
    InputError
        If an auxiliary cannot be read.
    Cancelled
        If ``progress`` asks to stop; ``work`` is then half filled.
    """
    filler = _Filler(
        work, void, voids, np.asarray(selected, np.int64), engine, place=place,
        limit=np.inf if interpolation_error is None else interpolation_error, sigma=sigma,
        pixel_size=pixel_size, lattice=lattice, threads=threads, surfaces=len(surfaces),
    )  # fmt: skip
    steps = len(surfaces) + 1
    for number, surface in enumerate(surfaces):
        filler.use(number, surface, Span(progress, number / steps, (number + 1) / steps))
    if model is not None:
        filler.interpolate_rest(model, Span(progress, len(surfaces) / steps, 1))
    return filler.fill


class _Filler:
    """A window of the target while auxiliaries are used one after the other."""

    def __init__(
        self, work, void, voids, selected, engine, *, place, limit, sigma, pixel_size, lattice,
        threads, surfaces,
    ):  # fmt: skip
        self.work, self.void, self.voids, self.selected = work, void, voids, selected
        self.engine, self.threads = engine, threads
        self.place, self.limit = place, np.broadcast_to(limit, len(voids))
        self.sigma = np.zeros(void.shape, np.float32) if sigma is None else sigma
        self.pixel_size = metres(void.shape, pixel_size)
        self.lattice = lattice or Lattice.covering(void.shape)
        self.fill = AuxiliaryFill(
            surface=np.zeros(len(voids), np.int64),
            verdict=np.full((surfaces, len(voids)), NOT_ASKED, np.uint8),
            error=np.full(len(voids), np.nan),
            source=np.zeros(void.shape, np.uint8),
        )

    def use(self, number, surface, progress):
        """Fill from an auxiliary what it is trusted with."""
        verdict = self.fill.verdict[number]
        if not surface.alignment.accepted:
            verdict[self.selected] = REFUSED
            return
        left = self._with_cells_left()
        if not left.size:
            return
        aligned, absent = surface.alignment.apply(
            surface.resampler, *self.place, self.void.shape, progress=Span(progress, 0, 0.3)
        )
        delta = self.work - aligned
        self._judge(left, delta, absent, surface.alignment.spread_after, verdict)
        asked = left[verdict[left] == NOT_ASKED]
        sigma = np.zeros(self.void.shape, np.float32)
        expected = self._estimate(
            asked, delta, sigma, absent, surface.model, Span(progress, 0.3, 0.9)
        )
        better = expected < _IN_DOUBT * self.limit[asked]
        verdict[asked] = np.where(better, USED, WORSE)
        self._take(number, asked[better], expected[better], aligned + delta, sigma, absent)
        checkpoint(progress, 1.0)

    def interpolate_rest(self, model, progress):
        """Interpolate what is left of voids that were filled in part, from that part too."""
        rest = self._with_cells_left()
        rest = rest[self.fill.surface[rest] > 0]
        absent = np.zeros(self.void.shape, bool)
        for done, (number, span) in enumerate(zip(rest, self._spans(rest), strict=True)):
            checkpoint(progress, done / rest.size)
            self._estimate_alone(number, span, self.work, self.sigma, absent, model)

    def _with_cells_left(self):
        """Give the voids that still have a cell to fill."""
        if not self.fill.source.any():
            return self.selected
        left = self._count(self.fill.source == 0)
        return self.selected[left[self.selected] > 0]

    def _count(self, cells):
        """Count the cells of each void among some cells."""
        return np.bincount(self.voids.labels[cells], minlength=len(self.voids) + 1)[1:]

    def _judge(self, left, delta, absent, promised, verdict):
        """Refuse the auxiliary for voids it does not know, or whose rims it disagrees with."""
        from demsmith.core.auxiliary._rims import survey

        present = self._count(~absent & (self.fill.source == 0))
        spread = np.full((2, len(self.voids)), np.nan)
        cells = np.zeros(len(self.voids), np.int64)
        survey(
            np.stack([delta, self.work]), self.void | absent, self.voids.runs,
            self.voids.first_run, left, _RIM, spread, cells,
        )  # fmt: skip
        unlike = (spread[0] > _SPREADS * promised) & (spread[0] > _SHARE * spread[1])
        verdict[left[unlike[left]]] = UNLIKE
        verdict[left[((present == 0) | (cells == 0))[left]]] = UNKNOWN

    def _estimate(self, asked, delta, sigma, absent, model, progress):
        """Fill the delta of some voids in place, and tell the errors to expect.

        Mostly the delta's voids are the target's, and filled all together. Where the auxiliary
        has voids of its own near, or another one has filled a part, they are not, and are found
        around each void for itself, for what they are must not depend on the window.
        """
        spans = self._spans(asked)
        alone = np.array(
            [
                self.fill.surface[number] > 0 or absent[span].any()
                for number, span in zip(asked, spans, strict=True)
            ],
            bool,
        )
        expected = np.full(asked.size, np.nan)
        if not alone.all():
            expected[~alone] = self.engine.estimate(
                delta, self.void | absent, self.voids, asked[~alone], model, sigma=sigma,
                pixel_size=self.pixel_size, lattice=self.lattice, threads=self.threads,
                progress=Span(progress, 0, 0.5),
            ).error  # fmt: skip
        each = np.flatnonzero(alone)
        for done, n in enumerate(each):
            checkpoint(progress, 0.5 + 0.5 * done / each.size)
            expected[n] = self._estimate_alone(asked[n], spans[n], delta, sigma, absent, model)
        return expected

    def _estimate_alone(self, number, span, values, sigma, absent, model):
        """Fill what is left of one void within its own surroundings; gives the expected error."""
        rows, columns = span
        own = self.voids.labels[span] == number + 1
        left = own & (self.fill.source[span] == 0)
        unknown = (self.void[span] & ~(own & ~left)) | absent[span]
        if unknown.all():
            return np.inf
        voids = find_voids(unknown, threads=1)
        selected = np.unique(voids.labels[left]).astype(np.int64) - 1
        work = np.where(unknown, 0, values[span])
        uncertain = np.zeros(unknown.shape, np.float32)
        corner = self.lattice.row - rows.start, self.lattice.column - columns.start
        self.engine.estimate(
            work, unknown, voids, selected, model, sigma=uncertain,
            pixel_size=tuple(size[rows] for size in self.pixel_size),
            lattice=Lattice(*corner, self.lattice.levels), threads=self.threads,
        )  # fmt: skip
        values[span][left] = work[left]
        sigma[span][left] = uncertain[left]
        # Not the engine's for all of it: beyond the auxiliary's edge that is a far larger void.
        return float(np.sqrt(np.mean(np.square(uncertain[left], dtype=np.float64))))

    def _take(self, number, used, expected, filled, sigma, absent):
        """Keep what an auxiliary gave for some voids."""
        is_used = np.zeros(len(self.voids) + 1, bool)
        is_used[used + 1] = True
        cells = is_used[self.voids.labels] & ~absent & (self.fill.source == 0)
        self.work[cells] = filled[cells]
        self.sigma[cells] = sigma[cells]
        self.fill.source[cells] = number + 1
        first = self.fill.surface[used] == 0
        self.fill.surface[used[first]] = number + 1
        self.fill.error[used[first]] = expected[first]

    def _spans(self, numbers):
        """Give the window around each void on which its fill depends: (rows, columns) slices."""
        return [
            tuple(
                _widened(low, high, self.engine.margin(*sides), size)
                for low, high, size in zip(*box, self.void.shape, strict=True)
            )
            for box, sides in self._boxes(numbers)
        ]

    def _boxes(self, numbers):
        """Yield first and last cell, one past it, of voids by row and column, and their sides."""
        voids = self.voids
        for number in numbers:
            runs = voids.runs[voids.first_run[number] : voids.first_run[number + 1]]
            low = int(runs[0, 0]), int(runs[:, 1].min())
            high = int(runs[-1, 0]) + 1, int(runs[:, 2].max())
            yield (low, high), (high[0] - low[0], high[1] - low[1])


def _widened(low, high, margin, size):
    return slice(max(low - margin, 0), min(high + margin, size))
