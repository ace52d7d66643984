"""Decomposition with errors counted as they count in the blend of discs; see `metric`."""

from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.elevations import checked
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span
from demsmith.core.sparse.metric import Metric
from demsmith.core.sparse.patch_tree import PatchTree
from demsmith.core.sparse.patches import PatchGrid, gather_at
from demsmith.core.sparse.pursuit import Pursuit


def decompose_weighted(
    values, void=None, *, dictionary, sparsity, grid=None, threads=None, progress=SILENT
):  # fmt: skip
    """Approximate a raster by discs, each fitted where it counts in the blend.

    As `decompose`, but the pursuit's scalar product is `Metric`'s ``blend``, and each disc's
    ``z_i`` is fitted along with its coefficients. At the same number of atoms the blend is nearer
    to the raster by 3 to 5 dB. Voids are filled for it, and the raster is mirrored at its edges,
    so that all discs are whole; only with that is it exact where atoms are the raster's discs.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array, optional
        As of `fill_voids`.
    dictionary : (N, K) float32 array
        Atoms, 0 outside the disc.
    sparsity : int
    grid : PatchGrid, optional
        Default: discs of 10 by 10 cells, 5 cells apart.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    PatchTree

    Raises
    ------
    InputError
        If arrays do not fit, nothing is known, or an option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> from demsmith.core.sparse.learning import cosine_waves
    >>> y, x = np.mgrid[:40, :50] / 5
    >>> ground = 100 * np.sin(x) * np.cos(y)
    >>> tree = decompose_weighted(ground, dictionary=cosine_waves(10, 10), sparsity=4)
    >>> bool(abs(tree.evaluate() - ground).max() < 9)
    True
    """
    values, void = checked(values, void)
    grid = PatchGrid(values.shape) if grid is None else grid
    if grid.shape != values.shape:
        raise InputError(f"the discs are of a raster of {grid.shape}, values have {values.shape}")
    atoms = np.ascontiguousarray(dictionary, np.float32)
    if atoms.ndim != 2 or atoms.shape[1] != grid.samples:
        raise InputError(f"atoms of shape {atoms.shape} do not fit discs of {grid.samples} samples")
    metric = Metric(
        "blend", grid.side_rows, grid.side_columns, grid.step_rows, grid.step_columns
    )  # fmt: skip
    pursuit = Pursuit(metric.vectors(atoms), sparsity)
    offsets = metric.offsets(atoms)
    filled = _without_voids(values, void, threads, Span(progress, 0, 0.3))
    around = np.pad(
        filled, ((grid.side_rows,) * 2, (grid.side_columns,) * 2), mode="symmetric"
    )  # fmt: skip
    none = np.zeros(around.shape, bool)
    means = np.empty(grid.count, np.float32)
    indices = np.empty((grid.count, sparsity), np.int32)
    coefficients = np.empty((grid.count, sparsity), np.float32)

    def block(part):
        tops, lefts = grid.corners(np.arange(part.start, part.stop))
        patches = gather_at(
            around, none, tops + grid.side_rows, lefts + grid.side_columns, grid.disc
        )
        found = pursuit.block(metric.vectors(patches.samples))
        indices[part], coefficients[part] = found
        means[part] = (
            patches.means
            + metric.offsets(patches.samples)
            - np.einsum("ij,ij->i", found[1], offsets[found[0]])
        )

    size = pursuit.block_size
    parts = [slice(at, min(at + size, grid.count)) for at in range(0, grid.count, size)]
    parallel.run(
        [partial(block, part) for part in parts], threads=threads, progress=Span(progress, 0.3, 1)
    )
    return PatchTree(grid, means, indices, coefficients, atoms)


def _without_voids(values, void, threads, progress):
    if not void.any():
        return values.astype(np.float32)
    if void.all():
        raise InputError("every cell is a void; there is nothing to decompose")
    from demsmith.core.voids import fill_voids

    return fill_voids(
        values, void, method="mcmd", float_output=True, threads=threads, progress=progress
    ).values.astype(np.float32)  # fmt: skip
