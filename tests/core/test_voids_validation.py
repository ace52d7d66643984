"""Punching voids and scoring fills."""

import numpy as np
import pytest
from scenes import fractal, holed

from demsmith.core.errors import InputError
from demsmith.core.voids import find_voids
from demsmith.core.voids.validation import SIZE_CLASSES, errors_by_size, punch_voids


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
