"""Discs of a patch tree and the atoms of its dictionary, coded by what was coded before.

Discs come row by row. Each has the number of its atoms, their indices (the largest coefficient
first), sizes and signs of the coefficients, and its mean. Neighbours know the ground's slope, and
it tells much: which atoms are likely, how large they are and with which sign, and with the disc's
own slope, known by then, where its mean should be.
"""

import math

import numpy as np

from demsmith.core.codec._coder import (
    FRESH,
    code_adaptive,
    code_mixed,
    code_plain,
    finish,
    kernel,
    memory,
    start,
)
from demsmith.core.codec._memory import half_octaves, read_i64, write_i64

INPUTS = 3
PREDICTORS = 6
LARGEST = 1 << 27
"""No mean and no coefficient has more steps."""

_LENGTHS = 32  # states of the decisions that tell the length of a number
_LEVELS = 24
_SECTORS = 16
_SLOTS = 4  # first, second, third, later atoms
_HASHED = 1 << 16
_RATE = np.float32(0.02)

# Where the states of each kind begin.
_COUNTS = 0
_COUNT_PLACES = 3 * 4096
_SIZES = _COUNTS + _COUNT_PLACES
_SIZE_PLACES = INPUTS * 1024 * _LENGTHS
_MEANS = _SIZES + _SIZE_PLACES
_MEAN_PLACES = INPUTS * 1024 * _LENGTHS
_BITS = _MEANS + _MEAN_PLACES  # the highest bits of numbers after their length
_SIGNS = _BITS + 3 * _LENGTHS * 4
_MEAN_SIGNS = _SIGNS + 2 * _LEVELS * _LEVELS
_INDICES = _MEAN_SIGNS + 2
_STATES = _INDICES + INPUTS * _HASHED

_COUNT_ROWS = 0
_SIZE_ROWS = _COUNT_ROWS + 16
_MEAN_ROWS = _SIZE_ROWS + _LENGTHS * _SLOTS
_INDEX_ROWS = _MEAN_ROWS + _LENGTHS
_ROWS = _INDEX_ROWS + 17 * 2


@kernel
def _number(m, places, inputs, row, value, kind, decoding):
    """Code a number from 0 on: how many bits it has, by mixed states, and these bits.

    The states of ``inputs`` contexts begin at ``places``, an address; they are moved.
    """
    length = np.int64(0)
    if not decoding:
        while value >> length:
            length += 1
    at = np.int64(0)
    while at < 29:
        longer = code_mixed(m, places, inputs, row + at, _RATE, np.int64(at < length), decoding)
        if not longer:
            break
        at += 1
        for i in range(inputs):
            write_i64(places, i, read_i64(places, i) + 1)
    if at < 2:
        return at
    out = np.int64(1)
    for k in range(at - 2, -1, -1):
        bit = (value >> k) & 1
        if k >= at - 3:
            place = _BITS + (kind * _LENGTHS + at) * 4
            place += 0 if k == at - 2 else 1 + (out & 1)
            bit = code_adaptive(m, place, bit, decoding)
        else:
            bit = code_plain(m, bit, 1, decoding)
        out = 2 * out + bit
    return out


@kernel
def _hashed(first, second, node):
    """Give a place for a node of the tree of indices in a context of two numbers."""
    return ((first * 31 + second + 1) * 40503 + node * 7) % _HASHED


@kernel
def _code_index(m, places, slot, index, bits, contexts, decoding):
    """Code an atom's index bit by bit, each by the bits before and some contexts.

    ``places`` and ``contexts`` are addresses.
    """
    node = np.int64(1)
    for level in range(bits):
        for i in range(INPUTS):
            place = _INDICES + i * _HASHED + _hashed(read_i64(contexts, i), slot, node)
            write_i64(places, i, place)
        bit = (index >> (bits - 1 - level)) & 1
        row = _INDEX_ROWS + 2 * level + (slot > 0)
        bit = code_mixed(m, places, INPUTS, row, _RATE, bit, decoding)
        node = 2 * node + bit
    return node - (np.int64(1) << bits)


@kernel
def _sector(by_row, by_column):
    """Give the direction of a line, whichever way along it, as one of some sectors; 0 for none."""
    if by_row == 0 and by_column == 0:
        return np.int64(0)
    if by_row < 0:
        by_row, by_column = -by_row, -by_column
    # Half a turn in 15 parts, by a function that grows with the angle as the cosine falls.
    place = by_column / (abs(by_row) + abs(by_column))
    return 1 + min(np.int64((1 - place) * 7.5), _SECTORS - 2)


