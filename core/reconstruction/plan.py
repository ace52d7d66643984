"""What is settled once for the whole ground, before any void of it is filled."""

from dataclasses import dataclass, replace
from typing import Any

from demsmith.core.auxiliary import check_auxiliary, learn_surface, open_auxiliary
from demsmith.core.errors import InputError
from demsmith.core.faults import WATER_REACH, FaultModel, learn_faults
from demsmith.core.mcmd import Lattice
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.raster import tile_paths
from demsmith.core.reconstruction.doubts import outliers_of
from demsmith.core.reconstruction.engines import engine_of
from demsmith.core.reconstruction.grounds import steady_grid
from demsmith.core.reconstruction.options import ReconstructOptions
from demsmith.core.reconstruction.training import training_windows
from demsmith.core.voids.sources import auxiliary_code


@dataclass(frozen=True)
class Plan:
    """All that the filling of a void depends on besides the ground around it.

    Goes between processes.

    Attributes
    ----------
    options : ReconstructOptions
    pixel_size : (array, array)
        Ground metres per cell of each row, east-west and north-south.
    levels : int
        Of MCMD's lattice over the whole ground.
    unit : float
        Metres in the unit of the elevations.
    faults : FaultModel
        What is usual of the ground, so that faults stand out.
    model : object
        What the engine learned from the ground.
    surfaces : tuple of demsmith.core.auxiliary.Surface
        Auxiliary rasters in the order of trust.
    """

    options: ReconstructOptions
    pixel_size: tuple
    levels: int
    unit: float
    faults: FaultModel
    model: Any = None
    surfaces: tuple = ()

    @property
    def engine(self):
        """The module that fills voids."""
        return engine_of(self.options.method)

    def alignments(self):
        """Tell how each auxiliary was aligned, as dicts that JSON can hold."""
        return [
            {
                "path": surface.resampler.source.tiles[0].path,
                **surface.alignment.as_dict(unit=self.unit),
            }
            for surface in self.surfaces
        ]

    def margin(self, height, width):
        """Give the cells around a void's box of this size that its filling may depend on."""
        margin = self.engine.margin(height, width)
        return max(margin, WATER_REACH + 1) if self.options.flat_water else margin


def check_auxiliaries(auxiliaries, options, grid, *, inputs=(), progress=SILENT):
    """Refuse auxiliaries that cannot be used, before any work is done for them.

    Parameters
    ----------
    auxiliaries : sequence of path
    options : ReconstructOptions
    grid : Grid
        The target's.
    inputs : iterable of path
        Its files.
    progress : Progress

    Returns
    -------
    list of str
        The files of all auxiliaries.

    Raises
    ------
    InputError
        If the method is MCMD, there are more than a source map can tell apart, or one is refused
        by `demsmith.core.auxiliary.check_auxiliary`.
    Cancelled
        If ``progress`` asks to stop.
    """
    if not auxiliaries:
        return []
    if options.method == "mcmd":
        raise InputError("an auxiliary needs the method auto, which can tell what is better")
    auxiliary_code(len(auxiliaries))
    files = [check_auxiliary(path, grid, inputs=inputs, progress=progress) for path in auxiliaries]
    return [name for names in files for name in names]


def make_plan(ground, counts, options, *, auxiliaries=(), threads=None, progress=SILENT):
    """Learn from the ground what its reconstruction needs.

    Parameters
    ----------
    ground : Ground
    counts : (H, W) int array
        Void cells by block: `demsmith.core.reconstruction.training.gathered_counts`.
    options : ReconstructOptions
    auxiliaries : sequence of path
        Auxiliary rasters in the order of trust.
    threads : int, optional
    progress : Progress

    Returns
    -------
    Plan

    Raises
    ------
    InputError
        If nothing is known, or the ground or an auxiliary cannot be read.
    Cancelled
        If ``progress`` asks to stop.
    """
    grid = steady_grid(ground.grid)
    pixel_size = grid.pixel_size_m()
    windows = training_windows(ground, counts, pixel_size, progress=Span(progress, 0, 0.1))
    if not windows:
        raise InputError("every cell is a void; there is nothing to fill from")
    faults = learn_faults(windows, progress=Span(progress, 0.1, 0.15))
    levels = Lattice.covering(ground.shape).levels
    plan = Plan(options, tuple(pixel_size), levels, ground.unit or 1.0, faults)
    doubting = Span(progress, 0.15, 0.2)
    for number, window in enumerate(windows):
        checkpoint(doubting, number / len(windows))
        doubted = outliers_of(window, plan, threads=threads)
        windows[number] = replace(window, void=window.void | doubted)
    model = plan.engine.learn(windows, threads=threads, progress=Span(progress, 0.2, 0.6))
    surfaces = _surfaces(auxiliaries, windows, grid, plan, threads, Span(progress, 0.6, 1))
    checkpoint(progress, 1.0)
    return replace(plan, model=model, surfaces=surfaces)


def _surfaces(auxiliaries, windows, grid, plan, threads, progress):
    """Align the auxiliary rasters."""
    surfaces = []
    for number, path in enumerate(auxiliaries):
        part = Span(progress, number / len(auxiliaries), (number + 1) / len(auxiliaries))
        resampler = open_auxiliary(
            tile_paths(path), grid, unit=plan.unit, progress=Span(part, 0, 0.1)
        )
        surfaces.append(
            learn_surface(
                windows, resampler, engine=plan.engine, threads=threads,
                progress=Span(part, 0.1, 1),
            )
        )  # fmt: skip
    return tuple(surfaces)
