"""A raster of whole numbers as a coded tree, with or without its residual, and back."""

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.codec import reading
from demsmith.core.codec.patch_base import PatchBase
from demsmith.core.codec.pyramid import LEVELS, Analysis, Pyramid
from demsmith.core.codec.residual import WEIGHTS, decode_residual, encode_residual, plain_of
from demsmith.core.codec.search import (
    best_tree,
    fitted,
    sampled_tiles,
    tree_of_bytes,
    tree_of_rmse,
)
from demsmith.core.codec.tiling import Tiling
from demsmith.core.codec.voids import decode_voids, encode_voids
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Muted, Span, checkpoint

TILE = 256
_LARGEST = 1 << 30
_MOST_CELLS = 1 << 40
_BLOCK = 4  # tiles along the side of what is decoded at once


@dataclass(frozen=True, kw_only=True)
class CodecOptions:
    """How a raster is coded.

    Attributes
    ----------
    max_error : int, optional
        Largest error of a cell, in units; None: no residual, the tree alone.
    rmse : float, optional
        Root mean square error that a pyramid tree alone should have, in units.
    bytes : int, optional
        Size that a pyramid tree alone should have.
    patches : callable, optional
        Makes a patch tree instead of a pyramid: called with a float32 surface, its voids,
        ``threads`` and ``progress``, it gives what `patch_base.encode` does.
    effort : str
        How many trees are tried below a residual: ``low``, ``normal``, ``high``.
    tile : int
        Side of tiles in cells, a multiple of 32.
    """

    max_error: int | None = None
    rmse: float | None = None
    bytes: int | None = None
    patches: object = None
    effort: str = "normal"
    tile: int = TILE


@dataclass(frozen=True, eq=False)
class Encoded:
    """A coded raster.

    Attributes
    ----------
    params : dict
        Of integers, floats, strings, bytes and such dicts.
    sections : dict of list of bytes
        The parts of each section.
    """

    params: dict
    sections: dict = field(default_factory=dict)

    def part(self, section, index):
        """Give a part, as `Decoder` asks for it."""
        return self.sections[section][index]


def encode(values, void, *, options, threads=None, progress=SILENT):
    """Code a raster.

    Parameters
    ----------
    values : int32 (H, W)
        In units, from −2^30 to 2^30. What voids hold does not matter.
    void : bool (H, W)
        Not all of it.
    options : CodecOptions
    threads : int, optional
        Default: one for each core. The bytes do not depend on it.
    progress : Progress

    Returns
    -------
    Encoded

    Raises
    ------
    InputError
        If all is void.
    Cancelled
        If ``progress`` asks to stop.
    """
    if void.all():
        raise InputError("every cell is void: there is nothing to code")
    tiling = Tiling(values.shape, options.tile)
    known = values[~void]
    offset = (int(known.min()) + int(known.max())) // 2
    shifted = values - np.int32(offset)
    surface = filled_surface(shifted, void, threads=threads, progress=Span(progress, 0, 0.05))
    shifted[void] = 0
    params = dict(
        rows=values.shape[0], columns=values.shape[1], tile=options.tile, offset=offset,
        error=-1 if options.max_error is None else options.max_error, voids=int(void.any()),
    )  # fmt: skip
    sections = {}
    if params["voids"]:
        sections["voids"] = encode_voids(void, tiling, threads=threads)
    work = dict(threads=threads, progress=Span(progress, 0.05, 0.5))
    weights, plain = None, None
    if options.max_error is not None:
        plain = plain_of(shifted, void)
    if options.patches is not None:
        tree, more = options.patches(surface, void, **work)
        params |= dict(tree="patches", patches=tree)
        sections |= more
        below = PatchBase(tree, lambda name, index: more[name][index], threads).window(
            0, values.shape[0], 0, values.shape[1], progress=Muted(progress)
        )
        if options.max_error is not None:
            weights, _ = fitted(
                shifted, void, below, tiling, error=options.max_error, plain=plain, threads=threads,
                tiles=sampled_tiles(void, tiling, options.effort), progress=Muted(progress),
            )  # fmt: skip
    else:
        analysis = Analysis(surface, tiling, LEVELS)
        if options.max_error is not None:
            tree, plain, weights = best_tree(
                analysis, shifted, void, tiling, error=options.max_error, plain=plain,
                effort=options.effort, **work,
            )  # fmt: skip
        elif options.bytes is not None:
            tree = tree_of_bytes(analysis, options.bytes, **work)
        else:
            tree = tree_of_rmse(analysis, surface, void, options.rmse, progress=work["progress"])
        params |= dict(tree="pyramid", levels=LEVELS, step=float(tree.step))
        sections |= tree.sections(threads=threads, progress=Span(progress, 0.5, 0.6))
        below = tree.surface()
    if weights is not None:
        if plain is not None:
            params["plain"] = plain
        params["weights"] = weights.astype("<f2").tobytes()
        sections["residual"], _ = encode_residual(
            shifted, void, below, tiling, weights, error=options.max_error, plain=plain,
            threads=threads, progress=Span(progress, 0.6, 1),
        )  # fmt: skip
    checkpoint(progress, 1.0)
    return Encoded(params, sections)


