"""The container of `.sct` and `.dsd` files: a header, and named sections of parts.

Layout, all numbers little-endian::

    4 bytes  magic of the kind of file
    u16      version of its format
    u16      0
    u32 ×2   bytes of the header as stored and unpacked
    u32 ×2   bytes of the table as stored and unpacked
    u32      CRC-32 of all the above, the stored header and the stored table
    header   deflated (raw, RFC 1951) MessagePack array: [[[section, parts], ...], {field: value}]
    table    deflated: the length of every part (LEB128), in order; then u32 CRC-32 of every group
    parts    one after the other, section by section, to the end of the file

A group is the parts of a section that begin in the same 4096 bytes of it. So a small part costs
two bytes in the table and a share of four, and one part is checked without reading its whole
section.

A file is not trusted. Sizes are checked against limits and the file's own size before memory is
taken: opening takes less than `MEMORY_BOUND` bytes whatever the file holds, reading a part the
bytes of its group. There is no pickle, and a header holds nothing but numbers, text, bytes, lists
and dictionaries. What fields and parts mean is checked by those who read them.
"""

import os
import struct
import threading
import weakref
import zlib
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.raster.opening import check_there
from demsmith.core.raster.outputs import cannot_write, whole_or_nothing

MEMORY_BOUND = 256 << 20
"""Bytes that opening a file never exceeds."""

_PREAMBLE = struct.Struct("<4sHHIIII")
_CRC = struct.Struct("<I")
_GROUP_BYTES = 4096
_MOST_HEADER_BYTES = 4 << 20
_MOST_TABLE_BYTES = 4 << 20
# Lists and dictionaries take 50 times the memory that their bytes do, so they are counted; and
# they get theirs before their items are there, a thousand nested ones at once.
_MOST_CONTAINERS = 100_000
_LONGEST_LIST = 8192
_PLAIN = (type(None), bool, int, float, str, bytes, list, dict)
_MOST_SECTIONS = 1000
_LONGEST_NUMBER = 9  # bytes of a LEB128 number below 2**63


@dataclass(frozen=True)
class Kind:
    """A kind of sectioned file.

    Attributes
    ----------
    magic : bytes
        The file's first four bytes.
    version : int
        Version of the format that is written; older ones are read as well.
    noun : str
        What such a file is called in messages, as ``Sparse Construction Tree (.sct)``.
    """

    magic: bytes
    version: int
    noun: str


TREE = Kind(b"\x93SCT", 1, "Sparse Construction Tree (.sct)")
DICTIONARY = Kind(b"DSD\x1a", 1, "dictionary (.dsd)")
TERRAIN = Kind(b"DSP\x1a", 1, "procedural terrain (.dsp)")

_KINDS = (TREE, DICTIONARY, TERRAIN)


def write_sectioned(path, kind, *, header, sections):
    """Write a sectioned file, whole or not at all.

    Parameters
    ----------
    path : str or path-like
        An existing file is replaced.
    kind : Kind
    header : dict
        By text: None, bool, int, float, str, bytes, and lists and dictionaries of them, of up to
        8192 items each; larger things belong in a section.
    sections : dict of str to list of bytes
        The parts of each section. Any of them may be empty.

    Raises
    ------
    InputError
        If header or table are larger than a reader would accept.
    OutputError
        If the file cannot be written there.

    Examples
    --------
    >>> import tempfile
    >>> kind = Kind(b"DEMO", 1, "demonstration")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "x.demo")
    ...     write_sectioned(path, kind, header={"step": 0.5}, sections={"a": [b"one", b"two"]})
    ...     with open_sectioned(path, kind) as file:
    ...         file.header, file.part("a", 1)
    ({'step': 0.5}, b'two')
    """
    path = os.fspath(path)
    packed, table = _packed(header, sections), _packed_table(sections)
    if len(packed) > _MOST_HEADER_BYTES:
        raise InputError(
            f"cannot write '{path}': what its header would hold (metadata, CRS) takes "
            f"{len(packed)} bytes, more than the {_MOST_HEADER_BYTES} that are allowed"
        )
    if len(table) > _MOST_TABLE_BYTES:
        raise InputError(f"cannot write '{path}': it has too many parts; make several files")
    with whole_or_nothing(path) as unfinished:
        try:
            with open(unfinished, "wb") as file:
                file.write(_opening(kind, packed, table))
                for parts in sections.values():
                    file.writelines(parts)
        except OSError as error:
            raise cannot_write(path, error.strerror) from None


