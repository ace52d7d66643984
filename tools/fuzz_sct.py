"""Reads files that are damaged on purpose: only clean errors, in little time and memory.

    python tools/fuzz_sct.py --inputs 1000000
    python tools/fuzz_sct.py --seconds 3600 --seed 7 --keep failures/

Small `.sct` and `.dsd` files of every kind are made, and damaged in all ways that one can think of:
bits flipped, ends cut off, pieces moved, left out and mixed with those of other files; and, with
all checksums put right again so that what lies behind them is reached, fields of headers, tables
and the bytes of parts. Each is opened, told of, and decoded, in a process of its own whose memory
is limited. A failure is any other error than `InputError` or `OutputError`, a crash, an input that
takes longer than `--slowest` seconds, and one for which the process grows by more than `--memory`.
"""

import argparse
import multiprocessing
import random
import resource
import shutil
import struct
import sys
import tempfile
import time
import zlib
from pathlib import Path

import numpy as np

from demsmith.core import sct
from demsmith.core.errors import InputError, OutputError
from demsmith.core.raster import BandMeta, Grid, Raster
from demsmith.core.sct.coding import coded
from demsmith.core.sct.file import KIND, write_sct
from demsmith.core.sct.scaling import resampled
from demsmith.core.sectioned import open_sectioned, write_sectioned
from demsmith.core.sparse import dictionary_file
from demsmith.core.sparse.learning import learn

_PREAMBLE = struct.Struct("<4sHHIIII")
_CHECKED_EVERY = 0.2  # seconds
_ODD = (
    None, True, False, 0, 1, -1, 2, 255, 256, 257, 65535, 65536, 1 << 20, (1 << 31) - 1, 1 << 31,
    -(1 << 31), 1 << 40, (1 << 63) - 1, (1 << 64) - 1, -(1 << 63), 0.0, -0.0, 1.5, 1e-320, 1e308,
    -1e308, float("nan"), float("inf"), "", "x", "EPSG:4326", "/etc/passwd", "pyramid", "patches",
    b"", b"\0" * 46, b"\xff" * 46, [], [1], [[]], {}, {"a": 1},
)  # fmt: skip


def main(argv=None):
    """Fuzz; returns 1 if anything failed."""
    options = _options(argv)
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        seeds = _seeds(Path(folder))
        print(f"{len(seeds)} files of {sum(map(len, seeds.values()))} bytes", flush=True)
        run = _Run(options, seeds, Path(folder))
        run.all()
    print(run.report())
    return 1 if run.failures else 0


def _options(argv):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, help="how many; default 10000 without --seconds")
    parser.add_argument("--seconds", type=float, help="how long, at most")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--slowest", type=float, default=30.0, metavar="SECONDS")
    parser.add_argument("--memory", type=int, default=1024, metavar="MB")
    parser.add_argument("--keep", type=Path, help="folder for inputs that failed")
    options = parser.parse_args(argv)
    if options.inputs is None:
        options.inputs = 10_000 if options.seconds is None else sys.maxsize
    return options


# --- the files that are damaged ------------------------------------------------------------------


def _seeds(folder):
    """Make files of every kind; returns their bytes by name."""
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:70, :90] / 9.0
    ground = 500 + 80 * np.sin(x) * np.cos(1.3 * y) + 30 * np.sin(2 * x + y)
    ground += rng.normal(0, 0.3, ground.shape)
    wide = np.tile(ground, (4, 3))
    void = np.zeros(ground.shape, bool)
    void[20:30, 40:60] = void[:3] = True
    marked = np.where(void, -9999, ground)
    whole = marked.astype(np.int32)
    marked[22, 45:50] = np.nan
    makes = {
        "lossless": (ground.astype(np.int16), None, dict(max_error=0)),
        "bounded": (ground.astype(np.float32), None, dict(max_error=0.5)),
        "voids": (marked.astype(np.float32), void, dict(max_error=3)),
        "tiles": (wide.astype(np.int16), None, dict(max_error=2)),
        "small": (ground.astype(np.float64), None, dict(psnr=45)),
        "patches": (ground.astype(np.int16), None, dict(atoms=8, sparsity=2)),
        "patches bounded": (whole, void, dict(atoms=8, max_error=2)),
    }
    seeds = {}
    for name, (values, empty, options) in makes.items():
        path = folder / "seed.sct"
        _write(path, values, empty, options)
        seeds[f"{name}.sct"] = path.read_bytes()
    for name, method, precision in (
        ("ksvd", "ksvd", "float32"), ("halves", "constrained", "float16"),
        ("bytes", "constrained", "int8"), ("complete", "complete", "float32"),
    ):  # fmt: skip
        path = folder / "seed.dsd"
        learned = learn(ground.astype(np.float32), method=method, atoms=6, iterations=2)
        dictionary_file.write_dictionary(path, learned.dictionary, precision=precision)
        seeds[f"{name}.dsd"] = path.read_bytes()
    return seeds


