"""MCMD as published: the paper's figures, values by hand, and what its passes can reproduce."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import circle_and_segments, plane

from demsmith.core.errors import InputError
from demsmith.core.mcmd import Lattice, bottom_up, interpolate
from demsmith.core.mcmd._passes import bend

SCHEMES = ("triangle-edge", "diamond-square")
VARIANTS = ("paper", "weighted")


def two_cells(first=10.0, second=20.0):
    """The paper's figure 7: (column, row) = (1, 2) and (3, 1) of a 5 × 5 grid are known."""
    known = np.zeros((5, 5), bool)
    known[2, 1] = known[1, 3] = True
    values = np.zeros((5, 5))
    values[2, 1], values[1, 3] = first, second
    return values, known


def top_down_alone(values, known, **options):
    """MD without a bottom-up pass: no unknown cell is an ascendant of a known one's line."""
    from demsmith.core.mcmd.passes import _Passes
    from demsmith.core.progress import SILENT

    l = options.pop("l", 0.0)
    passes = _Passes(values, known, **options)
    passes.fix_corners()
    passes.top_down(l, None, SILENT)
    return passes.raster()[0]


def phi(e, d, d_max, l):
    """Equation 2 of the paper, written as it stands there."""
    sigma = 1 if l >= 0 else -1
    return e * (1 - sigma * (1 - (1 - d / d_max) ** abs(l)))


# --- the bottom-up pass --------------------------------------------------------------------------


@pytest.mark.parametrize("variant", VARIANTS)
def test_figure_7_ends_with_ten_known_cells(variant):
    values, known = two_cells()
    after = bottom_up(values, known, variant=variant)[1]
    assert after.astype(int).tolist() == [
        [1, 0, 1, 0, 1],
        [0, 0, 0, 1, 0],
        [1, 1, 1, 0, 1],
        [0, 0, 0, 0, 0],
        [1, 0, 0, 0, 1],
    ]


def test_figure_7_by_hand():
    """With plain means: generation 1 copies, generation 2 averages its children.

    (0, 0) has the children (2, 0) = 10, (2, 2) = 10 and (0, 2) = 20; (4, 4) has (2, 2) and
    (2, 4) = 20; (0, 4) only 20s; (4, 0) only (2, 0), for the triangles' other diagonal is none.
    """
    z = bottom_up(*two_cells(), datum=0)[0]
    np.testing.assert_allclose(
        [z[0, 0], z[0, 2], z[0, 4], z[2, 0], z[2, 2], z[2, 4], z[4, 0], z[4, 4]],
        [40 / 3, 20, 20, 10, 10, 20, 10, 15],
        rtol=1e-14,
    )


def test_figure_7_by_hand_with_a_falling_line():
    """l_bu = 1 and d_max = 10: every step keeps 1 − d / 10 of the elevation above the datum."""
    z = bottom_up(*two_cells(), datum=0, d_max=10, l_bu=1)[0]
    diagonal = 20 * (1 - 0.1414213562)  # the second cell, one diagonal up
    two_diagonal = 9 * (1 - 0.2828427125)
    np.testing.assert_allclose([z[2, 0], z[2, 2]], 9, rtol=1e-9)
    np.testing.assert_allclose([z[0, 2], z[2, 4]], diagonal, rtol=1e-9)
    np.testing.assert_allclose(z[4, 0], 7.2, rtol=1e-9)
    np.testing.assert_allclose(z[0, 4], 0.8 * diagonal, rtol=1e-9)
    np.testing.assert_allclose(z[4, 4], (two_diagonal + 0.8 * diagonal) / 2, rtol=1e-9)
    np.testing.assert_allclose(z[0, 0], (7.2 + two_diagonal + 0.8 * diagonal) / 3, rtol=1e-9)


