"""How the estimators' surfaces are put together, and what error is to be expected of the blend."""

import numpy as np

from demsmith.core.voids.accurate.model import ESTIMATORS, LARGEST_LEARNED

_CLASS_MIDDLES = np.log([5, 40, 320, 2500])
_LEAST_ROUGHNESS = 0.1


def shares_of(weights, weights_at_edge, cells, at_edge):
    """Give the (N, 3) shares of the estimators in voids of so many cells.

    ``weights`` holds those of the middle of each class; between them they change with the
    logarithm of the size. Voids that touch the raster's edge are filled from one side, which is
    another task: they have shares of their own.
    """
    shares = np.stack([_by_size(column, cells) for column in weights.T], axis=1)
    shares[at_edge] = weights_at_edge
    shares[cells > LARGEST_LEARNED, ESTIMATORS.index("learned")] = 0
    return shares / shares.sum(axis=1, keepdims=True)


def tensions_of(tension, cells):
    """Give the tension [rows] of voids of so many cells from that of each class."""
    return np.exp(_by_size(np.log(tension), cells))


def blend(surfaces, shares, void_of):
    """Give the (M,) blend of (3, M) surfaces by the shares of each cell's void."""
    return sum(surface * shares[void_of, k] for k, surface in enumerate(surfaces))


def units_of(roughness, usual):
    """Give what errors are measured in: the roughness of the ground around each void.

    Where that ground is nearly level, a share of the ``usual`` roughness, for the void need not be.
    """
    return np.maximum(np.hypot(roughness, _LEAST_ROUGHNESS * usual), 1e-6)


def features_of(estimates, cells, units):
    """Give the (4, M) logarithms by which an error is told: see `FEATURES`."""
    void_of = estimates.void_of
    mcmd, structured = estimates.surfaces[0], estimates.surfaces[2]
    apart = np.abs(structured - mcmd) / units[void_of]
    return np.stack([
        np.ones(void_of.size), np.log(estimates.distance), np.log(cells)[void_of],
        np.log(apart + 0.1),
    ])  # fmt: skip


def sigma_of(model, estimates, cells, at_edge):
    """Give the standard error [m] to be expected of the blend in each of the M cells.

    It is at most twice what the ground around the void varies by, in height and in bends.
    """
    units = units_of(estimates.roughness, model.roughness)
    spread = np.exp(model.spread @ features_of(estimates, cells, units))
    scale = np.where(at_edge, model.scale_at_edge, np.exp(_by_size(np.log(model.scale), cells)))
    void_of = estimates.void_of
    most = 2 * np.hypot(estimates.deviation, units)
    return np.minimum(spread * (units * scale)[void_of], most[void_of])


def _by_size(of_class, cells):
    return np.interp(np.log(cells), _CLASS_MIDDLES, of_class)
