"""Patch trees: exact reconstruction, evaluation at any scale, levels of detail, refinement."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.sparse import PatchGrid, PatchTree, decompose, gather, refine
from demsmith.core.sparse.patch_tree import extended, scaled_shape


def own_atoms(ground, void, grid):
    """The terrain's own discs, of root mean square 1 over their valid samples."""
    patches = gather(ground.astype(np.float32), void, grid)
    rms = np.sqrt((patches.samples**2).sum(axis=1) / np.maximum(patches.counts, 1))
    return patches.samples / np.where(rms > 0, rms, 1)[:, None]


def waves(grid, count=24, seed=3):
    """Atoms of smooth waves, of zero mean and root mean square 1 over the disc."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[-1 : 1 : grid.side_rows * 1j, -1 : 1 : grid.side_columns * 1j]
    ky, kx, phase = rng.normal(size=(3, count, 1, 1)) * 2.5
    atoms = np.sin(ky * y + kx * x + phase).reshape(count, -1)[:, grid.disc.ravel()]
    atoms -= atoms.mean(axis=1, keepdims=True)
    atoms /= np.sqrt((atoms**2).mean(axis=1, keepdims=True))
    full = np.zeros((count, grid.samples), np.float32)
    full[:, grid.disc.ravel()] = atoms
    return full


def a_tree(shape=(83, 71), *, sparsity=3, sides=(11, 8), steps=(4, 3)):
    ground = fractal(shape, seed=7)
    grid = PatchGrid(shape, *sides, *steps)
    return ground, decompose(ground, dictionary=waves(grid), sparsity=sparsity, grid=grid)


def rmse(tree, ground, void=None):
    error = (tree.evaluate() - ground)[slice(None) if void is None else ~void]
    return float(np.sqrt((error.astype(float) ** 2).mean()))


# --- exactness ------------------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(
    shape=st.tuples(st.integers(4, 70), st.integers(4, 70)),
    sides=st.tuples(st.integers(4, 12), st.integers(4, 12)),
    holes=st.integers(0, 3),
    seed=st.integers(0, 999),
)
def test_one_of_the_terrains_own_discs_each_is_exact(shape, sides, holes, seed):
    """s = 1, N = n (§4.3), up to the edges of the raster and of voids."""
    ground = fractal(shape, seed=seed).astype(np.float32)
    rng = np.random.default_rng(seed)
    void = np.zeros(shape, bool)
    for _ in range(holes):
        void |= disc(shape, (rng.integers(shape[0]), rng.integers(shape[1])), rng.integers(1, 15))
    void.flat[rng.integers(void.size)] = False
    grid = PatchGrid(shape, *sides, sides[0] // 2, sides[1] // 2)
    values = np.where(void, np.nan, ground)
    atoms = own_atoms(np.where(void, 0, ground), void, grid)
    tree = decompose(values, dictionary=atoms, sparsity=1, grid=grid)
    surface = tree.evaluate()
    assert np.isfinite(surface).all()
    np.testing.assert_allclose(surface[~void], ground[~void], rtol=0, atol=4e-4)


def test_the_blend_is_the_papers():
    """f(p) = Σ f_i α_i / Σ α_i, by brute force."""
    _, tree = a_tree((30, 26))
    grid = tree.grid
    sums, weights = np.zeros(tree.shape), np.zeros(tree.shape)
    for i, (top, left) in enumerate(zip(*grid.corners(), strict=True)):
        surface = tree.means[i] + tree.coefficients[i] @ tree.atoms[tree.indices[i]]
        for k, value in enumerate(surface):
            row, column = top + k // grid.side_columns, left + k % grid.side_columns
            if 0 <= row < tree.shape[0] and 0 <= column < tree.shape[1]:
                sums[row, column] += value * grid.weights.flat[k]
                weights[row, column] += grid.weights.flat[k]
    np.testing.assert_allclose(tree.evaluate(), sums / weights, rtol=2e-6)


def test_more_atoms_are_closer():
    errors = [rmse(tree, ground) for ground, tree in (a_tree(sparsity=s) for s in (1, 2, 4, 8))]
    assert (np.diff(errors) < 0).all()
    assert errors[-1] < 0.6 * errors[0]


def test_voids_say_nothing():
    ground = fractal((60, 60), seed=2)
    void = disc(ground.shape, (30, 30), 12)
    grid = PatchGrid(ground.shape)
    trees = [
        decompose(np.where(void, value, ground), void, dictionary=waves(grid), sparsity=2)
        for value in (-32768.0, 9e9, np.nan)
    ]
    surfaces = [tree.evaluate() for tree in trees]
    assert all(s.tobytes() == surfaces[0].tobytes() for s in surfaces)
    assert np.isfinite(surfaces[0]).all()
    assert surfaces[0][void].min() > 0 and surfaces[0][void].max() < 1500
    empty = gather(ground.astype(np.float32), void, grid).counts == 0
    assert empty.any() and (trees[0].coefficients[empty] == 0).all()


@pytest.mark.parametrize("dtype", ["int16", ">i2", "uint8", "float64"])
def test_types_of_elevation(dtype):
    ground = fractal((40, 40), relief=200).astype(dtype)
    atoms = waves(PatchGrid(ground.shape))
    tree = decompose(ground, dictionary=atoms, sparsity=2)
    same = decompose(ground.astype(np.float32), dictionary=atoms, sparsity=2)
    assert tree.evaluate().tobytes() == same.evaluate().tobytes()


# --- evaluation -----------------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(scale=st.sampled_from([1.0, 0.25, 0.37, 2.0, 2.7]), data=st.data())
def test_a_cell_is_the_same_in_every_window(scale, data):
    _, tree = a_tree()
    whole = tree.evaluate(scale=scale, threads=1)
    assert whole.shape == scaled_shape(tree.shape, scale)
    row, column = (data.draw(st.integers(0, side - 1)) for side in whole.shape)
    end_row, end_column = (
        data.draw(st.integers(at + 1, side))
        for at, side in zip((row, column), whole.shape, strict=True)
    )
    part = tree.evaluate((row, end_row, column, end_column), scale=scale, threads=2)
    assert part.tobytes() == whole[row:end_row, column:end_column].tobytes()


def test_a_finer_raster_passes_through_the_cells():
    _, tree = a_tree()
    fine = tree.evaluate(scale=3)
    np.testing.assert_allclose(fine[1::3, 1::3], tree.evaluate(), rtol=1e-5)


def test_between_the_cells_the_surface_is_that_of_the_lattice_node():
    """The tree's node evaluates point by point what is evaluated by rows here."""
    from demsmith.core.trees import Atoms, Frame, PatchLattice

    _, tree = a_tree((40, 37))
    grid = tree.grid
    atoms = extended(tree.atoms, grid.disc).reshape(-1, grid.side_rows, grid.side_columns)
    node = PatchLattice(
        grid, tree.means, tree.indices, tree.coefficients, atoms=Atoms(samples=atoms),
        frame=Frame(tree.shape, 30.0, 20.0),
    )  # fmt: skip
    scale = 2.5
    rows, columns = ((np.arange(n) + 0.5) / scale for n in scaled_shape(tree.shape, scale))
    x = columns * 30.0
    y = (tree.shape[0] - rows[:, None]) * 20.0
    np.testing.assert_allclose(tree.evaluate(scale=scale), node.joint(x, y).elevation, rtol=1e-5)