def _write(path, values, void, options):
    void = np.zeros(values.shape, bool) if void is None else void
    grid = Grid(values.shape, (10.0, 0.001, 0.0, 50.0, 0.0, -0.001), "EPSG:4326")
    meta = BandMeta(
        dtype=values.dtype, nodata=-9999, unit="m", dataset_metadata={"a": "b"},
        categories=("x",), color_table={1: (1, 2, 3, 4)}, gcps=((1.0, 2.0, 3.0, 4.0, 5.0),),
    )  # fmt: skip
    made = coded(Raster(values, void, grid, meta), sct.CompressOptions(effort="low", **options))
    write_sct(path, **made.parts())


# --- damage --------------------------------------------------------------------------------------


def _damaged(seeds, number, seed, scratch):
    """Make the input of this number; returns its extension and bytes."""
    rng = random.Random(f"{seed} {number}")  # noqa: S311, chance is all that is needed
    name = rng.choice(sorted(seeds))
    data, kind = seeds[name], name[-4:]
    damage = rng.choice((_flipped, _cut, _moved, _spliced, _told_wrong, _told_wrong, _recoded,
                         _recoded, _retabled, _resized))  # fmt: skip
    return kind, damage(bytearray(data), rng, seeds, scratch, kind)


def _flipped(data, rng, *_):
    for _ in range(rng.choice((1, 1, 1, 2, 8, 64))):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return data


def _cut(data, rng, *_):
    return data[: rng.randrange(len(data))]


def _moved(data, rng, *_):
    """Leave out, repeat or overwrite a piece."""
    first, last = sorted(rng.randrange(len(data)) for _ in range(2))
    piece, at = data[first:last], rng.randrange(len(data))
    way = rng.randrange(3)
    if way == 0:
        return data[:first] + data[last:]
    return data[:at] + piece + data[at + (len(piece) if way == 1 else 0) :]


def _spliced(data, rng, seeds, *_):
    """Go on as another file does."""
    other = seeds[rng.choice(sorted(seeds))]
    at = rng.randrange(len(data))
    return data[:at] + other[rng.randrange(len(other)) :]


def _told_wrong(data, rng, _, scratch, kind):
    """Put other values into the header."""
    header, sections = _parts_of(data, scratch, kind)
    for _ in range(rng.choice((1, 1, 2, 4))):
        _mutate(header, rng)
    return _rewritten(header, sections, scratch, kind) or data


