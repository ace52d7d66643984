"""Kernel that looks a parameter up, be it one number or a map."""

from numba import types
from numba.extending import overload


def value_at(parameter, row, column):
    """Give a parameter's value at a cell, or beyond the raster's edge that of the nearest cell.

    For kernels only, which are compiled once for numbers, where this costs nothing, and once for
    maps.
    """
    raise NotImplementedError


@overload(value_at)
def _value_at(parameter, row, column):
    if isinstance(parameter, types.Array):
        return _of_map
    return lambda parameter, row, column: parameter


def _of_map(parameter, row, column):
    height, width = parameter.shape
    return parameter[min(max(row, 0), height - 1), min(max(column, 0), width - 1)]
