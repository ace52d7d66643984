"""From a raster in memory to all that an `.sct` file holds, and the error that it will have."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from demsmith.core.errors import DemsmithError, InputError
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.raster import BandMeta, Grid
from demsmith.core.sct.file import stored_size
from demsmith.core.sct.header import Made
from demsmith.core.sct.marks import Marks, marks_of
from demsmith.core.sct.patches import PatchMaker
from demsmith.core.sct.quantisation import Quantisation, quantised, quantised_finely

_ROWS = 256
"""Decoded at once when the error is measured: a row of tiles."""

_OVERHEAD = 500
"""Bytes of a file besides what is coded, to begin with."""

_BYTES_WORTH_A_TRY = 0.2
"""For each cell: where so many are allowed, all values may be kept."""

_ROUNDING = 0.5
"""Root mean square error in units below which rounding to units is most of it."""

_LEAST_RMSE = 0.01
"""The least that a tree alone is asked for, in units."""

_TRIES = 4
"""Encodings after which a size or a PSNR that is missed by little is given up."""


@dataclass(frozen=True, eq=False)
class Coded:
    """All that is written, and what is told of it.

    Attributes
    ----------
    encoded : demsmith.core.codec.Encoded
    grid : Grid
    meta : BandMeta
        With the nodata tag of the file.
    quantisation : Quantisation
    marks : Marks
    classes : (H, W) uint8 array
        What `Marks.apply` needs to know.
    made : Made
    notes : list of str
        What the user should know.
    """

    encoded: Any
    grid: Grid
    meta: BandMeta
    quantisation: Quantisation
    marks: Marks
    classes: np.ndarray
    made: Made
    notes: list

    def parts(self):
        """Give the arguments of `demsmith.core.sct.file.write_sct`."""
        return {name: value for name, value in vars(self).items() if name != "notes"}


def coded(source, options, dictionary=None, threads=None, progress=SILENT):
    """Code a raster, decode it again, and measure its error.

    Parameters
    ----------
    source : Raster
    options : CompressOptions
    dictionary : path, optional
        For a tree of patches.
    threads : int, optional
    progress : Progress

    Returns
    -------
    Coded

    Raises
    ------
    InputError
        If nothing is known, or the options contradict each other or ask for what cannot be.
    Cancelled
        If ``progress`` asks to stop.
    """
    mode, wanted = mode_of(options, dictionary)
    if source.void.all():
        raise InputError("every cell is a void; there is nothing to keep")
    work = _Work(source, options, dictionary, mode, wanted, threads)
    if mode == "ratio":
        return work.small_enough(source.values.nbytes / wanted, progress)
    if mode == "psnr":
        return work.good_enough(wanted, progress)
    return work.tried({}, progress)


def mode_of(options, dictionary=None):
    """Tell what is asked for.

    Returns
    -------
    str
        ``max-error``, ``ratio``, ``psnr`` or ``tree``.
    float or None
        The maximum error, ratio or PSNR.

    Raises
    ------
    InputError
        If more than one is.

    Examples
    --------
    >>> from demsmith.core.sct.options import CompressOptions
    >>> mode_of(CompressOptions()), mode_of(CompressOptions(ratio=50))
    (('max-error', 1.0), ('ratio', 50))
    """
    modes = {"max-error": options.max_error, "ratio": options.ratio, "psnr": options.psnr}
    asked = [(mode, value) for mode, value in modes.items() if value is not None]
    if len(asked) > 1:
        listed = " and ".join(mode for mode, _ in asked)
        raise InputError(f"{listed} are asked for at once; give one of max-error, ratio and psnr")
    patches = patches_asked(options, dictionary)
    if patches and asked and asked[0][0] != "max-error":
        raise InputError(
            f"{asked[0][0]} and a tree of patches are asked for at once: its size follows from "
            "atoms, sparsity and radius; leave one out"
        )
    if asked:
        return asked[0]
    return ("tree", None) if patches else ("max-error", 1.0)


def patches_asked(options, dictionary=None):
    """Tell whether a tree of patches is asked for."""
    return any(
        value is not None for value in (options.atoms, options.sparsity, options.radius, dictionary)
    )


class _Work:
    """One raster on its way to be coded, perhaps more than once."""

    def __init__(self, source, options, dictionary, mode, wanted, threads):
        self._source, self._options, self._dictionary = source, options, dictionary
        self._mode, self._wanted, self._threads = mode, wanted, threads
        values, void, meta = source.values, source.void, source.meta
        self._scale = abs(meta.scale) or 1.0
        if mode == "max-error":
            self._quantisation, self._error = quantised(values, void, wanted / self._scale)
        else:
            self._quantisation, self._error = quantised_finely(values, void), None
        self._marks, self._notes = marks_of(values, void, meta)
        if meta.nodata is None and self._marks.nodata is not None:
            meta = replace(meta, nodata=self._marks.nodata.item())
        self._meta = meta
        self._units = self._quantisation.units(values, void)
        known = values[~void]
        self._range = float(known.min()), float(known.max())

    def tried(self, target, progress):
        """Encode for a target, decode and measure."""
        from demsmith.core import codec

        encoded = codec.encode(
            self._units, self._source.void, options=self._codec_options(target),
            threads=self._threads, progress=Span(progress, 0, 0.8),
        )  # fmt: skip
        made, classes = self._measured(encoded, Span(progress, 0.8, 1))
        return Coded(
            encoded, self._source.grid, self._meta, self._quantisation, self._marks, classes, made,
            self._notes,
        )  # fmt: skip

    def small_enough(self, most, progress):
        """Encode until the file takes no more bytes than these."""
        refusal = InputError(
            f"it cannot be made as small as a ratio of {self._wanted:g} asks, {int(most)} bytes: "
            "ask for less"
        )
        if most >= _BYTES_WORTH_A_TRY * self._units.size:
            whole = self._without_loss(_share(progress, 0))
            if whole is not None and stored_size(**whole.parts()) <= most:
                return whole
        target = most - _OVERHEAD - self._bytes_of_voids()
        for number in range(_TRIES):
            try:
                made = self.tried({"bytes": max(1, int(target))}, _share(progress, number))
            except InputError:
                raise refusal from None
            excess = stored_size(**made.parts()) - most
            if excess <= 0:
                return made
            target -= 1.02 * excess + 16
        raise refusal

    def good_enough(self, wanted, progress):
        """Encode until the PSNR is at least this."""
        low, high = self._range
        target = wanted
        if self._in_units((high - low) / 10 ** (target / 20)) < _ROUNDING:
            whole = self._without_loss(progress)
            if whole is not None:
                return whole
        for number in range(_TRIES):
            rmse = self._in_units((high - low) / 10 ** (target / 20))
            made = self.tried({"rmse": max(rmse, _LEAST_RMSE)}, _share(progress, number))
            reached = made.made.psnr
            if reached is None or reached >= wanted:
                return made
            target += wanted - reached + 0.02
        raise InputError(
            f"a PSNR of {wanted:g} dB is not reached, {reached:.2f} dB is; ask for a maximum error "
            "instead"
        )

    def _without_loss(self, progress):
        """Keep every value, if the unit allows it: else None."""
        if self._quantisation.unit != 1:
            return None
        self._error = 0
        whole = self.tried({}, progress)
        self._error = None
        return whole

    def _bytes_of_voids(self):
        from demsmith.core.codec.coding import TILE
        from demsmith.core.codec.tiling import Tiling
        from demsmith.core.codec.voids import encode_voids

        void = self._source.void
        return sum(map(len, encode_voids(void, Tiling(void.shape, TILE), threads=self._threads)))

    def _in_units(self, error):
        return error * self._quantisation.divisor / self._quantisation.unit

    def _codec_options(self, target):
        from demsmith.core.codec import CodecOptions

        patches = None
        if patches_asked(self._options, self._dictionary):
            patches = PatchMaker.of(self._options, self._dictionary, self._source.grid, self._error)
        return CodecOptions(
            max_error=self._error, patches=patches, effort=self._options.effort, **target
        )

    def _measured(self, encoded, progress):
        """Decode, row of tiles by row of tiles, and compare with what was given."""
        from demsmith.core import codec

        values, void = self._source.values, self._source.void
        decoder = codec.Decoder(
            encoded.params, lambda name, index: encoded.sections[name][index], threads=self._threads
        )
        classes = np.zeros(values.shape, np.uint8)
        largest, squares, tree_squares = 0.0, 0.0, 0.0
        for start in range(0, values.shape[0], _ROWS):
            checkpoint(progress, start / values.shape[0])
            rows = slice(start, min(start + _ROWS, values.shape[0]))
            units, unknown = decoder.window(rows.start, rows.stop, 0, values.shape[1])
            if not np.array_equal(unknown, void[rows]):
                raise _fault("other cells are void than before")
            decoded = self._quantisation.values(units)
            classes[rows] = self._marks.classes(values[rows], decoded, unknown)
            self._marks.apply(decoded, unknown, classes[rows])
            known = ~unknown
            wrong = np.abs(decoded[known].astype(np.float64) - values[rows][known])
            largest = max(largest, float(wrong.max(initial=0.0)))
            squares += float(np.dot(wrong, wrong))
            tree = decoder.surface(rows.start, rows.stop, 0, values.shape[1])
            wrong = (tree - self._units[rows])[known].astype(np.float64)
            tree_squares += float(np.dot(wrong, wrong))
        if self._mode == "max-error" and largest * self._scale > self._wanted * (1 + 1e-12):
            raise _fault(f"a cell is wrong by {largest * self._scale:g}")
        return self._made(largest, squares, tree_squares), classes

    def _made(self, largest, squares, tree_squares):
        cells = int(np.count_nonzero(~self._source.void))
        rmse = math.sqrt(squares / cells)
        low, high = self._range
        psnr = 20 * math.log10((high - low) / rmse) if rmse and high > low else None
        ends = sorted(self._source.meta.real(end) for end in self._range)
        tree_rmse = math.sqrt(tree_squares / cells) * self._quantisation.unit
        tree_rmse *= self._scale / self._quantisation.divisor
        return Made(
            self._mode, self._wanted, largest * self._scale, rmse * self._scale, psnr, *ends, cells,
            tree_rmse,
        )  # fmt: skip


def _share(progress, number):
    """Give a try half of what is left of the progress, so that it never goes back."""
    return Span(progress, 1 - 0.5**number, 1 - 0.5 ** (number + 1))


def _fault(what):
    return DemsmithError(
        f"nothing was written: decoded again, {what}; this is a fault of Demsmith, please report it"
    )
