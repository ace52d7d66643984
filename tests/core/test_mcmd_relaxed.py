"""MCMD with relaxed generations: what it reproduces, its symmetries, and its two paths."""

import numpy as np
import pytest
from scenes import diagonal_stripes, disc, fractal, holed, plane, river
from scipy.ndimage import gaussian_filter
from support import fill_by_mcmd

from demsmith.core.mcmd import Lattice, relaxed
from demsmith.core.voids import find_voids

SHAPE = (160, 170)


def blobs(scale, *, seed=0, shape=SHAPE, share=0.1, margin=30):
    """Random voids of about ``scale`` cells, away from the edge."""
    noise = gaussian_filter(np.random.default_rng(seed).standard_normal(shape), scale)
    void = noise > np.quantile(noise, 1 - share)
    inner = np.zeros(shape, bool)
    inner[margin:-margin, margin:-margin] = True
    return void & inner


def worst_by_relief(filled, truth, void):
    """The largest error in any void, as a share of the true relief across it and its rim."""
    voids = find_voids(void)
    worst = 0.0
    for number in range(len(voids)):
        own = voids.labels == number + 1
        rows, columns = np.nonzero(own)
        around = (
            slice(max(rows.min() - 1, 0), rows.max() + 2),
            slice(max(columns.min() - 1, 0), columns.max() + 2),
        )
        worst = max(worst, abs(filled - truth)[own].max() / np.ptp(truth[around]))
    return worst


# --- what it reproduces --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pixel_size", "bound"), [(30.0, 0.05), ((70.0, 90.0), 0.06), ((20.0, 90.0), 0.12)]
)
@pytest.mark.parametrize("scale", [1, 2, 4, 8])
def test_planes(scale, pixel_size, bound):
    """A plane has no energy, so it is the solution; the sweeps are counted, so the voids' first
    guess may be left over: at most 5 % of the relief across a void (12 % where pixels are four
    times as high as wide), and 0.2 % in the mean.
    """
    truth = plane(SHAPE)
    total = []
    for seed in range(3):
        void = blobs(scale, seed=seed)
        filled = fill_by_mcmd(truth, void, pixel_size=pixel_size).values
        assert worst_by_relief(filled, truth, void) < bound
        total.append(abs(filled - truth)[void].mean())
    assert np.mean(total) < 0.002 * 5 * (2 * scale + 2)


@pytest.mark.parametrize("radius", [10, 20, 40])
def test_planes_in_large_round_voids(radius):
    truth, void = plane(SHAPE), disc(SHAPE, (78, 87), radius)
    filled = fill_by_mcmd(truth, void, pixel_size=(70.0, 90.0)).values
    assert abs(filled - truth)[void].max() < 1e-3 * np.ptp(truth[void])


@pytest.mark.parametrize("box", [(0, 10, 50, 70), (0, 40, 50, 90), (0, 40, 0, 40)])
def test_planes_at_the_edge(box):
    """Free edges extrapolate: within 13 % of the relief, in a corner of 40 × 40 cells."""
    truth, void = plane(SHAPE), holed(SHAPE, box)
    assert worst_by_relief(fill_by_mcmd(truth, void).values, truth, void) < 0.13


def test_quadratic_surfaces():
    """Second differences are constant, so bending is least there too, but for the tension."""
    row, column = np.indices(SHAPE) - 80.0
    truth = row**2 + 0.5 * column**2 + row * column + 300 * row
    for scale, bound in ((2, 0.05), (4, 0.05)):
        void = blobs(scale)
        filled = fill_by_mcmd(truth, void).values
        assert worst_by_relief(filled, truth, void) < bound
    void = disc(SHAPE, (80, 85), 12)
    loose, taut = (fill_by_mcmd(truth, void, tension=t).values - truth for t in (1e6, 3.0))
    assert abs(loose[void]).max() < 0.2 * abs(taut[void]).max()


def test_tension_is_in_metres():
    """The same ground at 30 m: a tension length of 90 m is one of 3 cells."""
    truth, void = fractal(SHAPE, seed=4), disc(SHAPE, (80, 80), 25)
    by_cells = fill_by_mcmd(truth, void, tension=3.0).values
    by_metres = fill_by_mcmd(truth, void, tension=90.0, pixel_size=30.0).values
    np.testing.assert_allclose(by_metres, by_cells, rtol=1e-12)
    assert abs(by_cells - fill_by_mcmd(truth, void).values).max() > 1
    twelve = fill_by_mcmd(truth, void, tension=360.0, pixel_size=30.0).values
    np.testing.assert_allclose(
        twelve, fill_by_mcmd(truth, void, pixel_size=30.0).values, rtol=1e-12
    )


def test_least_bending():
    """No surface of the same rim that we try bends less than 1.01 times the filled one."""
    truth, void = fractal((60, 60), seed=2), disc((60, 60), (30, 30), 9)
    filled = fill_by_mcmd(truth, void, tension=1e6).values
    assert bending(filled) < bending(truth)
    rng = np.random.default_rng(0)
    for scale in (0.5, 1, 2, 4):
        change = gaussian_filter(rng.standard_normal(void.shape), scale) * void
        change /= abs(change).max()
        # Along the best multiple of any change, the energy hardly falls.
        slope = bending(filled + change) - bending(filled - change)
        curvature = bending(filled + change) + bending(filled - change) - 2 * bending(filled)
        assert slope**2 / (8 * curvature) < 0.01 * bending(filled)


