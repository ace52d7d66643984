"""The atoms of a patch lattice: sampled shapes, functions, or both kinds mixed."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.noise import NoiseSums
from demsmith.core.sparse import FunctionAtoms
from demsmith.core.sparse.patch_tree import extended
from demsmith.core.trees.bicubic import bicubic_limits


@dataclass(frozen=True, eq=False)
class Atoms:
    """Shapes on the disc of radius 1 (``u`` to the east, ``v`` to the south), in their order.

    Parameters
    ----------
    samples : (D, rows, columns) array of float32, optional
        Data-based atoms: samples at the centres of the cells of the square round the disc,
        interpolated bicubically.
    functions : NoiseSums, optional
        Function-based atoms before they are made of zero mean and unit norm; wavelengths in
        radii.
    means, norms : (F,) array of float
        An atom is its function less ``means``, divided by ``norms``.
    kinds : (N,) array of int, optional
        Of each atom, its index among the samples, or −1 less its index among the functions.
        Default: all samples, then all functions.

    Raises
    ------
    InputError
        If shapes do not fit, an index is none, a number is not finite or a norm not positive.
    """

    samples: np.ndarray | None = None
    functions: NoiseSums | None = None
    means: np.ndarray = ()
    norms: np.ndarray = ()
    kinds: np.ndarray | None = None

    def __post_init__(self):
        """Check, and bring to arrays, what was given."""
        samples = np.zeros((0, 1, 1), np.float32) if self.samples is None else self.samples
        samples = np.ascontiguousarray(samples, np.float32)
        means, norms = (
            np.asarray(each, np.float64).reshape(-1) for each in (self.means, self.norms)
        )
        functions = 0 if self.functions is None else len(self.functions)
        if samples.ndim != 3 or 0 in samples.shape[1:]:
            raise InputError(f"samples of shape {samples.shape} are no (atoms, rows, columns)")
        if not means.size == norms.size == functions:
            raise InputError(f"{functions} functions have {means.size} means, {norms.size} norms")
        if self.kinds is None:
            kinds = np.concatenate([np.arange(len(samples)), -1 - np.arange(functions)])
        else:
            kinds = np.asarray(self.kinds).astype(np.int64).reshape(-1)
        if not kinds.size or kinds.max() >= len(samples) or kinds.min() < -functions:
            raise InputError("an atom is none of the samples and functions")
        if not (np.isfinite(samples).all() and np.isfinite(means).all()):
            raise InputError("an atom is not finite")
        if not np.all((norms > 0) & (norms < np.inf)):
            raise InputError("the norm of an atom is not positive")
        for name, array in (("samples", samples), ("means", means), ("norms", norms),
                            ("kinds", kinds.astype(np.int64))):  # fmt: skip
            object.__setattr__(self, name, array)

    @classmethod
    def of_dictionary(cls, dictionary):
        """Make the atoms of a `Dictionary`: its functions as such, all others by their samples.

        Beyond its disc a sampled atom goes on as it is at the rim, for interpolation there.
        """
        disc = dictionary.disc
        kinds, functions, first, made = np.arange(len(dictionary)), [], 0, []
        for part in dictionary.parts:
            if isinstance(part, FunctionAtoms):
                before = sum(map(len, functions))
                kinds[first : first + len(part)] = -1 - before - np.arange(len(part))
                functions.append(part.sums)
                values, _ = part.made(*disc.shape, 1, slice(None))
                made.append(values[:, disc].astype(np.float64))
            first += len(part)
        samples = extended(dictionary.samples, disc).reshape(-1, *disc.shape)
        if not functions:
            return cls(samples, kinds=kinds)
        values = np.concatenate(made)
        norms = values.std(axis=1)
        norms[norms == 0] = 1.0
        return cls(samples, NoiseSums.joined(functions), values.mean(axis=1), norms, kinds)

    def __len__(self):
        return self.kinds.size

    def packed(self):
        """Give kinds, samples and functions as the kernels take them."""
        if self.functions is None:
            none, empty = np.zeros(0, np.int64), np.zeros((0, 1))
            functions = none, none, empty, empty
        else:
            sums = self.functions
            functions = sums.families, sums.seeds, sums.amplitudes, sums.wavelengths
        return self.kinds, self.samples, *functions, self.means, self.norms

    @cached_property
    def limits(self):
        """Bounds of each atom: low, high, and its slope along ``u`` and along ``v``; (4, N)."""
        rows, columns = self.samples.shape[1:]
        low, high, by_v, by_u = bicubic_limits(self.samples)
        sampled = np.stack([low, high, by_u * columns / 2, by_v * rows / 2])
        if self.functions is None:
            return sampled[:, self.kinds]
        lows, highs = self.functions.bounds()
        slopes = self.functions.lipschitz()
        made = np.stack([lows - self.means, highs - self.means, slopes, slopes]) / self.norms
        # −1 − n counts functions from the end.
        return np.concatenate([sampled, made[:, ::-1]], axis=1)[:, self.kinds]
