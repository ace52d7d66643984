"""Maps: each cell has its own parameters, and where all are alike they are those of the options."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal, holed, plane
from support import fill_by_mcmd

from demsmith.core.errors import InputError
from demsmith.core.mcmd import Displacement, Lattice, Maps, McmdOptions, bottom_up, interpolate
from demsmith.core.mcmd._displacement import uniform
from demsmith.core.options import specifications

VARIANTS = ("relaxed", "weighted", "paper")
SCHEMES = ("triangle-edge", "diamond-square")
NOISE = dict(h=0.37, r_s=0.21, r_t=-0.3)
CURVES = dict(l=0.8, l_bu=2.5)
SPECS = {spec.name: spec for spec in specifications(McmdOptions)}
NAMES = tuple(field.name for field in dataclasses.fields(Maps))


def everywhere(numbers, shape):
    return Maps(**{name: np.full(shape, number) for name, number in numbers.items()})


def parameters_of(variant):
    return NOISE if variant == "relaxed" else {**NOISE, **CURVES}


def corners_known(side):
    known = np.zeros((side, side), bool)
    known[[0, 0, -1, -1], [0, -1, 0, -1]] = True
    return known


# --- alike everywhere: the options' numbers ------------------------------------------------------


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("variant", VARIANTS)
def test_a_uniform_map_is_the_number(variant, scheme):
    """Bit for bit, for any number of threads, also on a mosaic's lattice."""
    truth = fractal((90, 70), seed=3)
    void = disc(truth.shape, (40, 30), 22) | holed(truth.shape, (0, 9, 60, 70))
    settings_ = dict(
        variant=variant, scheme=scheme, seed=5, lattice=Lattice(-7, -11, 7), pixel_size=(60, 90)
    )
    numbers = parameters_of(variant)
    expected = fill_by_mcmd(truth, void, **settings_, **numbers).values
    assert (expected != fill_by_mcmd(truth, void, **settings_).values)[void].mean() > 0.5
    for threads in (1, 2):
        filled = fill_by_mcmd(
            truth, void, maps=everywhere(numbers, truth.shape), threads=threads, **settings_
        )
        np.testing.assert_array_equal(filled.values, expected)


@pytest.mark.parametrize("variant", VARIANTS)
def test_where_a_map_has_no_number_the_option_holds(variant):
    truth, void = fractal((60, 60)), disc((60, 60), (30, 30), 15)
    numbers = parameters_of(variant)
    holey = {name: np.full(truth.shape, number) for name, number in numbers.items()}
    for values in holey.values():
        values[20:35, 25:50] = np.nan
    masked = {name: np.ma.masked_invalid(values) for name, values in holey.items()}
    for values in masked.values():
        values.data[values.mask] = 77  # out of every range, or far from the number
    expected = fill_by_mcmd(truth, void, variant=variant, **numbers).values
    for maps in (Maps(**holey), Maps(**masked)):
        filled = fill_by_mcmd(truth, void, variant=variant, maps=maps, **numbers).values
        np.testing.assert_array_equal(filled, expected)


@settings(max_examples=20, deadline=None)
@given(
    st.sampled_from(["f4", ">f8", "i2", "u1", "?", "f8"]),
    st.tuples(st.integers(2, 40), st.integers(2, 40)),
    st.booleans(),
    st.randoms(use_true_random=False),
)
def test_any_type_and_memory_order(dtype, shape, turned, random):
    values = plane(shape)
    void = np.array([[random.random() < 0.6 for _ in range(shape[1])] for _ in range(shape[0])])
    void[0, 0] = False
    rough = np.array([[random.randint(0, 1) for _ in range(shape[1])] for _ in range(shape[0])])
    given = rough.astype(dtype)
    given = given.T.copy().T if turned else given
    expected = fill_by_mcmd(values, void, maps=Maps(r_s=rough.astype(float)), relief=9.0).values
    before = given.copy()
    filled = fill_by_mcmd(values, void, maps=Maps(r_s=given), relief=9.0).values
    np.testing.assert_array_equal(filled, expected)
    np.testing.assert_array_equal(given, before)


# --- displacements -------------------------------------------------------------------------------


def test_each_midpoint_has_its_own_displacement():
    """Equation 1 with the strength, exponent and shift of the displaced cell, on every level."""
    levels, seed = 5, 9
    side = 2**levels + 1
    rng = np.random.default_rng(2)
    strength, h, r_t = rng.uniform([[[50]], [[0.1]], [[-1]]], [[[150]], [[0.9]], [[1]]],
                                   (3, side, side))  # fmt: skip
    noise = Displacement(strength, h, r_t, seed, levels)
    z = interpolate(np.zeros((side, side)), corners_known(side), displacement=noise)
    for r in range(1, levels + 1):
        step = 2 ** (levels - r)
        for i in range(0, side, step):
            for j in range(0, side, step):
                i_odd, j_odd = i // step % 2, j // step % 2
                if not (i_odd or j_odd):
                    continue
                di, dj = i_odd * step, j_odd * step
                mean = (z[i - di, j - dj] + z[i + di, j + dj]) / 2
                own = (uniform(seed, i, j) + r_t[i, j]) * strength[i, j] * 2 ** (-2 * r * h[i, j])
                assert z[i, j] == pytest.approx(mean + own, abs=1e-9)


