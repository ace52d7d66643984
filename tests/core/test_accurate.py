"""The accurate engine's fill of voids under a given model: what it reproduces and depends on."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal, holed, plane
from scipy.ndimage import distance_transform_edt

from demsmith.core.mcmd import Lattice
from demsmith.core.pixel_size import metres
from demsmith.core.voids import find_voids, survey_rims
from demsmith.core.voids.accurate import ESTIMATORS, SOURCE_OF_METHOD, Model, estimate, margin
from demsmith.core.voids.accurate.spectrum import HIGHEST, Covariance

SHAPE = (90, 100)
ROUND = disc(SHAPE, (45, 50), 11)
INTERIOR = ROUND | holed(SHAPE, (10, 12, 20, 25), (70, 71, 70, 71), (60, 80, 15, 22))
each_estimator = pytest.mark.parametrize("only", ESTIMATORS)


def covariance(orders, *, noise=0.0, dx=1.0, dy=1.0):
    """Weights by (order down, order across)."""
    weights = np.zeros((HIGHEST + 1, HIGHEST + 1))
    for order, weight in orders.items():
        weights[order] = weight
    return Covariance(weights, noise, dx, dy)


BENDING = covariance({(2, 0): 1, (1, 1): 2, (0, 2): 1})
THIRD = covariance({(3, 0): 1, (2, 1): 3, (1, 2): 3, (0, 3): 1})


def model(only=None, *, of=BENDING, tension=12.0, roughness=1.0):
    """A model that trusts one estimator, or all alike."""
    shares = np.array(ESTIMATORS) == only if only else np.full(3, 1 / 3)
    shares = np.asarray(shares, float)
    return Model(
        covariance=of, tension=np.full(4, tension), weights=np.tile(shares, (4, 1)),
        rmse=np.full((4, 4), np.nan), tried=np.zeros(4, np.int64),
        spread=np.array([-1.0, 1.2, 0.0, 0.3]), scale=np.full(4, 1.5), roughness=roughness,
        at_edge=shares, scale_at_edge=2.0,
    )  # fmt: skip


def fill(truth, void, model, *, selected=None, rubbish=np.nan, **options):
    """Fill a copy whose voids hold ``rubbish``; returns elevations, sigma and choices."""
    void = np.ascontiguousarray(void)
    work = np.ascontiguousarray(np.where(void, rubbish, truth), truth.dtype)
    voids = find_voids(void)
    sigma = np.zeros(void.shape, np.float32)
    chosen = np.arange(len(voids)) if selected is None else selected
    return work, sigma, estimate(work, void, voids, chosen, model, sigma=sigma, **options)


# --- what comes back -----------------------------------------------------------------------------


@pytest.mark.parametrize("pixel_size", [1.0, (30.0, 30.0), (60.0, 90.0)])
def test_a_covariance_without_first_differences_returns_planes(pixel_size):
    """Second differences of a plane are zero, in every void, at edges and in corners too."""
    truth = plane(SHAPE)
    void = INTERIOR | holed(SHAPE, (0, 9, 60, 75), (80, 90, 92, 100), (30, 50, 0, 3))
    filled, _, _ = fill(truth, void, model("learned"), pixel_size=pixel_size)
    np.testing.assert_allclose(filled, truth, rtol=0, atol=1e-6)


@pytest.mark.parametrize("box", [(0, 9, 60, 75), (80, 90, 92, 100), (30, 50, 0, 3)])
def test_planes_nearly_come_back_at_the_edge(box):
    """Estimators under tension level off a little: within a tenth of the relief."""
    truth, void = plane(SHAPE), holed(SHAPE, box)
    filled, _, _ = fill(truth, void, model())
    assert abs(filled - truth).max() < 0.1 * np.ptp(truth[void])


def test_voids_at_the_edge_have_shares_and_scale_of_their_own():
    truth, edge = fractal(SHAPE, seed=2), holed(SHAPE, (0, 9, 60, 75))
    apart = replace(model("mcmd"), at_edge=np.array([0.0, 1.0, 0.0]), scale_at_edge=4.0)
    filled, sigma, choices = fill(truth, ROUND | edge, apart)
    learned, usual, _ = fill(truth, ROUND | edge, model("learned"))
    assert choices.method.tolist() == [1, 0]
    np.testing.assert_array_equal(filled[edge], learned[edge])
    within = sigma[edge] < sigma[edge].max()  # which is the most that sigma may be
    np.testing.assert_allclose(sigma[edge][within], 2 * usual[edge][within], rtol=1e-6)
    assert within.mean() > 0.5
    np.testing.assert_allclose(sigma[ROUND], usual[ROUND], rtol=1e-6)


def test_a_covariance_of_third_differences_returns_quadratic_surfaces():
    row, column = np.indices(SHAPE) - 40.0
    truth = 0.5 * row**2 - 0.3 * column**2 + 0.7 * row * column + 3 * row
    filled, _, _ = fill(truth, INTERIOR, model("learned", of=THIRD))
    np.testing.assert_allclose(filled, truth, rtol=0, atol=1e-4)
    flat, _, _ = fill(truth, INTERIOR, model("learned", of=covariance({(1, 0): 1, (0, 1): 1})))
    assert abs(flat - truth)[ROUND].max() > 1


def test_a_covariance_of_first_differences_is_laplaces_equation():
    truth = fractal(SHAPE, seed=3)
    filled, _, _ = fill(truth, ROUND, model("learned", of=covariance({(1, 0): 1, (0, 1): 1})))
    neighbours = filled[:-2, 1:-1] + filled[2:, 1:-1] + filled[1:-1, :-2] + filled[1:-1, 2:]
    inside = ROUND[1:-1, 1:-1]
    np.testing.assert_allclose(neighbours[inside] / 4, filled[1:-1, 1:-1][inside], atol=1e-8)


def test_the_learned_surface_has_the_least_energy():
    """Of the surfaces with the same known ground, no change lowers the sum of squares."""
    truth = fractal(SHAPE, seed=3)
    weights = {(1, 0): 0.3, (0, 2): 2.0, (2, 1): 0.5, (4, 0): 0.1}

    def energy(z):
        return sum(
            weight * (np.diff(np.diff(z, down, axis=0), across, axis=1) ** 2).sum()
            for (down, across), weight in weights.items()
        )

    filled, _, _ = fill(truth, ROUND, model("learned", of=covariance(weights)))
    rng = np.random.default_rng(0)
    for _ in range(10):
        change = np.where(ROUND, rng.standard_normal(SHAPE), 0)
        for step in (1e-3, -1e-3):
            assert energy(filled + step * change) > energy(filled)


@pytest.mark.parametrize("only", ["mcmd", "structured"])
def test_planes_nearly_come_back(only):
    """Tension pulls a little: within 2 % of the relief across a void."""
    truth = plane(SHAPE)
    filled, _, _ = fill(truth, INTERIOR, model(only))
    assert abs(filled - truth).max() < 0.02 * np.ptp(truth[ROUND])


def test_ridges_are_followed():
    """A diagonal ridge under a void: the structured surface misses less than half as much."""
    row, column = np.indices(SHAPE)
    truth = 40 * np.exp(-(((row - column + 5) / 5.0) ** 2))
    error = {
        only: np.sqrt(((fill(truth, ROUND, model(only))[0] - truth)[ROUND] ** 2).mean())
        for only in ESTIMATORS
    }
    assert error["structured"] < 0.5 * error["mcmd"]
    assert error["structured"] < 0.5 * error["learned"]


def test_noise_on_known_cells_is_not_drawn_into_the_void():
    """Told of the noise, the plane is found better than through the noisy rim."""
    rng = np.random.default_rng(1)
    truth = plane(SHAPE, (0.5, -0.3))
    noisy = truth + rng.normal(0, 2, SHAPE)
    told = covariance({(2, 0): 1, (1, 1): 2, (0, 2): 1}, noise=4.0)
    void = np.zeros(SHAPE, bool)
    for top in range(8, 84, 12):
        for left in range(8, 94, 12):
            void[top : top + 3, left : left + 3] = True
    deaf, heard = (
        abs(fill(noisy, void, model("learned", of=each))[0] - truth)[void].mean()
        for each in (replace(told, noise=0.0), told)
    )
    assert heard < 0.5 * deaf


# --- shifts, scales, mirrors ---------------------------------------------------------------------


@each_estimator
def test_shifted_and_stretched(only):
    """A constant is added to the fill as to the ground; a factor multiplies fill and sigma."""
    truth = fractal(SHAPE, seed=1)
    filled, sigma, choices = fill(truth, INTERIOR, model(only))
    for factor, shift in ((1, 5000.0), (0.01, 0), (100, -3)):
        stretched = model(only, roughness=factor)
        again, errors, others = fill(factor * truth + shift, INTERIOR, stretched)
        np.testing.assert_allclose(
            again, factor * filled + shift, rtol=0, atol=1e-6 * factor * np.ptp(truth)
        )
        np.testing.assert_allclose(errors, factor * sigma, rtol=1e-3)
        np.testing.assert_allclose(others.error, factor * choices.error, rtol=1e-3)


@pytest.mark.parametrize(
    ("only", "bound"), [("learned", 1e-8), ("mcmd", 0.01), ("structured", 0.01)]
)
def test_a_plane_is_added_to_the_fill(only, bound):
    truth, tilt = fractal(SHAPE, seed=1), plane(SHAPE, (1.0, -0.7))
    one, other = (fill(z, INTERIOR, model(only))[0] for z in (truth, truth + tilt))
    assert abs(other - tilt - one).max() < bound * np.ptp(truth[ROUND])


@pytest.mark.parametrize(
    ("only", "bound"), [("learned", 1e-8), ("mcmd", 0.03), ("structured", 0.03)]
)
def test_mirrored_and_transposed(only, bound):
    truth = fractal(SHAPE, seed=3)
    of = covariance({(2, 0): 3, (1, 1): 2, (0, 2): 1}, dx=60.0, dy=90.0)
    turned = covariance({(2, 0): 1, (1, 1): 2, (0, 2): 3}, dx=90.0, dy=60.0)
    filled, _, _ = fill(truth, INTERIOR, model(only, of=of), pixel_size=(60.0, 90.0))
    here = partial(fill, model=model(only, of=of), pixel_size=(60.0, 90.0))
    there = partial(fill, model=model(only, of=turned), pixel_size=(90.0, 60.0))
    for other in (
        here(truth[:, ::-1], INTERIOR[:, ::-1])[0][:, ::-1],
        here(truth[::-1], INTERIOR[::-1])[0][::-1],
        there(truth.T, INTERIOR.T)[0].T,
    ):
        assert abs(other - filled).max() < bound * np.ptp(truth)


# --- what a fill depends on ----------------------------------------------------------------------


@each_estimator
def test_what_lies_in_voids_does_not_matter(only):
    truth = fractal(SHAPE, seed=4)
    plain = fill(truth, INTERIOR, model(only))
    for rubbish in (0.0, -32768.0, 1e30, np.inf):
        again = fill(truth, INTERIOR, model(only), rubbish=rubbish)
        assert again[0].tobytes() == plain[0].tobytes()
        assert again[1].tobytes() == plain[1].tobytes()


def test_a_void_alone_is_filled_as_among_others():
    """The others stay voids; whether they are filled as well, and in what order, is all one."""
    truth = fractal(SHAPE, seed=4)
    void = INTERIOR | holed(SHAPE, (44, 46, 63, 66))  # one cell from the round one
    together, sigma, choices = fill(truth, void, model())
    voids = find_voids(void)
    for number in range(len(voids)):
        alone, errors, choice = fill(truth, void, model(), selected=[number])
        own = voids.labels == number + 1
        assert alone[own].tobytes() == together[own].tobytes()
        assert errors[own].tobytes() == sigma[own].tobytes()
        assert np.isnan(alone[void & ~own]).all() and not errors[~own].any()
        assert choice.error[0] == choices.error[number]
    turned = fill(truth, void, model(), selected=np.arange(len(voids))[::-1])
    assert turned[0].tobytes() == together.tobytes()
    np.testing.assert_array_equal(turned[2].error, choices.error[::-1])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_same_bytes_whatever_the_threads(dtype):
    truth = fractal(SHAPE, seed=5).astype(dtype)
    void = INTERIOR | (np.random.default_rng(0).random(SHAPE) < 0.1)
    one, *others = (fill(truth, void, model(), threads=threads) for threads in (1, 2, 3))
    assert one[0].dtype == dtype
    for other in others:
        assert other[0].tobytes() == one[0].tobytes()
        assert other[1].tobytes() == one[1].tobytes()
        for a, b in zip(one[2], other[2], strict=True):
            assert a.tobytes() == b.tobytes()


def _around(own, extra=0):
    """A void's bounding box with its margin, as slices cut at the raster's edge."""
    rows, columns = np.nonzero(own)
    wide = margin(int(np.ptp(rows)) + 1, int(np.ptp(columns)) + 1) + extra
    return tuple(
        slice(max(int(index.min()) - wide, 0), min(int(index.max()) + 1 + wide, length))
        for index, length in zip((rows, columns), own.shape, strict=True)
    )


def _mosaic(dtype=np.float32):
    shape = (260, 300)
    truth = fractal(shape, seed=7).astype(dtype)
    void = disc(shape, (120, 130), 13) | holed(
        shape, (118, 121, 146, 150), (0, 7, 140, 160), (250, 260, 291, 300), (60, 61, 61, 62),
        (200, 203, 40, 95),
    )  # fmt: skip
    size = np.linspace(60, 70, shape[0]), np.full(shape[0], 90.0)
    return truth, void, size, model(of=replace(BENDING, dx=65.0, dy=90.0, noise=0.0))


@pytest.mark.parametrize("extra", [0, 5])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_window_with_its_margin_gives_the_mosaics_bytes(dtype, extra):
    """What tiles of a mosaic rely on: the same model and lattice, nothing of the rest."""
    truth, void, size, of = _mosaic(dtype)
    whole, sigma, choices = fill(truth, void, of, pixel_size=size)
    voids, levels = find_voids(void), Lattice.covering(void.shape).levels
    for number in range(len(voids)):
        own = voids.labels == number + 1
        window = _around(own, extra)
        rows, columns = window
        inside = find_voids(void[window])
        (selected,) = set(inside.labels[own[window]] - 1)
        part, errors, choice = fill(
            truth[window], void[window], of, selected=[selected],
            pixel_size=tuple(each[rows] for each in size),
            lattice=Lattice(-rows.start, -columns.start, levels),
        )  # fmt: skip
        assert part[own[window]].tobytes() == whole[own].tobytes(), number
        assert errors[own[window]].tobytes() == sigma[own].tobytes(), number
        assert choice.error[0] == choices.error[number]
        np.testing.assert_array_equal(choice.shares[0], choices.shares[number])


def test_ground_beyond_the_margin_does_not_matter():
    truth, void, size, of = _mosaic()
    whole, sigma, _ = fill(truth, void, of, pixel_size=size)
    voids = find_voids(void)
    for number in range(len(voids)):
        own = voids.labels == number + 1
        other = np.full(truth.shape, 4321, np.float32)
        other[_around(own)] = truth[_around(own)]
        again, errors, _ = fill(other, void, of, pixel_size=size)
        assert again[own].tobytes() == whole[own].tobytes(), number
        assert errors[own].tobytes() == sigma[own].tobytes(), number


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 60), st.integers(1, 60))
def test_the_margin_grows_with_the_void(high, wide):
    here = margin(high, wide)
    assert here == margin(wide, high) > 3
    assert margin(high + 1, wide) >= here
    assert isinstance(int(here), int)


# --- bounds, neighbours, edges, shapes -----------------------------------------------------------


@each_estimator
def test_overshoot_is_bounded_by_relief_and_slope(only):
    """Cliffs around the voids tempt every estimator to leave the rim's range."""
    truth = np.where(np.indices(SHAPE).sum(axis=0) % 23 < 11, 0.0, 800.0)
    truth += np.random.default_rng(2).normal(0, 60, SHAPE)
    void = INTERIOR | (np.random.default_rng(3).random(SHAPE) < 0.08)
    filled, _, _ = fill(truth, void, model(only))
    voids = find_voids(void)
    rims = survey_rims(np.where(void, np.nan, truth), void, voids)
    relief = rims.high - rims.low
    number = voids.labels[void] - 1
    climb = 500 * distance_transform_edt(void)[void]  # the ground's mean slope is less
    assert (filled[void] >= (rims.low - relief)[number] - climb).all()
    assert (filled[void] <= (rims.high + relief)[number] + climb).all()


