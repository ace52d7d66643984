"""`.sct` files: a coded raster with all that its input said, written and opened."""

import contextlib
import operator
import os

import numpy as np

import demsmith
from demsmith.core.errors import InputError
from demsmith.core.parallel import run
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.raster import Raster
from demsmith.core.sct import header
from demsmith.core.sct.marks import packed_classes, unpacked_classes
from demsmith.core.sectioned import TREE as KIND
from demsmith.core.sectioned import open_sectioned, sectioned_size, write_sectioned

LEVELS = 5
"""The coarsest overview has ``1 / 2**LEVELS`` of the resolution."""

CELLS_PER_BYTE = 1 << 20
"""Cells that a byte of a file may stand for, at most, beyond the first 64 million: so that a small
file cannot ask for hours of work. An even larger plain is given room for it."""

_MARKS, _ROOM = "marks", "room"
_FREE_CELLS = 1 << 26
_TILE = 256
"""Cells along the side of a tile of marks."""


def write_sct(path, encoded, *, grid, meta, quantisation, marks, classes, made):
    """Write an `.sct` file, whole or not at all.

    Parameters
    ----------
    path : str or path-like
        An existing file is replaced.
    encoded : demsmith.core.codec.Encoded
        The values in units.
    grid : Grid
    meta : BandMeta
    quantisation : Quantisation
        What the units mean.
    marks : Marks
        What the voids hold.
    classes : (H, W) uint8 array
        As `Marks.classes` gives them.
    made : Made

    Raises
    ------
    InputError
        If the metadata is too large.
    OutputError
        If it cannot be written there.
    """
    parts = _parts(encoded, grid, meta, quantisation, marks, classes, made)
    write_sectioned(path, KIND, **parts)


def stored_size(*, encoded, grid, meta, quantisation, marks, classes, made):
    """Tell how many bytes `write_sct` would write."""
    parts = _parts(encoded, grid, meta, quantisation, marks, classes, made)
    return sectioned_size(KIND, **parts)


def open_sct(path, *, threads=None):
    """Open an `.sct` file; nothing is decoded before it is asked for.

    Parameters
    ----------
    path : str or path-like
    threads : int, optional
        Threads that decode; default: one for each core.

    Returns
    -------
    SctFile
        A context manager.

    Raises
    ------
    InputError
        If the file is missing, no `.sct` file, of a newer version, truncated or damaged.
    """
    return SctFile(os.fspath(path), threads)