@pytest.mark.parametrize("variant", VARIANTS)
def test_rough_on_one_side_smooth_on_the_other(variant):
    """A step in r_s: of two voids only one is rough, and a third is so up to the step."""
    shape = (129, 257)
    truth = plane(shape, slope=(0.5, 0.5))
    void = disc(shape, (30, 60), 25) | disc(shape, (30, 200), 25) | holed(shape, (70, 120, 40, 220))
    r_s = np.zeros(shape)
    r_s[:, 128:] = 0.4
    smooth = fill_by_mcmd(truth, void, variant=variant).values
    added = fill_by_mcmd(truth, void, variant=variant, maps=Maps(r_s=r_s)).values - smooth
    assert (added[~void] == 0).all()
    if variant == "relaxed":  # the passes' coarse points are shared by all voids
        assert (added[disc(shape, (30, 60), 25)] == 0).all()
    # Second differences see the finest levels only, which are displaced east of the step alone.
    bends = np.abs(np.diff(added, 2, axis=1))
    assert bends[20:40, 190:210].mean() > 20 * bends[20:40, 50:70].mean()
    assert bends[75:115, 135:210].mean() > 5 * bends[75:115, 45:120].mean()


@pytest.mark.parametrize("variant", VARIANTS)
def test_h_and_r_t_matter_where_they_are_mapped(variant):
    """In the east H is less, so fine levels are rougher; in the west r_t lifts the ground."""
    shape = (129, 257)
    truth = plane(shape, slope=(0.5, 0.5))
    void = disc(shape, (64, 60), 40) | disc(shape, (64, 200), 40)
    east = np.arange(shape[1]) >= 128
    h, r_t = (np.broadcast_to(row, shape) for row in (np.where(east, 0.2, 0.5), 5.0 * ~east))
    plain = fill_by_mcmd(truth, void, variant=variant, r_s=0.2).values
    shaped = fill_by_mcmd(truth, void, variant=variant, r_s=0.2, maps=Maps(h=h)).values
    lifted = fill_by_mcmd(truth, void, variant=variant, r_s=0.2, maps=Maps(r_t=r_t)).values

    def roughness(z, columns):
        return np.abs(np.diff(z[40:90, columns], 2, axis=1)).mean()

    west_, east_ = slice(40, 80), slice(180, 220)
    assert roughness(shaped, east_) > 5 * roughness(plain, east_)
    assert (lifted - plain)[void & ~east].mean() > 1
    if variant == "relaxed":
        np.testing.assert_array_equal(shaped[:, ~east], plain[:, ~east])
        np.testing.assert_array_equal(lifted[:, east], plain[:, east])
    assert roughness(shaped, west_) < 2 * roughness(plain, west_)


@pytest.mark.parametrize("variant", VARIANTS)
def test_one_cells_strength(variant):
    """Of a fill, one cell of the finest level with a strength of its own stands alone."""
    truth, void = plane((65, 65)), disc((65, 65), (32, 32), 20)
    r_s = np.zeros(truth.shape)
    r_s[31, 35] = 2.0
    options = dict(variant=variant, relief=1000.0, h=0.3, seed=4)
    plain = fill_by_mcmd(truth, void, **options).values
    added = fill_by_mcmd(truth, void, maps=Maps(r_s=r_s), **options).values - plain
    levels = Lattice.covering(truth.shape).levels
    assert added[31, 35] == pytest.approx(
        uniform(4, 31, 35) * 2000 * 2 ** (-2 * 0.3 * levels), abs=1e-9
    )
    added[30:33, 34:37] = 0  # the edge midpoints beside it may descend from it
    assert (added == 0).all()


def test_a_map_of_strength_overrules_the_option():
    truth, void = plane((40, 40)), disc((40, 40), (20, 20), 10)
    smooth = fill_by_mcmd(truth, void).values
    none, some = Maps(r_s=np.zeros(truth.shape)), Maps(r_s=np.full(truth.shape, 0.3))
    np.testing.assert_array_equal(fill_by_mcmd(truth, void, r_s=0.3, maps=none).values, smooth)
    assert (fill_by_mcmd(truth, void, maps=some).values != smooth)[void].mean() > 0.5


# --- curves --------------------------------------------------------------------------------------


