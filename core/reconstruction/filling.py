"""Filling one part of the voids from the ground in its window."""

import numpy as np

from demsmith.core.auxiliary import fill_from_auxiliaries
from demsmith.core.faults import Water, find_water, hold_water
from demsmith.core.mcmd import Lattice
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.reconstruction.extents import cells_of
from demsmith.core.reconstruction.patches import Patch
from demsmith.core.reconstruction.windows import read_window
from demsmith.core.voids.labelling import survey_rims
from demsmith.core.voids.sources import WATER, auxiliary_code

_WATER_SIGMA = 0.5
"""Uncertainty [m] of water that is held flat: its level is a whole metre."""


def fill_part(ground, plan, part, *, threads=None, progress=SILENT):
    """Fill the voids of a part.

    Parameters
    ----------
    ground : Ground
    plan : Plan
    part : Part
    threads : int, optional
    progress : Progress

    Returns
    -------
    Patch

    Raises
    ------
    InputError
        If the ground or an auxiliary cannot be read.
    Cancelled
        If ``progress`` asks to stop.
    """
    window = read_window(ground, part, progress=Span(progress, 0, 0.1))
    rims = survey_rims(window.values, window.void, window.own, threads=threads)
    edge = rims.touches_edge | window.beside_gap
    wanted = _wanted(plan.options, window.own, rims, edge)
    filling = _Filling(window, plan, part, wanted, threads)
    filling.do(Span(progress, 0.1, 0.98))
    runs, (row, column) = filling.cells()
    checkpoint(progress, 1.0)
    return Patch(
        part.voids, wanted, filling.codes, filling.errors, filling.verdicts, rims.low, rims.mean,
        rims.high, edge, runs + part.corner, filling.work[row, column],
        filling.sigma[row, column], filling.sources[row, column],
    )  # fmt: skip


def _wanted(options, own, rims, edge):
    """Tell which voids are to be filled, and can be."""
    wanted = ~np.isnan(rims.mean)
    if options.interior_only:
        wanted &= ~edge
    if options.max_size is not None:
        wanted &= own.cells <= options.max_size
    return wanted


class _Filling:
    """The voids of a window while they are filled.

    ``codes``, ``errors`` and ``verdicts`` are by void of the part, ``work``, ``sigma`` and
    ``sources`` by cell of the window.
    """

    def __init__(self, window, plan, part, wanted, threads):
        self._window, self._plan, self._threads = window, plan, threads
        self._wanted = wanted
        self._place = part.rows.start, part.columns.start
        self._pixel_size = tuple(size[part.rows] for size in plan.pixel_size)
        self._lattice = Lattice(-self._place[0], -self._place[1], plan.levels)
        count = wanted.size
        self.codes, self.errors = np.zeros(count, np.uint8), np.full(count, np.nan)
        self.verdicts = np.zeros((count, len(plan.surfaces)), np.uint8)
        self.work = np.array(window.values, order="C")
        self.sigma = np.full(self.work.shape, np.nan, np.float32)
        self.sources = np.zeros(self.work.shape, np.uint8)

    def do(self, progress):
        water = self._water(Span(progress, 0, 0.05))
        dry = np.flatnonzero(self._wanted & ~water.whole)
        self._interpolate(dry, Span(progress, 0.05, 0.6))
        if self._plan.surfaces:
            self._take_auxiliaries(dry, Span(progress, 0.6, 0.95))
        self._hold(water, Span(progress, 0.95, 1))

    def cells(self):
        """Give the runs of the cells that were filled, and their rows and columns."""
        runs = self._window.own.runs[np.repeat(self._wanted, np.diff(self._window.own.first_run))]
        return runs, cells_of(runs)

    def _water(self, progress):
        own, options = self._window.own, self._plan.options
        if not options.flat_water:
            nowhere = np.full(len(own), np.nan)
            return Water(nowhere, nowhere, np.zeros(len(own), bool))
        return find_water(
            self._window.values, self._window.void, own, options=options,
            pixel_size=self._pixel_size, unit=self._plan.unit, threads=self._threads,
            progress=progress,
        )  # fmt: skip

    def _interpolate(self, dry, progress):
        engine = self._plan.engine
        choices = engine.estimate(
            self.work, self._window.void, self._window.voids, self._window.numbers[dry],
            self._plan.model, sigma=self.sigma, pixel_size=self._pixel_size,
            lattice=self._lattice, threads=self._threads, progress=progress,
        )  # fmt: skip
        self.codes[dry] = engine.SOURCE_OF_METHOD[choices.method]
        self.errors[dry] = choices.error
        row, column = cells_of(self._window.own.runs)
        self.sources[row, column] = np.repeat(self.codes, self._window.own.cells)

    def _take_auxiliaries(self, dry, progress):
        numbers = self._window.numbers[dry]
        expected = np.full(len(self._window.voids), np.inf)
        expected[numbers] = self.errors[dry]
        fill = fill_from_auxiliaries(
            self.work, self._window.void, self._window.voids, numbers, self._plan.surfaces,
            engine=self._plan.engine, model=self._plan.model, place=self._place,
            interpolation_error=expected, sigma=self.sigma, pixel_size=self._pixel_size,
            lattice=self._lattice, threads=self._threads, progress=progress,
        )  # fmt: skip
        code_of = np.array(
            [0] + [auxiliary_code(k + 1) for k in range(len(fill.verdict))], np.uint8
        )
        taken = fill.source > 0
        self.sources[taken] = code_of[fill.source[taken]]
        used = fill.surface[numbers] > 0
        self.codes[dry[used]] = code_of[fill.surface[numbers[used]]]
        self.errors[dry[used]] = fill.error[numbers[used]]
        self.verdicts[dry] = fill.verdict[:, numbers].T

    def _hold(self, water, progress):
        wet = hold_water(
            self.work, self._window.own, water, threads=self._threads, progress=progress
        )
        self.sources[wet] = WATER
        uncertainty = _WATER_SIGMA / self._plan.unit
        self.sigma[wet] = uncertainty
        self.codes[water.whole] = WATER
        self.errors[water.whole] = uncertainty
