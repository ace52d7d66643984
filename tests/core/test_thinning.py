"""Thinning arrays: how many cells are kept, which, and that they are what they were."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal, plane
from support import fill_by_mcmd, shared_data

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.thinning import thin
from demsmith.core.thinning.options import DETECTORS, ThinOptions

every_detector = pytest.mark.parametrize("detector", DETECTORS)


def rmse(truth, thinned, pixel_size=None):
    rebuilt = fill_by_mcmd(thinned.values, pixel_size=pixel_size, float_output=True).values
    return float(np.sqrt(((rebuilt - truth.astype(float))[~thinned.kept] ** 2).mean()))


# --- how many, and unchanged ---------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    shape=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    dtype=st.sampled_from(["int8", "uint8", ">i2", "int32", "uint64", "float16", "float32", ">f8"]),
    detector=st.sampled_from(DETECTORS),
    share=st.floats(1e-6, 1),
    voids=st.sampled_from([0.0, 0.3, 0.95]),
    seed=st.integers(0, 2**31 - 1),
)
def test_exactly_the_share_is_kept_as_it_was(shape, dtype, detector, share, voids, seed):
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 100, shape).astype(dtype)
    void = rng.random(shape) < voids
    void.flat[seed % void.size] = False
    before = values.copy()
    thinned = thin(values, void, detector=detector, share=share, seed=seed, threads=1)
    known = int((~void).sum())
    assert thinned.cells_known == known
    assert thinned.cells_kept == thinned.kept.sum() == max(1, math.floor(share * known))
    assert thinned.share == thinned.cells_kept / known
    assert not (thinned.kept & void).any()
    np.testing.assert_array_equal(values, before)
    assert thinned.values.dtype == values.dtype
    assert thinned.values.data[thinned.kept].tobytes() == before[thinned.kept].tobytes()
    np.testing.assert_array_equal(thinned.values.mask, ~thinned.kept)


@every_detector
def test_share_one_keeps_all(detector):
    ground = fractal((30, 40))
    void = disc(ground.shape, (15, 20), 6)
    np.testing.assert_array_equal(thin(ground, void, detector=detector, share=1).kept, ~void)


@every_detector
def test_one_pixel(detector):
    assert thin(np.array([[7]]), detector=detector).kept.tolist() == [[True]]


@every_detector
def test_constant_ground_is_thinned_all_over(detector):
    kept = thin(np.full((80, 100), 5.0), detector=detector, share=0.1, seed=1).kept
    quarters = [half.sum() for rows in np.split(kept, 2) for half in np.split(rows, 2, axis=1)]
    assert kept.sum() == 800
    assert min(quarters) > 150


@every_detector
def test_result_does_not_depend_on_threads_or_strips(detector, monkeypatch):
    from demsmith.core import strips

    ground = np.rint(fractal((97, 60)))  # whole metres: many ties
    void = disc(ground.shape, (40, 20), 9)
    size = (np.linspace(20, 20.001, 97), np.full(97, 30.0))
    whole = thin(ground, void, detector=detector, pixel_size=size, threads=1).kept
    monkeypatch.setattr(strips, "_STRIP_CELLS", 600)
    pieces = thin(ground, void, detector=detector, pixel_size=size, threads=3).kept
    if detector == "ridges":  # smooths by the mean pixel of each strip
        assert (whole != pieces).mean() < 0.001
    else:
        np.testing.assert_array_equal(whole, pieces)
    again = thin(ground, void, detector=detector, pixel_size=size, threads=1).kept
    np.testing.assert_array_equal(pieces, again)


@every_detector
def test_cells_are_kept_by_shape_not_by_unit_or_sign(detector):
    """Feet, depths and offsets keep the same cells (powers of 2, so that rounding is the same)."""
    ground = fractal((50, 60)).astype(np.float32)
    kept = thin(ground, detector=detector).kept
    np.testing.assert_array_equal(kept, thin(4 * ground, detector=detector).kept)
    np.testing.assert_array_equal(kept, thin(-ground, detector=detector).kept)


# --- bad input -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        (dict(share=0), "share is 0"),
        (dict(share=1.5), "at most 1"),
        (dict(share=float("nan")), "finite"),
        (dict(detector="canny"), "choose one of ridges, sobel, random"),
        (dict(seed=-1), "seed is -1"),
        (dict(void=np.ones((9, 9), bool)), "every cell is a void"),
        (dict(void=np.ones((3, 9), bool)), "void has shape"),
        (dict(pixel_size=0), "pixel_size"),
        (dict(threads=0), "threads is 0"),
        (dict(colour="red"), "thin got an unexpected keyword argument 'colour'"),
        (dict(options=ThinOptions(), share=0.5), "give options or share, not both"),
    ],
)
def test_bad_input(parameters, said):
    with pytest.raises(InputError, match=said):
        thin(np.zeros((9, 9)), **parameters)


def test_not_finite_and_masked_cells_are_voids():
    ground = fractal((20, 20))
    ground[3, 4], ground[5, 6] = np.nan, np.inf
    assert thin(ground).cells_known == 398
    assert thin(np.ma.masked_greater(fractal((20, 20)), -1)[:, :19].filled(1)).cells_known == 380
    masked = np.ma.MaskedArray(fractal((20, 20)), disc((20, 20), (9, 9), 3))
    assert thin(masked).cells_known == 400 - masked.mask.sum()


@every_detector
def test_cancel(detector):
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    with pytest.raises(Cancelled):
        thin(fractal((30, 30)), detector=detector, progress=Stop())


@every_detector
def test_progress_rises_to_the_end(detector):
    heard = []

    class Recorder:
        def report(self, fraction):
            heard.append(fraction)

        def cancelled(self):
            return False

    ground = fractal((30, 30))
    thin(ground, disc(ground.shape, (10, 10), 3), detector=detector, progress=Recorder())
    assert heard == sorted(heard)
    assert heard[0] < 0.2 and heard[-1] == 1


# --- random --------------------------------------------------------------------------------------


def test_random_is_uniform():
    total = sum(
        thin(np.zeros((40, 50)), detector="random", share=0.25, seed=seed).kept.astype(int)
        for seed in range(200)
    )
    expected, deviation = 50, math.sqrt(200 * 0.25 * 0.75)
    assert abs(total.mean() - expected) < 1e-9
    assert total.std() == pytest.approx(deviation, rel=0.1)
    assert abs(total - expected).max() < 5 * deviation
    for axis in (0, 1):  # no row or column is favoured
        lines = total.mean(axis=axis)
        assert abs(lines - expected).max() < 5 * deviation / math.sqrt(total.shape[axis])


def test_random_neighbours_are_unrelated():
    kept = thin(np.zeros((300, 300)), detector="random", share=0.5).kept.astype(float)
    bound = 5 / math.sqrt(kept.size)
    assert abs(np.corrcoef(kept[1:].ravel(), kept[:-1].ravel())[0, 1]) < bound
    assert abs(np.corrcoef(kept[:, 1:].ravel(), kept[:, :-1].ravel())[0, 1]) < bound


def test_random_depends_on_the_seed_alone():
    flat, rough = np.zeros((12, 13)), fractal((12, 13))
    one, same, other = (
        thin(z, detector="random", seed=seed).kept for z, seed in ((flat, 3), (rough, 3), (flat, 4))
    )
    np.testing.assert_array_equal(one, same)
    assert (one != other).any()


def test_random_stays_the_same_for_ever():
    kept = thin(np.zeros((6, 8)), detector="random", share=0.1, seed=42).kept
    assert np.flatnonzero(kept).tolist() == [5, 11, 22, 31]


# --- sobel ---------------------------------------------------------------------------------------


def test_sobel_keeps_the_step_of_a_ramp():
    ground = plane((40, 60), slope=(0, 1.0))
    ground[:, 30:] += 50
    kept = thin(ground, detector="sobel", share=2 / 60).kept
    assert kept[:, 29:31].all()
    assert kept.sum() == 80


def test_sobel_keeps_steep_flanks_not_the_crest():
    x = np.arange(-30, 31)
    roof = np.broadcast_to(np.where(abs(x) < 10, 10 * (10.0 - abs(x)), 0), (40, 61))
    kept = thin(roof, detector="sobel", share=0.25).kept
    assert not kept[:, x == 0].any()
    assert kept[:, (abs(x) > 0) & (abs(x) < 10)].mean() > 0.8


def test_sobel_is_even_at_edges_of_a_plane():
    """No edge is favoured or shunned: on a plane all slopes are equal, ties go by chance."""
    kept = thin(plane((60, 60), slope=(3.0, 2.0)), detector="sobel", share=0.5).kept
    frame = np.ones(kept.shape, bool)
    frame[1:-1, 1:-1] = False
    assert 0.3 < kept[frame].mean() < 0.7


def test_sobel_measures_ground_metres():
    """Two steps of the same height, across cells of 10 m and of 100 m: the first is steeper."""
    ground = np.zeros((60, 60))
    ground[:, 30:] += 50
    ground[30:] += 50
    kept = thin(ground, detector="sobel", share=0.03, pixel_size=(10, 100)).kept
    assert kept[:, 29:31].sum() == kept.sum() == 108
    kept = thin(ground, detector="sobel", share=0.03, pixel_size=(100, 10)).kept
    assert kept[29:31].sum() == kept.sum()


# --- ridges and valleys --------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("angle", [0, 30, 45, 90])
def test_ridges_keeps_crest_and_thalweg_not_flanks(sign, angle):
    row, column = np.indices((101, 101)) - 50
    turn = np.radians(angle)
    away = abs(np.cos(turn) * column + np.sin(turn) * row)
    kept = thin(sign * (500 - 7 * away), detector="ridges", share=0.03).kept
    on_line, flanks = away < 2, away > 6
    assert (kept & flanks).sum() < 0.08 * kept.sum()
    assert kept[on_line].mean() > 100 * kept[flanks].mean() > 0
    along = (np.cos(turn) * row - np.sin(turn) * column)[kept & on_line]
    assert np.histogram(along, 10, (-40, 40))[0].min() > 5  # the whole line, not a part


def test_ridges_measures_ground_metres():
    """A roof and a valley at right angles, equal on the ground: both are kept alike."""
    y, x = (np.arange(120) - 60.0)[:, None] * 90, (np.arange(240) - 120.0) * 45
    ground = np.maximum(-abs(x - 1350), -4000) / 10 + np.minimum(abs(y - 1350), 4000) / 10
    kept = thin(ground, share=0.03, pixel_size=(45, 90)).kept
    across_x = kept[:, abs(x - 1350) < 100].mean()
    across_y = kept[abs(y[:, 0] - 1350) < 100].mean()
    assert across_x == pytest.approx(across_y, rel=0.25)
    assert min(across_x, across_y) > 5 * kept.mean()


@pytest.mark.parametrize("detector", ["ridges", "sobel"])
def test_voids_make_no_shapes(detector):
    """A void in a slope, whatever its cells hold: its rim is not kept more than other ground."""
    ground = plane((90, 90), slope=(5.0, -3.0)) + fractal((90, 90), relief=20, exponent=3)
    void = disc(ground.shape, (45, 45), 12)
    rim = disc(ground.shape, (45, 45), 14) & ~void
    ground[void] = -32768
    kept = thin(ground, void, detector=detector, share=0.2).kept
    assert kept[rim].mean() < 2.5 * 0.2
    assert kept[disc(ground.shape, (45, 45), 30)].sum() > 100


def test_edges_of_the_raster_are_no_ridges():
    kept = thin(plane((90, 90), slope=(5.0, -3.0)), share=0.1).kept
    frame = np.ones(kept.shape, bool)
    frame[3:-3, 3:-3] = False
    assert 0.05 < kept[frame].mean() < 0.15


def test_ridges_spreads_cells_over_even_ground():
    """On ground that bends alike everywhere, a kept cell is never far: no clumps, no gaps."""
    from scipy.ndimage import distance_transform_edt

    row, column = np.indices((200, 200))
    kept = thin((row - 99) ** 2 + (column - 99) ** 2, share=0.02).kept
    far = distance_transform_edt(~kept)
    assert far.max() < 1.4 / math.sqrt(0.02)
    assert far[20:-20, 20:-20].max() < 0.85 / math.sqrt(0.02)


@pytest.mark.parametrize("share", [0.1, 0.02])
def test_terrain_is_rebuilt_better_from_ridges(share):
    ground = fractal((257, 257), seed=4, exponent=2.3)
    error = {
        detector: rmse(ground, thin(ground, detector=detector, share=share))
        for detector in DETECTORS
    }
    assert error["ridges"] < 0.75 * error["random"]
    assert error["ridges"] < 0.2 * error["sobel"]


@pytest.mark.parametrize(
    ("name", "gain"),
    [
        ("sierra_nevada/N37W004.hgt", 0.65),
        ("white_mountains/N44W072.hgt", 0.6),
        ("kossou_plain/n07_w006_3arc_v2.tif", 0.8),
    ],
)
def test_real_terrain_is_rebuilt_better_from_ridges(name, gain):
    tile = raster.read(shared_data(name))
    size = tile.grid.pixel_size_m()
    ridges, chance = (
        thin(tile.values, tile.void, detector=detector, share=0.05, pixel_size=size)
        for detector in ("ridges", "random")
    )
    assert ridges.cells_kept == math.floor(0.05 * tile.values.size)
    assert rmse(tile.values, ridges, size) < gain * rmse(tile.values, chance, size)
