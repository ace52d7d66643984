"""Artificial voids in a raster's known ground, filled by every estimator."""

import math

import numpy as np

from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.voids.accurate.estimates import TENSION_CELLS, estimate_surfaces
from demsmith.core.voids.accurate.windows import as_float
from demsmith.core.voids.labelling import find_voids, survey_rims
from demsmith.core.voids.sizes import size_class

QUOTA = np.array([48, 48, 20, 8])
"""Artificial voids of each size class that are tried."""

_SHARE_AT_EDGE = 0.0, 0.1, 0.25, 0.4
"""As a share of that, voids at the edge that are tried besides; their errors are alike enough."""

_WINDOWS = 4

# Scale [cells] and share of a window of each kind of artificial void, by mask: among small ones
# there is no room for large ones.
_MIXTURES = ((1.5, 0.01), (4, 0.015), (10, 0.03)), ((20, 0.07),)


class Trial:
    """Artificial voids of one window, estimated.

    Attributes
    ----------
    size : (N,) int64 array
        Cells of each void.
    at_edge : (N,) bool array
        Whether it touches the window's edge, as others do the raster's.
    estimates : Estimates
    errors : (3, M) float64 array
        Of each estimator in each cell [m].
    """

    def __init__(self, window, void, voids, chosen, covariance, *, tension, threads, progress):
        self._ground = as_float(window.values)
        self._start = filled_by_mcmd(window, void, tension, threads, Span(progress, 0, 0.2))
        selected, self.at_edge = chosen
        self._where = void, voids
        self._selected = selected
        self._fitting = dict(dx=window.dx, dy=window.dy, threads=threads)
        self.size = voids.cells[selected]
        self.estimates = self._estimated(
            selected, covariance, TENSION_CELLS, Span(progress, 0.2, 1)
        )  # fmt: skip
        self.errors = self.estimates.surfaces - self._truth(self.estimates)

    def _estimated(self, selected, covariance, tension, progress=SILENT):
        return estimate_surfaces(
            self._start, *self._where, selected, covariance,
            tension=np.full(selected.size, tension), progress=progress, **self._fitting,
        )  # fmt: skip

    def _truth(self, estimates):
        return self._ground.ravel()[estimates.cells]

    def structured_errors(self, tension, chosen, progress=SILENT):
        """Give the (M,) errors of the structured surface under another tension [rows].

        Only of the ``chosen``, (N,) bool; those of other voids are as they were.
        """
        estimates = self._estimated(self._selected[chosen], None, tension, progress)
        errors = self.errors[2].copy()
        errors[chosen[self.estimates.void_of]] = estimates.surfaces[2] - self._truth(estimates)
        return errors

    def use(self, structured_errors, cells):
        """Take other errors of the structured surface for some cells, and their surface."""
        self.errors[2, cells] = structured_errors[cells]
        self.estimates.surfaces[2] = self.errors[2] + self._truth(self.estimates)


def filled_by_mcmd(window, void, tension, threads, progress):
    """Give a window's elevations, the cells of ``void`` filled by MCMD."""
    from demsmith.core.voids.filling import fill_voids  # which learns, and so comes here

    return fill_voids(
        as_float(window.values), void, method="mcmd", pixel_size=(window.dx, window.dy),
        tension=tension, threads=threads, progress=progress,
    ).values  # fmt: skip


def run_trials(windows, covariance, *, tension=None, threads=None, progress=SILENT):
    """Punch artificial voids into the windows that know most, and estimate them.

    Parameters
    ----------
    windows : list of Window
    covariance : Covariance
    tension : float, optional
        MCMD's, [m].
    threads : int, optional
    progress : Progress

    Returns
    -------
    list of Trial
    """
    from scipy.ndimage import maximum_filter

    known = [np.count_nonzero(~window.void) for window in windows]
    best = [windows[n] for n in np.sort(np.argsort(known, kind="stable")[::-1][:_WINDOWS])]
    quota = QUOTA / max(len(best), 1)
    trials = []
    for n, window in enumerate(best):
        # Not beside real voids, or they would become one, whose truth is known in part.
        apart = ~maximum_filter(window.void, 5)
        for kind, mixture in enumerate(_MIXTURES):
            done = (n + kind / len(_MIXTURES)) / len(best)
            part = Span(progress, done, done + 1 / len(_MIXTURES) / len(best))
            checkpoint(part, 0.0)
            void = window.void | (_punched(window, mixture, n) & apart)
            voids = find_voids(void, threads=1)
            few = quota * (np.arange(QUOTA.size) < 3 if kind == 0 else np.arange(QUOTA.size) == 3)
            chosen = _steepest(window, void, voids, few)
            if chosen[0].size:
                trials.append(
                    Trial(
                        window,
                        void,
                        voids,
                        chosen,
                        covariance,
                        tension=tension,
                        threads=threads,
                        progress=part,
                    )
                )
    return trials


def _punched(window, mixture, seed):
    """Punch voids of all sizes where smooth noise is high, in several scales."""
    rng = np.random.default_rng(seed)
    punched = np.zeros(window.void.shape, bool)
    for scale, share in mixture:
        noise = _smooth_noise(punched.shape, scale, rng)
        punched |= noise > np.quantile(noise, 1 - share)
    return punched


def _smooth_noise(shape, scale, rng):
    """Make noise smoothed over ``scale`` cells: on a coarse grid, then drawn out, for speed."""
    from scipy.ndimage import gaussian_filter, map_coordinates

    step = max(1, int(scale // 2))
    coarse = rng.standard_normal([n // step + 2 for n in shape])
    coarse = gaussian_filter(coarse, scale / step)
    if step == 1:
        return coarse[: shape[0], : shape[1]]
    rows, columns = np.ogrid[: shape[0], : shape[1]]
    places = np.broadcast_arrays(rows / step, columns / step)
    return map_coordinates(coarse, places, order=1)


def _steepest(window, void, voids, quota):
    """Choose the artificial voids with most relief at their rims, for real ones lie on slopes.

    Gives their numbers and whether they touch the window's edge.
    """
    real = np.bincount(voids.labels[window.void], minlength=len(voids) + 1)[1:] > 0
    rims = survey_rims(window.values, void, voids, threads=1)
    relief = np.where(~real, rims.high - rims.low, 0.0)
    of_class = size_class(voids.cells)
    chosen = []
    for k, many in enumerate(quota):
        for edge, most in ((False, many), (True, _SHARE_AT_EDGE[k] * many)):
            members = np.flatnonzero((of_class == k) & (relief > 0) & (rims.touches_edge == edge))
            order = np.argsort(-relief[members], kind="stable")
            chosen.append(members[order[: math.ceil(most)]])
    selected = np.sort(np.concatenate(chosen))
    return selected, rims.touches_edge[selected]