@kernel
def code_tile(
    means, counts, indices, steps, free, slopes, spread, coder, data, states, weights, opinions,
    places, contexts, slope, energy, errors, decoding,
):  # fmt: skip
    """Code a tile of discs, or decode it into the first four arrays, which are then zeros.

    Parameters
    ----------
    means : (m, n) int32 array
        Steps.
    counts : (m, n) int32 array
        Atoms of each disc.
    indices, steps : (m, n, s) int32 arrays
        Atoms and their coefficients, none of them 0.
    free : (m, n) bool array
        Discs of voids alone; the encoder takes the mean that costs least.
    slopes : (N, 2) float32 array
        Of the atoms, per disc down and to the right, in steps of the mean for a step of the
        coefficient.
    spread : (float32, float32)
        What a slope of the ground down and to the right times that of an atom make of the atom's
        coefficient, if it alone fits the slope.
    coder, data, states, weights, opinions
        Of `_coder`.
    places, contexts, slope, energy, errors
        Room, from `workspace`.
    """
    m = memory(coder, data, states, weights, opinions)
    at, around = places.ctypes.data, contexts.ctypes.data
    start(m, decoding)
    height, width = means.shape
    sparsity = indices.shape[2]
    bits = np.int64(0)
    while (len(slopes) - 1) >> bits:
        bits += 1
    guesses = np.zeros(PREDICTORS)
    for row in range(height):
        for column in range(width):
            west, north = column > 0, row > 0
            north_east = north and column + 1 < width
            k_west = np.int64(counts[row, column - 1]) if west else np.int64(0)
            k_north = np.int64(counts[row - 1, column]) if north else np.int64(0)
            near, known = np.float32(0), 0
            by_row, by_column = np.float32(0), np.float32(0)
            if west:
                near += 2 * energy[row, column - 1]
                by_row += 2 * slope[row, column - 1, 0]
                by_column += 2 * slope[row, column - 1, 1]
                known += 2
            if north:
                near += 2 * energy[row - 1, column]
                by_row += 2 * slope[row - 1, column, 0]
                by_column += 2 * slope[row - 1, column, 1]
                known += 2
            if north_east:
                near += energy[row - 1, column + 1]
                by_row += slope[row - 1, column + 1, 0]
                by_column += slope[row - 1, column + 1, 1]
                known += 1
            if known:
                part = np.float32(1) / np.float32(known)
                near *= part
                by_row *= part
                by_column *= part
            level = half_octaves(near, _LEVELS)
            sector = _sector(by_row, by_column)

            count = np.int64(counts[row, column])
            have = np.int64(0)
            own = np.float32(0)
            own_row, own_column = np.float32(0), np.float32(0)
            last_length = np.int64(0)
            while have < sparsity:
                slot = min(have, 15)
                places[0] = _COUNTS + (slot * 16 + min(k_west, 15)) * 16 + min(k_north, 15)
                places[1] = _COUNTS + 4096 + slot * _LEVELS + level
                places[2] = _COUNTS + 8192 + slot * _LENGTHS + last_length
                more = code_mixed(
                    m, at, 3, _COUNT_ROWS + slot, _RATE,
                    np.int64(have < count), decoding,
                )  # fmt: skip
                if not more:
                    break
                slot = min(have, _SLOTS - 1)
                contexts[0] = slot
                contexts[1] = sector * 32 + level if have == 0 else 1024 + sector
                contexts[2] = 2048 + (indices[row, column - 1, 0] if west and k_west else 0)
                index = _code_index(
                    m, at, slot, np.int64(indices[row, column, have]), bits, around, decoding
                )
                index = min(index, len(slopes) - 1)
                indices[row, column, have] = index

                likely = by_row * slopes[index, 0] * spread[0]
                likely += by_column * slopes[index, 1] * spread[1]
                likely_level = half_octaves(abs(likely), _LEVELS)
                contexts[0] = (slot * 32 + last_length) if have else 128 + level
                contexts[1] = index % 1024
                contexts[2] = likely_level * _LEVELS + level
                for i in range(INPUTS):
                    places[i] = _SIZES + (i * 1024 + contexts[i]) * _LENGTHS
                value = np.int64(steps[row, column, have])
                size = _number(
                    m, at, INPUTS, _SIZE_ROWS + slot * _LENGTHS, abs(value) - 1,
                    0 if have == 0 else 1, decoding,
                ) + 1  # fmt: skip
                last_length = np.int64(0)
                while size >> last_length and last_length < _LENGTHS - 1:
                    last_length += 1
                place = _SIGNS + likely_level * _LEVELS + min(last_length, _LEVELS - 1)
                if have:
                    place += _LEVELS * _LEVELS
                against = code_adaptive(m, place, np.int64((value < 0) != (likely < 0)), decoding)
                negative = (against != 0) != (likely < 0)
                value = -size if negative else size
                steps[row, column, have] = value
                own += np.float32(size)
                own_row += np.float32(value) * slopes[index, 0]
                own_column += np.float32(value) * slopes[index, 1]
                by_row -= np.float32(value) * slopes[index, 0]
                by_column -= np.float32(value) * slopes[index, 1]
                have += 1
            counts[row, column] = have
            energy[row, column] = own
            slope[row, column, 0] = own_row
            slope[row, column, 1] = own_column

            guess, wrong = _predict(means, slope, errors, guesses, row, column)
            doubt = half_octaves(np.float32(wrong), _LEVELS)
            contexts[0] = doubt * _LEVELS + level
            contexts[1] = half_octaves(own, _LEVELS) * _LEVELS + doubt
            contexts[2] = half_octaves(
                errors[row, column - 1, PREDICTORS] if west else np.float32(0), _LEVELS
            ) * _LEVELS + half_octaves(
                errors[row - 1, column, PREDICTORS] if north else np.float32(0), _LEVELS
            )
            for i in range(INPUTS):
                places[i] = _MEANS + (i * 1024 + contexts[i]) * _LENGTHS
            centre = np.int64(math.floor(guess + 0.5))
            off = np.int64(0)
            if not decoding and not free[row, column]:
                off = np.int64(means[row, column]) - centre
            size = _number(m, at, INPUTS, _MEAN_ROWS, abs(off), 2, decoding)
            if size:
                place = _MEAN_SIGNS + (guess < centre)
                off = -size if code_adaptive(m, place, np.int64(off < 0), decoding) else size
            mean = min(max(centre + off, -LARGEST), LARGEST)
            means[row, column] = mean
            for i in range(PREDICTORS):
                errors[row, column, i] = np.float32(abs(mean - guesses[i]))
            errors[row, column, PREDICTORS] = np.float32(abs(mean - guess))
    if not decoding:
        finish(m)