def test_a_summit_is_not_cut_flat():
    """The rim of a void on a round hill is nearly level, and the hill is higher."""
    row, column = np.indices(SHAPE) - 45
    truth = 1000 * np.exp(-(row**2 + column**2) / 40**2)
    void = row**2 + column**2 <= 15**2
    filled, _, _ = fill(truth, void, model("structured"))
    assert abs(filled - truth)[void].max() < 40


def test_a_level_rim_makes_a_level_void():
    truth = fractal(SHAPE, seed=2)
    truth[30:60, 35:65] = np.where(disc((30, 30), (15, 15), 13), 100.0, truth[30:60, 35:65])
    filled, _, _ = fill(truth, ROUND, model())
    assert (filled[ROUND] == 100).all()


@pytest.mark.parametrize("gap", [0, 1, 2])
def test_voids_beside_each_other(gap):
    """One, two cells of ground between them, or none but a shared corner: a plane comes back."""
    void = holed(SHAPE, (20, 35, 20, 35), (20 + 15 * (gap == 0), 50, 35 + gap, 55))
    assert len(find_voids(void)) == 2
    truth = plane(SHAPE)
    exact, _, _ = fill(truth, void, model("learned"))
    np.testing.assert_allclose(exact, truth, rtol=0, atol=1e-6)
    for only in ("mcmd", "structured"):
        near, _, _ = fill(truth, void, model(only))
        assert abs(near - truth).max() < 0.05 * np.ptp(truth[void])