def bending(z):
    z_yy, z_xx = z[2:] - 2 * z[1:-1] + z[:-2], z[:, 2:] - 2 * z[:, 1:-1] + z[:, :-2]
    z_xy = z[1:, 1:] - z[1:, :-1] - z[:-1, 1:] + z[:-1, :-1]
    return (z_yy**2).sum() + (z_xx**2).sum() + 2 * (z_xy**2).sum()


# --- shifts, scales, mirrors ---------------------------------------------------------------------


@pytest.mark.parametrize("variant", ["relaxed", "weighted", "paper"])
def test_shift_and_scale(variant):
    """Without curves, a filled raster moves and stretches with its input."""
    truth, void = fractal(SHAPE, seed=1), blobs(3) | disc(SHAPE, (20, 20), 25)
    filled = fill_by_mcmd(truth, void, variant=variant).values
    for factor, shift in ((1, 5000.0), (-2.5, 0), (0.001, -3)):
        again = fill_by_mcmd(factor * truth + shift, void, variant=variant).values
        np.testing.assert_allclose(again, factor * filled + shift, rtol=0, atol=1e-9)


@pytest.mark.parametrize("pixel_size", [(1.0, 1.0), (70.0, 90.0)])
def test_mirrored_and_transposed(pixel_size):
    """Sweeps have a direction; the solution has none: equal within 3 % of the relief of the
    surroundings at worst, 0.5 % in the mean, less than a third of the error.
    """
    shape = (129, 129)
    truth = fractal(shape, seed=3)
    void = blobs(3, shape=shape, margin=10) | disc(shape, (64, 64), 20)
    filled = fill_by_mcmd(truth, void, pixel_size=pixel_size).values
    relief = np.ptp(truth)
    # 129 = 2^7 + 1: the mirrored lattice is itself.
    across = fill_by_mcmd(truth[:, ::-1], void[:, ::-1], pixel_size=pixel_size).values[:, ::-1]
    upside = fill_by_mcmd(truth[::-1], void[::-1], pixel_size=pixel_size).values[::-1]
    swapped = fill_by_mcmd(truth.T, void.T, pixel_size=pixel_size[::-1]).values.T
    for other in (across, upside, swapped):
        difference = abs(other - filled)[void]
        assert difference.max() < 0.03 * relief
        assert difference.mean() < 0.005 * relief
        assert difference.mean() < 0.3 * abs(filled - truth)[void].mean()


def test_pixel_sizes_by_row():
    """Equal rows given one by one are the same as a number; unequal ones matter."""
    truth, void = fractal(SHAPE, seed=5), blobs(4)
    rows = np.ones(SHAPE[0])
    by_number = fill_by_mcmd(truth, void, pixel_size=(70.0, 90.0)).values
    by_row = fill_by_mcmd(truth, void, pixel_size=(70 * rows, 90 * rows)).values
    np.testing.assert_array_equal(by_row, by_number)
    narrowing = fill_by_mcmd(truth, void, pixel_size=(np.linspace(90, 20, SHAPE[0]), 90.0)).values
    assert abs(narrowing - by_number)[void].max() > 0.1


# --- independence --------------------------------------------------------------------------------


@pytest.mark.parametrize("r_s", [0.0, 0.3])
def test_voids_do_not_know_each_other(r_s):
    """Two neighbouring voids, each with a hole of its own: together or alone, the same bytes."""
    truth = fractal(SHAPE, seed=6).astype(np.float32)
    first, second = holed(SHAPE, (40, 80, 40, 80)), holed(SHAPE, (41, 90, 81, 110))
    third = holed(SHAPE, (60, 62, 111, 114))
    together = first | second | third
    options = dict(r_s=r_s, relief=100.0)
    # The others' cells are voids in any case; only one is filled.
    voids = find_voids(together)
    whole = fill_by_mcmd(truth, together, **options).values
    for number in range(len(voids)):
        own = voids.labels == number + 1
        alone = fill_by_mcmd(np.where(together, -1e30, truth), together, **options)
        np.testing.assert_array_equal(alone.values[own], whole[own])
    small = fill_by_mcmd(truth, together, max_size=6, **options).values
    np.testing.assert_array_equal(small[third], whole[third])


