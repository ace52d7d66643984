"""Other programs that compress rasters, and how small they made ours.

What a coder makes of a raster does not change, so it is kept in ``compression_peers.json`` by what
is in the raster, with the versions of the coders; JPEG XL takes an hour. To fill in what is missing
there: ``nice .venv/bin/python benchmarks/compression_peers.py``; with ``--print``, as a table.

Every peer is given its fairest treatment. It compresses the raster whole, in one piece. A peer
that knows no voids has them filled with the nearest elevation and pays for a mask beside (one bit
per cell, by zstd or JPEG XL, whichever is smaller), or holds them as one value below the lowest
elevation, whichever makes fewer bytes. LERC uses its own mask. Nothing is counted for georeference.
"""

import argparse
import functools
import hashlib
import json
import os
from dataclasses import dataclass, replace
from pathlib import Path

import imagecodecs
import numpy as np
from compression_tiles import NAMES, ground
from osgeo import gdal
from results import table
from scipy.ndimage import distance_transform_edt

CACHE = Path(__file__).resolve().with_name("compression_peers.json")
RATES = (0.03, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0, 1.3)  # bits per cell
SLACK = 1e-6  # of a decoded float32 elevation, relative: its rounding is no fault of the coder
GEOTIFF = {
    "LZW": ["COMPRESS=LZW"],
    "DEFLATE": ["COMPRESS=DEFLATE", "ZLEVEL=12"],
    "ZSTD": ["COMPRESS=ZSTD", "ZSTD_LEVEL=22"],
    "LZMA": ["COMPRESS=LZMA", "LZMA_PRESET=9"],
}
OWN, MASK, VALUE = "own mask", "filled, and a mask", "a value"
gdal.UseExceptions()


@dataclass(frozen=True)
class Result:
    """What a peer made of a raster.

    Attributes
    ----------
    size : int
        Bytes.
    rmse : float
        Root mean square error over the known cells [m].
    voids : str
        How it held them: `OWN`, `MASK` or `VALUE`; empty if there are none.
    """

    size: int
    rmse: float
    voids: str


@dataclass(frozen=True)
class Code:
    """Bytes, what they decode to, and how voids were held."""

    size: int
    values: np.ndarray
    voids: str


# --- the peers: each gives its `Code` for one setting ---------------------------------------------


def lerc(ground, error):
    """LERC with a greatest error [m] and its own mask, then zstd -19."""
    known = ~ground.void
    data = np.where(known, ground.values, ground.values[known].min())
    data = data.astype(np.int16 if ground.whole else np.float32)
    masks = None if known.all() else known
    code = imagecodecs.lerc_encode(data, level=error, masks=masks)
    size = len(imagecodecs.zstd_encode(code, level=19))
    return Code(size, imagecodecs.lerc_decode(code), OWN)


def quantised_jpegxl(ground, error):
    """Bins around multiples of 2e + 1 (whole elevations) or 2e, then lossless JPEG XL, effort 9."""
    step = 2 * error + 1 if ground.whole else 2 * error
    bins = np.rint(ground.values / step).astype(np.int32)
    code = _smaller(bins, ground.void, _jpegxl)
    return replace(code, values=code.values * step)


def wavelet_and_residual(ground, error):
    """JPEG 2000 at the rate that serves best, then what it misses in bins by JPEG XL."""
    trials = {rate: _with_residual(ground, error, rate, effort=3) for rate in RATES}
    best = min(trials, key=lambda rate: trials[rate].size)
    return _with_residual(ground, error, best, effort=9)


def _with_residual(ground, error, rate, effort):
    base = jpeg2000(ground, rate)  # its voids are filled, and their mask is paid for
    whole = np.rint(base.values) if ground.whole else base.values
    step = 2 * error + 1 if ground.whole else 2 * error
    bins = np.where(ground.void, 0, np.rint((ground.values - whole) / step)).astype(np.int32)
    size, _ = _jpegxl(bins - bins.min(), effort)
    return Code(base.size + size, whole + bins * step, base.voids)


def jpeg2000(ground, rate):
    """JPEG 2000 by OpenJPEG in one tile: to a rate [bits per cell], or lossless if it is 0."""
    if rate:
        low, unit = ground.values.min(), 1 if ground.whole else ground.relief / 65_000
        units = np.rint((ground.values - low) / unit).astype(np.int32)
        code = _filled(units, ground.void, functools.partial(_jpeg2000, rate=rate))
        return replace(code, values=code.values * unit + low)
    return _smaller(ground.values, ground.void, _jpeg2000)


