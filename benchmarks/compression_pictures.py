"""The pictures of compression: error by bytes, and where the error is."""

from tempfile import TemporaryDirectory

import numpy as np
from compression import jpeg2000_curve, peer_size
from compression_ours import Ours
from compression_peers import JPEG_XL, LERC
from compression_tiles import ground

from demsmith.core.sct import open_sct

CURVES = ("sierra_nevada", "white_mountains", "pyrenees_raw", "kossou_plain")
TILE = "sierra_nevada"
WINDOW = np.s_[880:1120, 700:1000]
ERROR = 10  # [m], of the map


def draw_curves(axes):
    """Draw PSNR and the greatest error by bits per cell into two axes."""
    with TemporaryDirectory() as folder:
        ours = Ours(folder, effort="high")
        for number, name in enumerate(CURVES):
            _draw_psnr(axes[0], ours, name, f"C{number}")
        _draw_errors(axes[1], ours)
    axes[0].set(
        title="without the residual layer", xlabel="bits per cell", ylabel="PSNR [dB]", xscale="log"
    )
    axes[1].set(
        title=f"guaranteed, {TILE}", xlabel="bits per cell", ylabel="greatest error [m]",
        xscale="log", yscale="log",
    )  # fmt: skip
    for axis in axes:
        axis.grid(which="both", color="0.9")
        axis.spines[["top", "right"]].set_visible(False)
        axis.legend(frameon=False, fontsize=8)


def _draw_psnr(axis, ours, name, colour):
    mine = ours.lossy(ground(name)).values()
    bits = 8 / ground(name).cells
    psnr = [ground(name).psnr(result.rmse) for result in mine]
    axis.plot([bits * each.size for each in mine], psnr, color=colour, label=f"{name}, Demsmith",
              marker="o", markersize=3)  # fmt: skip
    sizes, theirs = jpeg2000_curve(name)
    axis.plot(bits * np.array(sizes), theirs, color=colour, linestyle="--", label="JPEG 2000")


def _draw_errors(axis, ours):
    errors = [error for error in ground(TILE).errors if error]
    bits = 8 / ground(TILE).cells
    mine = ours.bounded(ground(TILE))
    lines = {"Demsmith": [mine[error].size for error in errors]} | {
        label: [peer_size(TILE, peer, error) for error in errors]
        for label, peer in (("JPEG XL of bins", JPEG_XL), (LERC, LERC))
    }
    for label, sizes in lines.items():
        axis.plot(bits * np.array(sizes), errors, label=label, marker="o", markersize=4,
                  linestyle="-" if label == "Demsmith" else "--")  # fmt: skip
    axis.set_yticks(errors, [str(error) for error in errors])
    axis.set_yticks([], minor=True)


def error_maps():
    """Give a window of a tile, the base's error there, and the error after the residual [m].

    Returns
    -------
    ground : (H, W) int array
        Elevations.
    base, held : (H, W) arrays
        Decoded less true elevation without and with the residual layer.
    bits : float
        Bits per cell of the file.
    """
    with TemporaryDirectory() as folder:
        path = Ours(folder, effort="high").compress(ground(TILE), max_error=ERROR)
        bits = 8 * path.stat().st_size / ground(TILE).cells
        rows, columns = WINDOW
        part = rows.start, rows.stop, columns.start, columns.stop
        with open_sct(path) as opened:
            surface = opened.decoder.surface(*part)
            base = opened.quantisation.values(np.rint(surface).astype(np.int32))
            held = opened.read(rows, columns).values
    true = ground(TILE).values[WINDOW]
    return true, base - true, held - true, bits
