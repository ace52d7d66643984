"""The error of a fill by the size of the voids, as sums that can be pooled over many masks."""

from dataclasses import asdict, dataclass

import numpy as np

from demsmith.core.validation.slope import slopes
from demsmith.core.voids.labelling import find_voids
from demsmith.core.voids.sizes import SIZE_CLASSES, size_class

_DEVIATIONS_95 = 1.959964  # of a normal error, 95 % are within so many standard deviations
(_VOIDS, _CELLS, _ERROR, _ABSOLUTE, _SQUARED, _SLOPE_CELLS, _SLOPE_SQUARED, _WITHIN_68,
 _WITHIN_95) = range(9)  # fmt: skip


@dataclass(frozen=True)
class SizeError:
    """The error of a fill in the voids of one size class; NaN where there is no cell.

    Attributes
    ----------
    smallest, largest : int
        Cells of the smallest and largest void of the class; ``largest`` None: no limit.
    voids, cells : int
        Those that were filled.
    rmse, bias, mae, max_error : float
        Root mean square, mean, mean magnitude and largest magnitude of filled less true
        elevation.
    slope_rmse : float
        Root mean square error of the slope, rise by run.
    within_68, within_95 : float
        Share of the cells whose true elevation lies in the interval that the method states for
        68 and for 95 % of them; NaN if it states none.
    """

    smallest: int
    largest: int | None
    voids: int
    cells: int
    rmse: float
    bias: float
    mae: float
    max_error: float
    slope_rmse: float
    within_68: float
    within_95: float

    @property
    def name(self):
        """The class in words.

        Examples
        --------
        >>> zero = Tally.zero().errors()
        >>> [each.name for each in zero]
        ['1-16', '17-100', '101-1000', '> 1000', 'all']
        """
        if self.largest is not None:
            return f"{self.smallest}-{self.largest}"
        return "all" if self.smallest == 1 else f"> {self.smallest - 1}"

    def as_dict(self):
        """Give a dict that JSON can hold: NaN becomes None."""
        return {key: None if value != value else value for key, value in asdict(self).items()}


@dataclass(frozen=True)
class Tally:
    """Sums over the cells of each size class; those of several masks can be added.

    Attributes
    ----------
    sums : (4, 9) float64 array
    greatest : (4,) float64 array
        Largest error by magnitude.
    """

    sums: np.ndarray
    greatest: np.ndarray

    @classmethod
    def zero(cls):
        """Give the tally of no cell."""
        return cls(np.zeros((len(SIZE_CLASSES), 9)), np.zeros(len(SIZE_CLASSES)))

    def __add__(self, other):
        return Tally(self.sums + other.sums, np.maximum(self.greatest, other.greatest))

    def errors(self):
        """Give a `SizeError` for each of `SIZE_CLASSES`, then one for all voids."""
        every = self.sums.sum(axis=0)
        return tuple(
            _size_error(limits, sums, greatest)
            for limits, sums, greatest in zip(
                (*SIZE_CLASSES, (1, None)),
                (*self.sums, every),
                (*self.greatest, self.greatest.max()),
                strict=True,
            )
        )


def _size_error(limits, sums, greatest):
    with np.errstate(invalid="ignore"):
        mean = sums / sums[_CELLS]
        slope_rmse = np.sqrt(sums[_SLOPE_SQUARED] / sums[_SLOPE_CELLS])
    return SizeError(
        *limits,
        voids=int(sums[_VOIDS]),
        cells=int(sums[_CELLS]),
        rmse=float(np.sqrt(mean[_SQUARED])),
        bias=float(mean[_ERROR]),
        mae=float(mean[_ABSOLUTE]),
        max_error=float(greatest) if sums[_CELLS] else float("nan"),
        slope_rmse=float(slope_rmse),
        within_68=float(mean[_WITHIN_68]),
        within_95=float(mean[_WITHIN_95]),
    )


class Holes:
    """Cells whose elevations were hidden, sorted into size classes.

    Parameters
    ----------
    truth : (H, W) array
        Elevations [m].
    hidden : (H, W) bool array
        The cells to be scored.
    void : (H, W) bool array, optional
        All cells without an elevation, hidden or really void; a hole that runs into a real void is
        as large as both. Default: ``hidden``.
    pixel_size : optional
        Ground metres per cell, see `demsmith.core.mcmd.lattice.metres`.
    threads : int, optional
    """

    def __init__(self, truth, hidden, *, void=None, pixel_size=None, threads=None):
        voids = find_voids(hidden if void is None else void)
        self._hidden, self._sloping = hidden, dict(pixel_size=pixel_size, threads=threads)
        self._truth = truth[hidden].astype(np.float64)
        known = np.ones_like(hidden) if void is None else ~void | hidden
        self._slope = slopes(truth, known, **self._sloping)[hidden]
        self._void_of = voids.labels[hidden] - 1
        self._class_of_void = size_class(voids.cells)

    def tally(self, filled, sigma=None):
        """Compare a fill with the truth.

        Parameters
        ----------
        filled : (H, W) array
            Elevations [m]; cells that are NaN were not filled and are left out.
        sigma : (H, W) array, optional
            Their standard error [m] as the method states it.

        Returns
        -------
        Tally
        """
        value = filled[self._hidden].astype(np.float64)
        done = ~np.isnan(value)
        value, truth = value[done], self._truth[done]
        error = np.abs(value - truth)
        slope_error = self._slope_errors(filled)[done]
        sloped = ~np.isnan(slope_error)
        stated = np.nan if sigma is None else sigma[self._hidden][done]
        class_of = self._class_of_void[self._void_of[done]]
        columns = {
            _CELLS: np.ones_like(error),
            _ERROR: value - truth,
            _ABSOLUTE: error,
            _SQUARED: error**2,
            _SLOPE_CELLS: sloped,
            _SLOPE_SQUARED: np.where(sloped, slope_error, 0) ** 2,
            _WITHIN_68: _within(error, stated),
            _WITHIN_95: _within(error, _DEVIATIONS_95 * stated),
        }
        tally = Tally.zero()
        for number, weights in columns.items():
            tally.sums[:, number] = np.bincount(class_of, weights, len(SIZE_CLASSES))
        met = np.unique(self._void_of[done])
        tally.sums[:, _VOIDS] = np.bincount(self._class_of_void[met], minlength=len(SIZE_CLASSES))
        np.maximum.at(tally.greatest, class_of, error)
        return tally

    def _slope_errors(self, filled):
        everywhere = np.ones(filled.shape, bool)
        slope = slopes(filled, everywhere, **self._sloping)
        return slope[self._hidden].astype(np.float64) - self._slope


def _within(error, stated):
    return np.where(np.isnan(stated), np.nan, error <= stated)


def errors_by_size(filled, truth, void, *, pixel_size=None):
    """Score a fill by void size.

    Parameters
    ----------
    filled, truth : (H, W) arrays
        Elevations.
    void : (H, W) bool array
        The cells that were filled.
    pixel_size : optional
        Ground metres per cell, for the slope; see `demsmith.core.mcmd.lattice.metres`.

    Returns
    -------
    tuple of SizeError
        One for each of `SIZE_CLASSES`, then one for all voids.

    Examples
    --------
    >>> void = np.zeros((4, 4), bool)
    >>> void[1, 1:3] = True
    >>> truth = np.zeros((4, 4))
    >>> [(each.voids, each.rmse) for each in errors_by_size(truth + 3.0, truth, void)][-1]
    (1, 3.0)
    """
    return Holes(truth, void, pixel_size=pixel_size).tally(filled).errors()
