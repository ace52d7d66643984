"""How fast Demsmith compresses and decompresses, and its peers beside it."""

import statistics
import time

import imagecodecs
import numpy as np
from compression_tiles import INTEGER_ERRORS, LARGE, ground
from results import table

from demsmith.core.sct import open_sct
from demsmith.core.sparse import LearnOptions, learn_file

ROUNDS = 3
ERROR = 5  # [m], where one is enough
WINDOW = 256
TILE = "sierra_nevada"


def speeds(ours):
    """Time everything, medians of some rounds."""
    dictionary, seconds = trained(ours.folder)
    rows = [*encoding(ours, dictionary), *decoding(ours, dictionary), *peers()]
    head = ["what", "raster", "million cells/s", "asked"]
    return (
        f"### Speed, median of {ROUNDS}\n\n"
        "Demsmith on two threads, peers on one. Encoding: from file to file. Decoding: from the "
        "file to an array. The dictionary of 128 atoms was trained by K-SVD on "
        f"{TILE} in {seconds:.1f} s.\n\n" + table(head, rows) + f"\n\n{window(ours)}"
    )


def trained(folder):
    """Learn the dictionary of 128 atoms at 2 per patch; gives its path and the seconds."""
    path = folder / "trained.dsd"
    begin = time.perf_counter()
    learn_file(
        [ground(TILE).file(folder)], path,
        options=LearnOptions(atoms=128, sparsity=2), overwrite=True,
    )  # fmt: skip
    return path, time.perf_counter() - begin


def encoding(ours, dictionary):
    """Time compressing."""
    paper = {"sparsity": 2, "dictionary": dictionary}
    cases = [("s = 2, N = 128, dictionary trained before", LARGE, paper, "≥ 1")]
    cases += [(f"≤ {error} m", TILE, {"max_error": error}, "") for error in INTEGER_ERRORS]
    cases.append((f"≤ {ERROR} m, effort high", TILE, {"max_error": ERROR, "effort": "high"}, ""))
    cases.append((f"≤ {ERROR} m", LARGE, {"max_error": ERROR}, ""))
    for label, name, what, bar in cases:
        seconds = median(lambda name=name, what=what: ours.compress(ground(name), **what))
        yield [f"encode, {label}", name, rate(name, seconds), bar]


def decoding(ours, dictionary):
    """Time decompressing, with and without the residual layer."""
    path = ours.compress(ground(LARGE), sparsity=2, dictionary=dictionary)
    yield ["decode, s = 2, N = 128", LARGE, rate(LARGE, median(lambda: base(path))), "≥ 30"]
    path = ours.compress(ground(LARGE), max_error=ERROR)
    for label, decode, bar in (("without", base, "≥ 30"), ("with", whole, "≥ 5")):
        seconds = median(lambda decode=decode: decode(path))
        yield [f"decode, ≤ {ERROR} m, {label} its residual layer", LARGE, rate(LARGE, seconds), bar]


def window(ours):
    """Time windows of the large raster, opening the file included."""
    path = ours.compress(ground(LARGE), max_error=ERROR)
    rng = np.random.default_rng(0)
    rows, columns = ground(LARGE).values.shape
    milliseconds = []
    for _ in range(20):
        row, column = rng.integers(rows - WINDOW), rng.integers(columns - WINDOW)
        begin = time.perf_counter()
        with open_sct(path) as opened:
            opened.read(slice(row, row + WINDOW), slice(column, column + WINDOW))
        milliseconds.append(1000 * (time.perf_counter() - begin))
    return (
        f"A window of {WINDOW} × {WINDOW} cells anywhere in {LARGE} (≤ {ERROR} m), opening the "
        f"file included, 20 windows: median **{statistics.median(milliseconds):.1f} ms**, slowest "
        f"{max(milliseconds):.1f} ms (asked: < 50)."
    )


def whole(path):
    """Decode a whole file to an array of elevations."""
    with open_sct(path) as opened:
        opened.read()


def base(path):
    """Decode a whole file's tree to an array, without the residual layer."""
    with open_sct(path) as opened:
        rows, columns = opened.grid.shape
        opened.decoder.surface(0, rows, 0, columns)


def peers():
    """Time the peers on one tile, from array to array."""
    values = ground(TILE).values
    bins = np.rint(values / (2 * ERROR + 1)).astype(np.int32)
    bins = (bins - bins.min()).astype(np.uint16)
    elevations = values.astype(np.int16)
    coders = {
        f"LERC + zstd, ≤ {ERROR} m": (
            lambda: imagecodecs.zstd_encode(
                imagecodecs.lerc_encode(elevations, level=ERROR), level=19
            ),
            lambda code: imagecodecs.lerc_decode(imagecodecs.zstd_decode(code)),
        ),
        f"JPEG XL effort 9, ≤ {ERROR} m": (
            lambda: imagecodecs.jpegxl_encode(bins, lossless=True, effort=9, numthreads=1),
            lambda code: imagecodecs.jpegxl_decode(code, numthreads=1),
        ),
        "JPEG 2000, lossless": (
            lambda: imagecodecs.jpeg2k_encode(
                (elevations - elevations.min()).astype(np.uint16), level=0, numthreads=1
            ),
            lambda code: imagecodecs.jpeg2k_decode(code, numthreads=1),
        ),
    }
    for label, (encode, decode) in coders.items():
        code = encode()
        yield [f"{label}: encode", TILE, rate(TILE, median(encode)), ""]
        yield [f"{label}: decode", TILE, rate(TILE, median(lambda d=decode, c=code: d(c))), ""]


def median(step):
    """Give the median seconds of a step, warm."""
    step()
    seconds = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        step()
        seconds.append(time.perf_counter() - begin)
    return statistics.median(seconds)


def rate(name, seconds):
    """Give million cells per second."""
    return f"**{ground(name).cells / seconds / 1e6:.2f}**"
