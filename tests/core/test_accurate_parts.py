"""Parts of the accurate engine: surfaces by cell, shares by size, expected errors."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scenes import disc, fractal, holed, plane

from demsmith.core.voids import find_voids
from demsmith.core.voids.accurate.blending import (
    blend,
    features_of,
    shares_of,
    sigma_of,
    tensions_of,
    units_of,
)
from demsmith.core.voids.accurate.estimates import cells_of, estimate_surfaces, work_rows
from demsmith.core.voids.accurate.model import ESTIMATORS, FEATURES, LARGEST_LEARNED, Model
from demsmith.core.voids.accurate.spectrum import HIGHEST, Covariance

SHAPE = (60, 70)
VOID = disc(SHAPE, (30, 30), 9) | holed(SHAPE, (5, 6, 50, 53), (40, 55, 60, 64))
masks = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=30))


def bending():
    weights = np.zeros((HIGHEST + 1, HIGHEST + 1))
    weights[2, 0], weights[1, 1], weights[0, 2] = 1, 2, 1
    return Covariance(weights, 0.0, 1.0, 1.0)


def estimates(ground, void=VOID, **options):
    ones = np.ones(len(ground))
    voids = find_voids(void)
    return voids, estimate_surfaces(
        ground, void, voids, np.arange(len(voids)), bending(), dx=ones, dy=ones,
        tension=np.full(len(voids), 12.0), **options,
    )  # fmt: skip


# --- surfaces by cell ----------------------------------------------------------------------------


@given(masks, st.integers(0, 10**6))
@settings(deadline=None)
def test_cells_are_listed_void_by_void(void, seed):
    voids = find_voids(void)
    selected = np.random.default_rng(seed).permutation(len(voids))[: 1 + len(voids) // 2]
    cells, first = cells_of(voids, selected, void.shape[1])
    assert first[0] == 0 and first[-1] == cells.size
    for k, number in enumerate(selected):
        own = cells[first[k] : first[k + 1]]
        np.testing.assert_array_equal(own, np.flatnonzero(voids.labels == number + 1))


def test_rows_are_those_of_the_voids_middles():
    voids = find_voids(VOID)
    assert work_rows(voids, np.array([0, 1, 2])).tolist() == [5, 30, 47]


def test_surfaces_are_of_the_listed_cells():
    start = fractal(SHAPE)
    voids, found = estimates(start)
    assert found.surfaces.shape == (len(ESTIMATORS), VOID.sum())
    np.testing.assert_array_equal(np.sort(found.cells), np.flatnonzero(VOID))
    # The first surface is the start itself.
    np.testing.assert_allclose(found.surfaces[0], start.ravel()[found.cells], rtol=1e-12)
    np.testing.assert_array_equal(found.void_of, voids.labels.ravel()[found.cells] - 1)


def test_distances_are_to_known_ground():
    from scipy.ndimage import distance_transform_edt

    _, found = estimates(fractal(SHAPE))
    exact = distance_transform_edt(VOID).ravel()[found.cells]
    assert (found.distance >= 1).all()
    np.testing.assert_allclose(found.distance, exact, rtol=0.09)  # by steps in eight directions


def test_roughness_is_of_the_ground_around():
    _, flat = estimates(plane(SHAPE))
    assert (flat.roughness < 1e-9).all()
    row, column = np.indices(SHAPE)
    _, curved = estimates(1.5 * row**2 + 0.5 * column**2)
    np.testing.assert_allclose(curved.roughness, 2 * 1.5 + 2 * 0.5, rtol=1e-6)


def test_the_start_is_not_changed():
    start = fractal(SHAPE)
    before = start.tobytes()
    estimates(start)
    assert start.tobytes() == before


def test_voids_beyond_a_size_are_not_learned_in():
    """Their learned surface is the start."""
    side = int(np.sqrt(LARGEST_LEARNED)) + 2
    void = holed((side + 20, side + 20), (10, 10 + side, 10, 10 + side))
    _, found = estimates(fractal(void.shape), void)
    np.testing.assert_array_equal(found.surfaces[1], found.surfaces[0])
    assert (found.surfaces[2] != found.surfaces[0]).any()


# --- shares --------------------------------------------------------------------------------------

AT_EDGE = np.array([0.2, 0.7, 0.1])
WEIGHTS = np.array([[0.1, 0.8, 0.1], [0.2, 0.5, 0.3], [0.3, 0.1, 0.6], [0.9, 0.0, 0.1]])


@given(hnp.arrays(np.int64, st.integers(1, 50), elements=st.integers(1, 10**7)))
def test_shares_add_up_to_one_in_voids_of_all_sizes(cells):
    shares = shares_of(WEIGHTS, AT_EDGE, cells, cells % 2 == 0)
    assert shares.shape == (cells.size, 3)
    np.testing.assert_allclose(shares.sum(axis=1), 1)
    assert (shares >= 0).all()
    assert not shares[cells > LARGEST_LEARNED, ESTIMATORS.index("learned")].any()


def test_shares_are_those_of_the_classes_and_change_gradually():
    cells = np.arange(1, LARGEST_LEARNED)
    inside = np.zeros(cells.size, bool)
    shares = shares_of(WEIGHTS, AT_EDGE, cells, inside)
    np.testing.assert_allclose(shares[0], WEIGHTS[0])
    np.testing.assert_allclose(shares[4], WEIGHTS[0])
    assert abs(np.diff(shares, axis=0)).max() < 0.2
    (largest,) = shares_of(WEIGHTS, AT_EDGE, np.array([10**6]), inside[:1])
    np.testing.assert_allclose(largest, WEIGHTS[3])


def test_voids_at_the_edge_have_shares_of_their_own():
    cells = np.array([10, 10, 500])
    shares = shares_of(WEIGHTS, AT_EDGE, cells, np.array([False, True, True]))
    np.testing.assert_allclose(shares[1:], [AT_EDGE, AT_EDGE])
    assert (shares[0] != AT_EDGE).any()


def test_tensions_are_those_of_the_classes_and_change_gradually():
    cells = np.arange(1, 20_000)
    tension = tensions_of(np.array([12.0, 12.0, 5.0, 30.0]), cells)
    assert tension[0] == pytest.approx(12) and tension[-1] == pytest.approx(30)
    assert tension.min() >= 5 - 1e-9 and tension.max() <= 30 + 1e-9
    assert abs(np.diff(np.log(tension))).max() < 0.05


def test_blend_takes_the_shares_of_each_cells_void():
    surfaces = np.array([[1.0, 2.0, 3.0], [10.0, 20.0, 30.0], [100.0, 200.0, 300.0]])
    shares = np.array([[1.0, 0.0, 0.0], [0.5, 0.25, 0.25]])
    blended = blend(surfaces, shares, np.array([0, 1, 1]))
    np.testing.assert_allclose(blended, [1, 0.5 * 2 + 5 + 50, 0.5 * 3 + 7.5 + 75])


def test_blend_of_equal_surfaces_is_that_surface():
    surface = fractal((1, 50))[0]
    shares = shares_of(WEIGHTS, AT_EDGE, np.array([3, 300]), np.zeros(2, bool))
    void_of = np.repeat([0, 1], 25)
    np.testing.assert_allclose(blend(np.stack([surface] * 3), shares, void_of), surface)


# --- expected errors -----------------------------------------------------------------------------


def test_units_are_the_ground_s_roughness_but_never_zero():
    units = units_of(np.array([0.0, 1.0, 100.0]), 2.0)
    assert units[0] == pytest.approx(0.2)
    assert units[1] == pytest.approx(1.0, rel=0.05)
    assert units[2] == pytest.approx(100.0, rel=0.01)
    assert (units_of(np.zeros(3), 0.0) > 0).all()


INSIDE = np.zeros(3, bool)


def a_model(scale=(1.0, 1.0, 1.0, 1.0), roughness=1.0):
    return Model(
        covariance=bending(), tension=np.full(4, 12.0), weights=WEIGHTS, rmse=np.zeros((4, 4)),
        tried=np.ones(4, np.int64), spread=np.array([-1.0, 1.2, 0.1, 0.3]), scale=np.array(scale),
        roughness=roughness, at_edge=AT_EDGE, scale_at_edge=3.0,
    )  # fmt: skip


def test_features_tell_cells_apart():
    voids, found = estimates(fractal(SHAPE))
    features = features_of(found, voids.cells, units_of(found.roughness, 1.0))
    assert features.shape == (FEATURES, VOID.sum())
    assert np.isfinite(features).all()
    assert (features[0] == 1).all()
    np.testing.assert_allclose(np.exp(features[1]), found.distance)
    np.testing.assert_allclose(np.exp(features[2]), voids.cells[found.void_of])


def test_sigma_scales_with_the_ground_and_the_learned_scale():
    voids, found = estimates(fractal(SHAPE))
    sigma = sigma_of(a_model(), found, voids.cells, INSIDE)
    most = 2 * np.hypot(found.deviation, units_of(found.roughness, 1.0))[found.void_of]
    assert (sigma > 0).all() and (sigma <= most).all() and (sigma < most).any()
    twice = sigma_of(a_model(scale=(2.0,) * 4), found, voids.cells, INSIDE)
    np.testing.assert_allclose(twice, np.minimum(2 * sigma, most))
    at_edge = np.array([True, False, False])
    mixed = sigma_of(a_model(), found, voids.cells, at_edge)
    threefold = np.where(found.void_of == 0, 3, 1) * sigma
    np.testing.assert_allclose(mixed, np.minimum(threefold, most))
    _, steeper = estimates(10 * fractal(SHAPE))
    np.testing.assert_allclose(
        sigma_of(a_model(roughness=10.0), steeper, voids.cells, INSIDE), 10 * sigma, rtol=1e-3
    )


def test_ground_of_which_nothing_is_known_but_its_height_makes_sigma_as_large():
    """No cell has four known neighbours, so its bends are unknown."""
    truth = fractal(SHAPE, seed=4) * 100
    void = np.random.default_rng(0).random(SHAPE) > 0.02
    voids = find_voids(void)
    found = estimate_surfaces(
        np.where(void, truth.mean(), truth), void, voids, np.arange(len(voids)), None,
        dx=np.ones(SHAPE[0]), dy=np.ones(SHAPE[0]), tension=np.full(len(voids), 12.0),
    )  # fmt: skip
    sigma = sigma_of(a_model(), found, voids.cells, np.zeros(len(voids), bool))
    assert np.median(sigma) > 0.3 * truth.std()
    assert sigma.max() < 4 * truth.std()