EDGES = {
    "corner": [(0, 8, 0, 9)],
    "all corners": [(0, 3, 0, 3), (0, 3, 97, 100), (87, 90, 0, 3), (87, 90, 97, 100)],
    "side": [(0, 90, 0, 6)],
    "row": [(44, 46, 0, 100)],
    "column": [(0, 90, 50, 51)],
    "cross": [(44, 45, 0, 100), (0, 90, 50, 51)],
    "frame": [(0, 5, 0, 100), (85, 90, 0, 100), (0, 90, 0, 5), (0, 90, 95, 100)],
    "all but the middle": [(0, 40, 0, 100), (50, 90, 0, 100), (0, 90, 0, 45), (0, 90, 55, 100)],
    "all but a corner": [(0, 88, 0, 100), (0, 90, 0, 98)],
}


@pytest.mark.parametrize("case", EDGES)
def test_voids_at_the_edge(case):
    truth, void = fractal(SHAPE, seed=6), holed(SHAPE, *EDGES[case])
    filled, sigma, choices = fill(truth, void, model())
    assert np.isfinite(filled).all() and (filled[~void] == truth[~void]).all()
    assert (sigma[void] > 0).all() and not sigma[~void].any()
    assert np.isfinite(choices.error).all()


@st.composite
def masked(draw):
    shape = draw(
        st.sampled_from([(1, 2), (2, 1), (1, 40), (40, 1), (2, 2), (3, 3), (5, 4), (2, 30)])
        | st.tuples(st.integers(1, 40), st.integers(2, 40))
    )
    rng = np.random.default_rng(draw(st.integers(0, 1000)))
    void = rng.random(shape) < draw(st.sampled_from([0.0, 0.1, 0.5, 0.95]))
    void.flat[rng.integers(void.size)] = False
    dtype = draw(st.sampled_from([np.float32, np.float64]))
    height = draw(st.sampled_from([0.0, 1e-6, 1.0, 1e4]))
    return (rng.random(shape) * height).astype(dtype), void


