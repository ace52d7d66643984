"""Nodes and operators: values, exact gradients, true bounds, and pruning that changes nothing."""

import threading

import numpy as np
import pytest
from support import hills

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.trees import (
    FULL,
    NOTHING,
    Add,
    Blend,
    Bounds,
    ConstructionTree,
    Detail,
    Frame,
    Joint,
    JointNode,
    Limits,
    Node,
    RasterNode,
)

WYVILL = 96 * np.sqrt(5) / 125


class Disc(JointNode):
    """A disc primitive: a tilted plane under Wyvill's weight (Génevaux et al., §4)."""

    def __init__(self, x, y, radius, height, slope=(0.0, 0.0)):
        self.x, self.y, self.radius, self.height, self.slope = x, y, radius, height, slope

    def bounds(self):
        x, y, radius = self.x, self.y, self.radius
        return Bounds(x - radius, y - radius, x + radius, y + radius)

    def joint(self, x, y, *, detail=FULL):
        u, v = (x - self.x) / self.radius, (y - self.y) / self.radius
        rest = np.maximum(1 - u * u - v * v, 0)
        inside = rest > 0
        falling = -6 * rest**2 / self.radius
        east, north = self.slope
        height = self.height + east * (x - self.x) + north * (y - self.y)
        return Joint(
            height * inside, rest**3, east * inside, north * inside, falling * u, falling * v
        )

    def limits(self, bounds):
        if not self.bounds().meets(bounds):
            return NOTHING
        steep = float(np.hypot(*self.slope))
        reach = steep * self.radius
        return Limits(
            self.height - reach, self.height + reach, steep, 0.0, 1.0, WYVILL / self.radius
        )


@pytest.fixture(scope="module")
def rng():
    return np.random.default_rng(11)


def a_scene():
    discs = [Disc(40, 50, 60, 100, (0.2, -0.1)), Disc(110, 60, 70, 180, (0, 0.3)),
             Disc(70, 120, 55, -20)]  # fmt: skip
    bump = Disc(80, 70, 30, 25, (0.5, 0))
    return Add(Blend(*discs), bump)


def slopes(node, x, y, line, step=1e-5):
    east = node.joint(x + step, y)[line] - node.joint(x - step, y)[line]
    north = node.joint(x, y + step)[line] - node.joint(x, y - step)[line]
    return east / (2 * step), north / (2 * step)


def assert_exact_gradients(node, x, y, allowed=0.0):
    joint = node.joint(x, y)
    there = joint.weight > 1e-4
    for line, found in ((0, joint[2:4]), (1, joint[4:6])):
        for mine, wanted in zip(found, slopes(node, x, y, line), strict=True):
            wrong = np.abs(mine - wanted) > 1e-4 * (1 + np.abs(wanted))
            assert wrong[there].mean() <= allowed


def assert_true_limits(node, rng, *, tries=200):
    """Require of the limits over random rectangles that all that is found there keeps to them."""
    box = node.bounds()
    found = 0
    for _ in range(tries):
        size = 10 ** rng.uniform(0, np.log10(box.xmax - box.xmin))
        x, y = rng.uniform(box.xmin - 5, box.xmax), rng.uniform(box.ymin - 5, box.ymax)
        part = Bounds(x, y, x + size, y + size)
        joint = node.joint(*rng.uniform((x, y), (x + size, y + size), (200, 2)).T)
        limits = node.limits(part)
        there = joint.weight >= 0.5
        assert np.all(joint.weight >= limits.weight_low - 1e-9)
        assert np.all(joint.weight <= limits.weight_high + 1e-9)
        steep = np.hypot(joint.weight_x, joint.weight_y)
        assert np.all(steep <= limits.weight_lipschitz + 1e-9)
        if there.any():
            found += 1
            assert joint.elevation[there].min() >= limits.low - 1e-6
            assert joint.elevation[there].max() <= limits.high + 1e-6
            steep = np.hypot(joint.gradient_x, joint.gradient_y)[there].max()
            assert steep <= limits.lipschitz * (1 + 1e-6) + 1e-9
            assert node.lipschitz(part) == limits.lipschitz
    assert found > tries / 10


