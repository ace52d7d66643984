"""The random displacements: equation 1, level by level, and whose number is whose."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import disc, holed, plane
from support import fill_by_mcmd

from demsmith.core.errors import InputError
from demsmith.core.mcmd import Displacement, Lattice, interpolate
from demsmith.core.mcmd._displacement import uniform


def draw(seed, rows, columns):
    return np.array([[uniform(seed, r, c) for c in columns] for r in rows])


# --- the numbers ---------------------------------------------------------------------------------


def test_numbers_are_uniform_from_minus_one_to_one():
    u = draw(7, range(300), range(300))
    count = u.size
    assert u.min() >= -1 and u.max() < 1
    assert abs(u.mean()) < 4 * np.sqrt(1 / 3 / count)  # four standard errors
    assert u.var() == pytest.approx(1 / 3, rel=0.02)
    shares = np.histogram(u, 20, (-1, 1))[0] / count
    np.testing.assert_allclose(shares, 0.05, atol=4 * np.sqrt(0.05 * 0.95 / count))


def test_neighbours_and_seeds_are_unrelated():
    u = draw(7, range(200), range(200))
    bound = 4 / np.sqrt(u.size)
    for a, b in [(u[1:], u[:-1]), (u[:, 1:], u[:, :-1]), (u, u.T), (u, draw(8, *[range(200)] * 2))]:
        off = a != b  # the diagonal is its own transpose
        assert abs(np.corrcoef(a[off], b[off])[0, 1]) < bound
    assert np.unique(u).size == u.size


@given(st.integers(0, 2**31 - 1), st.integers(-(2**30), 2**30), st.integers(-(2**30), 2**30))
def test_a_number_belongs_to_its_cell(seed, row, column):
    number = uniform(seed, row, column)
    assert -1 <= number < 1
    assert number == uniform(seed, row, column)
    assert len({number, uniform(seed + 1, row, column), uniform(seed, row + 1, column)}) == 3


# --- equation 1 ----------------------------------------------------------------------------------


def displacements(z):
    """What each midpoint of level r = 1, 2, … stands above the mean of its two ascendants."""
    out = []
    step = (z.shape[0] - 1) // 2
    while step:
        coarse = z[:: 2 * step, :: 2 * step]
        centres = z[step :: 2 * step, step :: 2 * step]
        rows = z[:: 2 * step, step :: 2 * step]
        columns = z[step :: 2 * step, :: 2 * step]
        parts = (
            centres - (coarse[:-1, :-1] + coarse[1:, 1:]) / 2,
            rows - (coarse[:, :-1] + coarse[:, 1:]) / 2,
            columns - (coarse[:-1] + coarse[1:]) / 2,
        )
        out.append(np.concatenate([part.ravel() for part in parts]))
        step //= 2
    return out


@pytest.mark.parametrize(("h", "r_t"), [(0.5, 0.0), (0.25, 0.0), (1.0, 0.0), (0.5, 0.5)])
def test_amplitude_by_level(h, r_t):
    """Level r: mean ``r_t`` and half-width 1, times ``r_s`` relief 2^(-r n H), n = 2."""
    levels, strength = 5, 100.0
    side = 2**levels + 1
    known = np.zeros((side, side), bool)
    known[[0, 0, -1, -1], [0, -1, 0, -1]] = True
    by_level = [[] for _ in range(levels)]
    for seed in range(40):
        noise = Displacement(strength, h, r_t, seed, levels)
        z = interpolate(np.zeros((side, side)), known, displacement=noise)
        assert (z[known] == 0).all()
        for level, part in enumerate(displacements(z)):
            by_level[level].append(part)
    for r, parts in enumerate(by_level, start=1):
        delta = np.concatenate(parts)
        amplitude = strength * 2.0 ** (-r * 2 * h)
        error = 4 * amplitude / np.sqrt(3 * delta.size)
        assert delta.mean() == pytest.approx(r_t * amplitude, abs=error)
        assert delta.std() == pytest.approx(amplitude / np.sqrt(3), rel=4 / np.sqrt(2 * delta.size))
        assert abs(delta - r_t * amplitude).max() <= amplitude * (1 + 1e-9)


# --- in voids ------------------------------------------------------------------------------------

VARIANTS = ("relaxed", "weighted", "paper")


@pytest.mark.parametrize("variant", VARIANTS)
def test_noise_in_a_void(variant):
    """It roughens voids by the order of its strength, depends on the seed, ends at the rim."""
    truth, void = plane((129, 129), slope=(0.5, 0.5)), disc((129, 129), (64, 64), 40)
    fills = {
        (r_s, seed): fill_by_mcmd(truth, void, variant=variant, r_s=r_s, seed=seed).values
        for r_s, seed in [(0, 0), (0, 1), (0.5, 0), (0.5, 1), (1.0, 0)]
    }
    np.testing.assert_array_equal(fills[0, 0], fills[0, 1])
    rough = fills[0.5, 0] - fills[0, 0]
    assert (rough[~void] == 0).all()
    assert 0.1 < rough[void].std() < 30
    assert abs(np.corrcoef(rough[void], (fills[0.5, 1] - fills[0, 0])[void])[0, 1]) < 0.5
    # Twice the strength, twice the noise.
    np.testing.assert_allclose(fills[1.0, 0] - fills[0, 0], 2 * rough, atol=1e-9)
    rim = disc((129, 129), (64, 64), 40) & ~disc((129, 129), (64, 64), 38)
    assert rough[rim].std() < 0.5 * rough[void].std()


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("dtype", ["uint8", "int8", "int16", ">i2", "uint16", "int32"])
def test_noise_relief_of_integers(dtype, variant):
    """The range of int8 from -100 to 100 is 200, not what 8 bits make of it."""
    values = np.tile(np.array([0, 100], dtype), (20, 10))
    if np.dtype(dtype).kind == "i":
        values[:, ::2] = -100
    void = disc(values.shape, (10, 10), 6)
    relief = float(values.max()) - float(values.min())
    given = fill_by_mcmd(values, void, variant=variant, r_s=0.3, relief=relief).values
    np.testing.assert_array_equal(
        fill_by_mcmd(values, void, variant=variant, r_s=0.3).values, given
    )
    assert (given != fill_by_mcmd(values, void, variant=variant).values).any()


def test_relief_is_of_known_cells_only():
    values, void = plane((40, 40)), disc((40, 40), (20, 20), 8)
    spoilt = np.where(void, 1e6, values)
    np.testing.assert_array_equal(
        fill_by_mcmd(values, void, r_s=0.4).values[void],
        fill_by_mcmd(spoilt, void, r_s=0.4).values[void],
    )


def test_noise_of_a_tile_is_the_mosaics():
    """Relaxed, float32, with noise: a tile that names the mosaic's lattice and relief."""
    rng = np.random.default_rng(5)
    mosaic = np.cumsum(rng.normal(size=(120, 150)), axis=1).astype(np.float32)
    void = holed(mosaic.shape, (60, 77, 70, 95), (10, 14, 60, 61), (100, 103, 100, 103))
    options = dict(r_s=0.2, relief=50.0, seed=11)
    whole = fill_by_mcmd(mosaic, void, **options).values
    lattice = Lattice(-17, -23, Lattice.covering(mosaic.shape).levels)
    tile, tile_void = mosaic[17:, 23:].copy(), void[17:, 23:].copy()
    part = fill_by_mcmd(tile, tile_void, lattice=lattice, **options).values
    far = holed(mosaic.shape, (60, 77, 70, 95), (100, 103, 100, 103))[17:, 23:]
    np.testing.assert_array_equal(part[far], whole[17:, 23:][far])


