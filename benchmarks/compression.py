"""Compression against every peer: bytes by greatest error, PSNR by bytes, speed.

Run it with ``.venv/bin/python benchmarks/compression.py``; with ``--write`` it puts its section
into ``benchmarks/RESULTS.md``. The peers' bytes are kept, see `compression_peers`; what is missing
there is measured first.
"""

import argparse
import tempfile

import numpy as np
from compression_ours import RATES, Ours
from compression_peers import (
    GEOTIFF,
    GTIFF,
    GTIFF_LERC,
    JPEG_2000,
    JPEG_XL,
    LERC,
    PEERS,
    WAVELET,
    complete,
    results,
    versions,
)
from compression_speed import speeds
from compression_tiles import FLOAT, LARGE, NAMES, ground
from results import provenance, table, write_section

# By greatest error [m]: Demsmith's bytes divided by those of LERC + zstd, and of JPEG XL.
BARS = {0: (None, 1.05), 1: (0.45, 1.02), 2: (0.45, 1.02), 5: (0.45, 1.0), 10: (0.45, 0.85),
        20: (0.45, 0.7)}  # fmt: skip
FINE_ERRORS = (0.05, 0.1, 0.25, 0.5, 1)
COARSE_FLOAT = ("pair_sangabriel (Copernicus)", "pair_bigbutte (NED)")
FINE = tuple(name for name in FLOAT if name not in COARSE_FLOAT)


def main():
    """Run all parts and print or write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update benchmarks/RESULTS.md")
    parser.add_argument("--raster", choices=NAMES, nargs="+", default=list(NAMES))
    parser.add_argument("--effort", default="high", help="of the bytes; speed is of the default")
    parser.add_argument(
        "--part", choices=PARTS, nargs="+", default=list(PARTS), help="print some parts alone"
    )
    arguments = parser.parse_args()
    complete(arguments.raster, [peer for peer in PEERS if peer != WAVELET])
    with tempfile.TemporaryDirectory() as folder:
        ours = Ours(folder, effort=arguments.effort)
        parts = [PARTS[part](ours, arguments.raster) for part in arguments.part]
    text = "\n\n".join([heading(arguments.effort), *parts]) + "\n"
    if arguments.write:
        write_section(text)
    print(text)


def heading(effort):
    """Say what was measured, when, where, and how to read it."""
    return (
        "## Compression: bytes at a guaranteed error, against every peer\n\n"
        f"{provenance('numpy', 'numba', 'imagecodecs')} {versions()}. Repeat with "
        "`.venv/bin/python benchmarks/compression.py`. Every elevation raster of the shared data "
        "but those of a few hundred cells, and `large` (`sierra_nevada` mirrored to 3601 × 3601). "
        f"Demsmith: whole `.sct` files by `--effort {effort}`, with header, georeference, "
        "metadata, tiling, tables and checksums; each was decompressed, its error checked against "
        "the bound and its voids against the input's. Peers: the bare code, nothing for "
        "georeference. *LERC + zstd*: LERC with that greatest error, then zstd -19. *JPEG XL*: "
        "elevations in bins of 2e + 1 (of 2e where they are no whole numbers), then lossless, "
        "effort 9. Every peer has the raster in one piece, and voids in the way that makes fewer "
        "bytes: one value below the lowest, or filled from the nearest cell and a compressed "
        "mask; LERC has its own mask. *JPEG 2000 + residual*: JPEG 2000 at the rate that serves "
        "best, and the rest in bins by JPEG XL; in brackets the rasters it was measured on."
    )


# --- bytes at a guaranteed error -----------------------------------------------------------------


def bounded(ours, names):
    """Compare bytes at every greatest error."""
    coarse = [name for name in names if name not in FINE]
    fine = [name for name in names if name in FINE]
    parts = ["### Bytes at a guaranteed greatest error"]
    if coarse:
        parts.append(
            "Rasters of 30 m to 90 m. In brackets: at most.\n\n" + summary(ours, coarse, BARS)
        )
    if fine:
        bars = dict.fromkeys(FINE_ERRORS, (None, None))
        parts.append("Lidar, cells of 0.5 m to 1 m:\n\n" + summary(ours, fine, bars))
    parts.append(
        "Bits per cell by raster; in brackets divided by LERC + zstd's and by JPEG XL's.\n\n"
        + "\n\n".join(
            by_raster(ours, group, errors)
            for group, errors in ((coarse, BARS), (fine, FINE_ERRORS))
            if group
        )
    )
    return "\n\n".join(parts)


def summary(ours, names, bars):
    """Give mean and worst ratios to the two bounded peers, by error."""
    rows = []
    for error, (lerc_bar, jpegxl_bar) in bars.items():
        there = [name for name in names if error in ground(name).errors]
        row = [f"{error:g} m", len(there)]
        for peer, bar in ((LERC, lerc_bar), (JPEG_XL, jpegxl_bar)):
            ratios = [ratio(ours, name, peer, error) for name in there]
            worst = int(np.argmax(ratios))
            limit = f" (≤ {bar})" if bar else ""
            row += [f"{np.mean(ratios):.3f}", f"**{ratios[worst]:.3f}**{limit}, {there[worst]}"]
        rows.append([*row, _against_wavelet(ours, there, error)])
    head = ["error", "rasters", "÷ LERC + zstd, mean", "worst", "÷ JPEG XL, mean", "worst"]
    return table([*head, "÷ JPEG 2000 + residual, mean; worst"], rows)


def _against_wavelet(ours, names, error):
    """Give mean and worst ratio to a wavelet base with a residual, where that was measured."""
    there = [name for name in names if error in results(ground(name)).get(WAVELET, {})]
    ratios = [ratio(ours, name, WAVELET, error) for name in there]
    return f"{np.mean(ratios):.3f}; {max(ratios):.3f} ({len(ratios)})" if ratios else "–"


def by_raster(ours, names, errors):
    """Give bits per cell and both ratios of every raster by error."""
    rows = [[name, *(_bits_and_ratios(ours, name, error) for error in errors)] for name in names]
    return table(["raster", *(f"{error:g} m" for error in errors)], rows)


def _bits_and_ratios(ours, name, error):
    if error not in ground(name).errors:
        return "–"
    bits = 8 * ours.bounded(ground(name))[error].size / ground(name).cells
    return f"{bits:.3f} (" + ", ".join(
        f"{ratio(ours, name, peer, error):.2f}" for peer in (LERC, JPEG_XL)
    ) + ")"  # fmt: skip


def ratio(ours, name, peer, error):
    """Give Demsmith's bytes divided by a peer's, at the same greatest error."""
    return ours.bounded(ground(name))[error].size / peer_size(name, peer, error)


def peer_size(name, peer, error):
    """Give a bounded peer's fewest bytes at a greatest error: a smaller one may take fewer."""
    kept = results(ground(name))[peer]
    return min(result.size for bound, result in kept.items() if bound <= error)


