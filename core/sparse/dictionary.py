"""Dictionaries: atoms of several kinds and sources, sampled on the block round a disc.

An atom is sampled terrain, learned or given (`SampledAtoms`); a disc of an exemplar, kept as its
place in it (`CutAtoms`); or a function, kept as its parameters (`FunctionAtoms`). A dictionary is
a sequence of them, and may have a finer twin of every atom: it is of two resolutions then.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.sparse.atoms import MADE_AT_ONCE, CutAtoms, FunctionAtoms, SampledAtoms
from demsmith.core.sparse.patches import LARGEST_SIDE, disc_weights

LARGEST_FACTOR = 64
"""Cells of the finer resolution along one of the coarser, at most."""

MOST_SAMPLES = 1 << 28
"""Samples of all atoms together, at most (1 GB)."""


@dataclass(frozen=True, eq=False)
class Dictionary:
    """Atoms of one or several kinds and sources, for discs of one size in cells.

    Parameters
    ----------
    side_rows, side_columns : int
        Cells across a disc.
    parts : tuple of SampledAtoms, CutAtoms or FunctionAtoms
        The atoms are theirs in this order.
    factor : int
        Cells of the finer resolution along one of these; 1 if there is no finer one.
    cell_size : (float, float), optional
        Ground metres from cell to cell, east-west and north-south, of the exemplars.

    Raises
    ------
    InputError
        If there are no atoms, shapes do not fit, or a number is out of range.

    Examples
    --------
    >>> ground = np.arange(600, dtype=np.float32).reshape(20, 30) ** 1.5
    >>> places = np.array([[0, 0, 0], [0, 5, 12]])
    >>> dictionary = Dictionary(10, 10, (CutAtoms((ground,), ("ground",), places),))
    >>> dictionary.samples.shape, dictionary.provenance(1)
    ((2, 100), Provenance(kind='patch', exemplar='ground', row=5, column=12, function=None))
    """

    side_rows: int
    side_columns: int
    parts: tuple
    factor: int = 1
    cell_size: tuple | None = None

    def __post_init__(self):
        """Check what was given."""
        object.__setattr__(self, "parts", tuple(self.parts))
        for name, value, most in (
            ("side_rows", self.side_rows, LARGEST_SIDE),
            ("side_columns", self.side_columns, LARGEST_SIDE),
            ("factor", self.factor, LARGEST_FACTOR),
        ):
            if not 1 <= value <= most:
                raise InputError(f"{name} is {value}; it must be in 1 to {most}")
        if not any(len(part) for part in self.parts):
            raise InputError("a dictionary needs at least one atom")
        if len(self) * self.side_rows * self.side_columns > MOST_SAMPLES:
            raise InputError(
                f"{len(self)} atoms of {self.side_rows} by {self.side_columns} samples are more "
                f"than the {MOST_SAMPLES} samples a dictionary may have"
            )
        for part in self.parts:
            if isinstance(part, SampledAtoms):
                self._check_sampled(part)
            elif isinstance(part, CutAtoms):
                self._check_cut(part)
            elif not isinstance(part, FunctionAtoms):
                raise InputError(f"{type(part).__name__} is no kind of atoms")

    def _check_sampled(self, part):
        for name, samples, factor in (("low", part.low, 1), ("high", part.high, self.factor)):
            if name == "high" and self.factor == 1:
                continue
            needed = len(part), factor * self.side_rows, factor * self.side_columns
            if samples is None or samples.shape != needed:
                shape = None if samples is None else samples.shape
                raise InputError(f"{name} has shape {shape}; it must be {needed}")
            if not np.isfinite(samples).all():
                raise InputError("an atom has samples that are not finite")
        if part.origins is not None:
            _check_origins(part.origins, len(part), len(part.names))

    def _check_cut(self, part):
        if len(part.names) != len(part.exemplars):
            raise InputError(f"{len(part.exemplars)} exemplars have {len(part.names)} names")
        _check_origins(part.origins, len(part), len(part.exemplars))
        block = self.factor * self.side_rows, self.factor * self.side_columns
        shapes = np.array([np.shape(values) for values in part.exemplars]).reshape(-1, 2)
        ends = part.origins[:, 1:] + block
        if (ends > shapes[part.origins[:, 0]]).any():
            raise InputError("an atom reaches beyond its exemplar")

    @classmethod
    def of_samples(cls, samples, side_rows, side_columns):
        """Make a dictionary of vectors of a block's samples, (N, side_rows * side_columns)."""
        samples = np.asarray(samples, np.float32)
        if samples.ndim != 2 or samples.shape[1] != side_rows * side_columns:
            raise InputError(
                f"samples of shape {samples.shape} are none of blocks of {side_rows} by "
                f"{side_columns}"
            )
        blocks = samples.reshape(-1, side_rows, side_columns)
        return cls(side_rows, side_columns, (SampledAtoms(blocks),))

    @classmethod
    def joined(cls, dictionaries):
        """Mix several dictionaries in one; pursuit takes what fits from any.

        Raises
        ------
        InputError
            If their discs or factors differ.
        """
        first, *others = dictionaries = list(dictionaries)
        for other in others:
            for name in ("side_rows", "side_columns", "factor"):
                if getattr(first, name) != getattr(other, name):
                    raise InputError(
                        f"dictionaries of {name} {getattr(first, name)} and "
                        f"{getattr(other, name)} cannot be joined; resample one"
                    )
        parts = [part for dictionary in dictionaries for part in dictionary.parts]
        return cls(first.side_rows, first.side_columns, parts, first.factor, first.cell_size)

    def __len__(self):
        return sum(len(part) for part in self.parts)

    @cached_property
    def disc(self):
        """Whether a block's samples lie in the disc, bool (side_rows, side_columns)."""
        return disc_weights(self.side_rows, self.side_columns) > 0

    @cached_property
    def samples(self):
        """Give all atoms, (N, side_rows * side_columns) float32.

        Over the disc their mean is 0 and their root mean square 1; outside they are 0. An atom
        that is flat is 0.
        """
        return np.concatenate(
            [
                self._made(part, part_slice, fine=False)
                for part in self.parts
                for part_slice in self._slices(part)
            ]
        )

    def high(self, indices=None):
        """Give some atoms at the finer resolution.

        Both resolutions have the mean over the disc taken off and are divided by the root mean
        square of the coarser, so that a coefficient found at one serves the other.

        Parameters
        ----------
        indices : (m,) int array, optional
            Default: all.

        Returns
        -------
        (m, factor * side_rows * factor * side_columns) float32 array
        """
        if self.factor == 1:
            raise InputError("this dictionary has one resolution")
        indices = np.arange(len(self)) if indices is None else np.asarray(indices)
        size = self.factor**2 * self.side_rows * self.side_columns
        found = np.empty((indices.size, size), np.float32)
        first = 0
        for part in self.parts:
            mine = np.flatnonzero((indices >= first) & (indices < first + len(part)))
            step = self._step()
            for begin in range(0, mine.size, step):
                some = mine[begin : begin + step]
                found[some] = self._made(part, indices[some] - first, fine=True)
            first += len(part)
        return found

    def _step(self):
        return max(1, MADE_AT_ONCE // (self.factor**2 * self.side_rows * self.side_columns))

    def _slices(self, part):
        step = self._step()
        return [slice(begin, begin + step) for begin in range(0, len(part), step)]

    def _made(self, part, indices, *, fine):
        low, high = part.made(self.side_rows, self.side_columns, self.factor, indices)
        low, norms = _normalised(low, self.disc)
        if not fine:
            return low
        disc = disc_weights(self.factor * self.side_rows, self.factor * self.side_columns) > 0
        return _normalised(high, disc, norms)[0]

    def provenance(self, index):
        """Tell where an atom comes from.

        Returns
        -------
        Provenance
        """
        place = range(len(self))[index]
        for part in self.parts:
            if place < len(part):
                return part.provenance(place)
            place -= len(part)
        raise IndexError(index)

    def resampled(self, side_rows, side_columns):
        """Give the same atoms for discs of other numbers of cells.

        Sampled ones are interpolated bicubically, and smoothed before where cells grow; functions
        are exact.
        """
        old = self.side_rows, self.side_columns
        if old == (side_rows, side_columns):
            return self
        parts = [part.resampled(side_rows, side_columns, self.factor, old) for part in self.parts]
        size = self.cell_size and (
            self.cell_size[0] * old[1] / side_columns, self.cell_size[1] * old[0] / side_rows
        )  # fmt: skip
        return Dictionary(side_rows, side_columns, parts, self.factor, size)


def _normalised(blocks, disc, norms=None):
    """Give vectors of mean 0 over the disc, divided by ``norms``, and these.

    ``norms`` None: their own root mean squares over the disc.
    """
    inside = disc.ravel()
    vectors = blocks.reshape(len(blocks), -1).astype(np.float64)
    vectors -= vectors[:, inside].mean(axis=1, keepdims=True)
    vectors[:, ~inside] = 0
    if norms is None:
        largest = np.abs(vectors).max(axis=1, keepdims=True)  # squares might overflow
        scaled = np.divide(vectors, largest, out=np.zeros_like(vectors), where=largest > 0)
        norms = largest * np.sqrt((scaled**2).sum(axis=1, keepdims=True) / inside.sum())
    found = np.divide(vectors, norms, out=np.zeros_like(vectors), where=norms > 1e-30)
    return found.astype(np.float32), norms


def _check_origins(origins, atoms, exemplars):
    if origins.shape != (atoms, 3):
        raise InputError(f"origins has shape {origins.shape} for {atoms} atoms")
    if origins.size and (origins.min() < 0 or origins[:, 0].max() >= exemplars):
        raise InputError("an atom's place is in none of the exemplars")
