"""Dictionary files, ``.dsd``: atoms of all kinds in the container of `demsmith.core.sectioned`.

The header holds ``side`` (rows, columns), ``factor``, ``cell`` (metres or None) and ``parts``, one
dictionary for each part of a `Dictionary`, in order; part ``i`` has the sections ``i.…``:

sampled
    ``type`` is float32, float16 or int8; ``low`` and, with a factor, ``high`` hold the samples of
    so many atoms a chunk; int8 ones are shares of 127 of the largest of their atom. Atoms that are
    discs of exemplars have their ``names`` and ``origins``.
cut
    ``exemplars``: shape and type of each, with their ``names``; ``exemplar.j`` holds their rows,
    ``origins`` the atoms' places.
functions
    ``terms``; ``functions`` holds families, seeds, amplitudes and wavelengths.

All arrays are little-endian, their bytes sorted by significance and deflated; integers of
exemplars and origins are differences to the one before in their row or column. A file is not
trusted: whatever it holds, reading it takes no more than `MEMORY_BOUND` bytes or raises
`InputError`.
"""

import math
import zlib

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.sectioned import DICTIONARY as KIND
from demsmith.core.sectioned import open_sectioned, write_sectioned
from demsmith.core.sparse.atoms import CutAtoms, FunctionAtoms, SampledAtoms
from demsmith.core.sparse.dictionary import LARGEST_FACTOR, MOST_SAMPLES, Dictionary
from demsmith.core.sparse.patches import LARGEST_SIDE

PRECISIONS = ("float32", "float16", "int8")
"""How samples may be stored."""

MEMORY_BOUND = 3 << 30
"""Bytes that reading a file never exceeds."""

_MOST_STORED = 512 << 20
"""Bytes of all arrays of a file together once they are unpacked, at most; reading holds them as
chunks, joined, and decoded."""

_CHUNK = 1 << 20
"""Bytes of a section's part before it is deflated, about."""

_MOST_ATOMS = 1 << 24
_MOST_PARTS = 64
_EXEMPLAR_TYPES = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "float32")
_LARGEST_EXEMPLAR = 1 << 16


def write_dictionary(path, dictionary, *, precision="float32"):
    """Write a dictionary to a file, whole or not at all.

    Parameters
    ----------
    path : path
        Ending in ``.dsd``. An existing file is replaced.
    dictionary : Dictionary
    precision : str
        How samples are stored: ``float32``, ``float16`` (a relative error up to 0.0005), or
        ``int8`` (up to 0.004 of the atom's largest). Exemplars of a complete dictionary and
        functions are always exact.

    Raises
    ------
    InputError
        If it is too large for a file.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import os, tempfile
    >>> samples = np.random.default_rng(1).normal(size=(3, 100))
    >>> dictionary = Dictionary.of_samples(samples, 10, 10)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "three.dsd")
    ...     write_dictionary(path, dictionary)
    ...     bool((read_dictionary(path).samples == dictionary.samples).all())
    True
    """
    if precision not in PRECISIONS:
        raise InputError(f"precision is {precision!r}; choose one of {', '.join(PRECISIONS)}")
    writer = _Writer(precision)
    for part in dictionary.parts:
        writer.add(part)
    if writer.stored > _MOST_STORED or len(dictionary) > _MOST_ATOMS:
        raise InputError(
            f"{len(dictionary)} atoms and their exemplars take {writer.stored >> 20} MB, more "
            f"than the {_MOST_STORED >> 20} MB that a dictionary file may hold"
        )
    if len(dictionary.parts) > _MOST_PARTS:
        raise InputError(f"a dictionary file may have {_MOST_PARTS} parts")
    header = {
        "side": [dictionary.side_rows, dictionary.side_columns],
        "factor": dictionary.factor,
        "cell": None if dictionary.cell_size is None else list(map(float, dictionary.cell_size)),
        "parts": writer.parts,
    }
    write_sectioned(path, KIND, header=header, sections=writer.sections)


def read_dictionary(path):
    """Read a dictionary from a file.

    Parameters
    ----------
    path : path

    Returns
    -------
    Dictionary

    Raises
    ------
    InputError
        If the file is missing, no dictionary, truncated, damaged, or too large.
    """
    with open_sectioned(path, KIND) as file:
        return _Reader(file).dictionary()


