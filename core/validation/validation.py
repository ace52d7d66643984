"""Validation: known ground is hidden in artificial voids, filled by each method, and compared."""

from dataclasses import dataclass
from statistics import median

import numpy as np

from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.options import options_from
from demsmith.core.progress import SILENT, Span
from demsmith.core.validation.methods import LARGEST_BIHARMONIC, Trial, chosen_methods
from demsmith.core.validation.options import ValidateOptions
from demsmith.core.validation.punching import punch_voids
from demsmith.core.validation.scoring import Holes, Tally
from demsmith.core.validation.shapes import void_shapes
from demsmith.core.validation.transplanting import transplant_voids

OWN, OTHER, MIXTURE = "own", "other", "mixture"
"""Where the shapes of the artificial voids come from: the raster, another one, or noise."""


@dataclass(frozen=True)
class MethodScore:
    """How wrong a method is.

    Attributes
    ----------
    method, title : str
        Its name, for options and for people.
    seconds : float
        What one fill took, the median over the masks.
    errors : tuple of SizeError
        One for each of `SIZE_CLASSES`, then one for all voids; masks pooled.
    """

    method: str
    title: str
    seconds: float
    errors: tuple

    @property
    def states_intervals(self):
        """Whether the method says how wrong it may be."""
        return self.errors[-1].within_68 == self.errors[-1].within_68  # no NaN

    def as_dict(self):
        """Give everything as a dict that JSON can hold."""
        return {
            "method": self.method,
            "title": self.title,
            "seconds": self.seconds,
            "errors": [{"size": each.name, **each.as_dict()} for each in self.errors],
        }


@dataclass(frozen=True)
class Validation:
    """What a validation found.

    Attributes
    ----------
    scores : tuple of MethodScore
        In the order of the methods.
    shapes_from : str
        ``"own"``, ``"other"`` or ``"mixture"``: whose shapes the artificial voids had.
    error : (H, W) float32 array
        Filled less true elevation [m] by the first method, of the first mask that hides the cell;
        NaN where none does.
    notes : tuple of str
        Warnings, one sentence each.
    """

    scores: tuple
    shapes_from: str
    error: np.ndarray
    notes: tuple

    @property
    def best(self):
        """The `MethodScore` of the least RMSE over all voids, of those that filled them all."""
        most = max(score.errors[-1].cells for score in self.scores)
        whole = [score for score in self.scores if score.errors[-1].cells == most]
        return min(whole, key=lambda score: score.errors[-1].rmse)


def validate(
    values, void=None, *, shapes=None, methods=None, options=None, pixel_size=None, threads=None,
    progress=SILENT, **parameters,
):  # fmt: skip
    """Tell how wrong fills of this ground are, by void size.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array, optional
        As in `demsmith.fill_voids`.
    shapes : sequence of VoidShape, optional
        Outlines of the artificial voids, from `void_shapes`. Default: those of the raster's own
        voids or, if none lies inside it, a mixture as of the SRTM (`punch_voids`).
    methods : sequence of str, optional
        Names in `demsmith.core.validation.METHODS`. Default: all whose libraries are there.
    options : ValidateOptions, optional
        Its fields can as well be given as keywords of their own.
    pixel_size : optional
        Ground metres per cell, as in `demsmith.fill_voids`.
    threads : int, optional
        The errors do not depend on it.
    progress : Progress

    Returns
    -------
    Validation

    Raises
    ------
    InputError
        If the arrays do not fit, too little ground is known to hide some, there is no such method
        or an option is out of range.
    DependencyError
        If a method that is named wants its library.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> z = np.add.outer(np.arange(80.0), 2 * np.arange(90.0))
    >>> found = validate(z, methods=["mcmd", "gdal"], seeds=1)
    >>> bool(found.scores[0].errors[-1].rmse < found.scores[1].errors[-1].rmse)
    True
    >>> found.shapes_from
    'mixture'
    """
    options = options_from(ValidateOptions, options, parameters, "validate")
    methods, absent = chosen_methods(methods)
    values, void = checked(values, void)
    if void.all():
        raise InputError("every cell is a void; there is no known ground to try fills on")
    values = values.astype(np.promote_types(values.dtype, np.float32), copy=False)
    masks, shapes_from = _masks(values, ~void, shapes, options, pixel_size, Span(progress, 0, 0.1))
    error = np.full(values.shape, np.nan, np.float32)
    tries = [_Tries(method) for method in methods]
    trying = Span(progress, 0.1, 1)
    for n, hidden in enumerate(masks):
        unknown = void | hidden
        visible = np.where(unknown, values.dtype.type(np.nan), values)
        trial = Trial(visible, unknown, hidden, pixel_size, threads)
        holes = Holes(values, hidden, void=unknown, pixel_size=pixel_size, threads=threads)
        for m, each in enumerate(tries):
            step, steps = n * len(tries) + m, len(masks) * len(tries)
            estimate = each.add(trial, holes, Span(trying, step / steps, (step + 1) / steps))
            if m == 0:
                new = hidden & np.isnan(error)
                error[new] = estimate.values[new] - values[new]
    scores = tuple(each.score() for each in tries)
    return Validation(scores, shapes_from, error, _notes(scores, absent, shapes_from))


class _Tries:
    """What a method has done so far."""

    def __init__(self, method):
        self._method, self._tally, self._seconds = method, Tally.zero(), []

    def add(self, trial, holes, progress):
        estimate = self._method.fill(trial, progress)
        self._tally += holes.tally(estimate.values, estimate.sigma)
        self._seconds.append(estimate.seconds)
        return estimate

    def score(self):
        return MethodScore(
            self._method.name, self._method.title, round(median(self._seconds), 3),
            self._tally.errors(),
        )  # fmt: skip


def _masks(values, known, shapes, options, pixel_size, progress):
    """Make the masks of artificial voids; gives those with voids, and whose shapes they have."""
    shapes_from = OTHER
    if shapes is None:
        shapes = void_shapes(~known, values, pixel_size=pixel_size, progress=Span(progress, 0, 0.2))
        shapes_from = OWN if shapes else MIXTURE
    masks, making_all = [], Span(progress, 0.2, 1)
    for n in range(options.seeds):
        part = Span(making_all, n / options.seeds, (n + 1) / options.seeds)
        making = dict(share=options.share, seed=options.seed + n, progress=part)
        if shapes_from == MIXTURE:
            masks.append(punch_voids(values, known=known, **making))
        else:
            masks.append(transplant_voids(values, known, shapes, pixel_size=pixel_size, **making))
    masks = [mask for mask in masks if mask.any() and (known & ~mask).any()]
    if not masks:
        rows, columns = values.shape
        raise InputError(
            f"no artificial void fits into the known ground of {rows} × {columns} cells; give a "
            "larger raster, a larger share or other voids"
        )
    return masks, shapes_from


def _notes(scores, absent, shapes_from):
    notes = []
    if shapes_from == MIXTURE:
        notes.append(
            "no void lies inside the raster: artificial ones have the sizes and outlines of a "
            "mixture as the SRTM has; name a raster to take their shapes from"
        )
    for method in absent:
        notes.append(f"method {method.name} is left out: {method.library} is not installed")
    most = max(score.errors[-1].cells for score in scores)
    for score in scores:
        missing = most - score.errors[-1].cells
        if missing:
            notes.append(
                f"{score.title} left out {missing} hidden cells: voids of more than "
                f"{LARGEST_BIHARMONIC} cells take it too long"
            )
    return tuple(notes)
