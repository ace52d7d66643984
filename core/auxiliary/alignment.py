"""An auxiliary raster laid on the target: moved, levelled, as sharp as the target, and judged."""

from dataclasses import asdict, dataclass, field, replace

import numpy as np

from demsmith.core import parallel
from demsmith.core.auxiliary.coregistration import coarse_shift, fine_shift, robust_spread
from demsmith.core.auxiliary.correction import MARGIN, Correction, Samples, fit, gather
from demsmith.core.auxiliary.resemblance import compare
from demsmith.core.progress import SILENT, Span

_SAMPLES = 60_000

_SAME_SCALE = 0.05
"""A vertical scale that differs by less does not spoil the shift."""

_ROUNDS = 4

_HEIGHTS = ("bias", "tilt_east", "tilt_north", "spread_before", "spread_after")


@dataclass(frozen=True)
class Alignment:
    """How an auxiliary raster lies on the target, and whether it is of use.

    Attributes
    ----------
    accepted : bool
    reason : str
        Why, or why not, as a sentence.
    shift_east, shift_north : float
        How far the auxiliary lies beside the target [m].
    bias : float
        How far it lies above the target, in the middle of the training ground [m].
    tilt_east, tilt_north : float
        How that grows [m per km].
    vertical_scale : float
        By what its relief is multiplied.
    blur_east, blur_north : float
        Scale of the Gaussian that would smooth it as much as the fitted stencil does [m];
        negative where the stencil sharpens.
    spread_before, spread_after : float
        Robust standard deviation of target less auxiliary, as it came and aligned [m].
    correlation : float
        Of the ground's relief as both show it.
    roughness : float
        Roughness of what is left between the two, as a share of the target's own.
    cells : int
        Training cells that both know.
    offset : (float, float)
        Rows and columns to add to a cell's place to find it in the auxiliary.
    correction : Correction
        What is done to the auxiliary there.
    """

    accepted: bool
    reason: str
    shift_east: float = 0.0
    shift_north: float = 0.0
    bias: float = 0.0
    tilt_east: float = 0.0
    tilt_north: float = 0.0
    vertical_scale: float = 1.0
    blur_east: float = 0.0
    blur_north: float = 0.0
    spread_before: float = 0.0
    spread_after: float = 0.0
    correlation: float = 0.0
    roughness: float = 1.0
    cells: int = 0
    offset: tuple = (0.0, 0.0)
    correction: Correction = field(default_factory=Correction)

    def apply(self, resampler, row, column, shape, *, progress=SILENT):
        """Give the aligned auxiliary on a window of the target.

        A cell's value depends on its absolute place only, not on the window.

        Parameters
        ----------
        resampler : Resampler
            Of the auxiliary, on the target's grid.
        row, column : int
            Absolute place of the window's first cell.
        shape : (int, int)
        progress : Progress

        Returns
        -------
        values : (h, w) float64 array
            Elevations in the target's unit; 0 where unknown.
        void : (h, w) bool array

        Raises
        ------
        InputError
            If the auxiliary cannot be read.
        Cancelled
            If ``progress`` asks to stop.
        """
        values, void = _with_margin(resampler, row, column, shape, self.offset, progress)
        inner = void[MARGIN:-MARGIN, MARGIN:-MARGIN]
        aligned = self.correction.apply(values, void, row, column)
        aligned[inner] = 0.0
        return aligned, inner.copy()

    def as_dict(self, *, unit=1.0):
        """Give what can be told of it as a dict that JSON can hold.

        Parameters
        ----------
        unit : float
            Metres in the unit of the target's elevations, in which the heights are.
        """
        told = asdict(self)
        del told["offset"], told["correction"]
        return told | {name: unit * told[name] for name in _HEIGHTS}


def align(windows, resampler, *, threads=None, progress=SILENT):
    """Lay an auxiliary raster on the target, as training windows show it.

    First the horizontal shift (phase correlation in whole cells, then the least spread of the
    delta, by nlopt), then bias, tilt, vertical scale and difference in sharpness together, by a
    robust regression whose terms are chosen by cross-validation; both again where the scale is
    another than it was; then a judgement of what is left.

    Parameters
    ----------
    windows : sequence of Window
        Of the target: ``row``, ``column``, ``values``, ``void``, ``dx``, ``dy``, see
        `demsmith.core.voids.accurate`.
    resampler : Resampler
        Of the auxiliary, on the target's grid.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    Alignment

    Raises
    ------
    InputError
        If the auxiliary cannot be read.
    Cancelled
        If ``progress`` asks to stop.
    """
    if not windows:
        return Alignment(False, "There is no ground to compare the auxiliary with.")
    raw = _laid(windows, resampler, (0.0, 0.0), threads, Span(progress, 0, 0.2))
    before, cells = _spread(windows, raw)
    if not cells:
        return Alignment(False, "The auxiliary knows none of the ground it was compared on.")
    offset, laid = _coarse(windows, resampler, raw, threads, Span(progress, 0.2, 0.4))
    offset, laid, correction = _fine(
        windows, resampler, offset, laid, threads, Span(progress, 0.4, 0.85)
    )
    aligned = _corrected(windows, laid, correction)
    after, cells = _spread(windows, aligned)
    likeness = compare(_pairs(windows, aligned), progress=Span(progress, 0.85, 1))
    result = Alignment(
        likeness.useful, likeness.sentence(), spread_before=before, spread_after=after,
        correlation=likeness.correlation, roughness=likeness.roughness, cells=cells,
        offset=offset, correction=correction,
    )  # fmt: skip
    return replace(result, **_on_the_ground(result, windows, resampler.grid))