class _Writer:
    def __init__(self, precision):
        self.precision, self.parts, self.sections, self.stored = precision, [], {}, 0

    def add(self, part):
        number = len(self.parts)
        if isinstance(part, SampledAtoms):
            self.parts.append(self._sampled(number, part))
        elif isinstance(part, CutAtoms):
            self.parts.append(self._cut(number, part))
        else:
            self.parts.append(self._functions(number, part.sums))

    def _sampled(self, number, part):
        largest = np.abs(part.low).max(axis=(1, 2))
        for name in ("low", "high"):
            blocks = getattr(part, name)
            if blocks is not None:
                self._put(f"{number}.{name}", _coded(blocks, self.precision, largest))
        told = {"kind": "sampled", "atoms": len(part), "type": self.precision}
        told |= {"names": list(part.names), "placed": part.origins is not None}
        if part.origins is not None:
            self._put(f"{number}.origins", _differences(part.origins.astype(np.int32), 0))
        return told

    def _cut(self, number, part):
        shapes = []
        for index, values in enumerate(part.exemplars):
            values = np.asarray(values)
            if values.dtype.name not in _EXEMPLAR_TYPES:
                values = values.astype(np.float32)
            shapes.append([*values.shape, values.dtype.name])
            self._put(f"{number}.exemplar.{index}", _differences(values, 1))
        self._put(f"{number}.origins", _differences(part.origins.astype(np.int32), 0))
        return {
            "kind": "cut", "atoms": len(part), "names": list(part.names), "exemplars": shapes,
        }  # fmt: skip

    def _functions(self, number, sums):
        table = np.column_stack(
            [sums.families, sums.seeds, sums.amplitudes, sums.wavelengths]
        ).astype(np.float64)  # seeds are below 2**48
        self._put(f"{number}.functions", table)
        return {"kind": "functions", "atoms": len(sums), "terms": sums.amplitudes.shape[1]}

    def _put(self, section, array):
        self.stored += array.size * max(array.itemsize, 4)
        array = np.ascontiguousarray(array)
        step = _rows_a_chunk(array.shape, array.dtype)
        self.sections[section] = [
            zlib.compress(_by_significance(array[first : first + step]), 9)
            for first in range(0, len(array), step)
        ]


