"""The container of `.sct` and `.dsd` files: what it keeps, what it refuses, and what it costs."""

import os
import struct
import threading
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from demsmith.core.errors import InputError, OutputError
from demsmith.core.sectioned import MEMORY_BOUND, Kind, open_sectioned, write_sectioned

KIND = Kind(b"TEST", 2, "test file (.test)")
HEADER = {
    "step": 0.1,
    "name": "Ålesund",
    "raw": b"\x00\xff",
    "list": [1, None, True],
    "d": {"a": 1},
}
SECTIONS = {
    "base": [bytes([number]) * (37 * number) for number in range(40)],
    "none": [],
    "mask": [b"", b"", b"x" * 9000, b""],
}
PREAMBLE = struct.Struct("<4sHHIIII")


def written(tmp_path, header=HEADER, sections=SECTIONS):
    path = str(tmp_path / "x.test")
    write_sectioned(path, KIND, header=header, sections=sections)
    return path


def everything(path):
    with open_sectioned(path, KIND) as file:
        return file.header, {
            name: [file.part(name, index) for index in range(count)]
            for name, count in file.counts.items()
        }


def patched(path, change):
    """Change the stored bytes by a function of a bytearray."""
    data = bytearray(Path(path).read_bytes())
    changed = change(data)
    Path(path).write_bytes(data if changed is None else changed)
    return path


def with_header(path, packed=None, table=None):
    """Put another header or table, packed, in a file, with right lengths and checksum."""
    data = Path(path).read_bytes()
    magic, version, zero, *sizes = PREAMBLE.unpack_from(data)
    start = PREAMBLE.size + 4
    pieces = [data[start : start + sizes[0]], data[start + sizes[0] :][: sizes[2]]]
    for place, new in enumerate((packed, table)):
        if new is not None:
            deflate = zlib.compressobj(9, zlib.DEFLATED, -15)
            pieces[place] = deflate.compress(new) + deflate.flush()
            sizes[2 * place : 2 * place + 2] = len(pieces[place]), len(new)
    rest = data[start + PREAMBLE.unpack_from(data)[3] + PREAMBLE.unpack_from(data)[5] :]
    preamble = PREAMBLE.pack(magic, version, zero, *sizes)
    stored = b"".join(pieces)
    crc = struct.pack("<I", zlib.crc32(stored, zlib.crc32(preamble)))
    Path(path).write_bytes(preamble + crc + stored + rest)
    return path


def test_gives_back_what_was_written(tmp_path):
    assert everything(written(tmp_path)) == (HEADER, SECTIONS)


def test_sizes_add_up(tmp_path):
    path = written(tmp_path)
    with open_sectioned(path, KIND) as file:
        assert file.size == os.path.getsize(path)
        assert file.bytes_of("mask") == 9000
        assert file.bytes_of("none") == 0
        assert file.overhead + sum(map(file.bytes_of, file.counts)) == file.size


def test_parts_come_in_any_order_from_any_thread(tmp_path):
    path = written(tmp_path)
    wrong = []
    with open_sectioned(path, KIND) as file:

        def read(seed):
            for index in np.random.default_rng(seed).permutation(40):
                if file.part("base", index) != SECTIONS["base"][index]:
                    wrong.append(index)

        threads = [threading.Thread(target=read, args=(seed,)) for seed in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert not wrong


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.dictionaries(
        st.text(max_size=8),
        st.lists(st.integers(0, 6000).map(lambda size: bytes([size % 251]) * size), max_size=30),
        max_size=5,
    )
)
def test_any_sections_come_back(tmp_path, sections):
    assert everything(written(tmp_path, {}, sections))[1] == sections


def test_a_small_part_costs_a_few_bytes(tmp_path):
    rng = np.random.default_rng(0)
    for count, size, allowed in ((25, 1600, 5), (10_000, 40, 2.5)):
        lengths = rng.integers(size // 2, size * 3 // 2, count)
        sections = {"base": [rng.bytes(length) for length in lengths]}
        with open_sectioned(written(tmp_path, {}, sections), KIND) as file:
            assert file.overhead < 60 + allowed * count


@pytest.mark.parametrize("section", ["base", "mask"])
def test_a_damaged_part_is_told_and_others_are_read(tmp_path, section):
    path = written(tmp_path)
    with open_sectioned(path, KIND) as file:
        start = file.overhead + (0 if section == "base" else file.bytes_of("base"))

    def flip(data):
        data[start + 5] ^= 4

    patched(path, flip)
    with open_sectioned(path, KIND) as file:
        with pytest.raises(InputError, match=f"x.test' is damaged: the checksum .*'{section}'"):
            file.part(section, 2)
        other = "mask" if section == "base" else "base"
        assert file.part(other, 2) == SECTIONS[other][2]


def test_every_flipped_bit_and_every_length_is_noticed(tmp_path):
    path = written(tmp_path, {"a": 1}, {"b": [b"abc", b"", b"defgh"]})
    whole = Path(path).read_bytes()
    for place in range(8 * len(whole)):
        data = bytearray(whole)
        data[place // 8] ^= 1 << place % 8
        Path(path).write_bytes(data)
        with pytest.raises(InputError):
            everything(path)
    for length in range(len(whole)):
        Path(path).write_bytes(whole[:length])
        with pytest.raises(InputError):
            everything(path)
    Path(path).write_bytes(whole + b"\0")
    with pytest.raises(InputError, match="1 bytes too many"):
        everything(path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda data: data[:-1], "is truncated"),
        (lambda data: data[:20], "is truncated"),
        (lambda data: b"TES", "is no test file"),
        (lambda data: b"GIF8" + data[4:], "is no test file"),
        (lambda data: b"", "is empty"),
        (lambda data: data[:4] + b"\3\0" + data[6:], "of version 3, .*reads up to 2"),
    ],
)
def test_refused(tmp_path, change, said):
    path = patched(written(tmp_path), change)
    with pytest.raises(InputError, match=said):
        open_sectioned(path, KIND)


