"""Tuning: parameters of MCMD fitted to the raster at hand, and what that gains.

Known ground is hidden three times over, never the same cells. The parameters are fitted on the
first holdout, and taken if they gain more than two standard errors there and on the second; on
the third, which had no say in either, their gain is measured.
"""

from dataclasses import dataclass, replace

import numpy as np

from demsmith.core.mcmd.maps import Maps
from demsmith.core.options import validate
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, Span
from demsmith.core.tuning.holdouts import punched_holdouts, sampled_holdouts
from demsmith.core.tuning.parameters import axes_of
from demsmith.core.tuning.score import Comparison, Gain
from demsmith.core.tuning.search import search
from demsmith.core.voids.filling import fill_voids

EVALUATIONS = 30
"""How many sets of parameters are tried, if not fewer."""

_FEWEST_HOLES = 30
_SURE = 2.0  # standard errors; with one, on real tiles, chance was taken for a gain now and then
# Of larger rasters windows of so many cells in all are looked at,
_FILL_CELLS = 2_000_000
_SAMPLE_CELLS = 250_000
# but so many that they hold this many samples.
_SAMPLES = 1000


@dataclass(frozen=True)
class Tuned:
    """What tuning found.

    Attributes
    ----------
    options : McmdOptions
        The options given, with the tuned parameters if they were accepted.
    accepted : bool
    parameters : dict
        Name to (before, after), equal where nothing was accepted.
    gain, noise : float
        Share by which the error became smaller, in holes that neither fitted nor chose the
        parameters, and its standard error: the mean over size classes of the logarithm of the
        RMSE, so that each class counts alike. 0 if nothing was accepted.
    errors : tuple of ClassError
        `ClassError` of each size class of those holes; empty if nothing was accepted.
    note : str
        Why nothing was accepted; empty otherwise.
    """

    options: object
    accepted: bool
    parameters: dict
    gain: float
    noise: float
    errors: tuple
    note: str

    def as_dict(self):
        """Give everything but the options as a dict that JSON can hold."""
        return {
            "accepted": self.accepted,
            "parameters": {
                name: {"before": before, "after": after}
                for name, (before, after) in self.parameters.items()
            },
            "gain": self.gain,
            "noise": self.noise,
            "errors": [vars(each) for each in self.errors],
            "note": self.note,
            "summary": self.summary(),
        }

    def summary(self):
        """Say in a few words what was gained."""
        if not self.accepted:
            return f"not tuned: {self.note}"
        found = ", ".join(f"{name} {after:.4g}" for name, (_, after) in self.parameters.items())
        return f"tuned {found}: gain {Gain(self.gain, self.noise)}"


def tune_fill(
    values, void, *, options, maps=None, pixel_size=None, d_max=None, evaluations=EVALUATIONS,
    threads=None, progress=SILENT,
):  # fmt: skip
    """Tune the parameters of a fill on artificial voids, punched into known ground.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array
    options : FillOptions
        Their variant is tuned, from their parameters.
    maps : Maps, optional
        Parameters by cell; these are not tuned.
    pixel_size : optional
        Ground metres per cell, see `demsmith.core.mcmd.lattice.metres`.
    d_max : float, optional
        As in `demsmith.core.voids.fill_voids`.
    evaluations : int
        At most so many fills of all windows are tried.
    threads : int, optional
        The result does not depend on it.
    progress : Progress

    Returns
    -------
    Tuned
        Not accepted, with a note, where too little ground is known.

    Raises
    ------
    InputError
        If an option is out of range.
    DependencyError
        If nlopt is missing.
    Cancelled
        If ``progress`` asks to stop.
    """
    values, known = np.asarray(values), ~np.asarray(void, bool)
    raster = _Raster(values, known, options, maps, pixel_size)
    holdouts = punched_holdouts(
        values, known, count=3, most_cells=_FILL_CELLS, threads=threads,
        progress=Span(progress, 0, 0.5),
    )  # fmt: skip

    def rebuild(trial, options, progress):
        options = replace(
            options,
            method="mcmd",
            tune=False,
            natural_roughness=False,
            interior_only=False,
            max_size=None,
            float_output=True,
        )
        return fill_voids(
            values[trial.rows, trial.columns], ~trial.known, options=options,
            maps=raster.maps_of(trial), pixel_size=raster.pixel_size(trial),
            d_max=d_max or raster.diagonal, threads=threads, progress=progress,
        ).values  # fmt: skip

    return _tune(raster, holdouts, rebuild, evaluations, Span(progress, 0.5, 1))