def test_a_coarser_raster_is_the_mean_over_its_cells():
    _, tree = a_tree((80, 60))
    cells = tree.evaluate().reshape(20, 4, 15, 4).mean(axis=(1, 3))
    np.testing.assert_allclose(tree.evaluate(scale=0.25), cells, rtol=1e-5)
    mean = tree.evaluate(scale=1 / 1000)
    assert mean.shape == (1, 1)
    assert mean[0, 0] == pytest.approx(tree.evaluate().mean(), rel=1e-5)


def test_fewer_coefficients_are_a_coarser_level_of_detail():
    ground, tree = a_tree(sparsity=4)
    for used in range(5):
        kept = np.where(np.arange(4) < used, tree.coefficients, 0)
        expected = replace(tree, coefficients=kept).evaluate()
        np.testing.assert_array_equal(tree.evaluate(coefficients=used), expected)
    assert np.ptp(tree.evaluate(coefficients=0)) < np.ptp(ground)


def test_threads_do_not_matter():
    ground = fractal((300, 200), seed=4)
    atoms = waves(PatchGrid(ground.shape))
    one, many = (
        decompose(ground, dictionary=atoms, sparsity=2, threads=threads) for threads in (1, 6)
    )
    for name in ("means", "indices", "coefficients"):
        assert getattr(one, name).tobytes() == getattr(many, name).tobytes()
    for scale in (1, 1.7, 0.6):
        surfaces = [one.evaluate(scale=scale, threads=threads).tobytes() for threads in (1, 6)]
        assert surfaces[0] == surfaces[1]


# --- refinement -----------------------------------------------------------------------------------