def test_an_older_version_is_read(tmp_path):
    path = str(tmp_path / "old.test")
    write_sectioned(path, Kind(b"TEST", 1, "test file"), header={}, sections={})
    with open_sectioned(path, KIND) as file:
        assert file.counts == {}


def test_a_missing_file_and_a_folder(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        open_sectioned(tmp_path / "none.test", KIND)
    with pytest.raises(InputError, match="cannot be opened"):
        open_sectioned(tmp_path, KIND)


@pytest.mark.parametrize(
    "packed",
    [
        b"\xc0",  # nil
        b"\x92\x90",  # cut off
        b"\x92\x90\x80\x80",  # too long
        b"\x92\x90\x90",  # header is a list
        b"\x92\x80\x80",  # sections are a dictionary: allowed to be empty only
        b"\x92\x91\x92\xa1a\xff\x80",  # -1 parts
        b"\x92\x91\x92\xa1a\xcb\x3f\xf0\0\0\0\0\0\0\x80",  # 1.0 parts
        b"\x92\x91\x92\xa1a\xc3\x80",  # True parts
        b"\x92\x91\x92\xa1a\xcf" + b"\xff" * 8 + b"\x80",  # 2^64 - 1 parts
        b"\x92\x92\x92\xa1a\x01\x92\xa1a\x01\x80",  # one name twice
        b"\x92\x91\x92\x01\x01\x80",  # a name that is a number
        b"\x92\x90\x81\xc4\x01a\x01",  # a key of bytes
        b"\x92\x90\x81\xa1a\xd6\xff\0\0\0\1",  # a timestamp
        b"\x92\x90\x81\xa1a\xd4\x05\0",  # an extension
        b"\x92\x90\x81\xa1a\xa1\xff",  # no UTF-8
        b"\x92\x90\x81\xa1a" + b"\x91" * 2000 + b"\xc0",  # nested
        b"\x92\x90\x81\xa1a" + b"\xdd\0\x40\0\0" * 500,  # huge lists in each other
        b"\x92\x90\x81\xa1a\xdc\x20\0" + (b"\xdc\x20\0" + b"\x90" * 8192) * 20,  # many
    ],
)
def test_a_header_that_lies_is_refused_in_little_memory(tmp_path, packed):
    path = with_header(written(tmp_path, {}, {"a": [b"x"]}), packed)
    tracemalloc.start()
    with pytest.raises(InputError, match="damaged"):
        open_sectioned(path, KIND)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 80 << 20


@pytest.mark.parametrize(
    "table",
    [
        b"",
        b"\x01",
        b"\x81",
        b"\x02\0\0\0\0",
        b"\x01\0\0\0\0\0",
        b"\xff" * 8 + b"\x7f\0\0\0\0",
        b"\xff" * 12 + b"\x01\0\0\0\0",
    ],
)
def test_a_table_that_lies_is_refused(tmp_path, table):
    path = with_header(written(tmp_path, {}, {"a": [b"x"]}), table=table)
    with pytest.raises(InputError, match="damaged|truncated"):
        everything(path)


def test_a_bomb_stays_within_the_bound(tmp_path):
    path = written(tmp_path, {}, {"a": [b"x"]})
    count = (4 << 20) - 4
    packed = b"\x92\x91\x92\xa1a\xce" + struct.pack(">I", count) + b"\x80"
    tracemalloc.start()
    with pytest.raises(InputError):
        open_sectioned(with_header(path, packed, bytes(4 << 20)), KIND)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert os.path.getsize(path) < 20_000
    assert peak < MEMORY_BOUND
    for size in (1 << 22, 1 << 30, 2**32 - 1):

        def lie(data, size=size):
            data[12:16] = struct.pack("<I", size)

        with pytest.raises(InputError):
            open_sectioned(patched(path, lie), KIND)


def test_no_such_part(tmp_path):
    with open_sectioned(written(tmp_path), KIND) as file:
        for section, index in (("base", 40), ("base", -1), ("none", 0), ("other", 0)):
            with pytest.raises(InputError, match=f"section '{section}' has no part {index}"):
                file.part(section, index)


def test_a_closed_file_says_so(tmp_path):
    file = open_sectioned(written(tmp_path), KIND)
    file.close()
    with pytest.raises(InputError, match="is closed"):
        file.part("base", 3)


def test_too_large_a_header_is_refused_when_written(tmp_path):
    with pytest.raises(InputError, match="header would hold"):
        written(tmp_path, {"text": "x" * (4 << 20)})
    assert os.listdir(tmp_path) == []


def test_an_unwritable_place(tmp_path):
    with pytest.raises(OutputError, match="cannot write"):
        write_sectioned(tmp_path / "no" / "x.test", KIND, header={}, sections={})
