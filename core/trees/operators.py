"""Operators of construction trees: nodes that put other nodes together.

J.-D. Génevaux et al., *Terrain modelling from feature primitives*, Computer Graphics Forum 34
(2015), §4 and §7.3.
"""

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.trees.node import FULL, NOTHING, Bounds, Joint, JointNode, Limits

THRESHOLD = 0.5
"""Weight from which on there is terrain."""


class _Operator(JointNode):
    """A node over others, its children."""

    def __init__(self, children):
        self.children = tuple(children)
        if not self.children:
            raise InputError(f"{type(self).__name__} needs at least one node below it")
        self._boxes = np.array([child.bounds() for child in self.children])

    def _reaching(self, bounds):
        """List the children whose bounds meet a rectangle."""
        xmin, ymin, xmax, ymax = self._boxes.T
        meet = (
            (xmin <= bounds.xmax) & (bounds.xmin <= xmax)
            & (ymin <= bounds.ymax) & (bounds.ymin <= ymax)
        )  # fmt: skip
        return [self.children[i] for i in np.flatnonzero(meet)]


class Blend(_Operator):
    """The mean of nodes by their weights: ``f = Σ α f / Σ α``, ``α = Σ α``.

    Parameters
    ----------
    *children : Node

    Raises
    ------
    InputError
        If there is none.
    """

    def __init__(self, *children):
        super().__init__(children)

    def bounds(self):
        """Give the rectangle round all children."""
        return Bounds(
            *(float(side) for side in self._boxes[:, :2].min(axis=0)),
            *(float(side) for side in self._boxes[:, 2:].max(axis=0)),
        )

    def joint(self, x, y, *, detail=FULL):
        """Give elevation and weight with their gradients."""
        parts = [child.joint(x, y, detail=detail) for child in self.children]
        weight = sum(part.weight for part in parts)
        safe = np.where(weight > 0, weight, 1.0)
        elevation = sum(part.weight * part.elevation for part in parts) / safe

        def slope(gradient, weight_gradient):
            total = sum(
                part.weight * part[gradient] + part[weight_gradient] * (part.elevation - elevation)
                for part in parts
            )
            return np.where(weight > 0, total / safe, 0.0)

        return Joint(
            elevation, weight, slope(2, 4), slope(3, 5),
            sum(part.weight_x for part in parts), sum(part.weight_y for part in parts),
        )  # fmt: skip

    def limits(self, bounds):
        """Bound elevation, weight and slopes.

        The slope is at most ``max λ_i + m · sup|f_i − f_j| / inf Σα`` with ``m`` the lesser of
        ``(n − 1) · max λ_αi`` and ``Σ λ_αi``, where there is terrain (``Σα ≥ 1/2``) or the
        weights are known to be more. The printed bound lacks the weights' slope: two discs 1.2
        radii apart break it. Proof: ``∇f = Σ α_i ∇f_i / Σα + Σ_{i<j} (f_i − f_j)
        (α_j ∇α_i − α_i ∇α_j) / (Σα)²``.
        """
        parts = [child.limits(bounds) for child in self._reaching(bounds)]
        parts = [part for part in parts if part.weight_high > 0]
        if not parts:
            return NOTHING
        low, high = min(part.low for part in parts), max(part.high for part in parts)
        weight_low = sum(part.weight_low for part in parts)
        lipschitz = max(part.lipschitz for part in parts)
        slopes = [part.weight_lipschitz for part in parts]
        if len(parts) > 1 and high > low and max(slopes) > 0:
            mixing = min((len(parts) - 1) * max(slopes), sum(slopes))
            lipschitz += (high - low) * mixing / max(weight_low, THRESHOLD)
        return Limits(
            low, high, lipschitz,
            weight_low, sum(part.weight_high for part in parts), sum(slopes),
        )  # fmt: skip

    def within(self, bounds):
        """Give the blend of the children that reach a rectangle, each itself pruned to it."""
        parts = [child.within(bounds) for child in self._reaching(bounds)]
        parts = [part for part in parts if part is not None]
        if len(parts) == 1:
            return parts[0]
        return Blend(*parts) if parts else None


class Add(_Operator):
    """A node on top of another: ``f = f_A + α_B f_B`` with ``α_B`` at most 1.

    Parameters
    ----------
    base : Node
        ``A``; where it has no weight, there is nothing.
    added : Node
        ``B``, whose elevations are heights above ``A``.
    widen : bool
        The weight is ``α_A + α_B²`` instead of ``α_A``.
    """

    def __init__(self, base, added, *, widen=False):
        super().__init__((base, added))
        self.widen = widen

    def bounds(self):
        """Give the bounds of the base, or of both if the weight is widened."""
        base, added = (child.bounds() for child in self.children)
        return base.joined(added) if self.widen else base

    def joint(self, x, y, *, detail=FULL):
        """Give elevation and weight with their gradients."""
        a, b = (child.joint(x, y, detail=detail) for child in self.children)
        share = np.minimum(b.weight, 1.0)
        inside = b.weight < 1
        share_x, share_y = np.where(inside, b.weight_x, 0.0), np.where(inside, b.weight_y, 0.0)
        weight, weight_x, weight_y = a.weight, a.weight_x, a.weight_y
        if self.widen:
            weight = weight + share * share
            weight_x, weight_y = weight_x + 2 * share * share_x, weight_y + 2 * share * share_y
        there = weight > 0
        return Joint(
            np.where(there, a.elevation + share * b.elevation, 0.0),
            weight,
            np.where(there, a.gradient_x + share * b.gradient_x + share_x * b.elevation, 0.0),
            np.where(there, a.gradient_y + share * b.gradient_y + share_y * b.elevation, 0.0),
            weight_x,
            weight_y,
        )

    def limits(self, bounds):
        """Bound elevation, weight and slopes: ``λ ≤ λ_A + sup α_B λ_B + sup|f_B| λ_αB``."""
        a, b = (child.limits(bounds) for child in self.children)
        if not (self.widen or a.weight_high > 0):
            return NOTHING
        if b.weight_high <= 0:
            return a
        most, height = min(b.weight_high, 1.0), max(abs(b.low), abs(b.high))
        tallest = [share * edge for share in (min(b.weight_low, 1.0), most)
                   for edge in (b.low, b.high)]  # fmt: skip
        lipschitz = a.lipschitz + most * b.lipschitz
        if height > 0:
            lipschitz += height * b.weight_lipschitz
        return Limits(
            a.low + min(tallest),
            a.high + max(tallest),
            lipschitz,
            a.weight_low + (min(b.weight_low, 1.0) ** 2 if self.widen else 0.0),
            a.weight_high + (most**2 if self.widen else 0.0),
            a.weight_lipschitz + (2 * most * b.weight_lipschitz if self.widen else 0.0),
        )

    def within(self, bounds):
        """Give the same of what reaches a rectangle; the base alone where nothing is added."""
        base, added = (child.within(bounds) for child in self.children)
        if added is None:
            return base
        if base is None:
            # Widened, the added node makes terrain of its own: it needs the empty base's place.
            return self if self.widen else None
        return Add(base, added, widen=self.widen)