@kernel
def _predict(means, slope, errors, guesses, row, column):
    """Guess a disc's mean by its neighbours', their slopes and its own; tell how sure it is.

    Several guesses are weighed by the inverse squares of how wrong they were nearby.
    """
    width = means.shape[1]
    if row == 0 and column == 0:
        guesses[:] = 0
        return 0.0, 1e6
    j_west, i_north = max(column - 1, 0), max(row - 1, 0)
    j_east = min(column + 1, width - 1) if row else column
    i, j = row, column
    if column == 0:
        west, north = np.float64(means[row - 1, 0]), np.float64(means[row - 1, 0])
        corner, east = north, np.float64(means[row - 1, j_east])
        j_west = 0
        guesses[0] = north + (slope[i - 1, j, 0] + slope[i, j, 0]) * 0.5
        guesses[1] = guesses[0]
        guesses[2] = guesses[0]
    elif row == 0:
        west = np.float64(means[0, column - 1])
        north, corner, east = west, west, west
        guesses[0] = west + (slope[i, j - 1, 1] + slope[i, j, 1]) * 0.5
        guesses[1] = guesses[0]
        guesses[2] = guesses[0]
    else:
        west, north = np.float64(means[i, j - 1]), np.float64(means[i - 1, j])
        corner, east = np.float64(means[i - 1, j - 1]), np.float64(means[i - 1, j_east])
        guesses[0] = west + (slope[i, j - 1, 1] + slope[i, j, 1]) * 0.5
        guesses[1] = north + (slope[i - 1, j, 0] + slope[i, j, 0]) * 0.5
        guesses[2] = west + north - corner
    if row and column:
        guesses[3] = corner + 0.5 * (
            slope[i - 1, j - 1, 0] + slope[i, j, 0] + slope[i - 1, j - 1, 1] + slope[i, j, 1]
        )
        guesses[5] = (guesses[0] + guesses[1]) * 0.5
    else:
        guesses[3] = guesses[0]
        guesses[5] = guesses[0]
    if row and j_east > column:
        guesses[4] = east + 0.5 * (
            slope[i - 1, j_east, 0] + slope[i, j, 0] - slope[i - 1, j_east, 1] - slope[i, j, 1]
        )
    else:
        guesses[4] = guesses[5]
    total, trust = 0.0, 0.0
    for k in range(PREDICTORS):
        wrong = 0.0
        if column:
            wrong += 2 * errors[row, j_west, k]
        if row:
            wrong += 2 * errors[i_north, column, k]
            wrong += errors[i_north, j_east, k]
            if column:
                wrong += errors[i_north, j_west, k]
        share = 1 / (wrong * wrong + 1.0)
        total += share * guesses[k]
        trust += share
    wrong = 0.0
    parts = 0.0
    if column:
        wrong += 2 * errors[row, j_west, PREDICTORS]
        parts += 2
    if row:
        wrong += 2 * errors[i_north, column, PREDICTORS] + errors[i_north, j_east, PREDICTORS]
        parts += 3
    guess = min(max(total / trust, -1.0 * LARGEST), 1.0 * LARGEST)
    return guess, wrong / parts