def sectioned_size(kind, *, header, sections):
    """Tell how many bytes `write_sectioned` would write."""
    opening = _opening(kind, _packed(header, sections), _packed_table(sections))
    return len(opening) + sum(len(part) for parts in sections.values() for part in parts)


def open_sectioned(path, kind):
    """Open a sectioned file for reading.

    Parameters
    ----------
    path : str or path-like
    kind : Kind
        What it must be.

    Returns
    -------
    SectionedFile
        A context manager; `SectionedFile.close` lets go of the file as well.

    Raises
    ------
    InputError
        If the file is missing, not of this kind, of a newer version, truncated or damaged.
    """
    return SectionedFile(os.fspath(path), kind)


class SectionedFile:
    """A sectioned file that is open; parts are read when they are asked for, from any thread.

    Attributes
    ----------
    path : str
    header : dict
        The writer's, untrusted.
    counts : dict of str to int
        Number of parts of each section.
    size : int
        Bytes of the file.
    """

    def __init__(self, path, kind):
        self.path = path
        check_there(path)
        try:
            self._file = open(path, "rb")  # noqa: SIM115, close does
        except OSError as error:
            raise InputError(f"'{path}' cannot be opened: {error.strerror}") from None
        # Whoever forgets to close it does so by letting go.
        self._closing = weakref.finalize(self, self._file.close)
        self._lock = threading.Lock()
        try:
            self.size = os.fstat(self._file.fileno()).st_size
            self._open(kind)
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Let go of the file; parts cannot be read any more."""
        self._closing()

    def part(self, section, index):
        """Read a part.

        Parameters
        ----------
        section : str
        index : int
            From 0.

        Returns
        -------
        bytes

        Raises
        ------
        InputError
            If there is no such part, or its group's checksum does not match.
        """
        count = self.counts.get(section)
        if count is None or not 0 <= index < count:
            raise self._damaged(f"its section '{section}' has no part {index}")
        number = self._first[section] + index
        begin, end = int(self._ends[number]), int(self._ends[number + 1])
        group = int(np.searchsorted(self._group_firsts, number, side="right")) - 1
        if group in self._checked:
            return self._read(begin, end - begin)
        first, last = self._group_firsts[group], self._group_firsts[group + 1]
        group_begin, group_end = int(self._ends[first]), int(self._ends[last])
        data = self._read(group_begin, group_end - group_begin)
        if zlib.crc32(data) != self._group_crcs[group]:
            raise self._damaged(f"the checksum of a part of its section '{section}' does not match")
        self._checked.add(group)
        return data[begin - group_begin : end - group_begin]

    def bytes_of(self, section):
        """Count the bytes of a section's parts."""
        first = self._first[section]
        return int(self._ends[first + self.counts[section]] - self._ends[first])

    @property
    def overhead(self):
        """Bytes of the file that are in no section: preamble, header and table."""
        return int(self._ends[0])

    def _open(self, kind):
        preamble = self._read(0, min(_PREAMBLE.size + _CRC.size, self.size))
        if preamble[:4] != kind.magic:
            for other in _KINDS:
                if preamble[:4] == other.magic:
                    raise InputError(
                        f"'{self.path}' is a {other.noun}; what is read here is a {kind.noun}"
                    )
            raise InputError(f"'{self.path}' is no {kind.noun}, or its beginning is damaged")
        if len(preamble) < _PREAMBLE.size + _CRC.size:
            raise self._truncated()
        _, version, _, *sizes = _PREAMBLE.unpack_from(preamble)
        if not 1 <= version <= kind.version:
            raise InputError(
                f"'{self.path}' is a {kind.noun} of version {version}, and this Demsmith reads "
                f"up to {kind.version}: use a newer one"
            )
        header_stored, header_size, table_stored, table_size = sizes
        start = len(preamble)
        if start + header_stored + table_stored > self.size:
            raise self._truncated()
        if header_size > _MOST_HEADER_BYTES or table_size > _MOST_TABLE_BYTES:
            raise self._damaged("its header or table is larger than any")
        stored = self._read(start, header_stored + table_stored)
        (crc,) = _CRC.unpack_from(preamble, _PREAMBLE.size)
        if zlib.crc32(stored, zlib.crc32(preamble[: _PREAMBLE.size])) != crc:
            raise self._damaged("the checksum of its header does not match")
        self._read_header(self._inflated(stored[:header_stored], header_size))
        self._read_table(self._inflated(stored[header_stored:], table_size), start + len(stored))

    def _read_header(self, packed):
        import msgpack

        try:
            shape, self.header = _unpacked(packed)
            counts = dict(shape)
        except (msgpack.UnpackException, ValueError, TypeError, RecursionError):
            raise self._damaged("its header cannot be read") from None
        sane = (
            len(counts) == len(shape) <= _MOST_SECTIONS
            and isinstance(self.header, dict)
            and all(isinstance(name, str) for name in counts)
            and all(type(count) is int and count >= 0 for count in counts.values())
        )
        if not sane:
            raise self._damaged("its header does not hold what it should")
        self.counts = counts

    def _read_table(self, table, start):
        counts = list(self.counts.values())
        total = sum(counts)
        if total > len(table):
            raise self._damaged("its table has fewer parts than its header tells")
        lengths, used = _numbers(np.frombuffer(table, np.uint8), total)
        if lengths is None or (lengths.size and lengths.max() > self.size):
            raise self._damaged("its table cannot be read")
        firsts = np.cumsum([0, *counts])
        self._first = dict(zip(self.counts, firsts.tolist(), strict=False))
        self._ends = np.concatenate([[0], np.cumsum(lengths)]) + start
        if self._ends[-1] > self.size:
            raise self._truncated()
        if self._ends[-1] < self.size:
            raise self._damaged(f"{self.size - int(self._ends[-1])} bytes too many follow its end")
        self._group_firsts = _group_firsts(lengths, firsts)
        self._checked = set()
        if len(table) - used != _CRC.size * (self._group_firsts.size - 1):
            raise self._damaged("its table has the wrong number of checksums")
        self._group_crcs = np.frombuffer(table, "<u4", offset=used)

    def _inflated(self, stored, size):
        inflate = zlib.decompressobj(-zlib.MAX_WBITS)
        try:
            # One byte more than told, so that longer data shows.
            data = inflate.decompress(stored, size + 1)
        except zlib.error:
            raise self._damaged("its header cannot be unpacked") from None
        if len(data) != size or not inflate.eof or inflate.unused_data:
            raise self._damaged("its header unpacks to another size than it tells")
        return data

    def _read(self, begin, count):
        try:
            with self._lock:
                self._file.seek(begin)
                data = self._file.read(count)
        except ValueError:
            raise InputError(f"'{self.path}' is closed: open it again to read it") from None
        except OSError as error:
            raise InputError(f"'{self.path}' cannot be read: {error}") from None
        if len(data) != count:
            raise self._truncated()
        return data

    def _truncated(self):
        return InputError(f"'{self.path}' is truncated: it ends after {self.size} bytes")

    def _damaged(self, how):
        return InputError(f"'{self.path}' is damaged: {how}")