def tune_samples(
    values, known, *, options, maps=None, pixel_size=None, evaluations=EVALUATIONS, threads=None,
    progress=SILENT,
):  # fmt: skip
    """Tune the parameters of a reconstruction from samples on samples held back.

    A fifth of the samples is held back at a time, so the parameters are fitted to ground that is
    a little less densely sampled than it really is.

    Parameters
    ----------
    values : (H, W) float array
        Elevations [m]; only known cells are read.
    known : (H, W) bool array
        Cells that hold samples.
    options : SampleOptions
    maps, pixel_size, evaluations, threads, progress
        As in `tune_fill`.

    Returns
    -------
    Tuned

    Raises
    ------
    InputError, DependencyError, Cancelled
        As `tune_fill` does.
    """
    from demsmith.core.samples.presets import settled
    from demsmith.core.samples.reconstruction import reconstruct

    raster = _Raster(values, known, settled(options), maps, pixel_size)
    most_cells = max(_SAMPLE_CELLS, known.size * _SAMPLES // max(np.count_nonzero(known), 1))
    holdouts = sampled_holdouts(
        known, count=3, most_cells=most_cells, progress=Span(progress, 0, 0.1)
    )

    def rebuild(trial, options, progress):
        return reconstruct(
            values[trial.rows, trial.columns], trial.known, options=options,
            maps=raster.maps_of(trial), pixel_size=raster.pixel_size(trial), threads=threads,
            progress=progress,
        )  # fmt: skip

    return _tune(raster, holdouts, rebuild, evaluations, Span(progress, 0.1, 1))


class _Raster:
    """What windows of a raster must know of the whole."""

    def __init__(self, values, known, options, maps, pixel_size):
        validate(options)
        maps = maps or Maps()
        maps.over(options, values.shape)  # tells what does not fit
        self.values, self.options = values, options
        curves = {"l": maps.l, "l_bu": maps.l_bu}
        self.curves = {name: values for name, values in curves.items() if values is not None}
        self.dx, self.dy = metres(values.shape, pixel_size)
        self.diagonal = float(
            np.hypot((values.shape[1] - 1) * self.dx.max(), self.dy.sum() - self.dy[0])
        )
        lowest = float(values[known].min()) if known.any() else None
        self.datum = lowest if options.datum is None else options.datum

    def pixel_size(self, trial):
        return self.dx[trial.rows], self.dy[trial.rows]

    def maps_of(self, trial):
        """Give the maps of the curves; those of the noise are left out, as the noise is."""
        window = trial.rows, trial.columns
        return Maps(**{name: values[window] for name, values in self.curves.items()})

    def axes(self):
        return axes_of(self.options, float(self.dy.mean()), fixed=self.curves)

    def errors(self, holdout, rebuild, parameters, progress):
        """Give the squared error of each hole, without noise, which could only add to it."""
        options = replace(self.options, datum=self.datum, r_s=0.0, **parameters)
        return holdout.squared_errors(
            self.values, lambda trial, part: rebuild(trial, options, part), progress
        )

    def compare(self, holdout, rebuild, found, progress):
        """Compare the parameters found with those given."""
        return Comparison(
            holdout.holes,
            self.errors(holdout, rebuild, {}, Span(progress, 0, 0.5)),
            self.errors(holdout, rebuild, found, Span(progress, 0.5, 1)),
        )


def _tune(raster, holdouts, rebuild, evaluations, progress):
    if min(each.holes.count for each in holdouts) < _FEWEST_HOLES:
        return _untuned(raster, f"too little known ground to hide {_FEWEST_HOLES} holes in")
    if not raster.axes():
        return _untuned(raster, "all that could be tuned is given by maps")
    fitting, choosing, judging = holdouts
    found = search(
        lambda values, part: fitting.holes.score(raster.errors(fitting, rebuild, values, part)),
        raster.axes(), evaluations=evaluations, progress=Span(progress, 0, 0.7),
    )  # fmt: skip
    for holdout, start, where in (
        (fitting, 0.7, "where it was fitted"),
        (choosing, 0.8, "elsewhere"),
    ):
        gain = raster.compare(holdout, rebuild, found, Span(progress, start, start + 0.1)).gain()
        if gain.share <= _SURE * gain.noise:
            return _untuned(raster, f"the best found gains only {gain} {where}")
    judged = raster.compare(judging, rebuild, found, Span(progress, 0.9, 1))
    return Tuned(
        options=replace(raster.options, **found),
        accepted=True,
        parameters={name: (getattr(raster.options, name), found[name]) for name in found},
        gain=judged.gain().share,
        noise=judged.gain().noise,
        errors=judged.by_class(),
        note="",
    )


def _untuned(raster, note):
    given = {axis.name: getattr(raster.options, axis.name) for axis in raster.axes()}
    return Tuned(
        options=raster.options,
        accepted=False,
        parameters={name: (value, value) for name, value in given.items()},
        gain=0.0,
        noise=0.0,
        errors=(),
        note=note,
    )
