"""Sums of noises of several wavelengths: the shapes of function-based atoms and of terrain."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.noise.gradient import PERLIN_LIPSCHITZ, given, in_blocks, points
from demsmith.core.parallel import run
from demsmith.core.progress import SILENT

FAMILIES = ("perlin", "ridged", "multifractal")
"""Kinds of sums, by their number."""

MOST_TERMS = 8
"""Terms that a sum may have: with amplitude and wavelength each, 16 coefficients."""

_MULTIFRACTAL = FAMILIES.index("multifractal")
_POINTS_A_TASK = 1 << 17


@dataclass(frozen=True, eq=False)
class NoiseSums:
    """Some sums of noises, each ``Σ a_t · noise_t(p / w_t)``.

    Every term has a rotation and a shift of its own, by the sum's seed, so that the sums are not
    tied to one lattice. In family ``perlin`` the noises are `perlin`, in ``ridged`` they are
    `ridged`; in ``multifractal`` (Musgrave's ridged multifractal) they are the squares of
    `ridged`, each multiplied by the twofold of the one before it, at most 1, so that valleys stay
    smooth. Order therefore matters there: coarse terms come first.

    Parameters
    ----------
    families : (n,) array of int
        Index in `FAMILIES`.
    seeds : (n,) array of int
        0 to 2⁴⁸ − 1.
    amplitudes : (n, terms) array of float
        A term of amplitude 0 is left out.
    wavelengths : (n, terms) array of float
        Positive, in the units of the points. At most `MOST_TERMS` terms.

    Raises
    ------
    InputError
        If shapes do not fit, or a number is out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> hills = NoiseSums([1, 0], [7, 7], [[1, 0.5], [1, 0]], [[2, 1], [2, 1]])
    >>> hills.values(np.linspace(0, 1, 5), np.zeros(5)).shape
    (2, 5)
    """

    families: np.ndarray
    seeds: np.ndarray
    amplitudes: np.ndarray
    wavelengths: np.ndarray

    def __post_init__(self):
        """Check, and bring to arrays, what was given."""
        with np.errstate(invalid="ignore"):
            families = np.asarray(self.families).astype(np.int64).reshape(-1)
            seeds = np.asarray(self.seeds).astype(np.int64).reshape(-1)
        amplitudes = np.array(self.amplitudes, np.float64, ndmin=2)
        wavelengths = np.array(self.wavelengths, np.float64, ndmin=2)
        _check(families, seeds, amplitudes, wavelengths)
        for name, array in (("families", families), ("seeds", seeds),
                            ("amplitudes", amplitudes), ("wavelengths", wavelengths)):  # fmt: skip
            object.__setattr__(self, name, np.ascontiguousarray(array))

    @classmethod
    def joined(cls, several):
        """Make one of several; sums of fewer terms get terms of amplitude 0."""
        several = list(several)
        terms = max(sums.amplitudes.shape[1] for sums in several)

        def widened(array, value):
            return np.pad(array, ((0, 0), (0, terms - array.shape[1])), constant_values=value)

        return cls(
            np.concatenate([sums.families for sums in several]),
            np.concatenate([sums.seeds for sums in several]),
            np.concatenate([widened(sums.amplitudes, 0.0) for sums in several]),
            np.concatenate([widened(sums.wavelengths, 1.0) for sums in several]),
        )

    def __len__(self):
        return self.families.size

    def __getitem__(self, indices):
        """Give some of the sums, by an index array or a slice."""
        return NoiseSums(
            self.families[indices], self.seeds[indices],
            self.amplitudes[indices], self.wavelengths[indices],
        )  # fmt: skip

    def values(self, x, y, *, resolution=0.0, threads=None, progress=SILENT):
        """Give all sums at points.

        Parameters
        ----------
        x, y : (points,) array_like of float
        resolution : float
            Distance between samples: terms fade out from a wavelength of four of them to two, so
            that none is sampled too thinly. 0 keeps all.
        threads : int, optional
            Default: one for each core. The result does not depend on it.
        progress : Progress

        Returns
        -------
        (n, points) ndarray of float32
        """
        from demsmith.core.noise._sums import fill_values

        x, y, _ = points(x, y)
        values = np.empty((len(self), x.size), np.float32)
        step = max(1, _POINTS_A_TASK // max(1, x.size * self.amplitudes.shape[1]))

        def task(start):
            fill_values(
                self.families, self.seeds, self.amplitudes, self.wavelengths, x, y,
                float(resolution), start, min(start + step, len(self)), values,
            )  # fmt: skip

        tasks = [lambda start=start: task(start) for start in range(0, len(self), step)]
        run(tasks, threads=threads, progress=progress)
        return values

    def joint(self, index, x, y, *, resolution=0.0, threads=None, progress=SILENT):
        """Give one sum at points, with its exact gradient.

        Parameters
        ----------
        index : int
        x, y, resolution, threads, progress
            As in `values`; the points may have any shape.

        Returns
        -------
        NoiseJoint
        """
        from demsmith.core.noise._sums import fill_joint

        x, y, shape = points(x, y)
        joint = np.empty((3, x.size))
        index = range(len(self))[index]
        packed = self.families, self.seeds, self.amplitudes, self.wavelengths, index
        in_blocks(
            lambda a, b: fill_joint(*packed, x, y, float(resolution), a, b, joint),
            x.size, threads, progress,
        )  # fmt: skip
        return given(joint, shape, with_gradient=True)

    def bounds(self):
        """Give numbers between which each sum stays.

        Returns
        -------
        low, high : (n,) ndarray of float64
        """
        low = np.minimum(self.amplitudes, 0).sum(axis=1)
        high = np.maximum(self.amplitudes, 0).sum(axis=1)
        both_ways = self.families == FAMILIES.index("perlin")
        return np.where(both_ways, low - high, low), np.where(both_ways, high - low, high)

    def lipschitz(self):
        """Bound the slope of each sum, by the noise's (§7.3 of Génevaux et al. 2015).

        The paper divides by the frequencies; they multiply.

        Returns
        -------
        (n,) ndarray of float64
        """
        from demsmith.core.noise._sums import GAIN

        slopes = PERLIN_LIPSCHITZ / self.wavelengths
        multifractal = self.families == _MULTIFRACTAL
        before = np.zeros(len(self))
        for term in range(slopes.shape[1]):
            present = multifractal & (self.amplitudes[:, term] != 0)
            slopes[present, term] = 2 * slopes[present, term] + before[present]
            before[present] = GAIN * slopes[present, term]
        return (np.abs(self.amplitudes) * slopes).sum(axis=1)


def ridged_multifractal(
    x, y, *, seed=0, octaves=6, lacunarity=2.0, gain=0.5, with_gradient=False, threads=None,
    progress=SILENT,
):  # fmt: skip
    """Give Musgrave's ridged multifractal, whose coarsest noise has wavelength 1.

    Parameters
    ----------
    x, y : array_like of float
    seed : int
        0 to 2⁴⁸ − 1.
    octaves : int
        1 to `MOST_TERMS`.
    lacunarity : float
        Ratio of the wavelengths of an octave and the next.
    gain : float
        Ratio of the amplitudes of an octave and the one before.
    with_gradient, threads, progress
        As in `perlin`.

    Returns
    -------
    ndarray of float64, or NoiseJoint
        From 0 on.

    Raises
    ------
    InputError
        If a parameter is out of its range.

    References
    ----------
    F. K. Musgrave in Ebert et al., *Texturing and Modeling*, 1994.

    Examples
    --------
    >>> 0 < float(ridged_multifractal(0.3, 0.4, seed=5)) < 2
    True
    """
    if not 1 <= octaves <= MOST_TERMS:
        raise InputError(f"octaves is {octaves}; it must be from 1 to {MOST_TERMS}")
    if not lacunarity > 0:
        raise InputError(f"lacunarity is {lacunarity}; it must be positive")
    octave = np.arange(octaves)
    sums = NoiseSums(
        [_MULTIFRACTAL], [seed], [float(gain) ** octave], [float(lacunarity) ** -octave]
    )
    joint = sums.joint(0, x, y, threads=threads, progress=progress)
    return joint if with_gradient else joint.value


def _check(families, seeds, amplitudes, wavelengths):
    n, terms = amplitudes.shape
    if not families.size == seeds.size == n or wavelengths.shape != amplitudes.shape:
        raise InputError(
            f"{families.size} families, {seeds.size} seeds, amplitudes of shape "
            f"{amplitudes.shape} and wavelengths of shape {wavelengths.shape} do not go together"
        )
    if terms > MOST_TERMS:
        raise InputError(f"a sum has {terms} terms; it may have {MOST_TERMS}")
    if np.any((families < 0) | (families >= len(FAMILIES))):
        raise InputError(f"a family is none of 0 to {len(FAMILIES) - 1}")
    if np.any((seeds < 0) | (seeds >= 1 << 48)):
        raise InputError("a seed is not between 0 and 2**48 - 1")
    if not np.all(np.isfinite(amplitudes)):
        raise InputError("an amplitude is not finite")
    if not np.all((wavelengths > 1e-12) & (wavelengths < 1e12)):
        raise InputError("a wavelength is not between 1e-12 and 1e12")
