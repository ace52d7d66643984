"""The lattice of discs as a node: the paper's sums, its patches, exact gradients, true bounds."""

import numpy as np
import pytest
from support import hills

from demsmith.core.errors import InputError
from demsmith.core.noise import NoiseSums
from demsmith.core.sparse import (
    Dictionary,
    FunctionAtoms,
    PatchGrid,
    PatchTree,
    decompose,
    gather,
)
from demsmith.core.trees import (
    FULL,
    Atoms,
    Blend,
    Bounds,
    ConstructionTree,
    Detail,
    Frame,
    PatchLattice,
    RasterNode,
)

SHAPE = (43, 61)


def some_functions(count, seed=0, family=None):
    rng = np.random.default_rng(seed)
    families = np.arange(count) % 3 if family is None else np.full(count, family)
    return NoiseSums(
        families, rng.integers(0, 1 << 40, count), rng.normal(size=(count, 3)),
        rng.uniform(0.8, 3, (count, 3)),
    )  # fmt: skip


def mixed_atoms():
    """Two kinds, in turn: even ones are sampled, odd ones functions."""
    rng = np.random.default_rng(1)
    samples = rng.normal(size=(10, 10, 10)).cumsum(axis=1)
    kinds = np.stack([np.arange(10), -1 - np.arange(10)], axis=1).ravel()
    means, norms = rng.normal(size=10), rng.uniform(0.5, 2, 10)
    return Atoms(samples, some_functions(10), means, norms, kinds)


def a_node(sparsity=3, **lattice):
    grid = PatchGrid(SHAPE, **lattice)
    rng = np.random.default_rng(2)
    size = grid.count, sparsity
    means = rng.normal(500, 40, grid.count)
    return PatchLattice(
        grid, means, rng.integers(0, 20, size), rng.normal(0, 20, size), atoms=mixed_atoms(),
        frame=Frame(SHAPE, 20.0, 30.0),
    )  # fmt: skip


