"""What is learned of a raster's ground before its voids are filled."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.voids.accurate.spectrum import Covariance

ESTIMATORS = ("mcmd", "learned", "structured")
"""Constrained midpoint displacement; the expectation under the learned covariance; the surface of
least bending that follows the ridges and valleys around the void."""

LARGEST_LEARNED = 4000
"""Cells of the largest void in which the learned covariance is tried."""

FEATURES = 4
"""Constant, and the logarithms of distance to known ground, of the void's cells and of what
estimators disagree by, relative to the ground's roughness."""


UNCALIBRATED = (
    "too little ground is known to try artificial voids in; the usual shares were taken, and the "
    "uncertainty is a guess"
)
"""What to say where a model is not calibrated."""


@dataclass(frozen=True)
class Model:
    """The ground of a raster or mosaic, as filling its voids needs to know it.

    Attributes
    ----------
    covariance : Covariance
    tension : (4,) float64 array
        Distance [rows] over which bending gives way to stretching in the structured surface, by
        size class.
    weights : (4, 3) float64 array
        Share of each of `ESTIMATORS` in the filled surface, by size class
        (`demsmith.core.voids.sizes.SIZE_CLASSES`); rows add up to 1.
    rmse : (4, 4) float64 array
        Error [m] in artificial voids of each estimator, and of their blend, by size class; NaN
        where none were tried.
    tried : (4,) int64 array
        How many artificial voids of each class were tried.
    spread : (4,) float64 array
        Of the logarithm of the expected error over the ground's roughness: the share of each of
        the `FEATURES`.
    scale : (4,) float64 array
        By which the expected error is multiplied, by size class, so that intervals of one and two
        sigma hold what they should.
    roughness : float
        Typical root mean square of the Laplacian of the ground around a void.
    at_edge : (3,) float64 array
        Share of each of `ESTIMATORS` in voids that touch the raster's edge, which are filled from
        one side.
    scale_at_edge : float
        By which their expected error is multiplied.
    """

    covariance: Covariance
    tension: np.ndarray
    weights: np.ndarray
    rmse: np.ndarray
    tried: np.ndarray
    spread: np.ndarray
    scale: np.ndarray
    roughness: float
    at_edge: np.ndarray
    scale_at_edge: float

    @property
    def calibrated(self):
        """Whether any artificial void could be tried."""
        return bool(self.tried.any())

    def reason(self, size_class):
        """Say in a sentence why voids of a class are filled as they are."""
        shares = ", ".join(
            f"{share:.0%} {name}"
            for name, share in zip(ESTIMATORS, self.weights[size_class], strict=True)
            if share > 0.005
        )
        if not self.tried[size_class]:
            return f"{shares}: the usual shares, for no artificial void of this size fitted"
        errors = ", ".join(
            f"{name} {error:.1f}"
            for name, error in zip((*ESTIMATORS, "blend"), self.rmse[size_class], strict=True)
            if np.isfinite(error)
        )
        return f"{shares}: RMSE [m] in {self.tried[size_class]} artificial voids: {errors}"