def _opening(kind, packed, table):
    """Make all that goes before the parts."""
    header_stored, table_stored = _deflated(packed), _deflated(table)
    preamble = _PREAMBLE.pack(
        kind.magic, kind.version, 0, len(header_stored), len(packed), len(table_stored), len(table)
    )
    stored = header_stored + table_stored
    return preamble + _CRC.pack(zlib.crc32(stored, zlib.crc32(preamble))) + stored


def _packed(header, sections):
    import msgpack

    return msgpack.packb([[[name, len(parts)] for name, parts in sections.items()], header])


def _packed_table(sections):
    parts = [part for section in sections.values() for part in section]
    lengths = np.array([len(part) for part in parts], dtype=np.int64)
    firsts = np.cumsum([0, *(len(section) for section in sections.values())])
    groups = _group_firsts(lengths, firsts)
    crcs = []
    for first, last in pairwise(groups):
        crc = 0
        for part in parts[first:last]:
            crc = zlib.crc32(part, crc)
        crcs.append(crc)
    return b"".join(map(_leb128, lengths.tolist())) + np.array(crcs, dtype="<u4").tobytes()


def _group_firsts(lengths, firsts):
    """Give the first part of every group, and one past the last part.

    Parameters
    ----------
    lengths : (N,) int64 array
        Of the parts of all sections.
    firsts : (S + 1,) array
        First part of every section, and N.
    """
    begins = np.concatenate([[0], np.cumsum(lengths)])
    counts = np.diff(firsts)
    within = begins[:-1] - np.repeat(begins[firsts[:-1]], counts)
    page = within // _GROUP_BYTES
    section = np.repeat(np.arange(counts.size), counts)
    new = np.ones(lengths.size, dtype=bool)
    new[1:] = (np.diff(page) != 0) | (np.diff(section) != 0)
    return np.concatenate([np.flatnonzero(new), [lengths.size]])