def test_a_midpoint_is_bent_by_its_own_curve():
    """l = 1 in one cell: its ascendants' elevations fall in a line with distance, no others."""
    known = corners_known(9)
    values = np.where(known, 100.0, 0.0)
    l = np.zeros(known.shape)
    l[3, 5] = 1.0
    plain = interpolate(values, known, datum=0, d_max=20.0)
    bent = interpolate(values, known, l=l, datum=0, d_max=20.0)
    expected = plain.copy()
    expected[3, 5] = 100 * (1 - np.sqrt(2) / 20)
    np.testing.assert_allclose(bent, expected, rtol=1e-14)


@pytest.mark.parametrize("variant", ["paper", "weighted"])
def test_an_ascendant_is_bent_by_its_own_curve(variant):
    known = np.zeros((5, 5), bool)
    known[1, 1] = True
    l_bu = np.zeros(known.shape)
    l_bu[2, 2] = 1.0
    z, reached = bottom_up(
        np.where(known, 100.0, 0), known, variant=variant, l_bu=l_bu, datum=0, d_max=20.0
    )
    assert reached[2, 2] and reached[0, 0]
    assert z[2, 2] == pytest.approx(100 * (1 - np.sqrt(2) / 20), rel=1e-14)
    assert z[0, 0] == 100


@pytest.mark.parametrize("variant", ["paper", "weighted"])
def test_beyond_the_raster_the_nearest_cell_counts(variant):
    """A raster in a larger lattice is the part of the lattice that it is, its maps continued."""
    rng = np.random.default_rng(1)
    values, known = rng.uniform(10, 90, (6, 5)), rng.random((6, 5)) < 0.3
    maps = {name: rng.uniform(0.1, 2, values.shape) for name in ("l", "l_bu", "strength")}
    pad = ((1, 2), (3, 1))
    wide = {name: np.pad(each, pad, mode="edge") for name, each in maps.items()}
    lattice = Lattice(-1, -3, 3)
    whole = np.pad(values, pad), np.pad(known, pad)

    def run(values, known, maps, lattice):
        noise = Displacement(maps["strength"], 0.4, 0.1, 3, 3)
        return interpolate(
            values, known, variant=variant, l=maps["l"], l_bu=maps["l_bu"], displacement=noise,
            lattice=lattice, datum=0, d_max=30.0,
        )  # fmt: skip

    inside = run(values, known, maps, lattice)
    around = run(*whole, wide, Lattice(0, 0, 3))
    np.testing.assert_array_equal(inside, around[1:7, 3:8])


# --- what is refused -----------------------------------------------------------------------------

VALUES, VOID = plane((8, 9)), holed((8, 9), (3, 5, 3, 6))


@pytest.mark.parametrize("side", ["minimum", "maximum"])
@pytest.mark.parametrize("name", NAMES)
def test_ranges_are_the_options(name, side):
    spec = SPECS[name]
    values = np.full(VALUES.shape, getattr(spec, side), float)
    Maps(**{name: values}).over(McmdOptions(), VALUES.shape)
    for wrong in (values[0, 0] + (-1e-6 if side == "minimum" else 1e-6), -np.inf, np.inf):
        values[5, 7] = wrong
        words = f"the map of {name} is .* at row 5, column 7; .* {spec.minimum:g} to"
        with pytest.raises(InputError, match=words):
            fill_by_mcmd(VALUES, VOID, variant="paper", maps=Maps(**{name: values}))


@pytest.mark.parametrize("name", NAMES)
def test_shape_and_type(name):
    with pytest.raises(InputError, match=rf"map of {name} has shape \(9, 8\), .*\(8, 9\)"):
        fill_by_mcmd(VALUES, VOID, variant="paper", maps=Maps(**{name: np.zeros((9, 8))}))
    with pytest.raises(InputError, match=f"map of {name} is of type"):
        fill_by_mcmd(VALUES, VOID, variant="paper", maps=Maps(**{name: np.full((8, 9), "0")}))


@pytest.mark.parametrize("name", ["l", "l_bu"])
def test_relaxed_has_no_curves(name):
    curve = np.zeros(VALUES.shape)
    fill_by_mcmd(VALUES, VOID, maps=Maps(**{name: curve}))
    curve[7, 8] = 0.1
    with pytest.raises(InputError, match="'relaxed' has no such curve"):
        fill_by_mcmd(VALUES, VOID, maps=Maps(**{name: curve}))


def test_natural_roughness_wants_no_map_of_strength():
    r_s = np.full(VALUES.shape, 0.1)
    with pytest.raises(InputError, match="natural_roughness finds"):
        fill_by_mcmd(VALUES, VOID, natural_roughness=True, maps=Maps(r_s=r_s))


def test_the_passes_alone_check_shapes_too():
    with pytest.raises(InputError, match="shape"):
        interpolate(VALUES, ~VOID, l=np.zeros((2, 2)))
    with pytest.raises(InputError, match="shape"):
        bottom_up(VALUES, ~VOID, l_bu=np.zeros(9))