def geotiff(ground, codec):
    """GeoTIFF in one strip with a predictor, voids as one value below the lowest; lossless."""
    if ground.whole:
        data = np.where(ground.void, ground.values.min() - 1, ground.values).astype(np.int16)
    else:
        data = np.where(ground.void, np.nan, ground.values).astype(np.float32)
    predictor = f"PREDICTOR={2 if ground.whole else 3}"
    options = [*GEOTIFF[codec], predictor, *_one_strip(data)]
    return Code(*_by_gdal("GTiff", data, options), VALUE)


def geotiff_lerc(ground, error):
    """GeoTIFF in one strip by LERC and zstd with a greatest error [m]."""
    values = ground.values.astype(np.int16 if ground.whole else np.float32)
    options = ["COMPRESS=LERC_ZSTD", f"MAX_Z_ERROR={error}", "ZSTD_LEVEL=22", *_one_strip(values)]
    return _filled(values, ground.void, lambda data: _by_gdal("GTiff", data, options))


@dataclass(frozen=True)
class Peer:
    """A coder.

    Attributes
    ----------
    encode : callable
        By ground and setting: the `Code`.
    settings : callable
        By ground: the settings to run.
    promise : callable
        By setting: the greatest error [m], or None if it promises none.
    """

    encode: object
    settings: object
    promise: object


def _errors(ground):
    return ground.errors


def _large_errors(ground):
    return tuple(error for error in ground.errors if error >= 2)


def _rates(ground):
    return ((0,) if ground.whole else ()) + RATES


LERC, JPEG_XL, JPEG_2000, GTIFF = "LERC + zstd", "JPEG XL", "JPEG 2000", "GeoTIFF"
GTIFF_LERC, WAVELET = "GeoTIFF LERC_ZSTD", "JPEG 2000 + residual by JPEG XL"
PEERS = {
    LERC: Peer(lerc, _errors, lambda error: error),
    JPEG_XL: Peer(quantised_jpegxl, _errors, lambda error: error),
    JPEG_2000: Peer(jpeg2000, _rates, lambda rate: None if rate else 0),
    GTIFF: Peer(geotiff, lambda _: tuple(GEOTIFF), lambda _: 0),
    GTIFF_LERC: Peer(geotiff_lerc, _errors, lambda error: error),
    WAVELET: Peer(wavelet_and_residual, _large_errors, lambda error: error),
}


# --- their parts ---------------------------------------------------------------------------------


def _smaller(units, void, encode):
    """Code whole numbers by a coder of none below 0, with voids filled or as a value."""
    low = units[~void].min()
    code = _filled(units - low, void, encode)
    code = replace(code, values=code.values + low)
    if not void.any():
        return code
    size, decoded = encode(np.where(void, 0, units - low + 1))
    return min(code, Code(size, decoded.astype(int) + low - 1, VALUE), key=lambda each: each.size)


def _filled(values, void, encode):
    """Code values with their voids filled from the nearest cell, and a mask."""
    size, decoded = encode(_nearest(values, void))
    return Code(size + _mask_size(void), decoded.astype(np.float64), MASK)


def _nearest(values, void):
    if not void.any():
        return values
    indices = distance_transform_edt(void, return_distances=False, return_indices=True)
    return values[tuple(indices)]


def _mask_size(void):
    if not void.any():
        return 0
    packed = len(imagecodecs.zstd_encode(np.packbits(void).tobytes(), level=19))
    return min(packed, _jpegxl(void)[0])


def _jpegxl(units, effort=9):
    data = units.astype(np.uint8 if units.max() < 256 else np.uint16)
    code = imagecodecs.jpegxl_encode(data, lossless=True, effort=effort)
    return len(code), imagecodecs.jpegxl_decode(code)


def _jpeg2000(units, rate=None):
    rows, columns = units.shape
    levels = min(8, int(np.log2(min(rows, columns))))  # GDAL's own choice loses 1 dB at 0.05 bits
    options = ["CODEC=J2K", f"BLOCKXSIZE={columns}", f"BLOCKYSIZE={rows}"]
    options += [f"RESOLUTIONS={levels}", "PRECINCTS={32768,32768}"]
    if rate:
        options += ["REVERSIBLE=NO", f"QUALITY={100 * rate / 16}"]
    else:
        options += ["REVERSIBLE=YES", "QUALITY=100"]
    return _by_gdal("JP2OpenJPEG", units.astype(np.uint16), options)


def _one_strip(data):
    return ["TILED=NO", f"BLOCKYSIZE={data.shape[0]}"]