# --- terrain from nothing ------------------------------------------------------------------------


def from_nothing(shape=(129, 129), *, h=0.5, seed=1, lattice=None, **options):
    lattice = lattice or Lattice.covering(shape)
    displacement = Displacement(100.0, h, 0.0, seed, lattice.levels)
    return interpolate(
        np.zeros(shape), np.zeros(shape, bool), displacement=displacement, lattice=lattice,
        **options,
    )  # fmt: skip


def test_nothing_known_needs_displacements():
    with pytest.raises(InputError, match="no cell is known"):
        interpolate(np.zeros((5, 5)), np.zeros((5, 5), bool))


def test_terrain_from_nothing_rises_and_falls_about_the_datum():
    many = np.stack([from_nothing(seed=seed, datum=500.0) for seed in range(60)])
    assert abs(many.mean() - 500) < 15
    assert 10 < many.std() < 100


@pytest.mark.parametrize("h", [0.3, 0.45])
def test_terrain_from_nothing_has_the_exponent_of_the_paper(h):
    """The structure function of displacements with H goes as the distance to the power 4 H."""
    many = [from_nothing(h=h, seed=seed, scheme="diamond-square") for seed in range(20)]
    lags = np.array([2, 4, 8, 16])
    squares = [np.mean([(z[lag:] - z[:-lag]) ** 2 for z in many]) for lag in lags]
    slope = np.polyfit(np.log(lags), np.log(squares), 1)[0]
    assert slope == pytest.approx(4 * h, rel=0.25)


def test_a_window_of_terrain_from_nothing_is_the_same_terrain():
    whole = from_nothing((65, 65))
    window = from_nothing((20, 30), lattice=Lattice(-10, -5, 6))
    np.testing.assert_array_equal(window, whole[10:30, 5:35])


def test_auto_scheme_is_triangle_edge_unless_nothing_is_known():
    shape = (33, 33)
    np.testing.assert_array_equal(from_nothing(shape), from_nothing(shape, scheme="diamond-square"))
    known = np.zeros(shape, bool)
    known[16, 3] = True
    z = np.where(known, 100.0, 0.0)
    noise = Displacement(100.0, 0.5, 0.0, 1, 5)

    def made(scheme):
        return interpolate(z, known, displacement=noise, scheme=scheme)

    np.testing.assert_array_equal(made("auto"), made("triangle-edge"))
    assert not np.array_equal(made("auto"), made("diamond-square"))
