"""The error of a reconstruction over many holes, as one number, and how sure it is."""

from dataclasses import dataclass

import numpy as np

_FEWEST = 8
_RESAMPLES = 200
_TINY = 1e-12  # squared metres: below any error that matters, and its logarithm is finite


@dataclass(frozen=True)
class Holes:
    """Holes of known ground, in classes by size.

    Attributes
    ----------
    cells : (N,) int64 array
        Cells of each hole whose elevations are known.
    classes : tuple of (int, int or None)
        Smallest and largest hole of each class; None: no limit.
    class_of : (N,) int64 array
        The class of each hole.
    """

    cells: np.ndarray
    classes: tuple
    class_of: np.ndarray

    @property
    def count(self):
        """Number of holes."""
        return self.cells.size

    def rmse(self, squares):
        """Give each class's root mean square error from each hole's sum of squares [m²]."""
        count = len(self.classes)
        total = np.bincount(self.class_of, squares, count)
        return np.sqrt(total / np.bincount(self.class_of, self.cells, count))

    def score(self, squares):
        """Give the mean over classes of the logarithm of the RMSE, so that each counts alike."""
        return float(np.log(np.maximum(self.rmse(squares), _TINY)).mean())


@dataclass(frozen=True)
class Gain:
    """How much smaller an error became, as a share of it, and the standard error of that."""

    share: float
    noise: float

    def __str__(self):
        return f"{100 * self.share:.1f} ± {100 * self.noise:.1f} %"


@dataclass(frozen=True)
class ClassError:
    """Root mean square error [m] before and after tuning, in the holes of one size class.

    ``largest`` is None where the class has no upper limit.
    """

    smallest: int
    largest: int | None
    holes: int
    before: float
    after: float


@dataclass(frozen=True)
class Comparison:
    """Two reconstructions of the same holes: each hole's sum of squared errors [m²]."""

    holes: Holes
    before: np.ndarray
    after: np.ndarray

    def gain(self):
        """Compare the scores.

        Returns
        -------
        Gain
            Its noise is the standard deviation over bootstrap samples of the holes of each class
            (Efron and Tibshirani 1993, "An Introduction to the Bootstrap", chapter 6).
        """
        count = len(self.holes.classes)
        rng = np.random.default_rng(0)
        logs = np.zeros(_RESAMPLES)
        for number in range(count):
            member = np.flatnonzero(self.holes.class_of == number)
            even = np.full(member.size, 1 / member.size)
            drawn = rng.multinomial(member.size, even, size=_RESAMPLES)
            before, after = drawn @ self.before[member], drawn @ self.after[member]
            logs += np.log((after + _TINY) / (before + _TINY)) / (2 * count)
        change = self.holes.score(self.after) - self.holes.score(self.before)
        return Gain(1 - float(np.exp(change)), float(np.exp(logs).std()))

    def by_class(self):
        """Give a tuple with the `ClassError` of each class."""
        before, after = self.holes.rmse(self.before), self.holes.rmse(self.after)
        members = np.bincount(self.holes.class_of, minlength=len(self.holes.classes))
        return tuple(
            ClassError(*limits, int(members[n]), float(before[n]), float(after[n]))
            for n, limits in enumerate(self.holes.classes)
        )


def classify(cells, sizes, limits):
    """Sort holes into classes by size; a class of too few holes joins the next smaller one.

    Parameters
    ----------
    cells : (N,) int array
        Cells of each hole that are scored.
    sizes : (N,) int array
        Cells of each hole in all.
    limits : sequence of (int, int or None)
        Smallest and largest size of each class, in ascending order.

    Returns
    -------
    Holes

    Examples
    --------
    >>> sizes = np.array([1, 2, 3, 4, 5, 6, 7, 8, 50, 60])
    >>> classify(sizes, sizes, ((1, 16), (17, 100), (101, None))).classes
    ((1, None),)
    """
    merged = []
    for smallest, largest in limits:
        top = np.inf if largest is None else largest
        few = ((sizes >= smallest) & (sizes <= top)).sum() < _FEWEST
        if few and merged:
            merged[-1] = (merged[-1][0], largest)
        else:
            merged.append((smallest, largest))
    if len(merged) > 1 and (sizes <= merged[0][1]).sum() < _FEWEST:
        merged[:2] = [(merged[0][0], merged[1][1])]
    starts = np.array([smallest for smallest, _ in merged])
    class_of = np.searchsorted(starts, sizes, side="right") - 1
    return Holes(cells, tuple(merged), class_of)