# --- lossless ------------------------------------------------------------------------------------


def lossless(ours, names):
    """Compare lossless bits per cell of whole elevations."""
    names = [name for name in names if ground(name).whole and name != LARGE]
    peers = (*(f"{GTIFF} {codec}" for codec in GEOTIFF), GTIFF_LERC, LERC, JPEG_2000, JPEG_XL)
    rows = []
    for name in names:
        sizes = lossless_peers(name)
        mine = ours.bounded(ground(name))[0].size
        best = min(size for peer, size in sizes.items() if peer.startswith(GTIFF))
        bits = [8 * size / ground(name).cells for size in (mine, *(sizes[peer] for peer in peers))]
        ratios = f"**{mine / sizes[JPEG_XL]:.3f}**", f"**{mine / best:.3f}**"
        rows.append([name, *map("{:.3f}".format, bits), *ratios])
    return (
        "### Lossless, whole elevations: bits per cell\n\nGeoTIFF in one strip, predictor 2, each "
        "codec at its highest level. Asked: ≤ 1.05 × JPEG XL, < 1 × the best GeoTIFF. "
        f"Without `{LARGE}`: LZMA and zstd find its copies of one tile.\n\n"
        + table(["raster", "**Demsmith**", *peers, "÷ JPEG XL", "÷ best GeoTIFF"], rows)
    )


def lossless_peers(name):
    """Give the bytes of every lossless peer."""
    kept = results(ground(name))
    geotiff = {f"{GTIFF} {codec}": result.size for codec, result in kept[GTIFF].items()}
    others = {peer: kept[peer][0].size for peer in (GTIFF_LERC, LERC, JPEG_2000, JPEG_XL)}
    return geotiff | others


# --- PSNR at equal bytes -------------------------------------------------------------------------


def lossy(ours, names):
    """Compare PSNR at equal bytes, without a bound."""
    rows, lead = [], []
    for name in names:
        gains = [gain(ours, name, rate) for rate in RATES]
        psnr = [ground(name).psnr(ours.lossy(ground(name))[rate].rmse) for rate in RATES]
        lead.append(gains)
        rows.append([name, *map("{:.1f} ({:+.2f})".format, psnr, gains)])
    rows.append(["**mean lead**", *(f"**{each:+.2f}**" for each in np.nanmean(lead, axis=0))])
    return (
        "### PSNR [dB] at equal bytes, without the residual layer\n\nAgainst the raster's relief; "
        "in brackets the lead over JPEG 2000 (OpenJPEG, 9/7, one tile) at the same bytes. Columns: "
        "bits per cell asked for.\n\n" + table(["raster", *map("{:g}".format, RATES)], rows)
    )


def gain(ours, name, rate):
    """Give the lead in PSNR over JPEG 2000 at the bytes that Demsmith made of a rate [dB]."""
    mine = ours.lossy(ground(name))[rate]
    sizes, psnr = jpeg2000_curve(name)
    if not sizes[0] <= mine.size <= sizes[-1]:
        return float("nan")
    theirs = np.interp(np.log(mine.size), np.log(sizes), psnr)
    return ground(name).psnr(mine.rmse) - theirs


def jpeg2000_curve(name):
    """Give JPEG 2000's bytes, ascending, and PSNR [dB]."""
    kept = results(ground(name))[JPEG_2000]
    curve = {result.size: ground(name).psnr(result.rmse) for rate, result in kept.items() if rate}
    sizes = sorted(curve)
    return sizes, [curve[size] for size in sizes]


PARTS = {
    "bounded": bounded,
    "lossless": lossless,
    "lossy": lossy,
    "speed": lambda ours, _: speeds(Ours(ours.folder)),
}

if __name__ == "__main__":
    main()