# --- operators -----------------------------------------------------------------------------------


def test_operators_are_nodes():
    assert isinstance(a_scene(), Node)
    assert isinstance(Blend(Disc(0, 0, 1, 1)), Node)


def test_a_blend_is_the_mean_by_weights(rng):
    a, b = Disc(0, 0, 10, 100), Disc(6, 0, 10, 200)
    x, y = rng.uniform(-12, 18, (2, 500))
    joint, one, other = (node.joint(x, y) for node in (Blend(a, b), a, b))
    np.testing.assert_allclose(joint.weight, one.weight + other.weight)
    there = joint.weight > 0
    wanted = (one.weight * 100 + other.weight * 200)[there] / joint.weight[there]
    np.testing.assert_allclose(joint.elevation[there], wanted)
    assert not joint.elevation[~there].any()


def test_add_lifts_by_its_weight(rng):
    base, bump = Disc(0, 0, 10, 100), Disc(3, 0, 5, 50)
    x, y = rng.uniform(-12, 12, (2, 500))
    joint, one, other = (node.joint(x, y) for node in (Add(base, bump), base, bump))
    there = one.weight > 0
    np.testing.assert_allclose(joint.elevation[there], (100 + other.weight * 50)[there])
    np.testing.assert_array_equal(joint.weight, one.weight)
    wide = Add(base, bump, widen=True).joint(x, y)
    np.testing.assert_allclose(wide.weight, one.weight + other.weight**2)


def test_weights_above_one_add_no_more_than_all():
    stack = Blend(Disc(0, 0, 10, 7), Disc(0, 0, 10, 7), Disc(0, 0, 10, 7))
    joint = Add(Disc(0, 0, 10, 100), stack).joint(np.zeros(1), np.zeros(1))
    assert joint.elevation == 107
    assert joint.gradient_x == 0


@pytest.mark.parametrize("widen", [False, True])
def test_gradients_are_exact(rng, widen):
    scene = a_scene()
    scene.widen = widen
    assert_exact_gradients(scene, *rng.uniform(-30, 200, (2, 3000)))


@pytest.mark.parametrize("widen", [False, True])
def test_limits_hold(rng, widen):
    scene = a_scene()
    scene.widen = widen
    assert_true_limits(scene, rng)
    assert_true_limits(Blend(scene, Disc(90, 90, 80, 500)), rng)


def test_the_blend_of_two_discs_is_steeper_than_the_printed_bound():
    """Two plateaus 1.2 radii apart: ``max(λ_A, λ_B)`` and their difference alone are not enough."""
    a, b = Disc(0, 0, 1, 0), Disc(1.2, 0, 1, 1)
    node = Blend(a, b)
    joint = node.joint(np.linspace(0, 1.2, 2001), np.zeros(2001))
    there = joint.weight >= 0.5
    steepest = joint.gradient_x[there].max()
    assert WYVILL < steepest <= node.lipschitz(node.bounds())


def test_pruning_leaves_out_what_is_elsewhere_and_changes_nothing(rng):
    discs = [Disc(x, y, 12, x + y) for x in range(0, 200, 10) for y in range(0, 200, 10)]
    scene = Add(Blend(*discs), Blend(*discs[::7]))
    part = Bounds(40, 60, 70, 80)
    pruned = scene.within(part)
    kept = pruned.children[0].children
    assert len(kept) < 50
    x, y = rng.uniform((40, 60), (70, 80), (500, 2)).T
    for mine, wanted in zip(pruned.joint(x, y), scene.joint(x, y), strict=True):
        np.testing.assert_allclose(mine, wanted, atol=1e-12)
    assert scene.within(Bounds(500, 500, 600, 600)) is None
    assert scene.limits(Bounds(500, 500, 600, 600)) == NOTHING


