"""Demsmith's own files of the benchmark's rasters, from file to file as users make them."""

from pathlib import Path

import numpy as np
from compression_peers import OWN, Code, Peer, measure

from demsmith.core import raster
from demsmith.core.sct import CompressOptions, compress_file, decompress_file

RATES = (0.05, 0.1, 0.2, 0.4, 0.7, 1.0)  # bits per cell


class Ours:
    """Demsmith's compression, with some options the same throughout.

    Parameters
    ----------
    folder : path
        Where files are written.
    always : options of `CompressOptions`
        Such as ``effort``.
    """

    def __init__(self, folder, **always):
        self.folder = Path(folder)
        self.always = always
        self._kept = {}

    def bounded(self, ground):
        """Give the `Result`s by greatest error [m]."""
        return self._results(ground, Peer(self._by_error, lambda e: e.errors, lambda error: error))

    def lossy(self, ground):
        """Give the `Result`s by rate [bits per cell], without a bound."""
        return self._results(ground, Peer(self._by_rate, lambda _: RATES, lambda _: None))

    def compress(self, ground, dictionary=None, **what):
        """Compress a raster; gives the file's path."""
        path = self.folder / "ours.sct"
        options = CompressOptions(vrt=False, **self.always, **what)
        compress_file(
            ground.file(self.folder), path, options=options, dictionary=dictionary, overwrite=True
        )
        return path

    def round_trip(self, ground, **what):
        """Compress a raster and decompress it; its voids must be those of the input."""
        path = self.compress(ground, **what)
        output = self.folder / "ours.tif"
        decompress_file(path, output, overwrite=True)
        decoded = raster.read(output)
        if not np.array_equal(decoded.void, ground.void):
            raise RuntimeError(f"{ground.name}, {what}: voids differ")
        return Code(path.stat().st_size, decoded.values, OWN)

    def _by_error(self, ground, error):
        code = self.round_trip(ground, max_error=error)
        off = np.abs(code.values.astype(np.float64) - ground.values)[~ground.void].max()
        if off > error:  # to the last bit: no slack as peers have
            raise RuntimeError(f"{ground.name}: off by {off} m, asked {error}")
        return code

    def _by_rate(self, ground, rate):
        raw = 8 * ground.band.values.dtype.itemsize
        return self.round_trip(ground, ratio=raw / rate)

    def _results(self, ground, peer):
        key = ground.name, peer.encode.__name__
        if key not in self._kept:
            self._kept[key] = {each: measure(ground, peer, each) for each in peer.settings(ground)}
        return self._kept[key]
