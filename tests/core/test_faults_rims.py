"""Rims of voids that are not to be believed."""

from types import SimpleNamespace

import numpy as np
import pytest
from scenes import disc, fractal, holed

from demsmith.core.faults import REACH, find_untrusted_rims, learn_faults


def ground(shape=(160, 150)):
    return fractal(shape, seed=4, relief=2000.0)


def test_nothing_by_default_and_nothing_without_voids():
    values = ground()
    void = disc(values.shape, (60, 60), 9)
    assert not find_untrusted_rims(values, void).any()
    none = np.zeros_like(void)
    assert not find_untrusted_rims(values, none, erode=3, noisy_rims=True).any()
    assert not find_untrusted_rims(values, ~none, erode=3, noisy_rims=True).any()


def test_erosion_takes_so_many_cells_all_around():
    void = holed((30, 30), (10, 12, 10, 15), (0, 2, 28, 30))
    values = np.zeros(void.shape)
    expected = holed((30, 30), (7, 15, 7, 18), (0, 5, 25, 30)) & ~void
    assert np.array_equal(find_untrusted_rims(values, void, erode=3), expected)


def test_noisy_cells_go_and_the_others_stay():
    values = ground()
    void = holed(values.shape, (60, 80, 60, 90))
    values[59, 70] += 200
    values[70, 59] -= 200
    values[120, 30] += 200  # at no void
    found = find_untrusted_rims(values, void, noisy_rims=True)
    assert found[59, 70] and found[70, 59] and not found[120, 30]
    assert found.sum() <= 6  # with those whose neighbours they are
    values = ground()
    assert find_untrusted_rims(values, void, noisy_rims=True).sum() == 0


def test_shores_stay():
    values = np.where(np.arange(150) < 75, 10.0, ground())
    void = disc(values.shape, (60, 40), 9)
    assert not find_untrusted_rims(values, void, noisy_rims=True).any()


@pytest.mark.parametrize("options", [dict(erode=2), dict(noisy_rims=True)])
def test_windows_of_a_mosaic_find_the_same(options):
    values = ground() + np.random.default_rng(1).standard_cauchy((160, 150)) * 4
    void = fractal(values.shape, seed=8) > 600
    model = learn_faults([SimpleNamespace(values=values, void=void)])
    whole = find_untrusted_rims(values, void, model=model, threads=2, **options)
    assert whole.any() and not (whole & void).any()
    for top in range(0, 160, 40):
        a = max(top - REACH, 0)
        rows = slice(a, top + 40 + REACH)
        part = find_untrusted_rims(values[rows], void[rows], model=model, **options)
        assert np.array_equal(part[top - a :][:40], whole[top : top + 40])