def _leb128(number):
    """Write a number in sevens of bits, the lowest first; the last byte is below 128."""
    data = bytearray()
    while number > 127:
        data.append(number & 127 | 128)
        number >>= 7
    data.append(number)
    return bytes(data)


def _numbers(data, count):
    """Read LEB128 numbers.

    Parameters
    ----------
    data : (B,) uint8 array
    count : int

    Returns
    -------
    (count,) int64 array or None
        None if there are fewer, or one is 2**63 or more.
    int
        How many bytes they took.
    """
    if not count:
        return np.zeros(0, dtype=np.int64), 0
    ends = np.flatnonzero(data < 128)[:count]
    if ends.size < count:
        return None, 0
    used = int(ends[-1]) + 1
    begins = np.concatenate([[0], ends[:-1] + 1])
    sizes = ends - begins + 1
    if sizes.max() > _LONGEST_NUMBER:
        return None, 0
    place = np.arange(used) - np.repeat(begins, sizes)
    sevens = (data[:used] & 127).astype(np.int64) << (7 * place)
    return np.add.reduceat(sevens, begins), used


def _deflated(data):
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    return deflate.compress(data) + deflate.flush()


def _unpacked(packed):
    """Unpack MessagePack into plain types.

    Raises
    ------
    ValueError, TypeError, msgpack.UnpackException
        If it is none, has too many containers or other types.
    """
    import msgpack

    containers = 0

    def checked(container):
        nonlocal containers
        containers += 1
        if containers > _MOST_CONTAINERS or not all(type(each) in _PLAIN for each in container):
            raise ValueError("too many containers, or a value of a type that is not used")
        return container

    def checked_dict(container):
        checked(container.values())
        if not all(isinstance(key, str) for key in container):
            raise ValueError("keys are text")
        return container

    return msgpack.unpackb(
        packed, list_hook=checked, object_hook=checked_dict,
        max_array_len=_LONGEST_LIST, max_map_len=_LONGEST_LIST, max_ext_len=0,
    )  # fmt: skip
