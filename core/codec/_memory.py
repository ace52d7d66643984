"""Reading and writing memory by address, inside kernels.

Numba counts references to an array whenever a function takes it, with atomic operations: around a
few instructions of arithmetic coding they took three quarters of the time. An address is a plain
integer. Whoever takes one (`array.ctypes.data`) keeps the array alive and indexes within it:
arrays whose addresses are used are allocated by the kernels' callers.
"""

import numba
import numpy as np
from numba import types
from numba.extending import intrinsic


def _reading(kind):
    @intrinsic
    def read(context, address, index):
        """Read the item ``index`` of the array that begins at ``address``."""

        def generate(context, builder, signature, arguments):
            item = context.get_value_type(kind).as_pointer()
            return builder.load(builder.gep(builder.inttoptr(arguments[0], item), [arguments[1]]))

        return kind(types.int64, types.int64), generate

    return read


def _writing(kind):
    @intrinsic
    def write(context, address, index, value):
        """Write ``value`` to the item ``index`` of the array that begins at ``address``."""

        def generate(context, builder, signature, arguments):
            item = context.get_value_type(kind).as_pointer()
            place = builder.gep(builder.inttoptr(arguments[0], item), [arguments[1]])
            builder.store(arguments[2], place)
            return context.get_dummy_value()

        return types.void(types.int64, types.int64, kind), generate

    return write


@intrinsic
def _bits_of(context, value):
    """Give the 32 bits of a float32 as an integer."""

    def generate(context, builder, signature, arguments):
        return builder.bitcast(arguments[0], context.get_value_type(types.int32))

    return types.int32(types.float32), generate


read_u8, write_u8 = _reading(types.uint8), _writing(types.uint8)
read_i32, write_i32 = _reading(types.int32), _writing(types.int32)
read_i64, write_i64 = _reading(types.int64), _writing(types.int64)
read_f32, write_f32 = _reading(types.float32), _writing(types.float32)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def half_octaves(x, levels):
    """Level of a number from 0 on, below ``levels``: 0 under 0.25, then two for each doubling.

    A float's exponent and its mantissa's first bit are its logarithm in half octaves.
    """
    return min(max((_bits_of(np.float32(x)) >> 22) - 249, 0), levels - 1)
