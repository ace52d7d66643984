"""Punching voids like the SRTM's, and scoring fills by void size."""

import numpy as np
import pytest
from scenes import fractal, holed, plane

from demsmith.core.errors import InputError
from demsmith.core.validation import SIZE_CLASSES, Holes, Tally, errors_by_size, punch_voids
from demsmith.core.voids import find_voids


def test_punched_voids_are_as_described():
    """About 5 % of the cells, small and large, more of them on slopes; seeds differ."""
    ground = fractal((600, 600), relief=2000)
    void = punch_voids(ground, seed=1)
    assert 0.04 < void.mean() < 0.055
    sizes = find_voids(void).cells
    for smallest, largest in SIZE_CLASSES:
        assert ((sizes >= smallest) & (sizes <= (largest or np.inf))).sum() >= 3
    slope = np.hypot(*np.gradient(ground))
    assert slope[void].mean() > 1.2 * slope[~void].mean()
    np.testing.assert_array_equal(punch_voids(ground, seed=1), void)
    assert (punch_voids(ground, seed=2) != void).any()


def test_only_known_ground_is_punched():
    ground, known = fractal((200, 200)), ~holed((200, 200), (50, 120, 30, 90))
    void = punch_voids(ground, known=known, seed=1)
    assert void.any() and not void[~known].any()
    rubbish = np.where(known, ground, -32768)
    np.testing.assert_array_equal(punch_voids(rubbish, known=known, seed=1), void)
    with pytest.raises(InputError, match="nothing is known"):
        punch_voids(ground, known=np.zeros(ground.shape, bool))


@pytest.mark.parametrize("shape", [(1, 50), (50, 1), (2, 2), (1, 1)])
def test_tiny_rasters_can_be_punched(shape):
    assert punch_voids(np.zeros(shape)).shape == shape


def test_errors_by_size():
    void = holed((60, 60), (2, 4, 2, 4), (10, 14, 10, 15), (20, 60, 20, 60))
    truth, filled = np.zeros((60, 60)), np.zeros((60, 60), np.float32)
    filled[2:4, 2:4] = [[1, -1], [1, -1]]
    filled[10:14, 10:15] = 3
    filled[20:, 20:] = -2
    filled[0, 0] = 99  # no void
    small, middle, none, large, every = errors_by_size(filled, truth, void)
    assert (small.voids, small.cells, small.rmse, small.bias) == (1, 4, 1, 0)
    assert (middle.voids, middle.cells, middle.rmse, middle.bias) == (1, 20, 3, 3)
    assert (none.voids, none.cells) == (0, 0) and np.isnan([none.rmse, none.bias]).all()
    assert (large.voids, large.cells, large.rmse, large.bias) == (1, 1600, 2, -2)
    assert (every.voids, every.cells) == (3, 1624)
    assert every.rmse == pytest.approx(np.sqrt((4 + 20 * 9 + 1600 * 4) / 1624))
    assert (every.smallest, every.largest) == (1, None)


def test_errors_of_integers_do_not_wrap_around():
    void = holed((4, 4), (1, 2, 1, 2))
    truth, filled = np.full((4, 4), 200, np.uint8), np.full((4, 4), 100, np.uint8)
    assert errors_by_size(filled, truth, void)[-1].bias == -100


def test_the_share_of_punched_voids_can_be_chosen():
    ground = fractal((400, 400))
    assert 0.008 < punch_voids(ground, share=0.01).mean() < 0.012
    assert 0.15 < punch_voids(ground, share=0.2).mean() < 0.23


def test_errors_by_magnitude():
    void = holed((30, 30), (5, 7, 5, 7))
    filled = np.zeros((30, 30))
    filled[5:7, 5:7] = [[1, -2], [3, -6]]
    error = errors_by_size(filled, np.zeros((30, 30)), void)[0]
    assert (error.mae, error.max_error, error.bias) == (3, 6, -1)
    assert error.name == "1-16"


def test_the_slope_error_is_in_ground_units():
    """A plane filled as a plane half as steep: half its slope is missing in the void's middle."""
    truth, flatter = plane((60, 60), slope=(0, 30.0)), plane((60, 60), slope=(0, 15.0))
    void = holed((60, 60), (10, 50, 10, 50))
    inner = holed((60, 60), (20, 40, 20, 40))
    dx, dy = np.full(60, 60.0), np.full(60, 90.0)
    holes = Holes(truth, inner, void=void, pixel_size=(dx, dy))
    error = holes.tally(np.where(void, flatter, truth)).errors()[-1]
    assert error.slope_rmse == pytest.approx(15 / 60, rel=1e-5)
    exact = errors_by_size(truth, truth, void, pixel_size=(dx, dy))[-1]
    assert (exact.rmse, exact.slope_rmse) == (0, 0)


def test_slopes_beside_real_voids_are_left_out():
    truth = plane((40, 40))
    void = holed((40, 40), (10, 20, 10, 20))
    hidden = void & holed((40, 40), (10, 20, 10, 15))
    rubbish = np.where(void & ~hidden, -32768.0, truth)
    error = Holes(rubbish, hidden, void=void).tally(truth).errors()[-1]
    assert error.slope_rmse == pytest.approx(0, abs=1e-6)


def test_a_hole_that_runs_into_a_real_void_is_as_large_as_both():
    void = holed((40, 40), (5, 15, 5, 25))
    hidden = holed((40, 40), (5, 15, 5, 6))
    errors = Holes(np.zeros((40, 40)), hidden, void=void).tally(np.ones((40, 40))).errors()
    assert [each.cells for each in errors] == [0, 0, 10, 0, 10]
    assert errors[2].voids == 1


def test_intervals_of_honest_and_of_bold_methods():
    """Normal errors lie in their 68 and 95 % intervals as often as promised; half of sigma not."""
    rng = np.random.default_rng(0)
    void = holed((300, 300), (20, 280, 20, 280))
    sigma = rng.uniform(1, 20, (300, 300)).astype(np.float32)
    filled = rng.standard_normal((300, 300)) * sigma
    holes = Holes(np.zeros((300, 300)), void)
    honest, bold = (holes.tally(filled, share * sigma).errors()[-1] for share in (1, 0.5))
    assert honest.within_68 == pytest.approx(0.683, abs=0.01)
    assert honest.within_95 == pytest.approx(0.95, abs=0.005)
    assert bold.within_68 == pytest.approx(0.383, abs=0.01)
    silent = holes.tally(filled).errors()[-1]
    assert np.isnan([silent.within_68, silent.within_95]).all()
    assert silent.as_dict()["within_68"] is None


def test_cells_that_were_not_filled_are_not_scored():
    void = holed((40, 40), (5, 8, 5, 8), (20, 23, 20, 23))
    filled = np.where(np.arange(40)[:, None] > 15, np.nan, 2.0) * np.ones(40)
    error = Holes(np.zeros((40, 40)), void).tally(filled).errors()[0]
    assert (error.voids, error.cells, error.rmse) == (1, 9, 2)


def test_tallies_of_several_masks_are_pooled():
    truth, filled = np.zeros((60, 60)), fractal((60, 60))
    masks = holed((60, 60), (5, 9, 5, 9)), holed((60, 60), (20, 24, 20, 24))
    pooled = sum((Holes(truth, mask).tally(filled) for mask in masks), Tally.zero()).errors()
    at_once = errors_by_size(filled, truth, masks[0] | masks[1])
    for one, other in zip(pooled, at_once, strict=True):
        assert one.as_dict() == pytest.approx(other.as_dict())