def test_distances_are_ground_metres():
    """Columns twice as wide as rows are high: the child one column away has d = 2."""
    z = bottom_up(*two_cells(), datum=0, d_max=10, l_bu=1, pixel_size=(2.0, 1.0))[0]
    assert z[2, 2] == pytest.approx(8)  # from (2, 1): 10 (1 − 2 / 10)
    assert z[2, 4] == pytest.approx(20 * (1 - np.hypot(2, 1) / 10))
    assert z[4, 0] == pytest.approx(8 * (1 - 2 / 10))  # from (2, 0): two rows


def test_weighted_pass_counts_near_children_more():
    """The middle of a 5 × 5 grid: children at 1 (elevation 0) and at 2 √2 (elevation 9)."""
    known = np.zeros((9, 9), bool)
    values = np.zeros((9, 9))
    known[4, 5] = known[2, 2] = True
    values[4, 5], values[2, 2] = 0.0, 9.0
    paper = bottom_up(values, known, variant="paper", datum=0)[0][4, 4]
    weighted = bottom_up(values, known, variant="weighted", datum=0)[0][4, 4]
    assert paper == pytest.approx(4.5)
    assert weighted == pytest.approx(0.0)  # the finest level comes first


@given(st.data())
def test_bottom_up_leaves_no_unknown_ascendant(data):
    """When the pass ends, ascendants of known points are known: checked from the definition."""
    scheme = data.draw(st.sampled_from(SCHEMES))
    variant = data.draw(st.sampled_from(VARIANTS))
    seed = data.draw(st.integers(0, 1000))
    rng = np.random.default_rng(seed)
    known = rng.random((17, 17)) < data.draw(st.sampled_from([0.01, 0.05, 0.5]))
    known[rng.integers(17), rng.integers(17)] = True
    values = rng.random((17, 17))
    z, after = bottom_up(values, known, scheme=scheme, variant=variant)
    assert after[known].all()
    np.testing.assert_array_equal(z[known], values[known])
    for i, j in zip(*np.nonzero(after), strict=True):
        for ascendant in ascendants(i, j, 17, scheme):
            assert after[ascendant]


def ascendants(i, j, side, scheme):
    """The definition of methods.md section 1, slowly."""
    step = 1
    while (i | j) and not ((i | j) & step):
        step *= 2
    if not (i | j) or step >= side - 1:
        return []
    i_odd, j_odd = bool(i & step), bool(j & step)
    if i_odd and j_odd:
        signs = [(-1, -1), (1, 1)]
        if scheme == "diamond-square":
            signs += [(-1, 1), (1, -1)]
    elif scheme == "triangle-edge":
        signs = [(-1, 0), (1, 0)] if i_odd else [(0, -1), (0, 1)]
    else:
        signs = [(-1, 0), (1, 0), (0, -1), (0, 1)]
    found = [(i + a * step, j + b * step) for a, b in signs]
    return [(r, c) for r, c in found if 0 <= r < side and 0 <= c < side]


# --- the interpolation function ------------------------------------------------------------------


@given(st.floats(-9000, 9000), st.floats(0, 1), st.sampled_from([-20, -1, -0.5, 0, 0.5, 1, 2, 20]))
def test_curve_is_equation_2(e, share, l):
    assert e * bend(share * 70.0, 70.0, float(l)) == pytest.approx(
        phi(e, share * 70.0, 70.0, l), rel=1e-12, abs=1e-9
    )


def test_curve_shapes():
    share = np.linspace(0, 1, 21)
    shape = {l: np.array([bend(d, 1.0, float(l)) for d in share]) for l in (-2, 0, 0.5, 1, 2)}
    np.testing.assert_array_equal(shape[0], 1)  # l = 0: the elevation itself
    np.testing.assert_allclose(shape[1], 1 - share, atol=1e-15)  # a line
    inner = slice(1, -1)
    assert (shape[0.5][inner] > shape[1][inner]).all()  # a bell stays above it
    assert (shape[2][inner] < shape[1][inner]).all()  # a ridge falls below it
    for l in (0.5, 1, 2):
        assert (np.diff(shape[l]) < 0).all()
    assert (np.diff(shape[-2]) > 0).all()  # below 0: rises with distance
    assert np.isfinite([bend(3.0, 1.0, -2.0), bend(3.0, 1.0, 0.5)]).all()


