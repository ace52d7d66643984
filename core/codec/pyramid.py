"""The pyramid tree: levels of wavelet atoms, each a lattice twice as coarse as the one below.

A Sparse Construction Tree (Guérin et al. 2016) whose dictionary is the three atoms of the CDF 9/7
wavelet: a primitive of level ``k`` stands at every second one of level ``k − 1``, its atoms are
``2^k`` times as wide as those of the cells, and the levels are added. Atoms of all places and
levels are nearly orthogonal, so that pursuit is one transform and a threshold; coefficients are
rounded to whole steps and most are zero. The coarsest lattice, the root, holds means.

The root is one part; the coefficients of every tile of cells are another, coarse levels first, so
that an overview and the surroundings of a window decode only the beginning of a part.
"""

import threading
from collections import OrderedDict
from dataclasses import dataclass
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.codec import _details, _residual
from demsmith.core.codec._coder import (
    INPUTS,
    SIZE_WEIGHT_SETS,
    buffer_for,
    close_stream,
    coding_room,
    open_stream,
)
from demsmith.core.codec._details import PAD
from demsmith.core.codec._wavelet import SUPPORT, forward, inverse
from demsmith.core.codec.priors import primed
from demsmith.core.progress import SILENT

LEVELS = 5
_THRESHOLD = np.float32(0.62)  # of a step: below it a coefficient costs more than it mends
_ROOT_WEIGHTS = _residual.fixed_weights(
    # The root is predicted by a plane through the nearest means, a little smoothed.
    np.concatenate([[0.5, 0.5, -0.6, 0.1], np.zeros(_residual.FEATURES - 4)])
)
_KEPT_BYTES = 1 << 27  # of decoded coefficients, for the next window


