"""The patch tree as a base: quantised and coded, and any window of it decoded.

Means and coefficients are rounded to steps, the dictionary's samples to finer ones. Discs are
coded in square tiles of the lattice that do not know of each other (`_patch_coding`), so that a
window needs only the tiles over it. What the decoder makes of the bytes are float32 numbers that
depend on nothing else.
"""

import math
import threading
from collections import OrderedDict
from dataclasses import replace
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span
from demsmith.core.sparse.patch_tree import Discs, PatchTree, blend, window_discs
from demsmith.core.sparse.patches import PatchGrid, gather
from demsmith.core.sparse.pursuit import LARGEST_SPARSITY
from demsmith.core.sparse.refinement import refine

MOST_SAMPLES = 1 << 24
"""Samples of all atoms of a dictionary, at most: 64 MB once decoded."""

_MOST_ATOMS = 1 << 16
_MOST_LINES = 1 << 22
_MOST_IN_TILE = 1 << 17  # discs times sparsity
_LEAST_TILE = 16
_PART_SAMPLES = 1 << 18  # of a part of the dictionary
_TILE = 64  # discs along its side
_TILES_KEPT = 64
_ROUNDING = 0.4
"""What is added before steps of a coefficient are cut off: less than a half, for small steps cost
more bits than they mend."""

_FINEST, _COARSEST = 1 / 512, 1 / 8
_SMALLEST, _LARGEST, _STEEPEST = 1e-30, 1e21, 1e9
"""Bounds of floats in damaged params, that keep what follows from them finite in float32."""


def encode(
    values, void, *, tree, step, coefficient_step=None, atom_step=None, sweeps=4, threads=None,
    progress=SILENT,
):  # fmt: skip
    """Quantise and code a patch tree.

    Parameters
    ----------
    values : (H, W) float32 array
        Elevations that the tree approximates.
    void : (H, W) bool array
    tree : PatchTree
    step : float
        Of the means, in units of elevation.
    coefficient_step : float, optional
        Of the coefficients, in the same units, as atoms have a root mean square of 1. Default:
        twice ``step``: bits that a mean takes are worth more than a coefficient's.
    atom_step : float, optional
        Of the atoms' samples. Default: such that it adds about half the error of the
        coefficients' rounding, between 1/512 and 1/8.
    sweeps : int
        Of the joint refinement (`sparse.refine`) once the atoms are rounded, 0 for none.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    params : dict of int and float
    sections : dict of str to list of bytes
        Together what `PatchBase` takes.

    Raises
    ------
    InputError
        If a step is not above 0, or so small or the dictionary so large that numbers grow beyond
        the format's.
    Cancelled
        If ``progress`` asks to stop.
    """
    coefficient_step = 2 * step if coefficient_step is None else coefficient_step
    tree = _used_atoms(tree)
    if atom_step is None:
        atom_step = _fit_atom_step(tree, coefficient_step)
    for name, value in (
        ("step", step), ("coefficient_step", coefficient_step), ("atom_step", atom_step)
    ):  # fmt: skip
        if not (math.isfinite(value) and value > 0):
            raise InputError(f"{name} is {value}; it must be a number above 0")
    atoms = _rounded(tree.atoms, atom_step, "atom_step")
    tree = replace(tree, atoms=_scaled(atoms, atom_step))
    if sweeps:
        tree = refine(
            values, void, tree=tree, sweeps=sweeps, threads=threads,
            progress=Span(progress, 0, 0.7),
        )  # fmt: skip
    grid = tree.grid
    offset = float(np.round(tree.means.mean(dtype=np.float64) / step) * step)
    params = dict(
        rows=grid.shape[0], columns=grid.shape[1], side_rows=grid.side_rows,
        side_columns=grid.side_columns, step_rows=grid.step_rows, step_columns=grid.step_columns,
        atoms=len(atoms), sparsity=tree.sparsity, step=float(step),
        coefficient_step=float(coefficient_step), atom_step=float(atom_step), offset=offset,
        tile=_TILE if tree.sparsity * _TILE**2 <= _MOST_IN_TILE else _TILE // 2,
    )  # fmt: skip
    layout = _Layout(params)
    discs = _Quantised(tree, atoms, layout, values, void)
    sections = {"dictionary": [b""] * len(layout.atom_parts), "discs": [b""] * layout.tiles}

    def code_atoms(index):
        part = atoms[layout.atom_parts[index]]
        sections["dictionary"][index] = _code_atoms(layout, part)

    def code_discs(tile):
        sections["discs"][tile] = discs.code(tile)

    tasks = [partial(code_atoms, index) for index in range(len(layout.atom_parts))]
    tasks += [partial(code_discs, tile) for tile in range(layout.tiles)]
    parallel.run(tasks, threads=threads, progress=Span(progress, 0.7 if sweeps else 0, 1))
    return params, sections