# --- the top-down pass ---------------------------------------------------------------------------


@pytest.mark.parametrize("l", [0, 0.5, 1, 2, -1])
def test_top_down_on_nine_cells_is_equation_2(l):
    """Corners 1, 2, 4, 8; cells of 10 m, so that the centre lies half the diagonal away."""
    values = np.array([[1.0, 0, 2], [0, 0, 0], [4, 0, 8]])
    known = values > 0
    d_max = 20 * 2**0.5
    z = interpolate(values, known, l=l, datum=0, pixel_size=10.0)
    along, across = (lambda e: phi(e, 10, d_max, l)), (lambda e: phi(e, 10 * 2**0.5, d_max, l))
    assert z[1, 1] == pytest.approx((across(1) + across(8)) / 2)
    assert z[0, 1] == pytest.approx((along(1) + along(2)) / 2)
    assert z[1, 0] == pytest.approx((along(1) + along(4)) / 2)
    assert z[1, 2] == pytest.approx((along(2) + along(8)) / 2)
    assert z[2, 1] == pytest.approx((along(4) + along(8)) / 2)
    square = interpolate(values, known, l=l, datum=0, pixel_size=10.0, scheme="diamond-square")
    assert square[1, 1] == pytest.approx(np.mean([across(e) for e in (1, 2, 4, 8)]))
    centre = square[1, 1]
    assert square[0, 1] == pytest.approx((along(1) + along(2) + along(centre)) / 3)  # border: 3


@pytest.mark.parametrize("levels", [1, 2, 5])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_top_down_reproduces_planes(scheme, levels):
    """Triangle–edge from the four corners; diamond–square, whose border midpoints have three
    ascendants that do not balance, from the frame.
    """
    side = 2**levels + 1
    truth = plane((side, side))
    known = np.zeros((side, side), bool)
    known[[0, 0, -1, -1], [0, -1, 0, -1]] = True
    if scheme == "diamond-square":
        known[[0, -1]] = known[:, [0, -1]] = True
    z = top_down_alone(truth, known, scheme=scheme)
    np.testing.assert_allclose(z, truth, rtol=1e-12)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("variant", VARIANTS)
def test_both_passes_reproduce_a_plane_in_single_interior_cells(variant, scheme):
    """All descendants of the cell are known and lie around it evenly."""
    truth = plane((17, 17))
    for cell in itertools.product(range(1, 16), range(1, 16)):
        known = np.ones((17, 17), bool)
        known[cell] = False
        values = np.where(known, truth, -9999.0)
        z = interpolate(values, known, variant=variant, scheme=scheme, pixel_size=(70.0, 90.0))
        np.testing.assert_allclose(z, truth, rtol=1e-12)


def test_known_even_cells_are_a_plain_refinement():
    """Every other row and column known on a plane: the pass halves the spacing exactly."""
    truth = plane((33, 33))
    known = np.zeros((33, 33), bool)
    known[::2, ::2] = True
    np.testing.assert_allclose(interpolate(truth, known), truth, rtol=1e-12)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("variant", VARIANTS)
def test_constant_ground_stays_constant(variant, scheme):
    """Also from a single cell, through corners beyond the raster, and whatever the curves."""
    known = np.zeros((7, 12), bool)
    known[3, 4] = True
    z = interpolate(
        np.full((7, 12), 42.0), known, variant=variant, scheme=scheme, l=1.5, l_bu=10
    )  # the datum is the lowest cell, so there is nothing above it to fall
    np.testing.assert_allclose(z, 42.0, rtol=1e-13)


