"""The sky-view factor against terrain of which it is known."""

import math

import numpy as np
import pytest
from scenes import fractal

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.solar.sky_view import sky_view_factor

ON_A_PLANE = dict(curvature=False)


def metres(rows, size=1.0):
    return (np.full(rows, size),) * 2


@pytest.mark.parametrize("steepness", [0, 35, 70])
@pytest.mark.parametrize("aspect", [0, 30, 201])
def test_an_endless_slope_sees_what_is_not_behind_it(steepness, aspect):
    row, column = np.mgrid[:30, :40]
    turned = math.radians(aspect)
    along = 10.0 * (column * math.sin(turned) - row * math.cos(turned))
    z = along * math.tan(math.radians(steepness))
    view = sky_view_factor(z, None, *metres(30, 10.0), azimuths=36)
    assert view == pytest.approx((1 + math.cos(math.radians(steepness))) / 2, abs=1e-3)


@pytest.mark.parametrize(("radius", "depth"), [(250, 30), (150, 80), (140, 130)])
def test_a_bowl_hides_of_its_own_cells_the_same_part_everywhere(radius, depth):
    """Inside a sphere every piece of it sees every other alike: the sky's part is the open one."""
    row, column = np.mgrid[:301, :301] - 150.0
    squared = row**2 + column**2
    below = radius - depth  # from the rim's plane up to the centre, so negative for the bowl
    rim = radius**2 - below**2
    z = np.where(squared < rim, below - np.sqrt(np.maximum(radius**2 - squared, 0)), 0.0)
    view = sky_view_factor(z, None, *metres(301), azimuths=36, **ON_A_PLANE)
    assert view[squared < 0.6 * rim] == pytest.approx(1 - depth / (2 * radius), abs=4e-3)
    level = sky_view_factor(z, None, *metres(301), azimuths=36, tilted=False, **ON_A_PLANE)
    assert level[150, 150] == pytest.approx(1 - depth / (2 * radius), abs=4e-3)
    outside = (abs(row) > 147) & (squared > rim * 1.1)
    assert level[outside] == pytest.approx(1)


@pytest.mark.parametrize("steepness", [15, 45, 65])
def test_the_bottom_of_an_endless_valley(steepness):
    z = np.abs(np.arange(101) - 50.0) * math.tan(math.radians(steepness)) * np.ones((1201, 1))
    view = sky_view_factor(z, None, *metres(1201), tilted=False, azimuths=64, **ON_A_PLANE)
    assert view[600, 50] == pytest.approx(math.cos(math.radians(steepness)), abs=2e-3)


def test_the_foot_of_an_endless_wall():
    z = np.zeros((2001, 60))
    z[:, 50:] = 30.0
    view = sky_view_factor(z, None, *metres(2001), tilted=False, azimuths=90, **ON_A_PLANE)
    for column in (5, 20, 35):
        risen = math.atan(30 / (50 - column))
        assert view[1000, column] == pytest.approx((1 + math.cos(risen)) / 2, abs=3e-3)


@pytest.mark.parametrize("tilted", [False, True])
def test_it_lies_between_0_and_1_and_is_nan_in_voids(tilted):
    z = fractal((90, 110), seed=4, relief=3000.0, exponent=1.8)
    void = np.zeros(z.shape, bool)
    void[30:50, 40:60] = True
    view = sky_view_factor(z, void, *metres(90, 30.0), azimuths=16, tilted=tilted)
    assert np.array_equal(np.isnan(view), void)
    assert view[~void].min() > 0 and view[~void].max() <= 1 + 1e-6
    assert view[~void].min() < 0.7
    again = sky_view_factor(z, void, *metres(90, 30.0), azimuths=16, tilted=tilted, threads=1)
    assert view.tobytes() == again.tobytes()


class Stop:
    """A progress that asks to stop at once."""

    def report(self, fraction):
        pass

    def cancelled(self):
        return True


def test_it_can_be_cancelled():
    with pytest.raises(Cancelled):
        sky_view_factor(np.zeros((50, 50)), None, *metres(50), progress=Stop())


def test_no_directions_are_refused():
    with pytest.raises(InputError, match="azimuths is 0"):
        sky_view_factor(np.zeros((5, 5)), None, *metres(5), azimuths=0)