def test_add_prunes_each_of_its_nodes():
    base, bump = Disc(0, 0, 10, 100), Disc(30, 0, 5, 50)
    narrow, wide = Add(base, bump), Add(base, bump, widen=True)
    assert narrow.within(Bounds(-1, -1, 1, 1)) is base
    assert narrow.within(Bounds(29, -1, 31, 1)) is None
    assert wide.within(Bounds(29, -1, 31, 1)).weight(np.array([30.0]), np.zeros(1)) == 1
    assert narrow.bounds() == base.bounds()
    assert wide.bounds().xmax == 35


def test_operators_need_a_node():
    with pytest.raises(InputError, match="Blend needs"):
        Blend()


# --- the tree ------------------------------------------------------------------------------------


def test_a_lone_disc_shows_where_its_weight_is_a_half():
    tree = ConstructionTree(Disc(0, 0, 100, 9))
    x = np.linspace(0, 100, 10_001)
    shown = x[np.isfinite(tree.elevation(x, 0))]
    assert shown.max() == pytest.approx(100 * np.sqrt(1 - 0.5 ** (1 / 3)), abs=0.01)
    assert np.isnan(ConstructionTree(Blend(Disc(0, 0, 1, 5))).elevation(50.0, 50.0))


@pytest.mark.parametrize("threads", [1, 3])
def test_a_grid_is_the_elevations_at_its_points(threads):
    tree = ConstructionTree(a_scene())
    x, y = np.linspace(-40, 220, 301), np.linspace(220, -40, 263)
    grid = tree.grid(x, y, threads=threads)
    np.testing.assert_array_equal(grid, tree.elevation(*np.meshgrid(x, y)).astype(np.float32))
    assert 0.2 < np.isnan(grid).mean() < 0.9
    assert tree.bounds() == tree.root.bounds()
    assert tree.lipschitz() == tree.lipschitz(tree.bounds()) > 0


def test_a_grid_is_cancelled():
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    with pytest.raises(Cancelled):
        ConstructionTree(a_scene()).grid(np.arange(500.0), np.arange(500.0), progress=Stop())


@pytest.mark.parametrize("wrong", [dict(atoms=-1), dict(resolution=-1), dict(resolution=np.nan)])
def test_a_detail_that_makes_no_sense_is_refused(wrong):
    with pytest.raises(InputError):
        Detail(**wrong)


# --- frames and rasters --------------------------------------------------------------------------


def test_a_frame_has_the_ground_size_of_the_middle_row():
    grid = raster.Grid((1201, 1201), (10.0, 1 / 1200, 0.0, 61.0, 0.0, -1 / 1200), "EPSG:4326")
    frame = Frame.of(grid)
    sizes = grid.pixel_size_m()
    assert (frame.dx, frame.dy) == (sizes.dx[600], sizes.dy[600])
    assert frame.dx < 0.52 * frame.dy
    assert frame.bounds().xmax == pytest.approx(1201 * frame.dx)
    row, column = frame.place(*frame.xy(np.array([0, 7]), np.array([3, 1200])))
    np.testing.assert_allclose(row, [0, 7], atol=1e-9)
    np.testing.assert_allclose(column, [3, 1200], atol=1e-9)


@pytest.fixture(scope="module")
def ground():
    values = hills(50, 70, dtype=np.float32)
    void = np.zeros(values.shape, bool)
    void[10:14, 20:31] = True
    void[0, 0] = True
    return values, void, Frame((50, 70), 20.0, 30.0)


def node_of(ground):
    values, void, frame = ground
    return RasterNode(values, void, frame=frame)


def test_a_raster_node_has_the_cells_at_their_centres(ground):
    values, void, frame = ground
    grid = ConstructionTree(node_of(ground)).grid(*frame.axes())
    np.testing.assert_array_equal(np.isnan(grid), void)
    np.testing.assert_array_equal(grid[~void], values[~void])