class SctFile:
    """An open `.sct` file. What it holds is not trusted, and checked wherever it is used.

    Attributes
    ----------
    path : str
    by : str
        The program that wrote it.
    grid : Grid
    meta : BandMeta
    quantisation : Quantisation
    marks : Marks
    made : Made
        How, and how exactly.
    decoder : demsmith.core.codec.Decoder
        Gives the values in units.
    """

    def __init__(self, path, threads=None):
        from demsmith.core.codec import Decoder
        from demsmith.core.codec.tiling import Tiling

        self.path = path
        self._threads = threads
        self._sections = open_sectioned(path, KIND)
        try:
            fields = self._sections.header
            self.by = fields.get("by", "")
            raster, params = fields.get("raster"), fields.get("codec")
            if not (isinstance(self.by, str) and type(raster) is type(params) is dict):
                raise InputError(f"'{path}' is damaged: its header does not hold what it should")
            with self._told():
                self.grid, self.meta, self.quantisation, self.marks, self.made = header.unpacked(
                    raster
                )
                if self.size < _least_size(self.grid.shape):
                    raise InputError(f"{self.size} bytes are too few for its cells")
                self.decoder = Decoder(params, self._sections.part, threads=threads)
                self._tiling = Tiling(tuple(self.grid.shape), _TILE)
                if tuple(self.decoder.shape) != tuple(self.grid.shape):
                    raise InputError("header and codec speak of different sizes")
                self._check_counts()
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Let go of the file."""
        self._sections.close()

    @property
    def size(self):
        """Bytes of the file."""
        return self._sections.size

    def bytes_by_section(self):
        """Count the bytes of the header, with all tables, and of every section."""
        counted = {name: self._sections.bytes_of(name) for name in self._sections.counts}
        return {"header": self._sections.overhead} | counted

    def read(self, rows=None, columns=None, *, progress=SILENT):
        """Decode the raster or a window of it.

        Parameters
        ----------
        rows, columns : slice, optional
            Ends may be open, or negative: counted from the last. Default: all.
        progress : Progress

        Returns
        -------
        Raster
            Values as they were stored, within the maximum error of the file where it has one;
            void cells hold what they held.

        Raises
        ------
        InputError
            If the window is empty, reaches beyond the raster or leaves cells out, or the file is
            damaged or closed.
        Cancelled
            If ``progress`` asks to stop.
        """
        rows = _whole_slice("rows", rows, self.grid.shape.rows)
        columns = _whole_slice("columns", columns, self.grid.shape.columns)
        grid = self.grid.part(rows, columns)
        with self._told():
            units, void = self.decoder.window(
                rows.start, rows.stop, columns.start, columns.stop, progress=Span(progress, 0, 0.9)
            )
            values = self._stored(units, void, rows, columns)
        checkpoint(progress, 1)
        return Raster(values, void, grid, self.meta, source=self.path)

    def shows_level(self, level):
        """Whether a level of the tree alone is right enough to be shown.

        A file without a maximum error has nothing better. Where there is one, a level's means are
        of ``2**level`` by ``2**level`` cells, and their error that much smaller than the tree's.
        """
        if self.decoder.max_error is None:
            return level >= 1
        bound = self.made.wanted if self.made.mode == "max-error" else 0
        return level >= 2 and self.made.tree_rmse <= bound * 2 ** (level - 2)

    def overview(self, level, rows, columns, *, progress=SILENT):
        """Decode the tree alone at ``1 / 2**level`` of the resolution.

        Parameters
        ----------
        level : int
            From 1 to `LEVELS`.
        rows, columns : slice
            Of the overview, whose cells are squares of ``2**level`` by ``2**level`` cells.
        progress : Progress

        Returns
        -------
        (h, w) float64 array
            Stored values, not rounded; smoothly filled in voids.

        Raises
        ------
        InputError
            If the file is damaged.
        Cancelled
            If ``progress`` asks to stop.
        """
        with self._told():
            units = self.decoder.surface(
                rows.start, rows.stop, columns.start, columns.stop, level=level, progress=progress
            )
        scale = self.quantisation.unit / self.quantisation.divisor
        with np.errstate(over="ignore", invalid="ignore"):  # of a scale that no raster has
            return (units.astype(np.float64) + self.quantisation.first) * scale

    def voids_at(self, rows, columns, *, progress=SILENT):
        """Tell which cells are void.

        Parameters
        ----------
        rows, columns : (h,) and (w,) int arrays
            Which of them; they rise.
        progress : Progress

        Returns
        -------
        (h, w) bool array

        Raises
        ------
        InputError
            If the file is damaged.
        Cancelled
            If ``progress`` asks to stop.
        """
        void = np.zeros((rows.size, columns.size), bool)
        left, right = int(columns[0]), int(columns[-1]) + 1
        for band in np.unique(rows // _TILE).tolist():
            checkpoint(progress, band * _TILE / self.grid.shape.rows)
            lines = np.flatnonzero(rows // _TILE == band)
            top, bottom = int(rows[lines[0]]), int(rows[lines[-1]]) + 1
            with self._told():
                strip = self.decoder.voids(top, bottom, left, right)
            void[lines] = strip[rows[lines] - top][:, columns - left]
        checkpoint(progress, 1)
        return void

    def marked(self, values, void):
        """Round values that were evaluated between cells to what is stored.

        Parameters
        ----------
        values : (h, w) float64 array
        void : (h, w) bool array
            Cells that get the most frequent void value.

        Returns
        -------
        (h, w) array of the raster's data type
        """
        dtype = self.quantisation.dtype
        if dtype.kind != "f":
            limits = np.iinfo(dtype)
            values = np.clip(np.rint(values), float(limits.min), float(limits.max))
        stored = values.astype(dtype)
        self.marks.apply(stored, void)
        return stored

    def _stored(self, units, void, rows, columns):
        """Turn units into what is stored, strip by strip of tiles side by side."""
        values = np.empty(units.shape, self.quantisation.dtype)

        def finish(first, last):
            strip = slice(first - rows.start, last - rows.start)
            values[strip] = self.quantisation.values(units[strip])
            classes = self._classes(slice(first, last), columns)
            self.marks.apply(values[strip], void[strip], classes)

        starts = range(rows.start - rows.start % _TILE, rows.stop, _TILE)
        spans = [(max(start, rows.start), min(start + _TILE, rows.stop)) for start in starts]
        run([lambda span=span: finish(*span) for span in spans], threads=self._threads)
        return values

    def _classes(self, rows, columns):
        """Read the classes of marks of a window; None if the file has none."""
        if _MARKS not in self._sections.counts:
            return None
        window = (rows.start, rows.stop), (columns.start, columns.stop)
        tiles = {tile: self._tiling.slices(tile) for tile in self._tiling.overlapping(*window)}
        corners = list(tiles.values())
        top, left = (side.start for side in corners[0])
        bottom, right = (side.stop for side in corners[-1])
        classes = np.zeros((bottom - top, right - left), np.uint8)
        for tile, (down, across) in tiles.items():
            data = self._sections.part(_MARKS, tile)
            if data:
                target = classes[down.start - top : down.stop - top,
                                 across.start - left : across.stop - left]  # fmt: skip
                target[:] = unpacked_classes(data, target.shape)
        (top, bottom), (left, right) = (
            (window[axis][0] - corner, window[axis][1] - corner)
            for axis, corner in enumerate((top, left))
        )
        return classes[top:bottom, left:right]

    def _check_counts(self):
        """Refuse a file that has not a part for each tile, before any work is done for it."""
        by_tile = dict.fromkeys(("voids", "tree", "residual"), self.decoder.tiling.count)
        for name, count in (by_tile | {_MARKS: self._tiling.count}).items():
            if self._sections.counts.get(name, count) != count:
                raise InputError(f"its section '{name}' has not {count} parts, one for each tile")

    @contextlib.contextmanager
    def _told(self):
        """Have errors name the file."""
        try:
            yield
        except InputError as error:
            if self.path in str(error):
                raise
            how = str(error).removeprefix("damaged file: ")
            raise InputError(f"'{self.path}' is damaged: {how}") from None
        except MemoryError:
            raise InputError(
                f"'{self.path}' has {self.grid.shape.rows} × {self.grid.shape.columns} cells, more "
                "than the memory holds; decode a window of it"
            ) from None


def _whole_slice(name, given, count):
    """Give the same slice with both ends, counted from the first of so many.

    Other than by `slice.indices`, ends beyond the raster stay there, to be refused.
    """
    if given is None:
        return slice(0, count)
    wrong = InputError(
        f"{name} is {given!r}; give a slice of whole numbers and no step, as slice(10, 20)"
    )
    if not isinstance(given, slice) or given.step not in (None, 1):
        raise wrong
    try:
        start = 0 if given.start is None else operator.index(given.start)
        stop = count if given.stop is None else operator.index(given.stop)
    except TypeError:
        raise wrong from None
    return slice(*(end + count if -count <= end < 0 else end for end in (start, stop)))


def _parts(encoded, grid, meta, quantisation, marks, classes, made):
    """Make header and sections."""
    from demsmith.core.codec.tiling import Tiling

    tiling = Tiling(tuple(grid.shape), _TILE)
    sections = dict(encoded.sections)
    if classes.any():
        tiles = map(tiling.slices, range(tiling.count))
        sections[_MARKS] = [packed_classes(classes[tile]) for tile in tiles]
    fields = {
        "by": f"demsmith {demsmith.__version__}",
        "codec": encoded.params,
        "raster": header.packed(grid, meta, quantisation, marks, made),
    }
    missing = _least_size(grid.shape) - sectioned_size(KIND, header=fields, sections=sections)
    if missing > 0:
        sections[_ROOM] = [bytes(missing)]
    return {"header": fields, "sections": sections}


def _least_size(shape):
    """Give the bytes that a file of so many cells must have."""
    return -(-(shape.rows * shape.columns - _FREE_CELLS) // CELLS_PER_BYTE)
