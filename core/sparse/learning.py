"""Learning a dictionary from the discs of exemplars (§4.4 of the paper)."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.options import options_from
from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.sparse.atoms import CutAtoms, SampledAtoms, averaged
from demsmith.core.sparse.dictionary import Dictionary
from demsmith.core.sparse.ksvd import TooFewSamplesError, constrained, ksvd
from demsmith.core.sparse.metric import Metric
from demsmith.core.sparse.options import LearnOptions
from demsmith.core.sparse.patches import LARGEST_SIDE, disc_weights, gather_at
from demsmith.core.sparse.polishing import polish

_WAVES = 0.6
"""Share of the first atoms that are cosine waves, where several atoms may be summed."""

_WINDOW, _POLISHED = 50, 20_000
"""Discs along the side of a window to polish on, and in all windows together at most."""

_DEFAULT_RADIUS = 5
"""Radius of a disc in cells."""


@dataclass(frozen=True, eq=False)
class Learned:
    """A dictionary that was learned.

    Attributes
    ----------
    dictionary : Dictionary
    errors : tuple of float
        Root mean square error [m] of the discs after each pursuit, in the metric of the option
        ``weighting``; none for a complete dictionary.
    blend_errors : tuple of float
        Root mean square error [m] of the blended surface before and after each round of polishing.
    discs : int
        How many were learned from.
    discs_skipped : int
        How many were not looked at because a void lies in them.
    """

    dictionary: Dictionary
    errors: tuple
    blend_errors: tuple
    discs: int
    discs_skipped: int


def learn(
    exemplars, voids=None, *, options=None, pixel_size=None, names=None, threads=None,
    progress=SILENT, **parameters,
):  # fmt: skip
    """Learn a dictionary from elevation arrays.

    Parameters
    ----------
    exemplars : (H, W) array, or list of such arrays
        Elevations [m].
    voids : (H, W) bool array, or list, optional
        As of `fill_voids`. Discs with a void are skipped.
    options : LearnOptions, optional
        Its fields can as well be given as keywords of their own.
    pixel_size : optional
        Ground metres per cell of each exemplar as `fill_voids` takes them, or a list of one for
        each. Default: 1. A disc has the same number of cells all over all exemplars: what its
        radius measures on the ground in the middle row of the first.
    names : list of str, optional
        Of the exemplars, as their atoms are to tell; default: their numbers.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    Learned

    Raises
    ------
    InputError
        If arrays do not fit, there are too few discs without a void or with any relief, or an
        option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Notes
    -----
    Discs lie half a disc apart. A disc's mean is taken off; what remains is represented by
    `pursue`, by ``sparsity`` atoms at most. K-SVD starts from cosine waves and discs that differ
    much (or only these, for a sparsity of 1); the paper starts from random discs, and ends with an
    error up to a quarter larger. Its atoms are then fitted to the blend of discs (`polish`).

    Examples
    --------
    >>> y, x = np.mgrid[:60, :80] / 8
    >>> ground = 100 * np.sin(x) * np.cos(1.3 * y) + 20 * np.sin(3 * x + y)
    >>> learned = learn(ground, atoms=12, sparsity=2)
    >>> learned.dictionary.samples.shape, learned.discs, learned.errors[-1] < 2
    ((12, 100), 165, True)
    """
    options = options_from(LearnOptions, options, parameters, "learn")
    grounds = _grounds(exemplars, voids, pixel_size, names, options)
    places, skipped = _whole_discs(grounds, options.factor, Span(progress, 0, 0.1))
    if options.method != "complete" and len(places) > options.most_discs:
        chosen = np.random.default_rng(options.seed).choice(
            len(places), options.most_discs, replace=False
        )
        places = places[np.sort(chosen)]
    if not len(places):
        raise TooFewSamplesError(
            f"no disc of {grounds.side_rows} by {grounds.side_columns} cells lies in the terrain "
            "without a void; fill it first, or make the radius smaller"
        )
    learn_atoms = {"ksvd": _free, "constrained": _constrained, "complete": _complete}
    part, *errors = learn_atoms[options.method](
        grounds, places, options, threads, Span(progress, 0.1, 1)
    )
    dictionary = Dictionary(
        grounds.side_rows, grounds.side_columns, (part,), options.factor, grounds.cell_size
    )
    return Learned(dictionary, *errors, len(places), skipped)


@dataclass(frozen=True, eq=False)
class _Grounds:
    """The exemplars, at their own resolution and at the one that is decomposed."""

    fine: list
    coarse: list  # of (values, void)
    names: tuple
    side_rows: int
    side_columns: int
    cell_size: tuple

    def discs(self, places):
        """Give the samples of whole discs, by exemplar, row and column of coarse cells."""
        return self._gathered(places, [values for values, _ in self.coarse], 1)

    def fine_discs(self, places, factor):
        """Give the same discs at the finer resolution."""
        return self._gathered(places * [1, factor, factor], self.fine, factor)

    def _gathered(self, places, grounds, factor):
        block = factor * self.side_rows, factor * self.side_columns
        disc = disc_weights(*block) > 0
        samples = np.empty((len(places), disc.size), np.float32)
        for number, values in enumerate(grounds):
            mine = places[:, 0] == number
            samples[mine] = gather_at(
                values, np.zeros(values.shape, bool), *places[mine, 1:].T, disc
            ).samples
        return samples


def _grounds(exemplars, voids, pixel_size, names, options):
    if isinstance(exemplars, np.ndarray) or (len(exemplars) and np.isscalar(exemplars[0][0])):
        exemplars, voids = [exemplars], [voids]
        pixel_size = [pixel_size]
    exemplars = list(exemplars)
    count = len(exemplars)
    if not count:
        raise InputError("give at least one exemplar")
    voids = [None] * count if voids is None else list(voids)
    sizes = list(pixel_size) if isinstance(pixel_size, list) else [pixel_size] * count
    names = [str(number) for number in range(1, count + 1)] if names is None else list(names)
    for what, several in (("voids", voids), ("pixel sizes", sizes), ("names", names)):
        if len(several) != count:
            raise InputError(f"{count} exemplars have {len(several)} {what}")
    fine, coarse = [], []
    for values, void in zip(exemplars, voids, strict=True):
        values, void = checked(values, void)
        if void.any():  # an elevation like any other, for whole discs have none of these
            values = np.where(void, values[~void].min() if not void.all() else 0, values)
        fine.append(values)
        coarse.append(_coarse(np.asarray(values, np.float32), void, options.factor))
    cell_size = _cell_size(exemplars[0], sizes[0], options.factor)
    sides = [_side(options.radius, size) for size in (cell_size[1], cell_size[0])]
    return _Grounds(fine, coarse, tuple(names), *sides, cell_size)


def _coarse(values, void, factor):
    """Average the cells of a raster; what is left over at its right and bottom edge is dropped."""
    if factor == 1:
        return values, void
    rows, columns = (side - side % factor for side in values.shape)
    if not rows or not columns:
        return np.zeros((0, 0), np.float32), np.zeros((0, 0), bool)
    cut = np.s_[:rows, :columns]
    return averaged(values[cut], factor), averaged(void[cut], factor) > 0


def _cell_size(values, pixel_size, factor):
    """Give the metres of a coarse cell in the middle row, east-west and north-south."""
    dx, dy = metres(np.shape(values), pixel_size)
    middle = dx.size // 2
    return float(dx[middle] * factor), float(dy[middle] * factor)


def _side(radius, cell):
    """Give the cells across a disc."""
    if radius is None:
        return 2 * _DEFAULT_RADIUS
    side = max(round(2 * radius / cell), 2)
    if side > LARGEST_SIDE:
        raise InputError(
            f"a radius of {radius:g} m is {side / 2:g} cells of {cell:g} m; at most "
            f"{LARGEST_SIDE // 2} will do"
        )
    return side


def _whole_discs(grounds, factor, progress):
    """Find the discs of each exemplar's lattice in which there is no void.

    Returns
    -------
    places : (n, 3) int64 array
        Exemplar, first row and column in coarse cells.
    skipped : int
    """
    places, skipped = [], 0
    sides = grounds.side_rows, grounds.side_columns
    disc = disc_weights(*sides) > 0
    for number, (values, void) in enumerate(grounds.coarse):
        checkpoint(progress, number / len(grounds.coarse))
        tops, lefts = (
            np.arange(0, cells - side + 1, max(1, side // 2))
            for cells, side in zip(values.shape, sides, strict=True)
        )
        if not tops.size or not lefts.size:
            continue
        tops, lefts = np.repeat(tops, lefts.size), np.tile(lefts, tops.size)
        whole = ~_touches(void, tops, lefts, disc)
        skipped += int(np.count_nonzero(~whole))
        exemplar = np.full(np.count_nonzero(whole), number)
        places.append(np.column_stack([exemplar, tops[whole], lefts[whole]]))
    checkpoint(progress, 1)
    return np.concatenate(places) if places else np.empty((0, 3), np.int64), skipped


def _touches(void, tops, lefts, disc):
    """Tell which discs have a void cell."""
    if not void.any():
        return np.zeros(tops.size, bool)
    from scipy.signal import fftconvolve

    found = fftconvolve(void.astype(np.float32), disc[::-1, ::-1].astype(np.float32), mode="valid")
    return found[tops, lefts] > 0.5


def _free(grounds, places, options, threads, progress):
    """Learn atoms of any shape."""
    metric = Metric(options.weighting, grounds.side_rows, grounds.side_columns)
    discs = grounds.discs(places)
    vectors = metric.vectors(discs)
    start = None
    if options.sparsity > 1:
        waves = cosine_waves(*_block(grounds, 1), int(_WAVES * options.atoms))
        start = metric.vectors(waves)
    learned = ksvd(
        vectors, options.atoms, options.sparsity, iterations=options.iterations,
        tolerance=options.tolerance, seed=options.seed, start=start, threads=threads,
        progress=Span(progress, 0, 0.5),
    )  # fmt: skip
    low, blend_errors = metric.samples(learned.atoms), ()
    # The finer twins are fitted to discs, so the coarser ones must be so, too.
    if options.weighting == "blend" and options.polishing and options.factor == 1:
        low, blend_errors = polish(
            _windows(grounds, options), low, _block(grounds, 1), options.sparsity,
            rounds=options.polishing, threads=threads, progress=Span(progress, 0.5, 1),
        )  # fmt: skip
    high = None
    if options.factor > 1:
        # Shapes that, with the coarse discs' coefficients, give the fine ones best.
        fine = grounds.fine_discs(places, options.factor)
        high = _fitted(learned, fine).reshape(len(low), *_block(grounds, options.factor))
    part = SampledAtoms(low.reshape(len(low), *_block(grounds, 1)), high)
    return part, learned.errors, blend_errors


def _windows(grounds, options):
    """Choose windows of the exemplars at random, with about so many discs as are learned from."""
    side = _WINDOW * max(grounds.side_rows, grounds.side_columns) // 2
    windows = []
    for values, void in grounds.coarse:
        spans = [
            _spans(cells, side, least)
            for cells, least in zip(values.shape, _block(grounds, 1), strict=True)
        ]
        windows += [
            (values[rows, columns], void[rows, columns])
            for rows in spans[0]
            for columns in spans[1]
            if not void[rows, columns].all()
        ]
    order = np.random.default_rng(options.seed).permutation(len(windows))
    most = max(1, min(options.most_discs, _POLISHED) // _WINDOW**2)
    return [windows[number] for number in np.sort(order[:most])]


def _spans(cells, side, least):
    """Cut a side of a raster into about equal parts of at least so many cells."""
    if cells < least:
        return []
    edges = np.linspace(0, cells, max(1, round(cells / max(side, least))) + 1).astype(int)
    return [slice(*pair) for pair in pairwise(edges)]


def _constrained(grounds, places, options, threads, progress):
    """Learn atoms that are discs of the exemplars."""
    metric = Metric(options.weighting, grounds.side_rows, grounds.side_columns)
    discs = grounds.discs(places)
    vectors = metric.vectors(discs)
    learned = constrained(
        vectors, vectors, options.atoms, options.sparsity, iterations=options.iterations,
        tolerance=options.tolerance, seed=options.seed, threads=threads, progress=progress,
    )  # fmt: skip
    chosen = places[learned.chosen]
    low = discs[learned.chosen].reshape(-1, *_block(grounds, 1))
    high = None
    if options.factor > 1:
        high = grounds.fine_discs(chosen, options.factor)
        high = high.reshape(-1, *_block(grounds, options.factor))
    origins = chosen * [1, options.factor, options.factor]
    return SampledAtoms(low, high, grounds.names, origins), learned.errors, ()


def _complete(grounds, places, options, threads, progress):
    """Let all discs be atoms; only their places are kept."""
    checkpoint(progress, 1)
    origins = places * [1, options.factor, options.factor]
    return CutAtoms(tuple(grounds.fine), grounds.names, origins), (), ()


def _block(grounds, factor):
    return factor * grounds.side_rows, factor * grounds.side_columns


def _fitted(learned, samples):
    """Fit atoms to samples by least squares, given the coefficients.

    What an atom without users should be is not known: it is 0.
    """
    from scipy.sparse import csr_array

    count, sparsity = learned.indices.shape
    rows = np.arange(0, count * sparsity + 1, sparsity)
    shares = csr_array(
        (learned.coefficients.ravel().astype(np.float64), learned.indices.ravel(), rows),
        shape=(count, len(learned.atoms)),
    )
    gram = (shares.T @ shares).toarray()
    # A little of the diagonal: atoms that are always used together cannot be told apart.
    gram[np.diag_indices_from(gram)] += 1e-6 * gram.trace() / len(gram)
    return np.linalg.solve(gram, shares.T @ samples.astype(np.float64)).astype(np.float32)


def cosine_waves(side_rows, side_columns, count=None):
    """Give the two-dimensional cosine waves of a block, from long to short, but the constant.

    These are the atoms of the discrete cosine transform.

    Parameters
    ----------
    side_rows, side_columns : int
        Cells of the block.
    count : int, optional
        How many of the longest. Default, and at most: all.

    Returns
    -------
    (N, side_rows * side_columns) float32 array
        ``N`` is ``count``, or ``side_rows * side_columns - 1``.
    """
    squares = [
        (a / side_rows) ** 2 + (b / side_columns) ** 2
        for a in range(side_rows)
        for b in range(side_columns)
    ]
    order = np.argsort(squares, kind="stable")[1:][:count]
    rows = _waves(side_rows)[order // side_columns]
    columns = _waves(side_columns)[order % side_columns]
    waves = np.einsum("ni,nj->nij", rows, columns)
    return waves.reshape(len(order), side_rows * side_columns).astype(np.float32)


def _waves(side):
    return np.cos(np.pi * np.outer(np.arange(side), np.arange(side) + 0.5) / side)
