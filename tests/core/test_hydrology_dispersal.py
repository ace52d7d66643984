"""Flow that parts, MFD and D-infinity: against plain formulas, theory, balance and symmetry."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from demsmith.core import strips as strips_module
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.hydrology import _dispersal, traversal
from demsmith.core.hydrology._powers import angle, raise_all
from demsmith.core.hydrology.accumulation import accumulate_d8, accumulate_dinf, accumulate_mfd
from demsmith.core.hydrology.directions import d8_directions
from demsmith.core.hydrology.flats import resolve_flats
from demsmith.core.hydrology.specific import specific_area, specific_area_of_shares
from demsmith.core.hydrology.traversal import Surface

STEPS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))
both = pytest.mark.parametrize("exponent", [None, 1.1], ids=["dinf", "mfd"])


def accumulate(z, flat, void, dx, dy, weights, exponent, **options):
    if exponent is None:
        return accumulate_dinf(z, flat, void, dx, dy, weights, **options)
    return accumulate_mfd(z, flat, void, dx, dy, weights, exponent=exponent, **options)


@pytest.fixture
def narrow_strips(monkeypatch):
    monkeypatch.setattr(strips_module, "_STRIP_CELLS", 100)


# --- plain formulas ------------------------------------------------------------------------------


def lower(z, flat, void, row, column):
    """How far each neighbour lies below a cell; NaN where water cannot go."""
    drops = np.full(8, np.nan)
    for k, (down, right) in enumerate(STEPS):
        r, c = row + down, column + right
        if not (0 <= r < z.shape[0] and 0 <= c < z.shape[1]) or void[r, c]:
            continue
        if flat[row, column] == 0:
            drops[k] = float(z[row, column]) - float(z[r, c])
        elif z[r, c] == z[row, column]:
            drops[k] = float(flat[row, column]) - float(flat[r, c])
    return drops


def mfd(drops, dx, dy, exponent):
    cut = min(dx, dy) / max(dx, dy) / (2 + math.sqrt(2))
    sides = dy - 2 * cut * dx, cut * math.hypot(dx, dy), dx - 2 * cut * dy
    distances = dx, math.hypot(dx, dy), dy
    shares = np.zeros(8)
    for k, kind in enumerate((0, 1, 2, 1) * 2):
        if drops[k] > 0:
            shares[k] = sides[kind] * (drops[k] / distances[kind]) ** exponent
    return shares / shares.sum() if shares.any() else shares


def dinf(drops, dx, dy):
    ways = []
    for k in range(8):
        distance = (dx, math.hypot(dx, dy), dy, math.hypot(dx, dy))[k % 4]
        ways.append((drops[k] / distance, {k: 1.0}))
        side, corner = (k, (k + 1) % 8) if k % 2 == 0 else ((k + 1) % 8, k)
        ahead, across = (dx, dy) if side % 4 == 0 else (dy, dx)
        along, aside = drops[side] / ahead, (drops[corner] - drops[side]) / across
        if along > 0 and 0 < aside / along < across / ahead:
            share = math.atan(aside / along * ahead / across) / (math.pi / 4)
            ways.append((math.hypot(along, aside), {side: 1 - share, corner: share}))
    steepest = max((slope for slope, _ in ways if slope > 0), default=0.0)
    shares = np.zeros(8)
    for slope, way in ways:
        if steepest > 0 and slope > steepest * (1 - 1e-6):
            for k, share in way.items():
                shares[k] += share
    return shares / shares.sum() if shares.any() else shares


def slow(z, flat, void, dx, dy, weights, exponent):
    """Upstream sums by the plain formulas, cells from high to low."""
    area = np.where(void, 0.0, weights)
    cells = np.argwhere(~void)
    order = sorted(map(tuple, cells), key=lambda cell: (-z[cell], -int(flat[cell])))
    for row, column in order:
        drops = lower(z, flat, void, row, column)
        if exponent is None:
            shares = dinf(drops, dx[row], dy[row])
        else:
            shares = mfd(drops, dx[row], dy[row], exponent)
        for k in np.flatnonzero(shares):
            area[row + STEPS[k][0], column + STEPS[k][1]] += area[row, column] * shares[k]
    return area


def rough(shape, seed, levels, voids, dtype=np.float32):
    """Noise of so many levels, which has flats and pits if these are few."""
    rng = np.random.default_rng(seed)
    z = rng.integers(0, levels, shape).astype(dtype)
    void = rng.random(shape) < voids
    return (
        z,
        resolve_flats(z, void),
        void,
        rng.uniform(0.5, 2, shape[0]),
        rng.uniform(1, 3, shape[0]),
    )


@pytest.mark.usefixtures("narrow_strips")
@settings(max_examples=60, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 25), st.integers(1, 25)),
    levels=st.sampled_from([2, 5, 10**6]),
    voids=st.sampled_from([0.0, 0.1, 0.7]),
    exponent=st.sampled_from([None, 1.1, 0.0, 1.0, 6.0]),
    seed=st.integers(0, 10**6),
)
def test_area_is_that_of_the_plain_formulas(shape, levels, voids, exponent, seed):
    ground = rough(shape, seed, levels, voids)
    weights = np.random.default_rng(seed).random(shape)
    area = accumulate(*ground, weights, exponent, threads=2)
    np.testing.assert_allclose(area, slow(*ground, weights, exponent), rtol=1e-4)


@both
def test_the_same_in_double_precision(exponent):
    z, flat, void, dx, dy = rough((30, 40), 1, 4, 0.05)
    one = accumulate(z, flat, void, dx, dy, dx, exponent)
    other = accumulate(z.astype(float) + 1e9, flat.astype(np.uint32), void, dx, dy, dx, exponent)
    np.testing.assert_array_equal(one, other)


def test_powers_and_angles_are_exact_to_single_precision():
    bases = np.append(np.random.default_rng(0).random(5000) ** 3, [0.0, 1.0]).astype(np.float32)
    for exponent in (0.0, 0.3, 1.0, 1.1, 2.0, 10.0):
        powers = bases.copy()
        raise_all(powers, np.float32(exponent))
        expected = np.maximum(bases.astype(float), 2.0**-100) ** exponent
        error = np.abs(powers / np.maximum(expected, 2.0**-119) - 1)
        assert np.median(error) < 1e-6
        assert np.max(error[expected > 1e-9]) < 1e-5
    angles = [angle(base, np.float32(1)) for base in bases[bases > 0]]
    np.testing.assert_allclose(angles, np.arctan(bases[bases > 0].astype(float)), rtol=5e-7)


# --- nothing is lost -----------------------------------------------------------------------------


@both
@pytest.mark.parametrize("levels", [30, 10**6])
def test_what_arrives_at_outlets_and_sinks_is_all_that_fell(exponent, levels):
    z, flat, void, dx, dy = rough((600, 1000), 5, levels, 0.01)
    weights = np.random.default_rng(1).random(z.shape)
    area = accumulate(z, flat, void, dx, dy, weights, exponent)
    receivers = Surface(z, flat, void, dx, dy).receivers(exponent)
    ends = (receivers == 0) & ~void
    assert area[ends].sum() == pytest.approx(weights[~void].sum(), rel=1e-12)
    assert (area[~void] >= weights[~void]).all()
    assert (area[void] == 0).all()


@both
def test_same_bytes_for_any_number_of_threads(exponent):
    ground = rough((1200, 1000), 5, 300, 0.01)
    results = {accumulate(*ground, np.ones(1200), exponent, threads=n).tobytes() for n in (1, 2, 5)}
    assert len(results) == 1


@both
def test_strips_change_nothing_but_rounding(exponent, monkeypatch):
    ground = rough((150, 90), 8, 20, 0.02)
    whole = accumulate(*ground, np.ones(150), exponent)
    for cells in (1, 90 * 2, 90 * 7):
        monkeypatch.setattr(strips_module, "_STRIP_CELLS", cells)
        np.testing.assert_allclose(
            accumulate(*ground, np.ones(150), exponent, threads=2), whole, rtol=1e-12
        )


@both
def test_long_waits_and_little_room(exponent, monkeypatch):
    # A star: ground that falls outwards, north too, so that cells wait behind.
    monkeypatch.setattr(traversal, "_PATIENCE", 50)
    monkeypatch.setattr(traversal, "_ROOM", 17 * _dispersal.BUNCH)
    y, x = np.mgrid[:60, :60] - 29.5
    z = (-np.hypot(x, y) + 1e-3 * x).astype(np.float32)
    one, void = np.ones(60), np.zeros(z.shape, bool)
    area = accumulate(z, None, void, one, one, one, exponent)
    np.testing.assert_allclose(
        area, slow(z, np.zeros(z.shape, int), void, one, one, np.ones(z.shape), exponent), rtol=1e-4
    )


# --- mirrored and turned -------------------------------------------------------------------------


@both
@pytest.mark.parametrize("levels", [3, 12, 10**6])
def test_a_mirrored_or_turned_surface_drains_mirrored_or_turned(exponent, levels):
    z, _, void, _, _ = rough((40, 55), 11, levels, 0.03)
    assert resolve_flats(z, void).any() or levels == 10**6

    def drained(turn):
        z_turned, gaps = np.ascontiguousarray(turn(z)), np.ascontiguousarray(turn(void))
        sides = np.full(len(z_turned), 30.0)
        flat = resolve_flats(z_turned, gaps)
        return accumulate(z_turned, flat, gaps, sides, sides, sides, exponent)

    expected = drained(lambda a: a)
    for turn in (np.flipud, np.fliplr, np.rot90, np.transpose, lambda a: np.rot90(a, 2)):
        np.testing.assert_allclose(drained(turn), turn(expected), rtol=1e-6)


@both
def test_mirrored_where_rows_differ(exponent):
    z, flat, void, dx, dy = rough((40, 55), 12, 12, 0.03)
    area = accumulate(z, flat, void, dx, dy, dx, exponent)
    mirrored = accumulate(z[::-1], flat[::-1], void[::-1], dx[::-1], dy[::-1], dx[::-1], exponent)
    np.testing.assert_allclose(mirrored[::-1], area, rtol=1e-6)
    turned = accumulate(
        z[:20].T,
        flat[:20].T,
        void[:20].T,
        np.full(55, 2.0),
        np.full(55, 0.7),
        np.ones(55),
        exponent,
    )
    area = accumulate(
        z[:20], flat[:20], void[:20], np.full(20, 0.7), np.full(20, 2.0), np.ones(20), exponent
    )
    np.testing.assert_allclose(turned.T, area, rtol=1e-6)


# --- theory --------------------------------------------------------------------------------------

SIDE = 150.5


def places(dx, dy):
    """Easting and northing of the cells of a square of 301 by 301 metres."""
    rows, columns = (2 * int(SIDE / side) + 1 for side in (dy, dx))
    y, x = np.mgrid[:rows, :columns].astype(float)
    return (x - columns // 2) * dx, (rows // 2 - y) * dy


def error_of_theory(z, theory, where, dx, dy, exponent):
    """Mean and root mean square of the relative error of the specific catchment area."""
    sides = np.full(len(z), dx), np.full(len(z), dy)
    ground = z, None, np.zeros(z.shape, bool), *sides
    if exponent == "d8":
        directions = d8_directions(*ground)
        specific = specific_area(
            accumulate_d8(directions, np.full(len(z), dx * dy)), directions, *sides
        )
    else:
        area = accumulate(*ground, np.full(len(z), dx * dy), exponent)
        specific = specific_area_of_shares(area, *ground, exponent=exponent)
    error = (specific / np.where(where, theory, 1) - 1)[where]
    return error.mean(), math.sqrt((error**2).mean())


def plane(x, y, angle):
    """Falls in a direction; water comes from the western and southern sides."""
    east, north = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    length = np.minimum((x + SIDE) / east, (y + SIDE) / north)
    # Off the line from the corner, across which water spreads, and off the other sides.
    aside = np.abs((x + SIDE) * north - (y + SIDE) * east) > 30
    inner = (np.abs(x) < 100) & (np.abs(y) < 100)
    return -(east * x + north * y), length, aside & inner


def outward_cone(x, y):
    r = np.hypot(x, y)
    return -r, r / 2, (r > 30) & (r < 140)


def inward_cone(x, y):
    r, edge = np.hypot(x, y), 140.0
    z = np.where(r < edge, r, 2 * edge - r)
    return z, (edge**2 - r**2) / (2 * np.maximum(r, 1)), (r > 30) & (r < 100)


def saddle(x, y):
    # Water follows x y = constant, from the eastern and western sides.
    theory = np.log(SIDE / np.maximum(np.abs(x), 0.5)) * np.hypot(x, y)
    return (x**2 - y**2) / 200, theory, (np.abs(x) > 20) & (np.abs(x) < 110) & (np.abs(y) > 20) & (
        np.abs(y) < 130
    )  # fmt: skip


SURFACES = {
    "plane, 10°": lambda x, y: plane(x, y, 10),
    "plane, 30°": lambda x, y: plane(x, y, 30),
    "plane, 45°": lambda x, y: plane(x, y, 45.0),
    "plane, 70°": lambda x, y: plane(x, y, 70),
    "outward cone": outward_cone,
    "inward cone": inward_cone,
    "saddle": saddle,
}


@pytest.mark.parametrize(("dx", "dy"), [(1.0, 1.0), (0.5, 1.0), (1.0, 0.6)])
@pytest.mark.parametrize("surface", SURFACES)
def test_specific_area_is_that_of_theory(surface, dx, dy):
    z, theory, where = SURFACES[surface](*places(dx, dy))
    for exponent, mean, rms in ((1.1, 0.02, 0.04), (None, 0.06, 0.12)):
        found = error_of_theory(z, theory, where, dx, dy, exponent)
        assert abs(found[0]) < mean
        assert found[1] < rms


@pytest.mark.parametrize("surface", ["outward cone", "inward cone", "plane, 30°"])
def test_dispersion_is_nearer_to_theory_than_d8(surface):
    z, theory, where = SURFACES[surface](*places(1, 1))
    d8, dispersed, facets = (
        error_of_theory(z, theory, where, 1, 1, exponent)[1] for exponent in ("d8", 1.1, None)
    )
    assert dispersed < 0.5 * facets < 0.25 * d8


def test_a_cell_of_tarbotons_facet():
    # From the middle, 10 m down to the side and 4 more to the corner: 21.8° of 45°.
    z = np.array([[30.0, 30, 30], [30, 20, 10], [30, 30, 6]])
    one = np.ones(3)
    area = accumulate_dinf(z, None, np.zeros((3, 3), bool), one, one, np.diag([0, 1.0, 0]))
    share = math.atan2(4, 10) / (math.pi / 4)
    # What goes to the side goes on to the corner.
    np.testing.assert_allclose(area[1:, 2], [1 - share, 1], rtol=1e-6)


def test_a_large_exponent_is_nearly_d8():
    rng = np.random.default_rng(2)
    z, one, void = rng.random((40, 40)), np.ones(40), np.zeros((40, 40), bool)
    area = accumulate_mfd(z, None, void, one, one, one, exponent=100)
    d8 = accumulate_d8(d8_directions(z, None, void, one, one), one)
    assert np.mean(np.abs(area - d8) < 0.05) > 0.85


# --- what else may come --------------------------------------------------------------------------


@both
@pytest.mark.parametrize("scale", [1e-300, 1e-42, 1e-30, 1e30, 1e300])
def test_tiny_and_huge_slopes_lose_nothing(exponent, scale):
    z, flat, void, dx, dy = rough((30, 30), 3, 5, 0, np.float64)
    area = accumulate(z * scale, flat, void, dx, dy, np.ones(30), exponent)
    receivers = Surface(z * scale, flat, void, dx, dy).receivers(exponent)
    assert area[receivers == 0].sum() == pytest.approx(900, rel=1e-12)


@both
def test_numbers_that_lead_nowhere_still_give_a_result(exponent):
    rng = np.random.default_rng(4)
    z, flat = rng.integers(0, 3, (30, 30)).astype(float), rng.integers(0, 9, (30, 30), np.uint16)
    void, one = np.zeros(z.shape, bool), np.ones(30)
    area = accumulate(z, flat, void, one, one, one, exponent)
    receivers = Surface(z, flat, void, one, one).receivers(exponent)
    assert area[receivers == 0].sum() == pytest.approx(900, rel=1e-12)


@both
def test_only_voids(exponent):
    void, one = np.ones((3, 4), bool), np.ones(3)
    area = accumulate(np.zeros((3, 4)), None, void, one, one, one, exponent)
    np.testing.assert_array_equal(area, 0)


@pytest.mark.parametrize("exponent", [-0.1, 101, math.nan])
def test_exponents_out_of_range_are_refused(exponent):
    one = np.ones(2)
    with pytest.raises(InputError, match="exponent"):
        accumulate_mfd(
            np.zeros((2, 2)), None, np.zeros((2, 2), bool), one, one, one, exponent=exponent
        )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(flat=np.zeros((2, 2), np.uint16)), r"flat has shape \(2, 2\)"),
        (dict(dx=np.ones(2)), "dx"),
        (dict(dy=-np.ones(3)), "dy"),
        (dict(weights=np.ones(4)), "weights"),
        (dict(weights=np.array([1, 2, np.nan])), "finite"),
    ],
)
def test_arrays_must_fit(change, message):
    ground = dict(
        filled=np.zeros((3, 4)), flat=None, void=np.zeros((3, 4), bool), dx=np.ones(3),
        dy=np.ones(3), weights=np.ones(3),
    )  # fmt: skip
    with pytest.raises(InputError, match=message):
        accumulate_dinf(**ground | change)


@both
def test_cancel(exponent):
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    ground = rough((20, 20), 1, 9, 0)
    with pytest.raises(Cancelled):
        accumulate(*ground, np.ones(20), exponent, progress=Stop())