def filled_surface(values, void, *, threads=None, progress=SILENT):
    """Give values as float32, with voids filled smoothly: so they cost the tree least."""
    surface = values.astype(np.float32)
    if void.any():
        from demsmith.core.voids import fill_voids

        filled = fill_voids(surface, void, method="mcmd", threads=threads, progress=progress)
        surface = filled.values
    return surface


class Decoder:
    """A coded raster that is decoded window by window.

    Parameters
    ----------
    params : dict
        `Encoded.params`. They are not trusted.
    part : callable
        Gives the bytes of a part by section and number, as `Encoded.part` does. Not trusted
        either: damaged parts decode to nonsense within bounds, for checksums to find.
    threads : int, optional
        Default: one for each core.

    Attributes
    ----------
    shape : (int, int)
    max_error : int or None
        None: the tree alone.
    tree : str
        ``pyramid`` or ``patches``.

    Raises
    ------
    InputError
        If the params are not possible.
    """

    def __init__(self, params, part, threads=None):
        side = reading.whole(params, "tile", 32, 4096)
        rows = reading.whole(params, "rows", 1, _MOST_CELLS)
        columns = reading.whole(params, "columns", 1, _MOST_CELLS // rows)
        if side % 32:
            raise InputError(f"damaged file: 'tile' is {side}, no multiple of 32")
        self.shape = rows, columns
        self.tiling = Tiling(self.shape, side)
        self.tree = reading.choice(params, "tree", ("pyramid", "patches"))
        self._offset = reading.whole(params, "offset", -_LARGEST, _LARGEST)
        self._has_voids = bool(reading.whole(params, "voids", 0, 1))
        self._part, self._threads = part, threads
        error = reading.whole(params, "error", -1, _LARGEST)
        self.max_error = None if error < 0 else error
        if self.max_error is not None:
            packed = params.get("weights")
            if type(packed) is not bytes or len(packed) != 2 * WEIGHTS:
                raise InputError("damaged file: 'weights' are not what they should be")
            weights = np.frombuffer(packed, "<f2").astype(np.float32)
            if not np.all(np.abs(weights) < 1000):
                raise InputError("damaged file: 'weights' are no possible ones")
            self._weights = weights
            self._plain = None
            if "plain" in params:
                self._plain = reading.whole(params, "plain", -_LARGEST, _LARGEST)
        if self.tree == "pyramid":
            levels = reading.whole(params, "levels", LEVELS, LEVELS)
            step = reading.number(params, "step", 2.0**-10, 2.0**45)
            self._base = Pyramid(self.tiling, step, levels, part, threads)
        else:
            patches = params.get("patches")
            if type(patches) is not dict:
                raise InputError("damaged file: 'patches' are missing")
            self._base = PatchBase(patches, part, threads)
            if tuple(self._base.shape) != self.shape:
                raise InputError("damaged file: tree and raster differ in size")

    def window(self, row0, row1, col0, col1, *, progress=SILENT):
        """Decode the cells of a window.

        Parameters
        ----------
        row0, row1, col0, col1 : int
            First row and one past the last; columns likewise.
        progress : Progress

        Returns
        -------
        values : int32 (rows, columns)
            In units; 0 in voids.
        void : bool (rows, columns)

        Raises
        ------
        InputError
            If it is no window of the raster.
        Cancelled
            If ``progress`` asks to stop.
        """
        rows, columns = self._checked(row0, row1, col0, col1)
        values = np.empty((row1 - row0, col1 - col0), np.int32)
        void = np.zeros(values.shape, bool)
        blocks = list(self._blocks(rows, columns))
        for done, block in enumerate(blocks):
            self._decode_block(
                block, rows, columns, values, void,
                Span(progress, done / len(blocks), (done + 1) / len(blocks)),
            )  # fmt: skip
        values[void] = 0
        return values, void

    def surface(self, row0, row1, col0, col1, *, level=0, progress=SILENT):
        """Evaluate the tree alone, without the residual.

        Parameters
        ----------
        row0, row1, col0, col1 : int
            On the lattice of ``level``, of ⌈rows / 2^level⌉ × ⌈columns / 2^level⌉.
        level : int
            0: at the cells; up to 5: at the middles of squares of 2^level × 2^level cells, from a
            pyramid's coarse levels alone, as means of about that size.
        progress : Progress

        Returns
        -------
        float32 (rows, columns)
            In units.
        """
        scale = 1 << level
        shape = tuple(-(-side // scale) for side in self.shape)
        rows, columns = self._checked(row0, row1, col0, col1, shape)
        return self._tree_values(rows, columns, level, progress) + np.float32(self._offset)

    def voids(self, row0, row1, col0, col1):
        """Decode the voids of a window as a bool array."""
        rows, columns = self._checked(row0, row1, col0, col1)
        void = np.zeros((row1 - row0, col1 - col0), bool)
        if self._has_voids:
            for tile in self.tiling.overlapping(rows, columns):
                place, inner = _meeting(self.tiling.slices(tile), rows, columns)
                void[place] = self._tile_voids(tile)[inner]
        return void

    def _checked(self, row0, row1, col0, col1, shape=None):
        shape = shape or self.shape
        if not (0 <= row0 < row1 <= shape[0] and 0 <= col0 < col1 <= shape[1]):
            raise InputError(
                f"rows {row0} to {row1}, columns {col0} to {col1} are no window of "
                f"{shape[0]} × {shape[1]} cells"
            )
        return (row0, row1), (col0, col1)

    def _blocks(self, rows, columns):
        """Give groups of tiles (rows and columns of cells) that cover a window."""
        side = _BLOCK * self.tiling.side
        for row in range(rows[0] // side * side, rows[1], side):
            for column in range(columns[0] // side * side, columns[1], side):
                yield (
                    (max(row, rows[0]), min(row + side, rows[1])),
                    (max(column, columns[0]), min(column + side, columns[1])),
                )

    def _decode_block(self, block, rows, columns, values, void, progress):
        place = tuple(
            slice(start - origin[0], stop - origin[0])
            for (start, stop), origin in zip(block, (rows, columns), strict=True)
        )
        if self.max_error is None:
            void[place] = self.voids(*block[0], *block[1])
            surface = self._tree_values(*block, 0, progress)
            limit = np.float32(_LARGEST)
            whole = np.rint(np.clip(np.nan_to_num(surface), -limit, limit)).astype(np.int64)
            values[place] = whole + self._offset
            return
        tiles = list(self.tiling.overlapping(*block))
        # Tiles are decoded from their first row to the last that is asked for. The tree below them
        # reaches a cell beyond, within the raster.
        cells = [
            (slice(down.start, min(down.stop, block[0][1])), across)
            for down, across in map(self.tiling.slices, tiles)
        ]
        outer = tuple(
            (max(min(part[axis].start for part in cells) - 1, 0),
             min(max(part[axis].stop for part in cells) + 1, self.shape[axis]))
            for axis in (0, 1)
        )  # fmt: skip
        surface = self._tree_values(*outer, 0, Span(progress, 0, 0.5))
        corner = outer[0][0], outer[1][0]

        def decode(tile, part):
            around = _with_border(surface, corner, part, self.shape)
            unknown = self._tile_voids(tile)[: part[0].stop - part[0].start]
            decoded = decode_residual(
                unknown, around, self._weights, error=self.max_error,
                plain=self._plain, part=self._part("residual", tile),
            )  # fmt: skip
            to, inner = _meeting(part, rows, columns)
            values[to] = decoded[inner].astype(np.int64) + self._offset
            void[to] = unknown[inner]

        parallel.run(
            [partial(decode, tile, part) for tile, part in zip(tiles, cells, strict=True)],
            threads=self._threads, progress=Span(progress, 0.5, 1),
        )  # fmt: skip

    def _tile_voids(self, tile):
        shape = tuple(part.stop - part.start for part in self.tiling.slices(tile))
        return decode_voids(shape, self._part("voids", tile) if self._has_voids else b"")

    def _tree_values(self, rows, columns, level, progress):
        if self.tree == "pyramid":
            if level:
                return self._base.overview(rows, columns, level, progress=progress)
            return self._base.window(rows, columns, progress=progress)
        return self._base.window(*rows, *columns, scale=0.5**level, progress=progress)


def _meeting(part, rows, columns):
    """Give where a tile's cells lie in a window, and where the window's lie in the tile."""
    place, inner = [], []
    for cells, (start, stop) in zip(part, (rows, columns), strict=True):
        first, last = max(cells.start, start), min(cells.stop, stop)
        place.append(slice(first - start, last - start))
        inner.append(slice(first - cells.start, last - cells.start))
    return tuple(place), tuple(inner)


def _with_border(surface, corner, part, shape):
    """Cut a tile with a cell around out of a surface; beyond the raster its edge goes on."""
    lines = [
        np.clip(np.arange(cells.start - 1, cells.stop + 1), 0, end - 1) - first
        for cells, first, end in zip(part, corner, shape, strict=True)
    ]
    return surface[np.ix_(*lines)]