class Geometry:
    """Sizes of the levels' lattices, and the part of each that belongs to a tile."""

    def __init__(self, tiling, levels):
        self.tiling, self.levels = tiling, levels
        self.shapes = [tuple(tiling.shape)]
        for _ in range(levels):
            self.shapes.append(tuple((side + 1) // 2 for side in self.shapes[-1]))

    def means(self, tile, level):
        """Rows and columns, each (start, stop), of a level's means within a tile."""
        scale = 1 << level
        return tuple(
            (side.start // scale, -(-side.stop // scale)) for side in self.tiling.slices(tile)
        )

    def bands(self, tile, level):
        """Rows and columns of a level's three bands (across, down, both) within a tile."""
        rows, columns = self.means(tile, level)
        odd = tuple((start // 2, stop // 2) for start, stop in self.means(tile, level - 1))
        return (rows, odd[1]), (odd[0], columns), odd


class Analysis:
    """All coefficients of a surface, from which its tree follows for any step.

    Parameters
    ----------
    surface : float32 (H, W)
    tiling : Tiling
    levels : int
    """

    def __init__(self, surface, tiling, levels=LEVELS):
        self._geometry = Geometry(tiling, levels)
        self._low, self._details = np.array(surface, np.float32), []
        for _ in range(levels):
            self._low, *bands = forward(self._low)
            self._details.append(bands)

    def tree(self, step):
        """Round the coefficients to whole steps; small ones become zero."""
        step = np.float32(step)
        details = [[_whole_steps(band, step) for band in bands] for bands in self._details]
        root = np.rint(self._low / step).astype(np.int32)
        return PyramidTree(self._geometry, step, root, details)


@dataclass(frozen=True, eq=False)
class PyramidTree:
    """A pyramid tree with all its coefficients, in whole steps.

    Attributes
    ----------
    geometry : Geometry
    step : float32
    root : int32 array
    details : list of lists of int32 arrays
        The three bands of each level, from the finest on.
    """

    geometry: Geometry
    step: np.float32
    root: np.ndarray
    details: list

    def surface(self):
        """Evaluate it at all cells: the very float32 values of `Pyramid.window`."""
        surface = _values(self.root, self.step)
        for bands in reversed(self.details):
            surface = inverse(surface, *(_values(band, self.step) for band in bands))
        return surface

    def bands(self, tile):
        """Cut out a tile's bands, coarse levels first, with `PAD` zeros around each."""
        return [
            np.pad(self.details[level - 1][kind][slice(*rows), slice(*columns)], PAD)
            for level in range(self.geometry.levels, 0, -1)
            for kind, (rows, columns) in enumerate(self.geometry.bands(tile, level))
        ]

    def sections(self, *, tiles=None, threads=None, progress=SILENT):
        """Code it.

        Parameters
        ----------
        tiles : list of int, optional
            Tiles to code; default: all. The parts of others are empty.
        threads, progress
            As everywhere.

        Returns
        -------
        dict of list of bytes
            ``root`` and ``tree``.
        """
        geometry = self.geometry
        parts = [b""] * geometry.tiling.count

        def code(tile):
            parts[tile] = code_bands(self.bands(tile), geometry.levels, 0, None, _room())

        chosen = range(geometry.tiling.count) if tiles is None else tiles
        parallel.run([partial(code, tile) for tile in chosen], threads=threads, progress=progress)
        return {"root": [_code_root(self.root.copy(), None)], "tree": parts}


def _whole_steps(band, step):
    scaled = band / step
    return np.copysign(np.floor(np.abs(scaled) + (1 - _THRESHOLD)), scaled).astype(np.int32)


def _values(steps, step):
    """Give coefficients of whole steps: exact products, rounded once."""
    return (steps * np.float64(step)).astype(np.float32)


def _code_root(root, part):
    """Code the root if ``part`` is None, else decode it into ``root``; give the bytes."""
    room = _residual.workspace(*root.shape)
    decisions = _residual.DECISIONS_PER_CELL * root.size
    data = buffer_for(decisions) if part is None else np.frombuffer(part, np.uint8)
    _residual.code_tile(
        root, np.zeros(root.shape, bool), np.zeros(np.add(root.shape, 2), np.float32), 0,
        _residual.NO_PLAIN, _ROOT_WEIGHTS, data=data, decoding=part is not None, **room,
    )  # fmt: skip
    return data[: room["coder"][3]].tobytes()


def _room():
    room = coding_room(_details.STATES, INPUTS, SIZE_WEIGHT_SETS)
    return primed("details", room)


def code_bands(bands, levels, finest, part, room):
    """Code a tile's padded bands, coarse levels first, down to level ``finest + 1``.

    Or decode them into ``bands`` if there is a ``part``. Gives the bytes.
    """
    decisions = (_details.DECISIONS_PER_CELL * sum(band.size for band in bands)) + 1024
    data = buffer_for(decisions) if part is None else np.frombuffer(part, np.uint8)
    open_stream(data=data, decoding=part is not None, **room)
    nothing = np.zeros((2 * PAD, 2 * PAD), np.int32)
    parents = [nothing] * 3
    for level in range(levels, finest, -1):
        three = bands[3 * (levels - level) : 3 * (levels - level) + 3]
        for kind, band in enumerate(three):
            blank = np.zeros_like(band)
            _details.code_band(
                band, parents[kind], three[0] if kind else blank, three[1] if kind > 1 else blank,
                kind, min(level - 1, 7), at=np.zeros(INPUTS, np.int64), data=data,
                decoding=part is not None, **room,
            )  # fmt: skip
        parents = three
    if part is None:
        close_stream(data=data, **room)
    return data[: room["coder"][3]].tobytes()


class Pyramid:
    """A pyramid tree that is read from its parts.

    Parameters
    ----------
    tiling : Tiling
    step : float
    levels : int
        As they were encoded.
    part : callable
        Gives the bytes of a section's part by name and number. They are not trusted: whatever
        they are, some surface results.
    threads : int, optional
    """

    def __init__(self, tiling, step, levels, part, threads=None):
        self._geometry = Geometry(tiling, levels)
        self._step, self._part, self._threads = np.float32(step), part, threads
        self._kept, self._lock = OrderedDict(), threading.Lock()
        self._root = None

    def window(self, rows, columns, *, level=0, progress=SILENT):
        """Evaluate the tree at the cells of a window, or at a coarser level's lattice.

        Parameters
        ----------
        rows, columns : (int, int)
            First and one past the last, on the lattice of ``level``.
        level : int
            0: cells; ``k``: every ``2^k``-th cell from the first on, of a surface smoothed that
            much, from coarse levels alone.
        progress : Progress

        Returns
        -------
        float32 (rows, columns)
            In the surface's unit. Bit by bit the same whatever window a place is part of.
        """
        geometry = self._geometry
        spans = [(rows, columns)]
        for k in range(level + 1, geometry.levels + 1):
            spans.append(
                tuple(
                    (max((start - SUPPORT) // 2, 0), min((stop + SUPPORT + 1) // 2, end))
                    for (start, stop), end in zip(spans[-1], geometry.shapes[k], strict=True)
                )
            )
        self._decode(spans, level, progress)
        surface = self._root_values()[slice(*spans[-1][0]), slice(*spans[-1][1])]
        for k in range(geometry.levels, level, -1):
            surface = self._join(surface, spans[k - level], spans[k - level - 1], k)
        return surface * np.float32(0.5**level)

    def overview(self, rows, columns, level, *, progress=SILENT):
        """Give means of about ``2^level`` × ``2^level`` cells, from the levels that they need.

        A level's lattice stands on the first cells of such squares, their middles lie half a
        square on. So means are made from the lattice that is four times as fine (or from the cells:
        then they are exact), with weights whose middle is the square's.

        Parameters
        ----------
        rows, columns : (int, int)
            First and one past the last square.
        level : int
            From 1 to the number of levels.
        progress : Progress

        Returns
        -------
        float32 (rows, columns)
        """
        finer = max(level - 2, 0)
        size = 1 << (level - finer)
        weights = np.full(size + 1, 1 / size, np.float32)
        # A place of the finer lattice is 2^finer cells from the next, but its first cell's.
        weights[0] = (1 + 1 / (1 << finer)) / (2 * size)
        weights[-1] = (1 - 1 / (1 << finer)) / (2 * size)
        spans = [
            (size * start, min(size * stop + 1, end))
            for (start, stop), end in zip(
                (rows, columns), self._geometry.shapes[finer], strict=True
            )
        ]
        means = self.window(*spans, level=finer, progress=progress)
        for axis, (start, stop) in enumerate((rows, columns)):
            first = size * np.arange(stop - start)
            last = means.shape[axis] - 1
            parts = (
                np.take(means, np.minimum(first + k, last), axis) * weights[k]
                for k in range(size + 1)
            )
            means = sum(parts, start=np.float32(0))
        return means

    def _root_values(self):
        with self._lock:
            if self._root is None:
                root = np.zeros(self._geometry.shapes[-1], np.int32)
                _code_root(root, self._part("root", 0))
                self._root = _values(root, self._step)
            return self._root

    def _decode(self, spans, level, progress):
        """Decode the tiles that a window needs, each down to the finest level needed of it."""
        tiling, needed = self._geometry.tiling, {}
        for k in range(self._geometry.levels, level, -1):
            scale = 1 << k
            cells = [
                (start * scale, min(stop * scale, end))
                for (start, stop), end in zip(spans[k - level], tiling.shape, strict=True)
            ]
            needed.update((tile, k - 1) for tile in tiling.overlapping(*cells))
        tasks = [partial(self._tile, tile, finest) for tile, finest in needed.items()]
        parallel.run(tasks, threads=self._threads, progress=progress)

    def _tile(self, tile, finest):
        """Give a tile's padded bands, coarse levels first, decoded down to ``finest + 1``."""
        with self._lock:
            kept = self._kept.get(tile)
            if kept is not None and kept[0] <= finest:
                self._kept.move_to_end(tile)
                return kept[1]
        levels = self._geometry.levels
        bands = [
            np.zeros([stop - start + 2 * PAD for start, stop in span], np.int32)
            for level in range(levels, finest, -1)
            for span in self._geometry.bands(tile, level)
        ]
        part = self._part("tree", tile)
        code_bands(bands, levels, finest, part, _room())
        with self._lock:
            self._kept[tile] = finest, bands
            room = max(_KEPT_BYTES // (4 * self._geometry.tiling.side**2), 9)
            while len(self._kept) > room:
                self._kept.popitem(last=False)
        return bands

    def _join(self, low, span, finer, level):
        """Join a level's window of means with its details; give the finer window."""
        geometry = self._geometry
        fine_shape = geometry.shapes[level - 1]
        odd = [
            (start, min(stop, end // 2))
            for (start, stop), end in zip(span, fine_shape, strict=True)
        ]
        wanted = (span[0], odd[1]), (odd[0], span[1]), tuple(odd)
        steps = [np.zeros([stop - start for start, stop in pair], np.int32) for pair in wanted]
        scale = 1 << level
        cells = [
            (start * scale, min(stop * scale, end))
            for (start, stop), end in zip(span, geometry.tiling.shape, strict=True)
        ]
        for tile in geometry.tiling.overlapping(*cells):
            held = self._tile(tile, level - 1)
            first = 3 * (geometry.levels - level)
            for kind, place in enumerate(geometry.bands(tile, level)):
                _paste(steps[kind], wanted[kind], held[first + kind], place)
        bands = (_values(band, self._step) for band in steps)
        fine = inverse(np.ascontiguousarray(low), *bands)
        cut = tuple(
            slice(start - 2 * from_, stop - 2 * from_)
            for (start, stop), (from_, _) in zip(finer, span, strict=True)
        )
        return np.ascontiguousarray(fine[cut])


def _paste(window, wanted, band, place):
    """Copy what a tile's padded band has of a window."""
    inner = [(max(a, c), min(b, d)) for (a, b), (c, d) in zip(wanted, place, strict=True)]
    if any(start >= stop for start, stop in inner):
        return
    to = tuple(slice(a - w[0], b - w[0]) for (a, b), w in zip(inner, wanted, strict=True))
    of = tuple(
        slice(a - p[0] + PAD, b - p[0] + PAD) for (a, b), p in zip(inner, place, strict=True)
    )
    window[to] = band[of]