def by_hand(node, x, y, atoms=None):
    """Equation 1 of the paper, disc by disc; data atoms by their samples, so at cells only."""
    rows, columns = (place + 0.5 for place in node.frame.place(x, y))
    top, left = node.grid.centres()
    total = weights = 0.0
    for n in range(node.grid.count):
        v = (rows - top[n // node.grid.columns]) / (node.grid.side_rows / 2)
        u = (columns - left[n % node.grid.columns]) / (node.grid.side_columns / 2)
        rest = 1 - u * u - v * v
        if rest <= 0:
            continue
        f = node.means[n]
        for index, x_i in list(zip(node.indices[n], node.coefficients[n], strict=True))[:atoms]:
            kind = node.atoms.kinds[index]
            if kind >= 0:
                i, j = round((v + 1) * 5 - 0.5), round((u + 1) * 5 - 0.5)
                d = node.atoms.samples[kind, i, j]
            else:
                k = -1 - kind
                value = node.atoms.functions.joint(k, u, v).value
                d = (value - node.atoms.means[k]) / node.atoms.norms[k]
            f += np.float64(x_i) * d
        total += rest**3 * f
        weights += rest**3
    return total / weights


@pytest.mark.parametrize("atoms", [None, 0, 1])
def test_the_sums_are_the_papers(atoms):
    node = a_node()
    x, y = node.frame.axes()
    detail = FULL if atoms is None else Detail(atoms=atoms)
    for row, column in ((0, 0), (3, 7), (42, 60), (20, 31)):
        here = node.elevation(x[[column]], y[[row]], detail=detail)
        assert here == pytest.approx(by_hand(node, x[column], y[row], atoms), rel=1e-9)


def test_with_the_patches_as_atoms_it_is_exact():
    """s = 1, N = n: to float precision."""
    values = hills(*SHAPE, dtype=np.float32)
    void = np.zeros(SHAPE, bool)
    void[5:9, 10:20] = True
    grid = PatchGrid(SHAPE)
    patches = gather(values, void, grid)
    n = grid.count
    node = PatchLattice(
        grid, np.where(patches.counts > 0, patches.means, np.nan), np.arange(n)[:, None],
        np.ones((n, 1)), atoms=Atoms(patches.samples.reshape(n, 10, 10)),
        frame=Frame(SHAPE, 20.0, 30.0),
    )  # fmt: skip
    made = ConstructionTree(node).grid(*node.frame.axes())
    np.testing.assert_allclose(made[~void], values[~void], rtol=1e-6)


def test_it_is_the_patch_tree_made_continuous():
    grid = PatchGrid(SHAPE, 10, 8, 5, 4)
    rng = np.random.default_rng(4)
    atoms = rng.normal(size=(6, 10, 8)).astype(np.float32) * grid.disc
    parts = (
        rng.normal(500, 40, grid.count), rng.integers(0, 6, (grid.count, 2)),
        rng.normal(0, 20, (grid.count, 2)),
    )  # fmt: skip
    tree = PatchTree(grid, *parts, atoms.reshape(6, -1))
    node = PatchLattice(grid, *parts, atoms=Atoms(atoms), frame=Frame(SHAPE, 1.0, 1.0))
    made = ConstructionTree(node).grid(*node.frame.axes())
    np.testing.assert_allclose(made, tree.evaluate(), atol=1e-3)


def test_a_mixed_dictionary_is_sampled_and_exact_where_each_can_be():
    values = hills(*SHAPE, dtype=np.float32)
    grid = PatchGrid(SHAPE)
    patches = gather(values, np.zeros(SHAPE, bool), grid, np.arange(30, 42))
    dictionary = Dictionary.joined(
        [
            Dictionary(10, 10, (FunctionAtoms(some_functions(8, seed=1)),)),
            Dictionary.of_samples(patches.samples, 10, 10),
            Dictionary(10, 10, (FunctionAtoms(some_functions(8, seed=2)),)),
        ]
    )
    tree = decompose(values, dictionary=dictionary.samples, sparsity=3, grid=grid)
    assert len(np.unique(tree.indices)) > 20
    node = PatchLattice.of_tree(tree, dictionary, frame=Frame(SHAPE, 10.0, 10.0))
    made = ConstructionTree(node).grid(*node.frame.axes())
    np.testing.assert_allclose(made, tree.evaluate(), atol=2e-3)
    alone = Dictionary.of_samples(dictionary.samples, 10, 10)
    sampled = PatchLattice.of_tree(tree, alone, frame=node.frame)
    axes = node.frame.axes(3)
    fine = ConstructionTree(sampled).grid(*axes)
    inner = np.s_[6:-6, 6:-6]
    np.testing.assert_allclose(fine[inner], tree.evaluate(scale=3)[inner], atol=0.05)
    apart = np.abs(ConstructionTree(node).grid(*axes) - fine)[inner]
    assert 0.01 < apart.max() < 0.2 * np.ptp(values)


@pytest.mark.parametrize("lattice", [{}, dict(side_rows=12, side_columns=7, step_columns=3)])
def test_gradients_are_exact_across_cells_and_discs(lattice):
    node = a_node(**lattice)
    x, y = np.random.default_rng(0).uniform((-80, -80), (1300, 1370), (4000, 2)).T
    joint, step = node.joint(x, y), 1e-5
    there = joint.weight > 0.9
    for line, found in ((0, joint[2:4]), (1, joint[4:6])):
        ahead = node.joint(x + step, y)[line], node.joint(x, y + step)[line]
        behind = node.joint(x - step, y)[line], node.joint(x, y - step)[line]
        for mine, a, b in zip(found, ahead, behind, strict=True):
            wrong = np.abs(mine - (a - b) / (2 * step)) > 1e-4
            assert wrong[there].mean() < 0.001  # crests of ridged noise


def test_the_raster_is_covered_and_beyond_the_discs_is_nothing():
    node = a_node()
    x, y = np.meshgrid(*node.frame.axes())
    assert np.all(node.weight(x, y) == 1)
    box = node.bounds()
    outside = np.array([box.xmin - 1, box.xmax + 1]), np.array([box.ymin - 1, box.ymax + 1])
    assert not np.any(node.joint(*outside))
    assert node.within(Bounds(5000, 0, 6000, 10)) is None


def test_a_disc_of_nothing_is_left_out():
    node = a_node()
    means = np.full(node.grid.count, np.nan)
    means[40] = 7.0
    lone = PatchLattice(
        node.grid, means, node.indices, node.coefficients, atoms=node.atoms, frame=node.frame
    )
    weight = lone.weight(*np.meshgrid(*node.frame.axes()))
    assert 0.01 < np.mean(weight > 0) < 0.06
    assert not lone.limits(Bounds(0, 0, 50, 50)).weight_high


def test_limits_hold():
    node = a_node()
    rng = np.random.default_rng(6)
    box, covered = node.bounds(), 0
    for _ in range(150):
        size = 10 ** rng.uniform(-1, 3)
        x, y = rng.uniform((box.xmin, box.ymin), (box.xmax, box.ymax))
        part = Bounds(x, y, x + size, y + size)
        joint, limits = node.joint(*rng.uniform(part[:2], part[2:], (150, 2)).T), node.limits(part)
        there = joint.weight >= 0.5
        assert joint.weight.min() >= limits.weight_low
        assert np.hypot(joint.weight_x, joint.weight_y).max() <= limits.weight_lipschitz + 1e-12
        covered += limits.weight_low == 1
        if there.any():
            steep = np.hypot(joint.gradient_x, joint.gradient_y)[there].max()
            assert steep <= limits.lipschitz == node.lipschitz(part)
            assert limits.low <= joint.elevation[there].min()
            assert joint.elevation[there].max() <= limits.high
    assert covered > 50


def test_within_the_lattice_limits_are_of_use():
    """Not only true: the slope's bound is within two orders of the steepest slope."""
    limits = a_node().limits(Bounds(600, 600, 610, 610))
    assert 0 < limits.lipschitz < 500
    assert limits.high - limits.low < 1500


def test_coarse_looks_fade_atoms_out():
    node = a_node()
    x, y = np.meshgrid(*node.frame.axes())
    rough = [np.diff(node.elevation(x, y, detail=Detail(resolution=r))).std()
             for r in (0, 60, 110, 300)]  # fmt: skip
    assert rough[0] > rough[1] > rough[2]
    means = node.elevation(x, y, detail=Detail(resolution=1e5))
    np.testing.assert_allclose(means, node.elevation(x, y, detail=Detail(resolution=300)))


def test_it_goes_with_other_nodes():
    node = a_node()
    plain = RasterNode(np.full(SHAPE, 900.0), frame=node.frame)
    tree = ConstructionTree(Blend(node, plain))
    x, y = node.frame.axes()
    wanted = (node.elevation(*np.meshgrid(x, y)) + 900) / 2
    np.testing.assert_allclose(tree.grid(x, y), wanted, rtol=1e-6)


def test_what_does_not_fit_is_refused():
    node = a_node()

    def make(**changes):
        parts = dict(
            grid=node.grid, means=node.means, indices=node.indices,
            coefficients=node.coefficients, atoms=node.atoms, frame=node.frame,
        )  # fmt: skip
        return PatchLattice(**{**parts, **changes})

    for wrong, said in (
        (dict(means=node.means[1:]), "means"),
        (dict(indices=node.indices + 20), "none of the 20 atoms"),
        (dict(indices=node.indices[:, :1]), "differ in shape"),
        (dict(coefficients=node.coefficients * np.nan), "not finite"),
        (dict(frame=Frame((9, 9), 1.0, 1.0)), "frame"),
    ):
        with pytest.raises(InputError, match=said):
            make(**wrong)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (dict(samples=np.zeros((2, 3))), "no \\(atoms, rows, columns\\)"),
        (dict(samples=np.full((1, 3, 3), np.nan)), "not finite"),
        (dict(), "none of the samples"),
        (dict(functions=some_functions(2), means=[0.0], norms=[1.0]), "2 functions have 1 means"),
        (dict(functions=some_functions(1), means=[0.0], norms=[0.0]), "norm"),
        (dict(functions=some_functions(1), means=[0.0], norms=[1.0], kinds=[-2]), "none of"),
    ],
)
def test_atoms_that_make_no_sense_are_refused(wrong, said):
    with pytest.raises(InputError, match=said):
        Atoms(**wrong)