def _used_atoms(tree):
    """Give the tree with the atoms it uses, the most used first."""
    uses = np.bincount(
        tree.indices[tree.coefficients != 0], minlength=len(tree.atoms)
    )  # fmt: skip
    order = np.argsort(-uses, kind="stable")[: max(1, np.count_nonzero(uses))]
    place = np.zeros(len(tree.atoms), np.int32)
    place[order] = np.arange(order.size)
    return replace(tree, atoms=tree.atoms[order], indices=place[tree.indices])


def _fit_atom_step(tree, coefficient_step):
    used = tree.coefficients[tree.coefficients != 0].astype(np.float64)
    typical = math.sqrt((used**2).mean()) if used.size else 1.0
    return min(max(coefficient_step / (2 * typical), _FINEST), _COARSEST)


def _rounded(numbers, step, name, rounding=0.5):
    """Give numbers in steps, int32."""
    from demsmith.core.codec._patch_coding import LARGEST

    steps = np.floor(np.abs(numbers, dtype=np.float64) / step + rounding)
    if not (np.isfinite(steps).all() and steps.max(initial=0) <= LARGEST):
        raise InputError(f"{name} {step} is too small for numbers of this size; give a larger one")
    return np.copysign(steps, numbers).astype(np.int32)


def _scaled(steps, step):
    """Give numbers of steps, float32; encoder and decoder must do alike."""
    return (steps * np.float64(step)).astype(np.float32)


class _Quantised:
    """The discs of a tree in steps, coded tile by tile."""

    def __init__(self, tree, atoms, layout, values, void):
        self.layout = layout
        params, grid = layout.params, tree.grid
        lattice = grid.rows, grid.columns
        steps = _rounded(
            tree.coefficients, params["coefficient_step"], "coefficient_step", _ROUNDING
        )  # fmt: skip
        order = np.argsort(-np.abs(steps), axis=1, kind="stable")
        steps = np.take_along_axis(steps, order, axis=1)
        indices = np.take_along_axis(tree.indices, order, axis=1)
        means = tree.means.astype(np.float64) - params["offset"]
        self.means = _rounded(means, params["step"], "step").reshape(lattice)
        self.counts = np.count_nonzero(steps, axis=1).astype(np.int32).reshape(lattice)
        self.steps = steps.reshape(*lattice, -1)
        self.indices = indices.reshape(*lattice, -1)
        self.slopes, self.spread = layout.slopes(atoms)
        self.grid, self.values, self.void = grid, values, void
        self.has_voids = bool(void.any())

    def code(self, tile):
        """Give the bytes of a tile."""
        from demsmith.core.codec import _patch_coding as coding
        from demsmith.core.codec._coder import buffer_for

        rows, columns = self.layout.lines(tile)
        part = slice(*rows), slice(*columns)
        means, counts = self.means[part].copy(), self.counts[part].copy()
        free = self._free(rows, columns)
        counts[free] = 0
        steps, indices = self.steps[part].copy(), self.indices[part].copy()
        decisions = counts.size * 100 + int(counts.sum()) * 100
        room = coding.workspace(*counts.shape)
        data = buffer_for(decisions)
        coding.code_tile(
            means, counts, indices, steps, free, self.slopes, self.spread, data=data,
            decoding=False, **room,
        )  # fmt: skip
        return data[: room["coder"][3]].tobytes()

    def _free(self, rows, columns):
        """Tell the discs of voids alone."""
        shape = rows[1] - rows[0], columns[1] - columns[0]
        if not self.has_voids:
            return np.zeros(shape, bool)
        discs = np.arange(*rows)[:, None] * self.grid.columns + np.arange(*columns)
        patches = gather(self.values, self.void, self.grid, discs.ravel())
        return (patches.counts == 0).reshape(shape)


def _code_atoms(layout, steps):
    from demsmith.core.codec import _patch_coding as coding
    from demsmith.core.codec._coder import buffer_for

    samples = layout.blocks(steps.copy())
    room = coding.atoms_workspace()
    data = buffer_for(100 * samples.size)
    coding.code_atoms(samples, layout.grid.disc, data=data, decoding=False, **room)
    return data[: room["coder"][3]].tobytes()


