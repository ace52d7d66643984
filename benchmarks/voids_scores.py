"""Errors of every way of filling on every mask, pooled and compared.

The slow peers did not do every mask. A peer is always compared with Demsmith on the masks which
that peer did, and only where these have 20 holes or more of the size class.
"""

import functools
import operator
from typing import NamedTuple

import numpy as np
from voids_masks import KINDS, SEEDS, mask, tile
from voids_peers import QUICK, SLOW, kept_tallies

import demsmith
from demsmith.core.options import specifications
from demsmith.core.validation.scoring import Holes
from demsmith.core.voids import FillOptions

PEERS = (*QUICK, *SLOW)
FEWEST_HOLES = 20


def engines():
    """List Demsmith's own ways of filling (``--method``)."""
    (method,) = (each for each in specifications(FillOptions) if each.name == "method")
    return method.choices


class Case(NamedTuple):
    """A mask: on what tile, of what kind, from what seed."""

    name: str
    kind: str
    seed: int


class Scores:
    """Tallies by method and mask.

    Parameters
    ----------
    names : sequence of str
        Tiles.
    """

    def __init__(self, names):
        self.names = tuple(names)
        self._tallies = {method: {} for method in (*PEERS, *engines())}
        for name in names:
            for kind in KINDS:
                for seed in SEEDS:
                    self._fill(Case(name, kind, seed))

    def _fill(self, case):
        ground, void = tile(case.name), mask(*case)
        holes = Holes(ground.values, void, pixel_size=ground.pixel_size)
        for peer, fill in QUICK.items():
            self._tallies[peer][case] = holes.tally(fill(ground, void))
        for peer, tally in kept_tallies(ground, void).items():
            self._tallies[peer][case] = tally
        holed = np.where(void, 0, ground.values)
        for engine in engines():
            filled = demsmith.fill_voids(holed, void, pixel_size=ground.pixel_size, method=engine)
            self._tallies[engine][case] = holes.tally(filled.values, filled.sigma)

    def cases(self, *methods, name=None, kind=None):
        """List the masks that all these methods did, of a tile or kind or of all."""
        return [
            case
            for case in self._tallies[methods[0]]
            if name in (None, case.name)
            and kind in (None, case.kind)
            and all(case in self._tallies[method] for method in methods)
        ]

    def errors(self, method, cases):
        """Give a `SizeError` by class and for all voids, pooled over masks; None without masks."""
        if not cases:
            return None
        tallies = (self._tallies[method][case] for case in cases)
        return functools.reduce(operator.add, tallies).errors()

    def ratio(self, engine, size, measure="rmse", **which):
        """Divide an engine's error by that of the best peer.

        Parameters
        ----------
        engine : str
        size : int
            Number of the size class.
        measure : str
            Attribute of `SizeError`.
        **which
            Tile and kind of mask, see `cases`.

        Returns
        -------
        float
            The largest of the ratios to all peers; NaN if there are too few holes.
        """
        return max(self._ratios(engine, size, measure, which), default=float("nan"))

    def _ratios(self, engine, size, measure, which):
        for peer in PEERS:
            cases = self.cases(peer, engine, **which)
            if not cases:
                continue
            ours, theirs = (self.errors(method, cases)[size] for method in (engine, peer))
            if ours.voids >= FEWEST_HOLES:
                yield getattr(ours, measure) / getattr(theirs, measure)
