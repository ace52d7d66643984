"""Learning a raster's ground: its covariance, and by artificial voids which estimator to trust."""

from dataclasses import replace
from itertools import chain, combinations

import numpy as np

from demsmith.core.progress import SILENT, Muted, Span, checkpoint
from demsmith.core.voids.accurate.blending import (
    blend,
    features_of,
    shares_of,
    units_of,
)
from demsmith.core.voids.accurate.estimates import TENSION_CELLS
from demsmith.core.voids.accurate.model import ESTIMATORS, Model
from demsmith.core.voids.accurate.spectrum import learn_covariance
from demsmith.core.voids.accurate.trials import QUOTA, filled_by_mcmd, run_trials
from demsmith.core.voids.accurate.windows import as_float
from demsmith.core.voids.sizes import size_class

# What was found over many tiles: to begin with, and where a raster has little to learn from.
_USUAL_WEIGHTS = np.array([[0, 0.8, 0.2], [0, 0.5, 0.5], [0, 0.1, 0.9], [0.1, 0, 0.9]])
_USUAL_SPREAD = np.array([-1.0, 1.2, 0.0, 0.3])
_USUAL_SCALE = np.array([1.5, 1.5, 1.5, 1.5])
_USUAL_AT_EDGE = np.array([0.2, 0.5, 0.3])
_USUAL_SCALE_AT_EDGE = 2.2

# Other tensions [rows] that are tried in voids of the largest class, and what share of the squared
# error a better one must be below.
_TENSIONS = (5.0, 40.0)
_LARGE_CLASSES = (3,)
_CLEARLY_BETTER = 0.95

# Real voids' errors are spread otherwise than those of the compact artificial ones on the steepest
# ground: by so much, by size class, over many tiles.
_BIAS_OF_TRIALS = np.array([0.825, 0.88, 1.01, 1.12])
_BIAS_AT_EDGE = 1.1

# How many artificial voids the usual values count for.
_USUAL_COUNT = 5.0


def learn(windows, *, tension=None, threads=None, progress=SILENT):
    """Learn what filling voids needs to know of a ground.

    Parameters
    ----------
    windows : list of Window
        See `demsmith.core.voids.accurate.training_windows`.
    tension : float, optional
        Distance [m] over which bending gives way to stretching; default: 12 rows.
    threads : int, optional
        The result does not depend on it.
    progress : Progress

    Returns
    -------
    Model

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop.
    """
    surfaces = _without_gaps(windows, tension, threads, Span(progress, 0, 0.2))
    covariance = learn_covariance(
        [(z, each.void, each.dx, each.dy) for z, each in zip(surfaces, windows, strict=True)]
    )
    checkpoint(progress, 0.3)
    trials = run_trials(
        windows, covariance, tension=tension, threads=threads, progress=Span(progress, 0.3, 0.8)
    )
    rows = None if tension is None else tension / covariance.dy
    tensions = _best_tensions(trials, rows, Span(progress, 0.8, 1))
    return _judge(trials, covariance, tensions)


def _without_gaps(windows, tension, threads, progress):
    """Fill the windows' own voids by MCMD, so that their spectra can be taken."""
    filled = []
    for n, window in enumerate(windows):
        part = Span(progress, n / len(windows), (n + 1) / len(windows))
        if window.void.any():
            filled.append(filled_by_mcmd(window, window.void, tension, threads, part))
        else:
            filled.append(as_float(window.values))
    return filled


def _best_tensions(trials, wanted, progress):
    """Find the tension [rows] of the structured surface for each class, if none is ``wanted``.

    In larger voids, the one that does clearly better than the usual one; trials go on with it.
    """
    tensions = np.full(QUOTA.size, wanted or TENSION_CELLS)
    candidates = _TENSIONS if wanted is None else (wanted,)
    classes = _LARGE_CLASSES if wanted is None else range(QUOTA.size)
    for n, tension in enumerate(candidates):
        part = Span(progress, n / len(candidates), (n + 1) / len(candidates))
        errors = [
            trial.structured_errors(tension, np.isin(size_class(trial.size), classes), Muted(part))
            for trial in trials
        ]
        checkpoint(part, 1.0)
        for k in classes:
            cells = [_cells_in(trial, k) for trial in trials]
            usual = sum((t.errors[2, c] ** 2).sum() for t, c in zip(trials, cells, strict=True))
            other = sum((e[c] ** 2).sum() for e, c in zip(errors, cells, strict=True))
            if wanted or other < _CLEARLY_BETTER * usual:
                tensions[k] = tension
                for trial, error, c in zip(trials, errors, cells, strict=True):
                    trial.use(error, c)
    return tensions


