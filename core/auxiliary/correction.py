"""The linear correction that makes an auxiliary raster resemble the target, and its fit.

Two sensors see the same ground with different sharpness. On ground that both know, the target is
regressed on what the auxiliary shows in and around each cell: a plane (bias and tilt), its own
elevation (a wrong vertical scale) and a small stencil of differences, which can move, smooth and
sharpen it (the Wiener filter of the pair). Which of these are used is decided by cross-validation.
"""

from dataclasses import dataclass, fields

import numpy as np

_NEAR = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
_AROUND = [(i, j) for i in range(-2, 3) for j in range(-2, 3) if max(abs(i), abs(j)) == 2]
_WIDE = [(4 * i, 4 * j) for i, j in _NEAR]

TAPS = np.array(_NEAR + _AROUND + _WIDE)
"""Rows and columns from a cell to those of the stencil, nearest first."""

MARGIN = int(np.abs(TAPS).max())
"""Cells by which the stencil reaches beyond a window."""

_PLANE = 3  # columns of the regression: one, row, column
_CANDIDATES = tuple(
    (scaled, taps)
    for taps in (0, len(_NEAR), len(_NEAR + _AROUND), len(TAPS))
    for scaled in (False, True)
)
_WORTH = 0.005
"""Share by which the error must fall for more columns to be used."""

_SPREADS = 2.5
"""Residuals of so many spreads count half."""

_REWEIGHTINGS = 3
_FOLDS = 5
_SAMPLES_PER_COLUMN = 20
_PRIOR = 0.5
"""Standard deviation of a tap's weight before anything is known of it: keeps the weights small
where the auxiliary is so smooth that its taps tell the same."""


@dataclass(frozen=True)
class Correction:
    """A plane, a scale and a stencil.

    Attributes
    ----------
    origin : (float, float)
        Row and column where the plane is ``bias``.
    bias, per_row, per_column : float
        Plane to add [m, m per cell].
    scale, reference : float
        Share of the elevation above ``reference`` [m] to add.
    weights : tuple of float
        Of the first of `TAPS`: share of the difference to that cell to add.
    """

    origin: tuple = (0.0, 0.0)
    bias: float = 0.0
    per_row: float = 0.0
    per_column: float = 0.0
    scale: float = 0.0
    reference: float = 0.0
    weights: tuple = ()

    @property
    def taps(self):
        """The cells of the stencil, (T, 2) array."""
        return TAPS[: len(self.weights)]

    @property
    def shift(self):
        """Rows and columns by which the stencil moves the ground, its first moment."""
        return tuple(float(each) for each in self._shares @ self.taps)

    @property
    def variance(self):
        """Second moments of the stencil by row and column [cells²]: positive if it smooths."""
        moments = self._shares @ self.taps**2 - np.square(self.shift)
        return tuple(float(each) for each in moments)

    @property
    def _shares(self):
        """The stencil's weights as shares of the scaled ground that they are taken from."""
        return np.asarray(self.weights) / (1 + self.scale)

    def apply(self, values, void, row, column):
        """Correct a window.

        Parameters
        ----------
        values, void : (h + 2 MARGIN, w + 2 MARGIN) float64 and bool arrays
            The auxiliary on the target's cells, `MARGIN` cells more on each side.
        row, column : int
            Absolute place of the first cell of the window without the margin.

        Returns
        -------
        (h, w) float64 array
            Arbitrary where the cell itself is void.
        """
        from demsmith.core.auxiliary._filtering import add_taps

        inner = values[MARGIN:-MARGIN, MARGIN:-MARGIN]
        rows = np.arange(row, row + inner.shape[0]) - self.origin[0]
        columns = np.arange(column, column + inner.shape[1]) - self.origin[1]
        out = inner + self.scale * (inner - self.reference)
        out += self.bias + self.per_row * rows[:, None] + self.per_column * columns
        if self.weights:
            add_taps(values, void, MARGIN, self.taps, np.array(self.weights), out)
        return out


@dataclass(frozen=True)
class Samples:
    """Cells that both rasters know, with their surroundings in the auxiliary.

    Attributes
    ----------
    rows, columns : (N,) arrays
        Absolute.
    delta : (N,) float64 array
        Target less auxiliary [m].
    height : (N,) float64 array
        The auxiliary's elevation [m].
    differences : (N, T) float64 array
        What each of `TAPS` shows, less ``height``.
    fold : (N,) int64 array
        From 0: samples of one fold are left out together.
    """

    rows: np.ndarray
    columns: np.ndarray
    delta: np.ndarray
    height: np.ndarray
    differences: np.ndarray
    fold: np.ndarray

    @classmethod
    def joined(cls, parts):
        """Put samples together."""
        names = [each.name for each in fields(cls)]
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    @property
    def count(self):
        """Number of samples."""
        return self.delta.size