@settings(max_examples=80, deadline=None)
@given(masked(), st.sampled_from([None, *ESTIMATORS]), st.sampled_from([0.0, 1.0]))
def test_any_shape_is_filled(raster, only, noise):
    truth, void = raster
    of = model(only, of=replace(BENDING, noise=noise))
    filled, sigma, choices = fill(truth, void, of, pixel_size=(70.0, 90.0))
    assert filled.dtype == truth.dtype
    assert filled[~void].tobytes() == truth[~void].tobytes()
    assert np.isfinite(filled).all()
    assert (np.isfinite(sigma) & ((sigma > 0) == void)).all()
    count = len(find_voids(void))
    assert choices.method.shape == choices.error.shape == (count,)
    assert (choices.method < SOURCE_OF_METHOD.size).all()
    np.testing.assert_allclose(choices.shares.sum(axis=1), 1)


def test_choices_name_the_estimator_with_most_to_say():
    truth = fractal(SHAPE)
    for number, only in enumerate(ESTIMATORS):
        assert (fill(truth, INTERIOR, model(only))[2].method == number).all()
    assert (fill(truth, INTERIOR, model())[2].method == len(ESTIMATORS)).all()


def test_expected_error_of_a_void_is_the_root_mean_square_of_its_cells():
    _, sigma, choices = fill(fractal(SHAPE), INTERIOR, model())
    labels = find_voids(INTERIOR).labels
    for number, error in enumerate(choices.error):
        cells = sigma[labels == number + 1].astype(float)
        assert error == pytest.approx(np.sqrt((cells**2).mean()), rel=1e-5)