def _with_margin(resampler, row, column, shape, offset, progress=SILENT):
    wide = shape[0] + 2 * MARGIN, shape[1] + 2 * MARGIN
    return resampler.window(row - MARGIN, column - MARGIN, wide, shift=offset, progress=progress)


def _laid(windows, resampler, offset, threads, progress):
    """Resample the auxiliary for every window: list of values and voids, with their margins."""
    laid = [None] * len(windows)

    def lay(number, window):
        laid[number] = _with_margin(resampler, window.row, window.column, window.void.shape, offset)

    parallel.run(
        [lambda n=n, window=window: lay(n, window) for n, window in enumerate(windows)],
        threads=threads, progress=progress,
    )  # fmt: skip
    return laid


def _coarse(windows, resampler, raw, threads, progress):
    """Give the shift in whole cells, if it makes the two more alike, and the auxiliary there."""
    rows, columns = coarse_shift(_pairs(windows, raw), progress=Span(progress, 0, 0.5))
    if (rows, columns) == (0, 0):
        return (0.0, 0.0), raw
    offset = float(rows), float(columns)
    moved = _laid(windows, resampler, offset, threads, Span(progress, 0.5, 1))
    if compare(_pairs(windows, moved)).roughness < compare(_pairs(windows, raw)).roughness:
        return offset, moved
    return (0.0, 0.0), raw


def _fine(windows, resampler, offset, laid, threads, progress):
    """Give the shift, the auxiliary there, and its correction.

    The shift and the vertical scale are each found right only where the other is: relief of a
    third of the height fits best beside its place. So both are found anew until the scale stays.
    """
    correction = Correction()
    for number in range(_ROUNDS):
        part = Span(progress, number / _ROUNDS, (number + 1) / _ROUNDS)
        pairs = _pairs(windows, laid, 1 + correction.scale)
        more = fine_shift(pairs, progress=Span(part, 0, 0.7))
        offset = offset[0] + more[0], offset[1] + more[1]
        laid = _laid(windows, resampler, offset, threads, Span(part, 0.7, 1))
        before, correction = correction, _fitted(windows, laid)
        if abs(correction.scale - before.scale) <= _SAME_SCALE * (1 + before.scale):
            break
    return offset, laid, correction


def _pairs(windows, laid, scale=1.0):
    """Give elevations and known cells of target and scaled auxiliary, window by window."""
    inner = slice(MARGIN, -MARGIN)
    return [
        (window.values, ~window.void, scale * values[inner, inner], ~void[inner, inner])
        for window, (values, void) in zip(windows, laid, strict=True)
    ]


def _spread(windows, laid):
    deltas = [
        (ground - other)[known & other_known]
        for ground, known, other, other_known in _pairs(windows, laid)
    ]
    delta = np.concatenate(deltas)
    return robust_spread(delta), int(delta.size)


def _fitted(windows, laid):
    each = _SAMPLES // len(windows)
    parts = [gather(window, *pair, each) for window, pair in zip(windows, laid, strict=True)]
    return fit(Samples.joined(parts))


def _corrected(windows, laid, correction):
    """Correct the auxiliary of every window; the margin is kept, and not corrected."""
    out = []
    for window, (values, void) in zip(windows, laid, strict=True):
        corrected = values.copy()
        corrected[MARGIN:-MARGIN, MARGIN:-MARGIN] = correction.apply(
            values, void, window.row, window.column
        )
        out.append((corrected, void))
    return out


def _on_the_ground(alignment, windows, grid):
    """Tell the numbers of an alignment in metres on the ground."""
    east = float(np.mean([window.dx.mean() for window in windows]))
    south = float(np.mean([window.dy.mean() for window in windows]))
    north = south if grid.south_up else -south
    correction, (rows, columns) = alignment.correction, alignment.offset
    blur = [float(np.sign(each) * np.sqrt(abs(each))) for each in correction.variance]
    return dict(
        shift_east=(columns + correction.shift[1]) * east,
        shift_north=(rows + correction.shift[0]) * north,
        bias=-correction.bias,
        tilt_east=-1000 * correction.per_column / east,
        tilt_north=-1000 * correction.per_row / north,
        vertical_scale=1 + correction.scale,
        blur_east=blur[1] * east,
        blur_north=blur[0] * south,
    )