def gather(window, values, void, count):
    """Take samples from a window.

    Parameters
    ----------
    window : Window
        Of the target, see `demsmith.core.voids.accurate`.
    values, void : (h + 2 MARGIN, w + 2 MARGIN) arrays
        The auxiliary on it, `MARGIN` cells more on each side.
    count : int
        At most so many.

    Returns
    -------
    Samples
    """
    from demsmith.core.auxiliary._filtering import differences

    inner = slice(MARGIN, -MARGIN)
    cells = np.flatnonzero(~window.void & ~void[inner, inner])
    if cells.size > count:
        cells = np.random.default_rng(0).choice(cells, count, replace=False)
        cells.sort()
    rows, columns = np.unravel_index(cells, window.void.shape)
    seen = np.empty((cells.size, len(TAPS)))
    differences(values, void, rows + MARGIN, columns + MARGIN, TAPS, seen)
    whole = np.isfinite(seen).all(axis=1)
    rows, columns, seen = rows[whole], columns[whole], seen[whole]
    height = values[rows + MARGIN, columns + MARGIN]
    block = min(max(min(window.void.shape) // _FOLDS, 8), 64)
    return Samples(
        rows=rows + window.row,
        columns=columns + window.column,
        delta=window.values[rows, columns] - height,
        height=height,
        differences=seen,
        fold=(rows // block + 2 * (columns // block)) % _FOLDS,
    )


def fit(samples):
    """Fit the correction to samples, robustly, with as many terms as are worth it.

    Weighted least squares with Cauchy's weights (so that outliers count little), a weak prior on
    the taps; of nested sets of terms the smallest whose error on samples left out is within half
    a percent of the least.

    Parameters
    ----------
    samples : Samples

    Returns
    -------
    Correction
    """
    if not samples.count:
        return Correction()
    origin = float(samples.rows.mean()), float(samples.columns.mean())
    reference = float(samples.height.mean())
    table, units = _table(samples, origin, reference)
    candidates = [
        chosen
        for chosen in map(_columns_of, _CANDIDATES)
        if samples.count >= _SAMPLES_PER_COLUMN * len(chosen)
    ] or [np.array([0])]
    weights, variance = _robust_weights(table, candidates[-1])
    products = _products(table, weights, samples.fold, _FOLDS)
    chosen = _worthwhile(products, candidates, variance)
    solution = np.zeros(table.shape[1] - 1)
    solution[chosen] = _solve(products.sum(axis=0), chosen, variance)
    solution /= units
    taps = max(chosen[-1] - _PLANE, 0)
    return Correction(
        origin, *(float(term) for term in solution[:_PLANE]), float(solution[_PLANE]), reference,
        tuple(float(weight) for weight in solution[_PLANE + 1 : _PLANE + 1 + taps]),
    )  # fmt: skip


def _table(samples, origin, reference):
    """Columns of the regression, each divided by a unit, and the delta as the last one."""
    plain = [
        np.ones(samples.count),
        samples.rows - origin[0],
        samples.columns - origin[1],
        samples.height - reference,
    ]
    spans = [1.0, *(float(np.abs(column).max()) or 1.0 for column in plain[1:])]
    columns = [column / span for column, span in zip(plain, spans, strict=True)]
    table = np.column_stack([*columns, samples.differences, samples.delta])
    return table, np.array(spans + [1.0] * len(TAPS))


def _columns_of(candidate):
    scaled, taps = candidate
    first = np.arange(_PLANE + 1 if scaled else _PLANE)
    return np.concatenate([first, _PLANE + 1 + np.arange(taps)])


def _robust_weights(table, chosen):
    """Weigh samples by their residuals; also gives the variance of the bulk of these."""
    from demsmith.core.auxiliary.coregistration import robust_spread

    delta = table[:, -1]
    weights = np.ones(delta.size)
    group = np.zeros(delta.size, np.int64)
    spread = robust_spread(delta)
    weights /= 1 + ((delta - np.median(delta)) / (_SPREADS * spread or 1.0)) ** 2
    for _ in range(_REWEIGHTINGS):
        products = _products(table, weights, group, 1)[0]
        residual = delta - table[:, chosen] @ _solve(products, chosen, spread**2)
        spread = robust_spread(residual)
        weights = 1 / (1 + (residual / (_SPREADS * spread or 1.0)) ** 2)
    return weights, spread**2


def _products(table, weights, group, groups):
    from demsmith.core.auxiliary._filtering import add_products

    products = np.zeros((groups, table.shape[1], table.shape[1]))
    add_products(table, weights, group, products)
    return products + np.triu(products, 1).transpose(0, 2, 1)


def _solve(products, chosen, variance):
    """Solve the normal equations of the chosen columns."""
    prior = np.where(chosen > _PLANE, variance / _PRIOR**2, 1e-9 * products[0, 0])
    matrix = products[np.ix_(chosen, chosen)] + np.diag(prior + 1e-12)
    return np.linalg.solve(matrix, products[chosen, -1])


def _worthwhile(products, candidates, variance):
    """Choose the first candidate whose error on folds left out is nearly the least."""
    total = products.sum(axis=0)
    errors = []
    for chosen in candidates:
        error = 0.0
        for fold in products:
            solution = _solve(total - fold, chosen, variance)
            seen = fold[np.ix_(chosen, chosen)]
            error += fold[-1, -1] - 2 * solution @ fold[chosen, -1] + solution @ seen @ solution
        errors.append(max(error, 0.0))
    enough = (1 + _WORTH) ** 2 * min(errors)
    return next(each for each, error in zip(candidates, errors, strict=True) if error <= enough)