class _Reader:
    def __init__(self, file):
        self.file, self.header, self.stored = file, file.header, 0

    def dictionary(self):
        """Read all of it."""
        rows, columns = self._numbers("side", self.header, 2, 1, LARGEST_SIDE)
        factor = self._number("factor", self.header, 1, LARGEST_FACTOR)
        parts = self.header.get("parts")
        if not isinstance(parts, list) or not 1 <= len(parts) <= _MOST_PARTS:
            raise self._damaged("parts")
        self.side, self.factor = (rows, columns), factor
        made = [self._part(number, told) for number, told in enumerate(parts)]
        try:
            return Dictionary(rows, columns, made, factor, self._cell())
        except InputError as error:
            raise InputError(f"'{self.file.path}' is damaged: {error}") from None

    def _part(self, number, told):
        kinds = {"sampled": self._sampled, "cut": self._cut, "functions": self._functions}
        if not isinstance(told, dict) or not isinstance(told.get("kind"), str):
            raise self._damaged("parts")
        if told["kind"] not in kinds:
            raise self._damaged("kind")
        atoms = self._number("atoms", told, 1, _MOST_ATOMS)
        if atoms * self.side[0] * self.side[1] > MOST_SAMPLES:
            raise self._damaged("atoms")
        return kinds[told["kind"]](number, told, atoms)

    def _sampled(self, number, told, atoms):
        precision, names = told.get("type"), self._names(told)
        if precision not in PRECISIONS:
            raise self._damaged("type")
        low = self._blocks(f"{number}.low", precision, atoms, 1)
        high = None
        if self.factor > 1:
            high = self._blocks(f"{number}.high", precision, atoms, self.factor)
        placed = told.get("placed")
        if not isinstance(placed, bool):
            raise self._damaged("placed")
        origins = self._origins(number, atoms) if placed else None
        return SampledAtoms(low, high, names, origins)

    def _blocks(self, section, precision, atoms, factor):
        rows, columns = (factor * side for side in self.side)
        extra = 4 if precision == "int8" else 0  # the atom's scale
        kind = np.dtype("u1" if precision == "int8" else precision)
        coded = self._array(section, (atoms, rows * columns + extra), kind)
        samples = _decoded(coded, precision)
        if not np.isfinite(samples).all():
            raise self._damaged(section)
        return samples.reshape(atoms, rows, columns)

    def _cut(self, number, told, atoms):
        names, shapes = self._names(told), told.get("exemplars")
        if not isinstance(shapes, list) or len(shapes) != len(names):
            raise self._damaged("exemplars")
        exemplars = []
        for index, shape in enumerate(shapes):
            if not isinstance(shape, list) or len(shape) != 3 or shape[2] not in _EXEMPLAR_TYPES:
                raise self._damaged("exemplars")
            for side in shape[:2]:
                if type(side) is not int or not 1 <= side <= _LARGEST_EXEMPLAR:
                    raise self._damaged("exemplars")
            section = f"{number}.exemplar.{index}"
            values = _summed(self._array(section, tuple(shape[:2]), np.dtype(shape[2])), 1)
            if not np.isfinite(values).all():
                raise self._damaged(section)
            exemplars.append(values)
        return CutAtoms(tuple(exemplars), names, self._origins(number, atoms))

    def _functions(self, number, told, atoms):
        from demsmith.core.noise import MOST_TERMS, NoiseSums

        terms = self._number("terms", told, 1, MOST_TERMS)
        table = self._array(f"{number}.functions", (atoms, 2 + 2 * terms), np.dtype(np.float64))
        whole = table[:, :2]
        if not (np.isfinite(whole).all() and (whole == np.floor(whole)).all()):
            raise self._damaged("functions")
        if np.abs(whole).max() > 2**53 or np.abs(table[:, 2:]).max() > 1e30:
            raise self._damaged("functions")
        try:
            return FunctionAtoms(
                NoiseSums(*whole.T, table[:, 2 : 2 + terms], table[:, 2 + terms :])
            )
        except InputError as error:
            raise InputError(f"'{self.file.path}' is damaged: {error}") from None

    def _origins(self, number, atoms):
        return _summed(self._array(f"{number}.origins", (atoms, 3), np.dtype(np.int32)), 0)

    def _array(self, section, shape, kind):
        """Read an array; nothing is unpacked before all of it is known to be wanted."""
        self.stored += math.prod(shape) * max(kind.itemsize, 4)
        if self.stored > _MOST_STORED:
            raise InputError(
                f"'{self.file.path}' tells of more than {_MOST_STORED >> 20} MB of atoms and "
                "exemplars, which is more than is read"
            )
        step = _rows_a_chunk(shape, kind)
        if self.file.counts.get(section) != -(-shape[0] // step):
            raise self._damaged(section)
        chunks = [
            self._chunk(section, index, (min(step, shape[0] - first), *shape[1:]), kind)
            for index, first in enumerate(range(0, shape[0], step))
        ]
        return np.concatenate(chunks)

    def _chunk(self, section, index, shape, kind):
        size = math.prod(shape) * kind.itemsize
        inflate = zlib.decompressobj()
        try:
            data = inflate.decompress(self.file.part(section, index), size + 1)
        except zlib.error:
            raise self._damaged(section) from None
        if len(data) != size or not inflate.eof or inflate.unused_data:
            raise self._damaged(section)
        planes = np.frombuffer(data, np.uint8).reshape(kind.itemsize, -1)
        return np.ascontiguousarray(planes.T).view(kind.newbyteorder("<")).reshape(shape)

    def _cell(self):
        cell = self.header.get("cell")
        if cell is None:
            return None
        plain = isinstance(cell, list) and len(cell) == 2 and all(type(x) is float for x in cell)
        if not plain or not all(0 < size < math.inf for size in cell):
            raise self._damaged("cell")
        return tuple(cell)

    def _names(self, told):
        names = told.get("names")
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise self._damaged("names")
        return tuple(names)

    def _number(self, name, told, least, most):
        value = told.get(name)
        if type(value) is not int or not least <= value <= most:
            raise self._damaged(name)
        return value

    def _numbers(self, name, told, count, least, most):
        values = told.get(name)
        if not isinstance(values, list) or len(values) != count:
            raise self._damaged(name)
        return [self._number(name, {name: value}, least, most) for value in values]

    def _damaged(self, what):
        return InputError(f"'{self.file.path}' is damaged: its '{what}' is not what it must be")


def _rows_a_chunk(shape, kind):
    return max(1, _CHUNK // max(1, math.prod(shape[1:]) * kind.itemsize))


def _by_significance(array):
    """Give an array's bytes, the lowest of all numbers first."""
    numbers = array.astype(array.dtype.newbyteorder("<"), copy=False).reshape(-1, 1)
    return np.ascontiguousarray(numbers.view(np.uint8).T).tobytes()


def _coded(blocks, precision, scale):
    """Give atoms' samples as they are stored, one atom a row.

    ``scale`` is the same for an atom's two resolutions: float16 loses it, and it does not count.
    """
    samples = blocks.reshape(len(blocks), -1).astype(np.float32, copy=False)
    if precision == "float32":
        return samples
    if precision == "float16":
        most = np.finfo(np.float16).max
        return np.clip(_shares(samples, scale[:, None]), -most, most).astype(np.float16)
    largest = np.abs(samples).max(axis=1, keepdims=True)
    steps = np.rint(127 * _shares(samples, largest)).astype(np.int8)
    return np.hstack([steps.view(np.uint8), largest.astype("<f4").view(np.uint8)])


def _shares(samples, largest):
    return np.divide(samples, largest, out=np.zeros_like(samples), where=largest > 0)


def _decoded(coded, precision):
    """Give atoms' samples from how they are stored."""
    if precision != "int8":
        return coded.astype(np.float32)
    scale = np.ascontiguousarray(coded[:, -4:]).view("<f4").astype(np.float32)
    with np.errstate(over="ignore", invalid="ignore"):  # it is checked that all are finite
        return coded[:, :-4].view(np.int8) * (scale / 127)


def _differences(values, axis):
    """Give integers as differences along an axis, which wrap around; others as they are."""
    if values.dtype.kind == "f":
        return values
    out = values.copy()
    later, before = (np.s_[1:], np.s_[:-1]) if axis == 0 else (np.s_[:, 1:], np.s_[:, :-1])
    out[later] = values[later] - values[before]
    return out


def _summed(values, axis):
    """Undo `_differences`."""
    if values.dtype.kind == "f":
        return values
    return np.cumsum(values, axis=axis, dtype=values.dtype.newbyteorder("="))
