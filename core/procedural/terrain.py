"""Terrain as parameters: the model that inverse procedural modelling finds (Guérin et al. §5.2)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.noise import NoiseSums
from demsmith.core.options import options_from
from demsmith.core.pixel_size import metres
from demsmith.core.procedural.functions import random_functions, sampled
from demsmith.core.procedural.options import ProceduralizeOptions
from demsmith.core.procedural.selection import select
from demsmith.core.progress import SILENT, Span
from demsmith.core.sparse import PatchGrid, PatchTree, decompose, gather
from demsmith.core.sparse.patches import LARGEST_SIDE
from demsmith.core.trees import FULL, Atoms, ConstructionTree, Detail, Frame, PatchLattice

MOST_CELLS = 1 << 30
"""Cells that an evaluation may have."""

_LEARNED_FROM = 8192
_DEFAULT_RADIUS = 5


@dataclass(frozen=True, eq=False)
class ProceduralTerrain:
    """Discs on a lattice, each a mean and a few functions: a Sparse Construction Tree.

    Parameters
    ----------
    grid : PatchGrid
        The discs, in cells of the raster that was modelled.
    cell_size : (float, float)
        Ground metres of a cell, east-west and north-south.
    functions : NoiseSums
        Wavelengths in radii of a disc.
    means, norms : (N,) array of float
        An atom is its function less its mean, divided by its norm.
    heights : (n,) array of float
        Mean elevation of each disc.
    indices : (n, s) array of int
        Atoms of each disc.
    coefficients : (n, s) array of float
        In the elevations' unit; 0 for no atom.
    void : (H, W) bool array
        Cells of the raster without a value, which evaluations leave out.

    Raises
    ------
    InputError
        If shapes do not fit, or a number is out of range.
    """

    grid: PatchGrid
    cell_size: tuple
    functions: NoiseSums
    means: np.ndarray
    norms: np.ndarray
    heights: np.ndarray
    indices: np.ndarray
    coefficients: np.ndarray
    void: np.ndarray

    def __post_init__(self):
        """Check by making the node."""
        if self.void.shape != tuple(self.grid.shape):
            raise InputError(f"void has shape {self.void.shape}, the raster {self.grid.shape}")
        if not np.isfinite(self.heights).all():
            raise InputError("a disc's height is not finite")
        _ = self.node

    @cached_property
    def frame(self):
        """Local frame of the raster: see `demsmith.core.trees.Frame`."""
        return Frame(self.grid.shape, *self.cell_size)

    @cached_property
    def node(self):
        """The continuous surface as a `PatchLattice`, a node for construction trees."""
        atoms = Atoms(functions=self.functions, means=self.means, norms=self.norms)
        return PatchLattice(
            self.grid, self.heights, self.indices, self.coefficients, atoms=atoms, frame=self.frame
        )

    def evaluate(self, *, scale=1.0, threads=None, progress=SILENT):
        """Give the elevations at the cells of a raster of another resolution.

        Parameters
        ----------
        scale : float
            Cells along a cell of the modelled raster. Below 1, noises fade out that the cells
            are too large for.
        threads : int, optional
            Default: one for each core. The result does not depend on it.
        progress : Progress

        Returns
        -------
        values : (rows, columns) ndarray of float32
            Not-a-number in voids: where the modelled raster's cell is one.

        Raises
        ------
        InputError
            If the scale is not positive, or the raster would have more than 2³⁰ cells.
        Cancelled
            If ``progress`` asks to stop.
        """
        x, y = self.frame.axes(scale)
        if x.size * y.size > MOST_CELLS:
            raise InputError(
                f"a scale of {scale:g} gives {y.size} × {x.size} cells, more than the "
                f"{MOST_CELLS} that are evaluated at once: make it smaller"
            )
        if scale == 1:
            values = self._at_cells(threads, progress)
            values[self.void] = np.nan
            return values
        detail = FULL if scale >= 1 else Detail(resolution=min(self.cell_size) / scale)
        tree = ConstructionTree(self.node)
        values = tree.grid(x, y, detail=detail, threads=threads, progress=progress)
        rows, columns = (
            np.minimum((place + 0.5).astype(np.int64), side - 1)
            for place, side in zip(self.frame.place(x, y), self.grid.shape, strict=True)
        )
        values[self.void[rows[:, None], columns]] = np.nan
        return values

    def _at_cells(self, threads, progress):
        """Evaluate at the modelled raster's cells, where all discs' atoms have the same samples."""
        made = sampled(self.functions, self.grid, threads=threads, progress=Span(progress, 0, 0.1))
        tree = PatchTree(
            self.grid, self.heights, self.indices, self.coefficients, made.samples
        )  # fmt: skip
        return tree.evaluate(threads=threads, progress=Span(progress, 0.1, 1))


def proceduralize(
    values, void=None, *, options=None, pixel_size=None, threads=None, progress=SILENT,
    **parameters,
):  # fmt: skip
    """Model terrain by functions: inverse procedural modelling.

    A dictionary is chosen among random sums of noises, by what they explain of the terrain
    (`demsmith.core.procedural.select`); orthogonal matching pursuit then finds each disc's.

    Parameters
    ----------
    values : (H, W) array
        Elevations.
    void : (H, W) bool array, optional
        Cells without a value. Cells that are not finite are voids in any case.
    options : ProceduralizeOptions, optional
        Or its fields as keywords.
    pixel_size : None, float, (float, float) or two arrays of length H
        Ground metres per cell: both ways, east-west and north-south, or these by row; default 1.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    ProceduralTerrain

    Raises
    ------
    InputError
        If every cell is a void, or an option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    References
    ----------
    E. Guérin, J. Digne, É. Galin and A. Peytavie, *Sparse representation of terrains for
    procedural modeling*, Computer Graphics Forum 35 (2016), §5.2.

    Examples
    --------
    >>> import numpy as np
    >>> y, x = np.mgrid[:60, :60] / 9.0
    >>> terrain = proceduralize(500 - 200 * abs(np.sin(x + y / 2)), sparsity=4, candidates=512)
    >>> terrain.evaluate(scale=2).shape
    (120, 120)
    """
    options = options_from(ProceduralizeOptions, options, parameters, "proceduralize()")
    values, void = checked(values, void)
    if void.all():
        raise InputError("every cell is a void")
    dx, dy = metres(values.shape, pixel_size)
    cell_size = float(dx[dx.size // 2]), float(dy[dy.size // 2])
    grid = _lattice(values.shape, cell_size, options.radius)
    elevations = np.where(void, 0, values).astype(np.float32)
    functions = random_functions(
        options.candidates, families=options.families(), terms=options.terms, grid=grid,
        seed=options.seed,
    )  # fmt: skip
    made = sampled(functions, grid, threads=threads, progress=Span(progress, 0, 0.1))
    discs = _learned_from(elevations, void, grid, options.seed)
    chosen = select(
        discs, made.samples, options.atoms, options.sparsity, threads=threads,
        progress=Span(progress, 0.1, 0.6),
    )  # fmt: skip
    tree = decompose(
        elevations, void, dictionary=made.samples[chosen], sparsity=options.sparsity, grid=grid,
        threads=threads, progress=Span(progress, 0.6, 1),
    )  # fmt: skip
    return ProceduralTerrain(
        grid, cell_size, functions[chosen], made.means[chosen], made.norms[chosen],
        tree.means, tree.indices, tree.coefficients, void,
    )  # fmt: skip


def _lattice(shape, cell_size, radius):
    """Lay the discs, a radius apart."""
    sides = []
    for cell in reversed(cell_size):
        side = 2 * _DEFAULT_RADIUS if radius is None else max(2 * round(radius / cell), 2)
        if side > LARGEST_SIDE:
            raise InputError(
                f"a radius of {radius:g} m is {side / 2:g} cells of {cell:g} m; at most "
                f"{LARGEST_SIDE // 2} will do"
            )
        sides.append(side)
    return PatchGrid(shape, *sides, *(side // 2 for side in sides))


def _learned_from(elevations, void, grid, seed):
    """Give discs to choose the dictionary by: complete ones if there are any, not too many."""
    places = np.arange(grid.count)
    if places.size > 2 * _LEARNED_FROM:
        places = np.random.default_rng(seed).choice(places, 2 * _LEARNED_FROM, replace=False)
        places.sort()
    patches = gather(elevations, void, grid, places)
    complete = patches.counts == patches.counts.max()
    return np.ascontiguousarray(patches.samples[complete][:_LEARNED_FROM])