class _Layout:
    """Params of a coded patch tree, every one checked, and what follows from them."""

    def __init__(self, params):
        self.params = params = dict(params)
        whole = {
            "rows": _MOST_LINES, "columns": _MOST_LINES, "side_rows": _MOST_LINES,
            "side_columns": _MOST_LINES, "step_rows": _MOST_LINES, "step_columns": _MOST_LINES,
            "atoms": _MOST_ATOMS, "sparsity": LARGEST_SPARSITY, "tile": 256,
        }  # fmt: skip
        for name, most in whole.items():
            value = params.get(name)
            least = _LEAST_TILE if name == "tile" else 1
            if type(value) is not int or not least <= value <= most:
                raise InputError(
                    f"patch tree: {name} is {value!r}; it must be in {least} to {most}"
                )
        for name in ("step", "coefficient_step", "atom_step", "offset"):
            value = params.get(name)
            if type(value) is not float or not abs(value) < _LARGEST:
                raise InputError(f"patch tree: {name} is {value!r}, no number that is possible")
            if value < _SMALLEST and name != "offset":
                raise InputError(f"patch tree: {name} is {value}; it must be above 0")
        self.grid = PatchGrid(
            (params["rows"], params["columns"]), params["side_rows"], params["side_columns"],
            params["step_rows"], params["step_columns"],
        )  # fmt: skip
        if params["atoms"] * self.grid.samples > MOST_SAMPLES:
            raise InputError(
                f"patch tree: {params['atoms']} atoms of {self.grid.samples} samples are more "
                f"than {MOST_SAMPLES} in all"
            )
        if params["tile"] ** 2 * params["sparsity"] > _MOST_IN_TILE:
            raise InputError(
                f"patch tree: tiles of {params['tile']}² discs of {params['sparsity']} atoms are "
                "too large"
            )
        self.tile_columns = -(-self.grid.columns // params["tile"])
        self.tiles = self.tile_columns * -(-self.grid.rows // params["tile"])
        size = max(1, _PART_SAMPLES // self.grid.samples)
        self.atom_parts = [
            slice(first, min(first + size, params["atoms"]))
            for first in range(0, params["atoms"], size)
        ]

    def lines(self, tile):
        """Give the rows and columns (first, one past the last) of a tile's discs."""
        side = self.params["tile"]
        row, column = divmod(tile, self.tile_columns)
        return (
            (row * side, min((row + 1) * side, self.grid.rows)),
            (column * side, min((column + 1) * side, self.grid.columns)),
        )

    def blocks(self, samples):
        """Give atoms as blocks of rows and columns."""
        return samples.reshape(-1, self.grid.side_rows, self.grid.side_columns)

    def slopes(self, steps):
        """Give the slopes of atoms and their spread, as `_patch_coding.code_tile` takes them.

        An atom's slope is the least-squares plane's, down and to the right. Sums are of integers,
        for those of floats may depend on the machine.

        Parameters
        ----------
        steps : (N, K) int32 array
            The atoms' samples, in steps.
        """
        grid, params = self.grid, self.params
        unit = params["coefficient_step"] / params["step"]
        cells = int(np.count_nonzero(grid.disc))
        slopes, spread = np.zeros((len(steps), 2)), []
        for axis, step in enumerate((grid.step_rows, grid.step_columns)):
            side = grid.disc.shape[axis]
            halves = 2 * np.arange(side) - (side - 1)  # half cells from the middle
            place = ((halves[:, None] if axis == 0 else halves) * grid.disc).ravel()
            energy = max(int((place * place).sum()) / 4, 1.0)
            products = np.array([int((atom * place).sum()) for atom in steps]) * 0.5
            slopes[:, axis] = products * (params["atom_step"] * unit * step / energy)
            spread.append(energy / cells / (unit * step * (unit * step)))
        if not (np.abs(slopes).max() < _STEEPEST and max(spread) < _STEEPEST):
            raise InputError("patch tree: the atoms are too steep, or the steps differ too much")
        return slopes.astype(np.float32), tuple(np.float32(factor) for factor in spread)


class PatchBase:
    """A coded patch tree, decoded window by window.

    Parameters
    ----------
    params : dict
        As `encode` gives them; not trusted.
    part : callable
        ``part(section, index)`` gives bytes of a section; not trusted either.
    threads : int, optional
        Default: one for each core. Results do not depend on it.

    Attributes
    ----------
    shape : (int, int)
        Rows and columns of the raster.

    Raises
    ------
    InputError
        If params are not possible. Damaged parts decode to nonsense within bounds, for the
        container's checksums to find.
    """

    def __init__(self, params, part, threads=None):
        self._layout = _Layout(params)
        self._part, self._threads = part, threads
        self._tiles, self._lock = OrderedDict(), threading.Lock()
        self._atoms, self._slopes = self._dictionary()
        self.shape = self._layout.grid.shape

    def _dictionary(self):
        from demsmith.core.codec import _patch_coding as coding

        layout = self._layout
        params, grid = layout.params, layout.grid
        steps = np.zeros((params["atoms"], grid.side_rows, grid.side_columns), np.int32)

        def work(index):
            coding.code_atoms(
                steps[layout.atom_parts[index]], grid.disc,
                data=self._bytes("dictionary", index), decoding=True, **coding.atoms_workspace(),
            )  # fmt: skip

        parallel.run(
            [partial(work, index) for index in range(len(layout.atom_parts))],
            threads=self._threads,
        )
        steps = steps.reshape(len(steps), -1)
        atoms = _scaled(steps, params["atom_step"])
        most = float(np.abs(atoms).max()) * params["sparsity"] * params["coefficient_step"]
        if not most < _LARGEST:
            raise InputError("patch tree: the atoms are too large to be any")
        return atoms, layout.slopes(steps)

    def _bytes(self, section, index):
        return np.frombuffer(bytes(self._part(section, index)), np.uint8)

    def window(
        self, row0, row1, col0, col1, *, scale=1.0, coefficients=None, progress=SILENT
    ):  # fmt: skip
        """Decode a window of the surface.

        Parameters
        ----------
        row0, row1, col0, col1 : int
            First row and one past the last, first column and one past the last, at this scale. A
            cell's value does not depend on the window.
        scale, coefficients
            As of `PatchTree.evaluate`.
        progress : Progress

        Returns
        -------
        (rows, columns) float32 array

        Raises
        ------
        InputError
            If the window is not in the raster.
        Cancelled
            If ``progress`` asks to stop.
        """
        grid, window = self._layout.grid, (row0, row1, col0, col1)
        discs = self._discs(*window_discs(grid, window, scale=scale), Span(progress, 0, 0.6))
        return blend(
            grid, discs, self._atoms, window, scale=scale, coefficients=coefficients,
            threads=self._threads, progress=Span(progress, 0.6, 1),
        )  # fmt: skip

    def tree(self, *, progress=SILENT):
        """Decode all discs: the tree as it was coded."""
        grid = self._layout.grid
        discs = self._discs((0, grid.rows), (0, grid.columns), progress)
        return PatchTree(
            grid, discs.means.ravel(), discs.indices.reshape(grid.count, -1),
            discs.coefficients.reshape(grid.count, -1), self._atoms,
        )  # fmt: skip

    def _discs(self, rows, columns, progress):
        """Give the discs of some rows and columns of the lattice."""
        side, sparsity = self._layout.params["tile"], self._layout.params["sparsity"]
        shape = rows[1] - rows[0], columns[1] - columns[0]
        discs = Discs(
            rows[0], columns[0], np.empty(shape, np.float32),
            np.empty((*shape, sparsity), np.int32), np.empty((*shape, sparsity), np.float32),
        )  # fmt: skip
        tiles = [
            row * self._layout.tile_columns + column
            for row in range(rows[0] // side, (rows[1] - 1) // side + 1)
            for column in range(columns[0] // side, (columns[1] - 1) // side + 1)
        ]

        def work(tile):
            source = self._tile(tile)
            (top, bottom), (left, right) = self._layout.lines(tile)
            top, bottom = max(top, rows[0]), min(bottom, rows[1])
            left, right = max(left, columns[0]), min(right, columns[1])
            place = (slice(top - rows[0], bottom - rows[0]),
                     slice(left - columns[0], right - columns[0]))  # fmt: skip
            cut = source.cut((top, bottom), (left, right))
            discs.means[place], discs.indices[place], discs.coefficients[place] = cut

        parallel.run(
            [partial(work, tile) for tile in tiles], threads=self._threads, progress=progress
        )
        return discs

    def _tile(self, tile):
        """Decode a tile, or find it among the last decoded."""
        with self._lock:
            if tile in self._tiles:
                self._tiles.move_to_end(tile)
                return self._tiles[tile]
        discs = self._decode(tile)
        with self._lock:
            self._tiles[tile] = discs
            if len(self._tiles) > _TILES_KEPT:
                self._tiles.popitem(last=False)
        return discs

    def _decode(self, tile):
        from demsmith.core.codec import _patch_coding as coding

        params = self._layout.params
        rows, columns = self._layout.lines(tile)
        shape = rows[1] - rows[0], columns[1] - columns[0]
        means, counts = np.zeros(shape, np.int32), np.zeros(shape, np.int32)
        indices, steps = (np.zeros((*shape, params["sparsity"]), np.int32) for _ in range(2))
        coding.code_tile(
            means, counts, indices, steps, np.zeros(shape, bool), *self._slopes,
            data=self._bytes("discs", tile), decoding=True, **coding.workspace(*shape),
        )  # fmt: skip
        return Discs(
            rows[0], columns[0],
            (means * np.float64(params["step"]) + params["offset"]).astype(np.float32),
            indices, _scaled(steps, params["coefficient_step"]),
        )  # fmt: skip
