"""Gradient noise with exact gradients, and sums of it: the stuff of procedural terrain.

All of it is a pure function of a seed and a place: no tables, the same bits on every machine.

``perlin(x, y, *, seed=0)``, ``ridged(x, y, *, seed=0)``
    Values of one noise on the unit lattice; ``with_gradient=True`` gives `NoiseJoint`.
``ridged_multifractal(x, y, *, seed=0, octaves=6, lacunarity=2.0, gain=0.5)``
    Musgrave's sum.
``NoiseSums(families, seeds, amplitudes, wavelengths)``
    ``n`` sums of up to 8 noises each, as arrays ``(n,), (n,), (n, terms), (n, terms)``;
    ``len(sums)``; ``sums[indices]`` for some of them;
    ``sums.values(x, y, *, resolution=0.0, threads=None, progress=SILENT)`` is ``(n, points)``
    float32 for 1-D ``x, y`` in the units of the wavelengths;
    ``sums.joint(i, x, y, *, resolution=0.0)`` is the `NoiseJoint` of one, float64;
    ``sums.lipschitz()`` and ``sums.bounds()`` per sum; ``NoiseSums.joined(several)``.
``FAMILIES``
    ``("perlin", "ridged", "multifractal")``; a family is its index in this tuple.
"""

from demsmith.core.noise.gradient import (
    PERLIN_LIPSCHITZ,
    NoiseJoint,
    perlin,
    ridged,
)
from demsmith.core.noise.sums import FAMILIES, MOST_TERMS, NoiseSums, ridged_multifractal

__all__ = [
    "FAMILIES",
    "MOST_TERMS",
    "PERLIN_LIPSCHITZ",
    "NoiseJoint",
    "NoiseSums",
    "perlin",
    "ridged",
    "ridged_multifractal",
]