@pytest.mark.parametrize("holed", [False, True])
def test_refinement_leads_to_the_least_squares_optimum_of_the_blend(holed):
    ground = fractal((26, 22), seed=5)
    void = disc(ground.shape, (8, 9), 5) if holed else np.zeros(ground.shape, bool)
    grid = PatchGrid(ground.shape, 8, 8, 4, 4)
    tree = decompose(ground, void, dictionary=waves(grid), sparsity=2, grid=grid)
    errors = [
        rmse(refine(ground, void, tree=tree, sweeps=n), ground, void) for n in (0, 1, 3, 9, 200)
    ]
    assert errors[0] == pytest.approx(rmse(tree, ground, void))
    assert (np.diff(errors) <= 1e-6).all()
    columns = []
    base = np.column_stack([tree.means, tree.coefficients]) * 0
    for unknown in range(base.size):
        unit = base.copy()
        unit.flat[unknown] = 1
        if unknown % 3 == 0 or tree.coefficients[unknown // 3, unknown % 3 - 1] != 0:
            one = replace(tree, means=unit[:, 0], coefficients=unit[:, 1:])
            columns.append(one.evaluate()[~void].astype(float))
    fit = np.linalg.lstsq(np.array(columns).T, ground[~void], rcond=1e-6)[0]
    best = np.sqrt(((fit @ np.array(columns) - ground[~void]) ** 2).mean())
    assert errors[-1] < best + 0.05 * (errors[0] - best)


def test_refinement_keeps_what_is_exact():
    ground = fractal((40, 40), seed=6).astype(np.float32)
    void = np.zeros(ground.shape, bool)
    grid = PatchGrid(ground.shape)
    tree = decompose(ground, dictionary=own_atoms(ground, void, grid), sparsity=1, grid=grid)
    np.testing.assert_allclose(refine(ground, tree=tree, sweeps=3).evaluate(), ground, atol=1e-3)


# --- refusals -------------------------------------------------------------------------------------


def test_impossible_trees_are_refused():
    _, tree = a_tree((20, 20))
    for change, words in (
        (dict(means=tree.means[1:]), "as many means"),
        (dict(indices=tree.indices[1:]), "as many indices"),
        (dict(coefficients=tree.coefficients[:, 1:]), "coefficients of shape"),
        (dict(atoms=tree.atoms[:, 1:]), "do not fit discs"),
        (dict(indices=tree.indices + 24), "none of the 24 atoms"),
        (dict(indices=tree.indices - 24), "none of the 24 atoms"),
    ):
        with pytest.raises(InputError, match=words):
            replace(tree, **change)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (dict(window=(0, 21, 0, 5)), "not in the raster of 20 by 20"),
        (dict(window=(5, 5, 0, 5)), "not in the raster"),
        (dict(window=(-1, 5, 0, 5)), "not in the raster"),
        (dict(scale=0), "scale is 0"),
        (dict(scale=np.nan), "scale is nan"),
        (dict(scale=1e9), "scale is"),
        (dict(coefficients=-1), "coefficients is -1"),
    ],
)
def test_impossible_evaluations_are_refused(arguments, words):
    _, tree = a_tree((20, 20))
    with pytest.raises(InputError, match=words):
        tree.evaluate(**arguments)


def test_impossible_decompositions_are_refused():
    ground = np.zeros((20, 20))
    with pytest.raises(InputError, match="every cell is a void"):
        decompose(ground * np.nan, dictionary=np.ones((1, 100)), sparsity=1)
    with pytest.raises(InputError, match="atoms have 99 samples, the discs 100"):
        decompose(ground, dictionary=np.ones((1, 99)), sparsity=1)
    with pytest.raises(InputError, match="shape"):
        refine(ground[1:], tree=a_tree((20, 20))[1], sweeps=1)


def test_cancel_is_heard():
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    ground, tree = a_tree((30, 30))
    with pytest.raises(Cancelled):
        tree.evaluate(progress=Stop())
    with pytest.raises(Cancelled):
        decompose(ground, dictionary=tree.atoms, sparsity=1, grid=tree.grid, progress=Stop())
    with pytest.raises(Cancelled):
        refine(ground, tree=tree, sweeps=2, progress=Stop())


def test_a_tree_is_what_it_was_given():
    grid = PatchGrid((4, 4))
    tree = PatchTree(grid, [7.0], [[0]], [[0.0]], np.zeros((1, 100)))
    np.testing.assert_allclose(tree.evaluate(), np.full((4, 4), 7), rtol=1e-6)