# --- the circle and the segments (figures 5 and 8) -----------------------------------------------


def largest_step(z, values, known):
    """The largest difference between a cell of the circle and a neighbour."""
    circle = known & (values == values.max())
    steps = []
    for axis in (0, 1):
        there = np.moveaxis(circle, axis, 0)
        steps.append(np.abs(np.diff(np.moveaxis(z, axis, 0), axis=0))[there[1:] | there[:-1]])
    return np.concatenate(steps).max()


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("variant", VARIANTS)
def test_bottom_up_removes_the_step_across_the_circle(variant, scheme):
    """Circle 1000 m high. Top-down alone breaks off by over 600 m beside it: its descendants were
    made before it was met. With the bottom-up pass no step is over 85 m (l = 0), or 130 m with
    the slopes of the paper's figure (l = 1, l_bu = 6: 16 m a cell by intent).
    """
    values, known = circle_and_segments()
    alone = top_down_alone(values, known, scheme=scheme)
    assert largest_step(alone, values, known) > 600
    flat = interpolate(values, known, variant=variant, scheme=scheme)
    assert largest_step(flat, values, known) < 85
    sloped = interpolate(values, known, variant=variant, scheme=scheme, l=1, l_bu=6)
    assert largest_step(sloped, values, known) < 130


# --- what is refused, and where the lattice lies -------------------------------------------------


def test_nothing_known_is_refused():
    with pytest.raises(InputError, match="no cell is known"):
        interpolate(np.zeros((3, 3)), np.zeros((3, 3), bool))


def test_datum_above_known_ground_is_refused():
    with pytest.raises(InputError, match=r"datum 3 m is above the lowest known cell 2 m"):
        interpolate(np.full((3, 3), 2.0), np.eye(3, dtype=bool), datum=3)


def test_lattice_that_does_not_cover_is_refused():
    for lattice in (Lattice(0, 0, 2), Lattice(1, 0, 5)):
        with pytest.raises(InputError, match="does not cover"):
            interpolate(np.zeros((6, 6)), np.eye(6, dtype=bool), lattice=lattice)


@pytest.mark.parametrize("variant", VARIANTS)
def test_lattice_origin_is_an_input(variant):
    """A raster inside a larger lattice: the same as that part of the padded raster."""
    rng = np.random.default_rng(3)
    values, known = rng.random((9, 12)), rng.random((9, 12)) < 0.2
    lattice = Lattice(-3, -5, 5)
    wide = np.zeros((33, 33))
    wide_known = np.zeros((33, 33), bool)
    wide[3:12, 5:17], wide_known[3:12, 5:17] = values, known
    inside = interpolate(values, known, variant=variant, lattice=lattice, l=1, l_bu=3, d_max=60)
    whole = interpolate(wide, wide_known, variant=variant, l=1, l_bu=3, d_max=60, datum=None)
    lowest = values[known].min()
    whole = interpolate(wide, wide_known, variant=variant, l=1, l_bu=3, d_max=60, datum=lowest)
    np.testing.assert_array_equal(inside, whole[3:12, 5:17])


@given(st.integers(1, 5000), st.integers(1, 5000), st.integers(-4000, 0), st.integers(-4000, 0))
def test_smallest_covering_lattice(rows, columns, row, column):
    lattice = Lattice.covering((rows, columns), (row, column))
    need = max(rows - row, columns - column)
    assert lattice.side >= need
    assert lattice.levels == 0 or 2 ** (lattice.levels - 1) + 1 < need


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("shape", [(1, 1), (1, 2), (2, 2), (3, 1), (1, 9), (2, 5), (5, 3)])
def test_tiny_rasters(shape, variant, scheme):
    known = np.zeros(shape, bool)
    known[-1, -1] = True
    z = interpolate(np.full(shape, 5.0), known, variant=variant, scheme=scheme)
    np.testing.assert_array_equal(z, 5.0)
