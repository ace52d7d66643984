"""What every node of a construction tree can be asked: the `Node` protocol.

A node is a function of the plane with an elevation and a weight: where the weight is nought it
says nothing. Places are metres east and north in one local frame (`demsmith.core.trees.Frame`).
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from demsmith.core.errors import InputError


class Bounds(NamedTuple):
    """A rectangle of the plane in metres, its edges included.

    Examples
    --------
    >>> Bounds(0, 0, 2, 1).meets(Bounds(1, 1, 3, 3))
    True
    >>> Bounds(0, 0, 2, 1).joined(Bounds(1, 1, 3, 3))
    Bounds(xmin=0, ymin=0, xmax=3, ymax=3)
    """

    xmin: float
    ymin: float
    xmax: float
    ymax: float

    def meets(self, other):
        """Tell whether the two have a point in common."""
        return (
            self.xmin <= other.xmax and other.xmin <= self.xmax
            and self.ymin <= other.ymax and other.ymin <= self.ymax
        )  # fmt: skip

    def holds(self, other):
        """Tell whether the other lies inside this one."""
        return (
            self.xmin <= other.xmin and other.xmax <= self.xmax
            and self.ymin <= other.ymin and other.ymax <= self.ymax
        )  # fmt: skip

    def joined(self, other):
        """Give the smallest rectangle that holds both."""
        return Bounds(
            min(self.xmin, other.xmin), min(self.ymin, other.ymin),
            max(self.xmax, other.xmax), max(self.ymax, other.ymax),
        )  # fmt: skip


class Joint(NamedTuple):
    """All that a node says of some points, in one go.

    Attributes
    ----------
    elevation : ndarray of float64
        Metres; 0 where the weight is 0.
    weight : ndarray of float64
        From 0 on.
    gradient_x, gradient_y : ndarray of float64
        Slope of the elevation towards the east and the north.
    weight_x, weight_y : ndarray of float64
        The same of the weight, per metre: blends need them for their own gradient.
    """

    elevation: np.ndarray
    weight: np.ndarray
    gradient_x: np.ndarray
    gradient_y: np.ndarray
    weight_x: np.ndarray
    weight_y: np.ndarray


class Limits(NamedTuple):
    """Bounds of what a node says within a rectangle, wherever its weight is not nought.

    Attributes
    ----------
    low, high : float
        Of the elevation.
    lipschitz : float
        Of the magnitude of its gradient; may be infinite.
    weight_low, weight_high : float
        Of the weight; ``weight_low`` is 0 unless the node covers the whole rectangle.
    weight_lipschitz : float
        Of the magnitude of the weight's gradient; may be infinite.
    """

    low: float
    high: float
    lipschitz: float
    weight_low: float
    weight_high: float
    weight_lipschitz: float


NOTHING = Limits(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Limits where a node has no weight."""


@dataclass(frozen=True, kw_only=True)
class Detail:
    """How much detail is asked for.

    Parameters
    ----------
    atoms : int, optional
        Atoms of each patch to add to its mean, at most; default: all.
    resolution : float
        Metres between the places that will be looked at: what is too fine for them fades out.
        0 asks for all.

    Raises
    ------
    InputError
        If a number is negative or not finite.
    """

    atoms: int | None = None
    resolution: float = 0.0

    def __post_init__(self):
        """Check the numbers."""
        if self.atoms is not None and self.atoms < 0:
            raise InputError(f"atoms is {self.atoms}; it must be 0 or more")
        if not 0 <= self.resolution < np.inf:
            raise InputError(f"resolution is {self.resolution}; it must be 0 or more metres")


FULL = Detail()
"""Every detail there is."""


@runtime_checkable
class Node(Protocol):
    """A function of the plane: elevation, weight, their gradients, and bounds of them.

    ``x`` and ``y`` are arrays of one shape, metres in the local frame; results have that shape.
    """

    def elevation(self, x, y, *, detail=FULL):
        """Give the elevations at points, 0 where the weight is 0."""

    def weight(self, x, y, *, detail=FULL):
        """Give the weights at points."""

    def joint(self, x, y, *, detail=FULL) -> Joint:
        """Give elevation and weight with their gradients, exact where they have one."""

    def bounds(self) -> Bounds:
        """Give a rectangle outside of which the weight is 0."""

    def limits(self, bounds: Bounds) -> Limits:
        """Bound elevation, weight and their slopes within a rectangle."""

    def lipschitz(self, bounds: Bounds) -> float:
        """Bound the slope of the elevation within a rectangle; may be infinite."""

    def within(self, bounds: Bounds):
        """Give a node that says the same within a rectangle and may say less outside it.

        It is cheaper to ask: what does not reach the rectangle is left out. None if nothing does.
        """


class JointNode:
    """Base of nodes: all a `Node` can be asked that follows from `joint`, `bounds`, `limits`."""

    def elevation(self, x, y, *, detail=FULL):
        """Give the elevations at points, 0 where the weight is 0."""
        return self.joint(x, y, detail=detail).elevation

    def weight(self, x, y, *, detail=FULL):
        """Give the weights at points."""
        return self.joint(x, y, detail=detail).weight

    def lipschitz(self, bounds):
        """Bound the slope of the elevation within a rectangle; may be infinite."""
        return self.limits(bounds).lipschitz

    def within(self, bounds):
        """Give this node, or None where it does not reach the rectangle."""
        return self if self.bounds().meets(bounds) else None