def _resized(data, rng, _, scratch, kind):
    """Have header and codec speak of another size, alike, and give the tiles to go with it."""
    header, sections = _parts_of(data, scratch, kind)
    if kind == ".dsd":
        return _told_wrong(data, rng, _, scratch, kind)
    shape = [rng.choice((1, 31, 257, 3000, 40_000, 1 << 17, 1 << 20, 1 << 31)) for _ in range(2)]
    shape[rng.randrange(2)] = rng.choice((1, 70, 300, 20_000))
    tiles = -(-shape[0] // 256) * -(-shape[1] // 256)
    header["raster"]["shape"] = shape
    codec = header["codec"]
    for params in (codec, codec.get("patches", {})):
        params |= {"rows": shape[0], "columns": shape[1]}
    for name, parts in sections.items():
        if name not in ("root", "dictionary") and tiles < 2000:
            sections[name] = [parts[number % len(parts)] for number in range(tiles)]
    return _rewritten(header, sections, scratch, kind) or data


def _recoded(data, rng, _, scratch, kind):
    """Damage parts behind right checksums."""
    header, sections = _parts_of(data, scratch, kind)
    for _ in range(rng.choice((1, 1, 2, 4))):
        parts = sections[rng.choice(sorted(sections))]
        if not parts:
            continue
        index = rng.randrange(len(parts))
        part = bytearray(parts[index])
        way = rng.randrange(5)
        if way == 0:
            parts[index] = rng.randbytes(rng.choice((0, 1, 5, 60, len(part))))
        elif way == 1:
            parts.pop(index)
        elif way == 2:
            parts[index] = parts[rng.randrange(len(parts))]
        elif part:
            parts[index] = bytes((_flipped if way == 3 else _cut)(part, rng))
    return _rewritten(header, sections, scratch, kind) or data


def _retabled(data, rng, *_):
    """Damage header or table as they are packed, and put lengths and checksum right."""
    magic, version, zero, *sizes = _PREAMBLE.unpack_from(data)
    start = _PREAMBLE.size + 4
    packed = [
        bytearray(zlib.decompress(data[start : start + sizes[0]], -15)),
        bytearray(zlib.decompress(data[start + sizes[0] :][: sizes[2]], -15)),
    ]
    rest = data[start + sizes[0] + sizes[2] :]
    chosen = rng.randrange(2)
    packed[chosen] = rng.choice((_flipped, _cut, _moved))(packed[chosen], rng)
    stored = []
    for piece in packed:
        deflate = zlib.compressobj(9, zlib.DEFLATED, -15)
        stored.append(deflate.compress(bytes(piece)) + deflate.flush())
    preamble = _PREAMBLE.pack(
        magic, version, zero, len(stored[0]), len(packed[0]), len(stored[1]), len(packed[1])
    )
    body = b"".join(stored)
    return preamble + struct.pack("<I", zlib.crc32(body, zlib.crc32(preamble))) + body + rest


def _kind(extension):
    return KIND if extension == ".sct" else dictionary_file.KIND


def _parts_of(data, scratch, extension):
    path = scratch / f"whole{extension}"
    path.write_bytes(data)
    with open_sectioned(path, _kind(extension)) as file:
        return file.header, {
            name: [file.part(name, index) for index in range(count)]
            for name, count in file.counts.items()
        }


def _rewritten(header, sections, scratch, extension):
    path = scratch / f"new{extension}"
    try:
        write_sectioned(path, _kind(extension), header=header, sections=sections)
    except (InputError, OverflowError, ValueError, TypeError):
        return None  # it cannot even be written
    return path.read_bytes()


def _mutate(value, rng):
    """Change something somewhere in a dictionary or list."""
    keys = list(value) if isinstance(value, dict) else list(range(len(value)))
    if not keys:
        return
    key = rng.choice(keys)
    inner = value[key]
    if isinstance(inner, (dict, list)) and inner and rng.random() < 0.9:
        _mutate(inner, rng)
    elif rng.random() < 0.1 and isinstance(value, dict):
        del value[key]
    elif isinstance(inner, int) and rng.random() < 0.5:
        value[key] = inner + rng.choice((-1, 1, 2, 32, 1000))
    elif isinstance(inner, (int, float)) and rng.random() < 0.3:
        value[key] = inner * rng.choice((-1, 2, 1e3, 1e-3, 1 << 16))
    elif isinstance(inner, bytes) and inner and rng.random() < 0.7:
        value[key] = bytes(_flipped(bytearray(inner), rng))
    else:
        value[key] = rng.choice(_ODD)


# --- reading -------------------------------------------------------------------------------------


def _read(path, extension, number):
    """Do with a file all that users do; says how it went."""
    try:
        if extension == ".dsd":
            dictionary = dictionary_file.read_dictionary(path)
            if len(dictionary) * dictionary.side_rows * dictionary.side_columns < 1 << 22:
                np.sum(dictionary.samples)
            return "read"
        sct.info_file(path)
        with sct.open_sct(path, threads=1) as file:
            _decode(file, random.Random(number))  # noqa: S311
        return "read"
    except (InputError, OutputError):
        return "refused"


def _decode(file, rng):
    rows, columns = (
        slice(start, min(start + 100, side))
        for side in file.grid.shape
        for start in [rng.randrange(side) if side > 100 else 0]
    )
    way = rng.randrange(4)
    if way < 2:
        file.read(rows, columns)
    elif way == 2:
        resampled(file, rows, columns, (20, 30), threads=1)
    else:
        file.overview(1 + rng.randrange(5), slice(0, 1), slice(0, 1))


class _Run:
    """A process that reads, and what watches it."""

    def __init__(self, options, seeds, folder):
        self.options, self._seeds, self._folder = options, seeds, folder
        self.failures = []
        self.counts = {"read": 0, "refused": 0}
        self.slowest, self.grown = 0.0, 0
        self._context = multiprocessing.get_context("fork")
        self._number = self._context.Value("q", 0)  # the input that is being read

    def all(self):
        self._warm_up(Path(tempfile.mkdtemp(dir=self._folder)))
        begin, number = time.perf_counter(), 0
        self._until = begin + (self.options.seconds or 1e12)
        while number < self.options.inputs and time.perf_counter() < self._until:
            number = self._some(number)
        self.seconds = time.perf_counter() - begin

    def _some(self, first):
        """Read from this number on, until the end or a crash; returns the next number."""
        here, there = self._context.Pipe()
        worker = self._context.Process(target=self._work, args=(first, there), daemon=True)
        worker.start()
        there.close()
        number = first
        while True:
            try:
                told = here.recv() if here.poll(2 * self.options.slowest + 5) else None
            except EOFError:
                told = "crash"
            if told == "end":
                break
            if told is None or told == "crash":
                number = self._number.value
                self._fail(number, "hangs" if told is None else "crashes the process")
                number += 1
                break
            number, outcomes = told[0], told[1]
            for name, count in outcomes.items():
                self.counts[name] = self.counts.get(name, 0) + count
            for failed, how in told[2]:
                self._fail(failed, how)
            self.slowest, self.grown = max(self.slowest, told[3]), max(self.grown, told[4])
        worker.kill()
        worker.join()
        return number

    def _work(self, first, pipe):
        scratch = Path(tempfile.mkdtemp(dir=self._folder))
        usual = _status("VmSize")
        limit = usual + (self.options.memory << 20)
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        at_first = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10
        number, told = first, time.perf_counter()
        outcomes, failed, slowest = {}, [], 0.0
        while number < self.options.inputs and time.perf_counter() < self._until:
            self._number.value = number
            extension, data = _damaged(self._seeds, number, self.options.seed, scratch)
            path = scratch / f"x{extension}"
            path.write_bytes(data)
            begin = time.process_time()  # a busy machine is no fault of the input
            try:
                outcome = _read(path, extension, number)
                outcomes[outcome] = outcomes.get(outcome, 0) + 1
            except BaseException as error:
                failed.append((number, f"{type(error).__name__}: {error}"))
            took = time.process_time() - begin
            slowest = max(slowest, took)
            if took > self.options.slowest:
                failed.append((number, f"takes {took:.1f} s"))
            number += 1
            if time.perf_counter() - told > _CHECKED_EVERY or failed:
                grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10) - at_first
                pipe.send((number, outcomes, failed, slowest, grown))
                outcomes, failed, slowest, told = {}, [], 0.0, time.perf_counter()
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10) - at_first
        pipe.send((number, outcomes, failed, slowest, grown))
        pipe.send("end")
        shutil.rmtree(scratch)

    def _warm_up(self, scratch):
        """Load every kernel before time and memory count."""
        for name, data in self._seeds.items():
            path = scratch / f"x{name[-4:]}"
            path.write_bytes(data)
            for number in range(8):
                _read(path, name[-4:], number)

    def _fail(self, number, how):
        self.failures.append((number, how))
        print(f"input {number}: {how}", flush=True)
        if self.options.keep:
            self.options.keep.mkdir(parents=True, exist_ok=True)
            scratch = Path(tempfile.mkdtemp(dir=self._folder))
            extension, data = _damaged(self._seeds, number, self.options.seed, scratch)
            (self.options.keep / f"{number}{extension}").write_bytes(data)

    def report(self):
        inputs = sum(self.counts.values()) + len(self.failures)
        counted = ", ".join(f"{count} {name}" for name, count in self.counts.items())
        return (
            f"{inputs} inputs in {self.seconds:.0f} s: {counted}, {len(self.failures)} failures; "
            f"slowest {self.slowest:.2f} s, memory grew by {self.grown / 2**20:.0f} MB"
        )


def _status(name):
    """Read a size of this process from Linux, in bytes."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(name):
            return int(line.split()[1]) << 10
    raise OSError(f"/proc/self/status has no {name}")


if __name__ == "__main__":
    sys.exit(main())
