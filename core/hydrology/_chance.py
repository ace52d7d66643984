"""Chance by counting: random numbers that depend on a key alone, whoever asks for them and when."""

import math

import numba
import numpy as np

_jit = numba.njit(nogil=True, cache=True, error_model="numpy")

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_PER_STEP = 2.0**-53


@_jit
def mix(bits):
    """Turn 64 bits into others that look unrelated: the finaliser of SplitMix64.

    References
    ----------
    Steele, G. L., Lea, D. and Flood, C. H. (2014), Fast splittable pseudorandom number generators,
    OOPSLA 2014, 453-472.
    """
    bits = (bits ^ (bits >> np.uint64(30))) * _FIRST
    bits = (bits ^ (bits >> np.uint64(27))) * _SECOND
    return bits ^ (bits >> np.uint64(31))


@_jit
def begin(state, seed, purpose, place):
    """Set the state of a stream that is another for each seed, purpose and place."""
    bits = mix(np.uint64(seed) * _GOLDEN + np.uint64(purpose))
    state[0] = mix(bits + np.uint64(place) * _GOLDEN)


@_jit
def uniform(state):
    """Draw the next number of a stream, evenly from 0 to below 1."""
    state[0] += _GOLDEN
    return np.float64(mix(state[0]) >> np.uint64(11)) * _PER_STEP


@_jit
def binomial(state, trials, chance):
    """Draw how many of some trials succeed.

    Few are found by adding up probabilities, many by rejection.

    Parameters
    ----------
    state : (1,) uint64 array
    trials : int
    chance : float
        Below 0 it is taken as 0, above 1 as 1.

    References
    ----------
    Kachitvichyanukul, V. and Schmeiser, B. W. (1988), Binomial random variate generation,
    Communications of the ACM 31, 216-222: algorithm BINV.
    Hörmann, W. (1993), The generation of binomial random variates, Journal of Statistical
    Computation and Simulation 46, 101-110: algorithm BTRS.
    """
    if trials == 0 or chance <= 0:
        return 0
    if chance >= 1:
        return trials
    rare = min(chance, 1 - chance)
    successes = _few(state, trials, rare) if trials * rare < 10 else _many(state, trials, rare)
    return successes if chance <= 0.5 else trials - successes


@_jit
def _few(state, trials, chance):
    odds = chance / (1 - chance)
    none = math.exp(trials * math.log1p(-chance))
    while True:
        probability, left = none, uniform(state)
        for successes in range(min(trials, 200) + 1):
            if left <= probability:
                return successes
            left -= probability
            probability *= odds * (trials - successes) / (successes + 1)
        # Beyond what rounding leaves of the sum: draw again.


@_jit
def _many(state, trials, chance):
    odds = chance / (1 - chance)
    deviation = math.sqrt(trials * chance * (1 - chance))
    b = 1.15 + 2.53 * deviation
    a = -0.0873 + 0.0248 * b + 0.01 * chance
    mode = math.floor((trials + 1) * chance)
    while True:
        v = uniform(state)
        u = uniform(state) - 0.5
        margin = 0.5 - abs(u)
        if margin == 0:
            continue
        k = math.floor((2 * a / margin + b) * u + trials * chance + 0.5)
        if margin >= 0.07 and v <= 0.92 - 4.2 / b:
            return np.int64(k)
        if k < 0 or k > trials or v == 0:
            continue
        v = math.log(v * (2.83 + 5.1 / b) * deviation / (a / (margin * margin) + b))
        relative = (
            (mode + 0.5) * math.log((mode + 1) / (odds * (trials - mode + 1)))
            + (trials + 1) * math.log((trials - mode + 1) / (trials - k + 1))
            + (k + 0.5) * math.log(odds * (trials - k + 1) / (k + 1))
            + (_stirling(mode) + _stirling(trials - mode))
            - (_stirling(k) + _stirling(trials - k))
        )
        if v <= relative:
            return np.int64(k)


@_jit
def _stirling(k):
    """Give what Stirling's formula lacks of the logarithm of k's factorial."""
    n = k + 1.0
    if k < 10:
        return math.lgamma(n) - (0.5 * math.log(2 * math.pi) + (k + 0.5) * math.log(n) - n)
    return (1 / 12 - (1 / 360 - 1 / 1260 / (n * n)) / (n * n)) / n