@pytest.mark.parametrize("offset", [(0, 0), (16, 48), (13, 29), (1, 2)])
def test_a_tile_computes_what_the_mosaic_would(offset):
    """Voids at least twice their extent from the cut, pixel sizes by row, float32."""
    shape = (200, 220)
    truth = fractal(shape, seed=7).astype(np.float32)
    void = holed(shape, (90, 110, 120, 145), (70, 71, 90, 140), (150, 158, 160, 161))
    size = np.linspace(60, 70, shape[0]), np.full(shape[0], 90.0)
    whole = fill_by_mcmd(truth, void, pixel_size=size).values
    row, column = offset
    cut = (slice(row, None), slice(column, None))
    lattice = Lattice(-row, -column, Lattice.covering(shape).levels)
    part = fill_by_mcmd(
        truth[cut], void[cut], pixel_size=(size[0][row:], size[1][row:]), lattice=lattice
    ).values
    np.testing.assert_array_equal(part, whole[cut])
    if offset == (13, 29):  # no multiples of the voids' coarsest steps
        unaware = fill_by_mcmd(
            truth[cut], void[cut], pixel_size=(size[0][row:], size[1][row:])
        ).values
        assert (unaware != whole[cut]).any()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("block", [4_000_000, 700])
def test_large_voids_are_filled_like_small_ones(monkeypatch, block, dtype):
    """The path with progress between sweeps gives the same bytes; cut into blocks, where a block
    begins from rounded float32 neighbours, the same within rounding.
    """
    truth = fractal(SHAPE, seed=8).astype(dtype)
    void = disc(SHAPE, (70, 80), 45) | holed(SHAPE, (0, 9, 0, 50), (150, 160, 100, 101))
    small = fill_by_mcmd(truth, void).values
    monkeypatch.setattr(relaxed, "_LARGE", 1)
    monkeypatch.setattr(relaxed, "_BLOCK", block)
    large = fill_by_mcmd(truth, void).values
    if block > void.sum() or dtype is np.float64:
        np.testing.assert_array_equal(large, small)
    else:
        np.testing.assert_allclose(large, small, rtol=0, atol=1e-3 * np.ptp(truth))


# --- ground narrower than a coarse step ----------------------------------------------------------


@pytest.mark.parametrize("large", [False, True])
def test_islands_hold_the_surface(monkeypatch, large):
    """Single known cells in a void, on no coarse lattice point: the surface goes through them, as
    smoothly as without a void, and is better than that of the passes made for such cells.
    """
    if large:
        monkeypatch.setattr(relaxed, "_LARGE", 1)
    truth = fractal((301, 301), seed=3)
    known = np.zeros(truth.shape, bool)
    known[13::25, 7::25] = True
    filled, weighted = (
        fill_by_mcmd(truth, ~known, variant=variant).values for variant in ("relaxed", "weighted")
    )
    error, passes = (np.sqrt(((z - truth)[~known] ** 2).mean()) for z in (filled, weighted))
    assert error < 0.04 * np.ptp(truth)
    assert error < passes
    row, column = np.nonzero(known[1:-1, 1:-1])
    row, column = row + 1, column + 1
    spike = abs(filled[row, column] - (filled[row, column - 1] + filled[row, column + 1]) / 2)
    assert spike.mean() < 0.005 * np.ptp(truth)


@pytest.mark.parametrize("margin", [1, 2, 5])
def test_a_narrow_frame_holds_the_surface(margin):
    """All but the outermost cells unknown: a plane comes back within 3 % on all four sides."""
    truth = plane((203, 190))
    void = holed(truth.shape, (margin, 203 - margin, margin, 190 - margin))
    filled = fill_by_mcmd(truth, void).values
    assert abs(filled - truth)[void].max() < 0.03 * np.ptp(truth)


def test_narrow_strips_hold_the_surface():
    """A comb of voids a cell wide, joined at one end."""
    truth = fractal((301, 301), seed=3)
    void = np.zeros(truth.shape, bool)
    void[::2] = True
    void[1:-1, 0] = True
    filled = fill_by_mcmd(truth, void).values
    assert np.sqrt(((filled - truth)[void] ** 2).mean()) < 0.004 * np.ptp(truth)


# --- hard shapes ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mask", "bound"),
    [
        (holed(SHAPE, (0, 160, 0, 85)), 0.10),
        (holed(SHAPE, (80, 160, 0, 170)), 0.10),
        (disc(SHAPE, (80, 85), 75), 0.10),
        (~holed(SHAPE, (50, 51, 90, 91)), 0.0),
        (~holed(SHAPE, (50, 51, 0, 170)), 0.10),
        (river(SHAPE), 0.02),
        (diagonal_stripes(SHAPE), 0.02),
        (np.indices(SHAPE).sum(0) % 2 == 0, 0.02),
        (np.random.default_rng(0).random(SHAPE) < 0.5, 0.02),
        (np.random.default_rng(0).random(SHAPE) < 0.9, 0.05),
    ],
    ids=[
        "left half", "lower half", "large disc", "one cell known", "one row known", "river",
        "stripes", "checkerboard", "half at random", "nine tenths at random",
    ],
)  # fmt: skip
def test_overshoot_is_bounded(mask, bound):
    for seed in range(3):
        truth = fractal(SHAPE, seed=seed)
        filled = fill_by_mcmd(np.where(mask, np.nan, truth)).values
        assert np.isfinite(filled).all()
        relief = np.ptp(truth)
        known = truth[~mask]
        assert filled[mask].min() >= known.min() - bound * relief - 1e-9
        assert filled[mask].max() <= known.max() + bound * relief + 1e-9