@pytest.mark.parametrize("dtype", [np.int16, np.int32, np.float64])
def test_no_digit_is_lost(dtype):
    values = (hills(20, 20, dtype=np.float64) * 30).astype(dtype)
    node = RasterNode(values, frame=Frame((20, 20), 1.0, 1.0))
    x, y = np.meshgrid(*node.frame.axes())
    np.testing.assert_array_equal(node.elevation(x, y), values)


def test_a_raster_node_is_a_smooth_surface(ground, rng):
    node = node_of(ground)
    x, y = rng.uniform((60, 60), (1340, 1000), (3000, 2)).T
    assert_exact_gradients(node, x, y, allowed=0.001)  # next to voids, the weight jumps
    plane = RasterNode(np.add.outer(np.arange(9.0) * 3, np.arange(9.0) * 2),
                       frame=Frame((9, 9), 10.0, 10.0))  # fmt: skip
    joint = plane.joint(*rng.uniform(25, 65, (2, 100)))
    np.testing.assert_allclose(joint.gradient_x, 0.2)
    np.testing.assert_allclose(joint.gradient_y, -0.3)


def test_limits_of_a_raster_node_hold(ground, rng):
    assert_true_limits(node_of(ground), rng)


def test_outside_and_in_voids_there_is_nothing(ground):
    node = node_of(ground)
    x, y = np.array([-1.0, 1401, 500, 500]), np.array([500.0, 500, 1501, 1500 - 12 * 30])
    joint = node.joint(x, y)
    assert not np.any(joint)
    assert node.limits(Bounds(-50, 0, -1, 9)) == NOTHING
    assert node.limits(Bounds(420, 1100, 600, 1180)) == NOTHING


def test_less_detail_is_the_mean_of_cells():
    rng = np.random.default_rng(3)
    values = rng.normal(0, 10, (64, 64)) + np.linspace(0, 500, 64)
    frame = Frame((64, 64), 10.0, 10.0)
    node = RasterNode(values, frame=frame)
    x, y = np.meshgrid(*frame.axes(0.25))
    coarse = node.elevation(x, y, detail=Detail(resolution=40))
    means = values.reshape(16, 4, 16, 4).mean(axis=(1, 3))
    np.testing.assert_allclose(coarse, means, atol=1e-3)
    roughness = [
        np.diff(node.elevation(*np.meshgrid(*frame.axes()), detail=Detail(resolution=r))).std()
        for r in (0, 10, 14, 20, 28, 40, 1e6)
    ]
    assert roughness[0] == roughness[1]
    assert np.all(np.diff(roughness[1:]) < 0)


def test_halvings_are_made_once_for_all_threads(ground):
    node, wanted = node_of(ground), node_of(ground)
    x, y = np.random.default_rng(0).uniform(0, 1400, (2, 999))
    threads = [
        threading.Thread(target=node.joint, args=(x, y), kwargs={"detail": Detail(resolution=r)})
        for r in (100, 200, 400, 100)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    detail = Detail(resolution=300)
    np.testing.assert_array_equal(node.elevation(x, y, detail=detail),
                                  wanted.elevation(x, y, detail=detail))  # fmt: skip


def test_one_cell_is_a_plateau():
    node = RasterNode(np.array([[7]], np.int16), frame=Frame((1, 1), 10.0, 10.0))
    heights = node.elevation(np.array([1.0, 9.0]), np.array([2.0, 8.0]))
    np.testing.assert_allclose(heights, 7)
    assert node.elevation(np.array([5.0]), np.array([5.0]), detail=Detail(resolution=99)) == 7


def test_rasters_of_nothing_are_refused(ground):
    values, void, frame = ground
    with pytest.raises(InputError, match="every cell is a void"):
        RasterNode(values, np.ones_like(void), frame=frame)
    with pytest.raises(InputError, match="the frame is of"):
        RasterNode(values[1:], frame=frame)