def workspace(height, width):
    """Allocate what `code_tile` needs besides a tile and its data, as it begins."""
    return dict(
        atoms_workspace(),
        contexts=np.zeros(INPUTS, np.int64),
        slope=np.zeros((height, width, 2), np.float32),
        energy=np.zeros((height, width), np.float32),
        errors=np.zeros((height, width, PREDICTORS + 1), np.float32),
    )


def atoms_workspace():
    """Allocate what `code_atoms` needs besides the atoms and its data, as it begins."""
    return dict(
        coder=np.zeros(4, np.int64),
        states=np.full(_STATES, FRESH, np.int32),
        weights=np.full((_ROWS, INPUTS), 0.3, np.float32),
        opinions=np.zeros(INPUTS, np.float32),
        places=np.zeros(INPUTS, np.int64),
    )


@kernel
def code_atoms(samples, disc, coder, data, states, weights, opinions, places, decoding):
    """Code the samples of atoms, in steps, or decode them into ``samples``, then of zeros.

    Parameters
    ----------
    samples : (N, side_rows, side_columns) int32 array
    disc : (side_rows, side_columns) bool array
        Samples that are coded.
    coder, data, states, weights, opinions, places
        As of `code_tile`.
    """
    m = memory(coder, data, states, weights, opinions)
    start(m, decoding)
    height, width = disc.shape
    wrong = np.zeros((height, width), np.float32)
    for atom in range(len(samples)):
        for i in range(height):
            for j in range(width):
                if not disc[i, j]:
                    continue
                west, north = j > 0 and disc[i, j - 1], i > 0 and disc[i - 1, j]
                both = west and north and disc[i - 1, j - 1]
                guess, late = np.int64(0), np.float32(8)
                if both:
                    guess = _median(
                        np.int64(samples[atom, i, j - 1]), np.int64(samples[atom, i - 1, j]),
                        np.int64(samples[atom, i - 1, j - 1]),
                    )  # fmt: skip
                    late = (wrong[i, j - 1] + wrong[i - 1, j]) * np.float32(0.5)
                elif west:
                    guess, late = np.int64(samples[atom, i, j - 1]), wrong[i, j - 1]
                elif north:
                    guess, late = np.int64(samples[atom, i - 1, j]), wrong[i - 1, j]
                level = half_octaves(late, _LEVELS)
                places[0] = _MEANS + level * _LENGTHS
                places[1] = _MEANS + (1024 + 2 * west + north) * _LENGTHS
                off = np.int64(samples[atom, i, j]) - guess
                size = _number(m, places.ctypes.data, 2, _MEAN_ROWS, abs(off), 2, decoding)
                if size and code_adaptive(m, _SIGNS, np.int64(off < 0), decoding):
                    size = -size
                samples[atom, i, j] = min(max(guess + size, -LARGEST), LARGEST)
                wrong[i, j] = np.float32(abs(size))
    if not decoding:
        finish(m)


@kernel
def _median(west, north, corner):
    """Guess by the median of west, north, and the plane through the three (LOCO-I)."""
    if corner >= max(west, north):
        return min(west, north)
    if corner <= min(west, north):
        return max(west, north)
    return west + north - corner