def _by_gdal(driver, data, options):
    """Write an array by a driver of GDAL's: the file's bytes and what it reads there."""
    types = {"uint16": gdal.GDT_UInt16, "int16": gdal.GDT_Int16, "float32": gdal.GDT_Float32}
    rows, columns = data.shape
    kind = types[data.dtype.name]
    memory = gdal.GetDriverByName("MEM").Create("", columns, rows, 1, kind)
    memory.GetRasterBand(1).WriteRaster(0, 0, columns, rows, data.tobytes())
    path = "/vsimem/compression_peer"
    gdal.GetDriverByName(driver).CreateCopy(path, memory, options=options)
    size = gdal.VSIStatL(path).size
    dataset = gdal.Open(path)  # must outlive its band
    decoded = dataset.GetRasterBand(1).ReadRaster()
    del dataset
    gdal.Unlink(path)
    return size, np.frombuffer(decoded, data.dtype).reshape(data.shape)


# --- measuring, and kept results -----------------------------------------------------------------


def measure(ground, peer, setting):
    """Run a `Peer`, check what it promises, and give its `Result`."""
    code = peer.encode(ground, setting)
    known = ~ground.void
    off = code.values[known].astype(np.float64) - ground.values[known]
    promise = peer.promise(setting)
    if promise is not None and np.abs(off).max() > promise + SLACK * np.abs(ground.values).max():
        raise RuntimeError(f"{peer}, {setting}, {ground.name}: off by {np.abs(off).max()} m")
    voids = code.voids if ground.void.any() else ""
    return Result(code.size, float(np.sqrt(np.mean(off**2))), voids)


def results(ground):
    """Give the kept `Result`s of a raster by peer and setting."""
    entry = _kept().get(key(ground), {"peers": {}})
    return {
        peer: {_setting(name): Result(*result) for name, result in by_setting.items()}
        for peer, by_setting in entry["peers"].items()
    }


def key(ground):
    """Name a raster by what is in it."""
    digest = hashlib.sha256(ground.values.tobytes())
    digest.update(np.packbits(ground.void).tobytes())
    return digest.hexdigest()[:16]


@functools.cache
def versions():
    """Name the coders."""
    theirs = dict(part.split("-", 1) for part in imagecodecs.version().split(", ") if "-" in part)
    parts = [f"{name} {theirs[name]}" for name in ("lerc", "libjxl", "zstd")]
    return ", ".join([*parts, f"GDAL {gdal.__version__}"])


def complete(names, peers):
    """Run what is missing among the kept results."""
    for name in names:
        each = ground(name)
        for peer in peers:
            for setting in PEERS[peer].settings(each):
                _complete(each, peer, setting)


def _complete(ground, peer, setting):
    if setting in results(ground).get(peer, {}):
        return
    result = measure(ground, PEERS[peer], setting)
    print(f"{ground.name}, {peer}, {setting}: {8 * result.size / ground.cells:.4f}", flush=True)
    kept = _kept()
    entry = kept.setdefault(key(ground), {"raster": ground.name, "coders": versions(), "peers": {}})
    by_setting = entry["peers"].setdefault(peer, {})
    by_setting[_name(setting)] = [result.size, float(f"{result.rmse:.7g}"), result.voids]
    _keep(kept)


def _name(setting):
    return setting if isinstance(setting, str) else f"{setting:g}"


def _setting(name):
    try:
        return float(name)
    except ValueError:
        return name


def _kept():
    return json.loads(CACHE.read_text()) if CACHE.exists() else {}


def _keep(kept):
    lines = [f"{json.dumps(name)}: {json.dumps(entry)}" for name, entry in kept.items()]
    part = CACHE.with_suffix(".part")
    part.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    os.replace(part, CACHE)


def listing(names):
    """Give the kept results as a table."""
    rows = [
        [name, peer, ", ".join(_cells(ground(name), PEERS[peer], by_setting))]
        for name in names
        for peer, by_setting in results(ground(name)).items()
    ]
    return table(["raster", "peer", "setting: **bits per cell**, or bits: PSNR [dB]"], rows)


def _cells(ground, peer, by_setting):
    for setting, result in by_setting.items():
        bits = f"{8 * result.size / ground.cells:.4f}"
        if peer.promise(setting) is None:
            yield f"{bits}: {ground.psnr(result.rmse):.2f}"
        else:
            yield f"{_name(setting)}: **{bits}**"


def main():
    """Run what is missing, or print what is kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--raster", choices=NAMES, nargs="*", default=list(NAMES))
    parser.add_argument("--peer", choices=PEERS, nargs="*", default=list(PEERS))
    parser.add_argument("--print", action="store_true", help="print the kept results")
    arguments = parser.parse_args()
    if arguments.print:
        print(listing(arguments.raster))
    else:
        complete(arguments.raster, arguments.peer)


if __name__ == "__main__":
    main()
