"""Voids too wide for a band: the same surface as a band's, and one near it from a coarser grid."""

import numpy as np
import pytest
from scenes import disc, fractal, plane

from demsmith.core.errors import Cancelled
from demsmith.core.voids.accurate import giants
from demsmith.core.voids.accurate._locality import KNOWN, VOID
from demsmith.core.voids.accurate._structured import solve_structured

SHAPE = (90, 80)
VOIDS = disc(SHAPE, (44, 40), 30)
HOW = dict(spread=6.0, strength=0.8, tension=20.0, stiffness=0.7, dx=25.0, dy=30.0)


def holed_ground(ground):
    """Give the ground with its mean in the void, and the cells' states."""
    z = np.where(VOIDS, ground.mean(), ground).astype(np.float64)
    return z, np.where(VOIDS, VOID, KNOWN).astype(np.uint8)


def by_band(ground):
    z, state = holed_ground(ground)
    for _ in range(giants._PASSES):
        solve_structured(z, state, *HOW.values())
    return z


def by_giant(ground, **options):
    z, state = holed_ground(ground)
    giants.solve_giant(z, state, *HOW.values(), **options)
    return z


def test_a_sparse_factor_gives_the_bands_surface():
    ground = fractal(SHAPE, seed=3)
    np.testing.assert_allclose(by_giant(ground), by_band(ground), atol=1e-6 * np.ptp(ground))


@pytest.mark.parametrize("cells", [40_000, 800])
def test_known_cells_stay_and_a_plane_comes_back(monkeypatch, cells):
    monkeypatch.setattr(giants, "_LARGEST", cells)
    ground = plane(SHAPE)
    z = by_giant(ground)
    np.testing.assert_array_equal(z[~VOIDS], ground.astype(np.float64)[~VOIDS])
    np.testing.assert_allclose(z, ground, atol=0.02 * np.ptp(ground))


def test_a_coarser_grid_is_nearly_as_good(monkeypatch):
    grounds = [fractal(SHAPE, seed=seed) for seed in range(5)]
    direct = [by_band(ground) for ground in grounds]
    monkeypatch.setattr(giants, "_LARGEST", 800)
    coarser = [by_giant(ground) for ground in grounds]
    assert not np.array_equal(coarser, direct)
    assert rmse(coarser, grounds) < 1.15 * rmse(direct, grounds)


def rmse(surfaces, grounds):
    return np.sqrt((np.subtract(surfaces, grounds)[:, VOIDS] ** 2).mean())


def test_stopping():
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    with pytest.raises(Cancelled):
        by_giant(plane(SHAPE), progress=Stop())