def test_sigma_grows_with_distance_and_roughness():
    rough = fractal(SHAPE, seed=8)
    _, sigma, _ = fill(rough, ROUND, model())
    assert sigma[45, 50] > 2 * sigma[ROUND & ~disc(SHAPE, (45, 50), 10)].mean()
    _, smoother, _ = fill(rough / 50, ROUND, model(roughness=1 / 50))
    assert (smoother[ROUND] < sigma[ROUND] / 10).all()


def test_tension_of_the_start_is_in_metres():
    truth, of = fractal(SHAPE, seed=9), model("mcmd")
    by_cells, _, _ = fill(truth, ROUND, of, tension=3.0)
    by_metres, _, _ = fill(truth, ROUND, of, tension=90.0, pixel_size=30.0)
    np.testing.assert_allclose(by_metres, by_cells, rtol=1e-9)
    usual, _, _ = fill(truth, ROUND, of)
    assert abs(by_cells - usual)[ROUND].max() > 0.01 * np.ptp(truth[ROUND])


def test_tension_of_the_structured_surface_is_the_models_in_rows():
    truth = fractal(SHAPE, seed=9)
    usual, taut = (fill(truth, ROUND, model("structured", tension=t))[0] for t in (12.0, 2.0))
    assert abs(taut - usual)[ROUND].max() > 0.01 * np.ptp(truth[ROUND])
    of = model("structured", of=replace(BENDING, dx=30.0, dy=30.0), tension=2.0)
    np.testing.assert_allclose(fill(truth, ROUND, of, pixel_size=30.0)[0], taut, rtol=1e-6)


def test_pixel_sizes_by_row():
    truth, rows = fractal(SHAPE, seed=9), np.ones(SHAPE[0])
    of = model(of=replace(BENDING, dx=70.0, dy=90.0))
    one, two = (
        fill(truth, INTERIOR, of, pixel_size=size)[0]
        for size in ((70.0, 90.0), (70 * rows, 90 * rows))
    )
    assert one.tobytes() == two.tobytes()
    dx, dy = metres(SHAPE, (np.linspace(70, 35, SHAPE[0]), 90.0))
    assert (fill(truth, INTERIOR, of, pixel_size=(dx, dy))[0] != one).any()
