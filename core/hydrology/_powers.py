"""Functions of many numbers in single precision, as plain arithmetic.

The C library's take one number at a time and tens of nanoseconds; the compiler makes of these a
few vector instructions for eight or sixteen numbers.
"""

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_jit = numba.njit(nogil=True, cache=True, error_model="numpy")

# Coefficients, lowest first, fitted for the least relative error:
# log2(1 + t) / t for 1 + t from √½ to √2, to 1.7e-7;
_LOG = tuple(
    np.float32(c)
    for c in (
        1.442694962, -0.721352788, 0.480923238, -0.360239628,
        0.287098812, -0.248877131, 0.234041555, -0.145809785,
    )
)  # fmt: skip
# 2 ** t for t from -½ to ½, to 7.5e-8;
_EXP = tuple(
    np.float32(c)
    for c in (1.0000000717, 0.6931469671, 0.2402211972, 0.0555075061, 0.0096755413, 0.0013276467)
)
# arctan(√t) / √t for t from 0 to 1, to 9.9e-8.
_ARCTAN = tuple(
    np.float32(c)
    for c in (
        0.9999999010, -0.3333199071, 0.1996972325, -0.1401947703,
        0.0991428170, -0.0594862292, 0.0242522836, -0.0046932418,
    )
)  # fmt: skip
# The bits of √½, and those of the mantissa; the exponent begins at bit 23.
_ROOT_HALF, _MANTISSA, _SHIFT = np.int32(0x3F3504F3), np.int32(0x007FFFFF), np.int32(23)
# Adding and taking away 1.5 · 2^23 rounds a small float32 to the nearest whole number.
_ROUNDER = np.float32(12582912.0)
_LEAST = np.float32(2.0**-100)
_LEAST_RESULT = np.float32(-120.0)


@intrinsic
def _bits(typing_context, value):
    """Give the bits of a float32 as an int32."""

    def generate(context, builder, signature, arguments):
        return builder.bitcast(arguments[0], ir.IntType(32))

    return types.int32(types.float32), generate


@intrinsic
def _float(typing_context, bits):
    """Give the float32 that has these bits."""

    def generate(context, builder, signature, arguments):
        return builder.bitcast(arguments[0], ir.FloatType())

    return types.float32(types.int32), generate


@_jit
def raise_all(bases, exponent):
    """Raise numbers from 0 to 1 to a power, in place.

    Parameters
    ----------
    bases : (N,) float32 array
        Those below 2^-100 are taken as that.
    exponent : float32
        0 or more. Powers below 2^-120 are given as that. The relative error is about 2e-7, more
        where the power is small: some 1e-7 for each unit of its base-2 logarithm.
    """
    for k in range(bases.size):
        bits = np.int32(_bits(max(bases[k], _LEAST)) - _ROOT_HALF)
        # From √½ to √2 times a power of two.
        octave = np.float32(np.int32(bits >> _SHIFT))
        t = _float(np.int32((bits & _MANTISSA) + _ROOT_HALF)) - np.float32(1)
        log = _LOG[7]
        log = log * t + _LOG[6]
        log = log * t + _LOG[5]
        log = log * t + _LOG[4]
        log = log * t + _LOG[3]
        log = log * t + _LOG[2]
        log = log * t + _LOG[1]
        log = log * t + _LOG[0]
        power = max((octave + log * t) * exponent, _LEAST_RESULT)
        whole = (power + _ROUNDER) - _ROUNDER
        t = power - whole
        result = _EXP[5]
        result = result * t + _EXP[4]
        result = result * t + _EXP[3]
        result = result * t + _EXP[2]
        result = result * t + _EXP[1]
        result = result * t + _EXP[0]
        bases[k] = _float(np.int32(_bits(result) + np.int32(np.int32(whole) << _SHIFT)))


@_jit
def angle(y, x):
    """Give the angle of a direction with 0 <= y <= x [radians], to 1.5e-7 of it."""
    t = y / x
    square = t * t
    result = _ARCTAN[7]
    result = result * square + _ARCTAN[6]
    result = result * square + _ARCTAN[5]
    result = result * square + _ARCTAN[4]
    result = result * square + _ARCTAN[3]
    result = result * square + _ARCTAN[2]
    result = result * square + _ARCTAN[1]
    result = result * square + _ARCTAN[0]
    return result * t
