"""Candidates for function-based atoms: random sums of noises, and their samples over a disc."""

from typing import NamedTuple

import numpy as np

from demsmith.core.noise import NoiseSums
from demsmith.core.progress import SILENT

_COARSEST, _FINEST = 16.0, 1.0
"""Wavelengths of noises, in radii: within a disc, the longest are hardly more than a slope."""

_SAMPLES_A_WAVE = 4
"""Samples that a wavelength must have at least, so that a raster can tell what it is like."""


class Sampled(NamedTuple):
    """Functions over the samples of a disc, made of zero mean and unit norm.

    Attributes
    ----------
    samples : (N, K) ndarray of float32
        Root mean square 1 over the disc, 0 outside of it; all 0 for a function that is flat.
    means, norms : (N,) ndarray of float64
        What was taken off, and what it was then divided by.
    """

    samples: np.ndarray
    means: np.ndarray
    norms: np.ndarray


def random_functions(count, *, families, terms, grid, seed):
    """Draw sums of noises.

    All orders of wavelengths are as likely; amplitudes are normally distributed, of either sign,
    and fall in proportion to the wavelength, as those of terrain roughly do.

    Parameters
    ----------
    count : int
    families : sequence of int
        Indices in `demsmith.core.noise.FAMILIES`, taken in turn.
    terms : int
        Noises of a sum.
    grid : PatchGrid
        What the discs' samples can tell: no wavelength is shorter than four of them.
    seed : int

    Returns
    -------
    NoiseSums
        Wavelengths in radii, the longest of a sum first. What is drawn does not depend on the
        families, so that these can be compared.
    """
    rng = np.random.default_rng(seed)
    shortest = _SAMPLES_A_WAVE * 2 / min(grid.side_rows, grid.side_columns)
    finest = min(max(_FINEST, shortest), _COARSEST)
    seeds = rng.integers(0, 1 << 48, count)
    wavelengths = np.exp(rng.uniform(np.log(finest), np.log(_COARSEST), (count, terms)))
    wavelengths = -np.sort(-wavelengths, axis=1)
    amplitudes = rng.normal(size=(count, terms)) * wavelengths / wavelengths[:, :1]
    return NoiseSums(np.resize(families, count), seeds, amplitudes, wavelengths)


def sampled(sums, grid, *, threads=None, progress=SILENT):
    """Sample functions at the cells of a disc.

    Parameters
    ----------
    sums : NoiseSums
    grid : PatchGrid
    threads : int, optional
    progress : Progress

    Returns
    -------
    Sampled
    """
    v = (np.arange(grid.side_rows) + 0.5) * (2 / grid.side_rows) - 1
    u = (np.arange(grid.side_columns) + 0.5) * (2 / grid.side_columns) - 1
    places = np.tile(u, grid.side_rows), np.repeat(v, grid.side_columns)
    values = sums.values(*places, threads=threads, progress=progress).astype(np.float64)
    disc = grid.disc.ravel()
    means = values[:, disc].mean(axis=1)
    values = np.where(disc, values - means[:, None], 0.0)
    norms = np.sqrt(np.square(values).sum(axis=1) / disc.sum())
    flat = norms < 1e-6 * np.abs(sums.amplitudes).sum(axis=1)
    norms[flat] = 1.0
    values[flat] = 0.0
    return Sampled((values / norms[:, None]).astype(np.float32), means, norms)