def _judge(trials, covariance, tensions):
    """Turn the errors in artificial voids into shares and uncertainties."""
    classes = QUOTA.size
    weights, tried = _USUAL_WEIGHTS.copy(), np.zeros(classes, np.int64)
    rmse = np.full((classes, len(ESTIMATORS) + 1), np.nan)
    for k in range(classes):
        errors = _joined([trial.errors[:, _cells_in(trial, k)] for trial in trials])
        tried[k] = sum(int(_voids_in(trial, k).sum()) for trial in trials)
        if tried[k]:
            rmse[k, :-1] = np.sqrt((errors**2).mean(axis=1))
            weights[k] = _least_error_shares(errors, tried[k], _USUAL_WEIGHTS[k])
            rmse[k, -1] = np.sqrt(((weights[k] @ errors) ** 2).mean())
    rough = np.concatenate([np.empty(0), *(t.estimates.roughness for t in trials)])
    roughness = float(np.sqrt((rough**2).mean())) if rough.size else 0.0
    model = Model(
        covariance,
        tensions,
        weights,
        rmse,
        tried,
        _USUAL_SPREAD.copy(),
        _USUAL_SCALE.copy(),
        roughness,
        _shares_at_edge(trials),
        _USUAL_SCALE_AT_EDGE,
    )
    return _calibrated(model, trials) if tried.any() else model


def _voids_in(trial, k):
    """Mark the voids of a size class that do not touch the edge."""
    return (size_class(trial.size) == k) & ~trial.at_edge


def _cells_in(trial, k):
    return _voids_in(trial, k)[trial.estimates.void_of]


def _joined(errors):
    return np.concatenate([np.empty((len(ESTIMATORS), 0)), *errors], axis=1)


def _shares_at_edge(trials):
    """Find the shares in voids at the edge, every void made to count about the same."""
    errors, count = [], 0
    for trial in trials:
        void_of = trial.estimates.void_of
        squares = np.bincount(void_of, (trial.errors**2).mean(axis=0), trial.size.size)
        unit = np.sqrt(np.maximum(squares, 1e-12))[void_of]
        errors.append((trial.errors / unit)[:, trial.at_edge[void_of]])
        count += int(trial.at_edge.sum())
    return _least_error_shares(_joined(errors), count, _USUAL_AT_EDGE) if count else _USUAL_AT_EDGE


def _least_error_shares(errors, count, usual):
    """Find the shares, none negative, adding up to 1, of least squared error, near the usual ones.

    Few artificial voids say little, so leaving the usual shares costs what `_USUAL_COUNT` voids of
    the mean error weigh.
    """
    products = errors @ errors.T
    keep = _USUAL_COUNT / count * np.trace(products) / len(ESTIMATORS)
    best, least = usual, np.inf
    for chosen in _subsets(range(len(ESTIMATORS))):
        shares = np.zeros(len(ESTIMATORS))
        part = np.array(chosen)
        matrix = products[np.ix_(part, part)] + keep * np.eye(part.size)
        to_usual = np.linalg.solve(matrix, keep * usual[part])
        to_one = np.linalg.solve(matrix, np.ones(part.size))
        shares[part] = to_usual + to_one * (1 - to_usual.sum()) / to_one.sum()
        cost = shares @ products @ shares + keep * ((shares - usual) ** 2).sum()
        if shares.min() >= 0 and cost < least:
            best, least = shares, cost
    return best


def _subsets(items):
    return chain.from_iterable(combinations(items, n) for n in range(1, len(items) + 1))


def _calibrated(model, trials):
    """Fit the expected error to the errors of the blend, and its scale to their quantiles."""
    rows, ratios, sizes, edges = [], [], [], []
    for trial in trials:
        void_of = trial.estimates.void_of
        units = units_of(trial.estimates.roughness, model.roughness)
        error = blend(
            trial.errors,
            shares_of(model.weights, model.at_edge, trial.size, trial.at_edge),
            void_of,
        )
        rows.append(features_of(trial.estimates, trial.size, units))
        ratios.append(np.abs(error) / units[void_of])
        sizes.append(trial.size[void_of])
        edges.append(trial.at_edge[void_of])
    rows, ratio, size = np.concatenate(rows, axis=1), np.concatenate(ratios), np.concatenate(sizes)
    edge = np.concatenate(edges)
    # Every void counts the same, however many cells it has; the logarithm needs a floor.
    logs = np.log(ratio + 0.05 * np.sqrt((ratio**2).mean()) + 1e-12)
    keep = _USUAL_COUNT * np.eye(len(rows))
    spread = np.linalg.solve(
        (rows / size) @ rows.T + keep, (rows / size) @ logs + keep @ model.spread
    )
    score = ratio / np.exp(spread @ rows)
    all_sizes = _scale(score[~edge]) if not edge.all() else 1.0
    share = model.tried / (model.tried + _USUAL_COUNT)
    of_class = [
        _scale(score[(size_class(size) == k) & ~edge]) if tried else all_sizes
        for k, tried in enumerate(model.tried)
    ]
    scale = _BIAS_OF_TRIALS * np.array(of_class) ** share * all_sizes ** (1 - share)
    at_edge = _BIAS_AT_EDGE * _scale(score[edge]) if edge.any() else model.scale_at_edge
    return replace(model, spread=spread, scale=scale, scale_at_edge=at_edge)


def _scale(score):
    """Give what makes one sigma hold 68 % and 1.96 sigma 95 %, or nearly both."""
    one, two = np.quantile(score, [0.6827, 0.95])
    return max(float(np.sqrt(one * two / 1.96)), 1e-9)
