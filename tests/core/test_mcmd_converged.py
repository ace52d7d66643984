"""The converged variant: the surface of least energy through scattered known cells."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scenes import fractal, plane
from support import fill_by_mcmd

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.mcmd._converged import gradient
from demsmith.core.mcmd.converged import converge


def scattered(shape, share, seed=0):
    return np.random.default_rng(seed).random(shape) < share


def weights(height, aspect=1.0, pull=0.0):
    return np.tile([aspect**2, 2 * aspect, pull * aspect, pull], (height, 1))


def hessian(shape, *, stiffness=1.0, table=None):
    """The energy's matrix, a column for each cell."""
    free = np.zeros(shape, bool)
    out = np.empty(shape)
    columns = []
    for cell in range(free.size):
        z = np.zeros(free.size)
        z[cell] = 1
        table = weights(shape[0]) if table is None else table
        gradient(0, shape[0], z.reshape(shape), free, table, stiffness, out)
        columns.append(out.ravel().copy())
    return np.stack(columns, axis=1)


@pytest.mark.parametrize("shape", [(9, 11), (5, 5), (3, 8), (2, 4), (1, 6), (6, 1), (1, 1)])
@pytest.mark.parametrize("stiffness", [0.0, 2.0])
def test_energy_is_symmetric_and_never_negative(shape, stiffness):
    table = weights(shape[0], aspect=0.6, pull=0.01) * np.linspace(1, 1.1, shape[0])[:, None]
    table[:, 1] = 2 * np.sqrt(table[:, 0])
    matrix = hessian(shape, stiffness=stiffness, table=table)
    assert np.allclose(matrix, matrix.T, atol=1e-12)
    assert np.linalg.eigvalsh(matrix).min() > -1e-9


def test_planes_cost_nothing_even_at_the_edge():
    z = plane((7, 9))
    out = np.empty_like(z)
    free = np.zeros(z.shape, bool)
    assert abs(gradient(0, 7, z, free, weights(7), 3.0, out)) < 1e-7
    assert np.abs(out).max() < 1e-9


def test_inner_stencil_is_the_biharmonic_operator_and_the_square_of_slopes():
    """A single raised cell shows 20, -8, 2, 1, and 4 times the pull less its neighbours."""
    z = np.zeros((11, 11))
    z[5, 5] = 1
    out = np.empty_like(z)
    gradient(0, 11, z, np.zeros(z.shape, bool), weights(11, pull=0.5), 0.0, out)
    assert out[5, 5] == pytest.approx(20 + 4 * 0.5)
    assert out[5, 6] == out[4, 5] == pytest.approx(-8 - 0.5)
    assert out[4, 4] == pytest.approx(2)
    assert out[5, 7] == out[7, 5] == pytest.approx(1)


def test_stiffness_is_the_sum_of_squared_differences_of_laplacians():
    z = np.random.default_rng(1).normal(size=(8, 9))
    out = np.empty_like(z)
    free = np.zeros(z.shape, bool)
    soft = gradient(0, 8, z, free, weights(8), 0.0, out)
    stiff = gradient(0, 8, z, free, weights(8), 1.0, out)
    laplacian = z[1:-1, :-2] + z[1:-1, 2:] + z[:-2, 1:-1] + z[2:, 1:-1] - 4 * z[1:-1, 1:-1]
    expected = (np.diff(laplacian, axis=0) ** 2).sum() + (np.diff(laplacian, axis=1) ** 2).sum()
    assert stiff - soft == pytest.approx(expected)


def test_known_cells_stay_and_a_plane_comes_back():
    z = plane((60, 70))
    known = scattered(z.shape, 0.1)
    start = np.where(known, z, z.mean())
    found = converge(start, known, tension=1e6)
    assert np.array_equal(found[known], z[known])
    assert np.abs(found - z).max() < 0.05 * np.ptp(z)
    assert np.abs(found - z).mean() < 0.002 * np.ptp(z)


def test_more_accurate_than_relaxed_on_fractal_ground():
    z = fractal((200, 220))
    known = scattered(z.shape, 0.05)
    relaxed = fill_by_mcmd(z, ~known).values
    found = converge(relaxed, known)

    def rmse(surface):
        return np.sqrt(((surface - z)[~known] ** 2).mean())

    assert rmse(found) < 0.9 * rmse(relaxed)


def test_as_accurate_as_thin_plate_splines():
    """Scipy's thin-plate spline through the same cells is the peer."""
    from scipy.interpolate import RBFInterpolator

    z = fractal((80, 90), seed=3)
    known = scattered(z.shape, 0.05, seed=3)
    row, column = np.nonzero(known)
    everywhere = np.stack([axis.ravel() for axis in np.indices(z.shape)], axis=1)
    spline = RBFInterpolator(np.stack([row, column], axis=1).astype(float), z[known])
    peer = spline(everywhere.astype(float)).reshape(z.shape)
    found = converge(fill_by_mcmd(z, ~known).values, known)
    error = [np.sqrt(((surface - z)[~known] ** 2).mean()) for surface in (found, peer)]
    assert error[0] < 1.02 * error[1]


def test_metres_not_cells():
    """On cells twice as high as wide, ground made in metres comes back better by metres."""
    z = fractal((160, 320), seed=5)[:, ::2]
    known = scattered(z.shape, 0.05)
    start = fill_by_mcmd(z, ~known).values

    def rmse(pixel_size):
        found = converge(start, known, pixel_size=pixel_size)
        return np.sqrt(((found - z)[~known] ** 2).mean())

    assert rmse((20.0, 10.0)) < 0.97 * rmse((10.0, 10.0))


@settings(max_examples=15, deadline=None)
@given(arrays(np.float64, (23, 17), elements=st.floats(-1000, 1000)), st.integers(0, 99))
def test_shift_and_scale_pass_through(start, seed):
    known = scattered(start.shape, 0.3, seed)
    once = converge(start, known, pixel_size=30.0)
    again = converge(3 * start + 7, known, pixel_size=30.0)
    assert np.allclose(again, 3 * once + 7, atol=0.01 * (1 + np.ptp(once)))


def test_same_bytes_for_any_number_of_threads():
    z = fractal((150, 90))
    known = scattered(z.shape, 0.08)
    start = fill_by_mcmd(z, ~known).values
    assert np.array_equal(
        converge(start, known, threads=1), converge(start, known, threads=3), equal_nan=True
    )


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 2), (3, 3), (2, 70)])
def test_small_rasters(shape):
    z = plane(shape)
    known = np.zeros(shape, bool)
    known[0, 0] = True
    found = converge(np.full(shape, z[0, 0]), known)
    assert np.allclose(found, z[0, 0])


def test_nothing_to_change():
    z = fractal((20, 20))
    assert np.array_equal(converge(z, np.ones(z.shape, bool)), z)


def test_cancel_and_progress():
    z = fractal((120, 120))
    known = scattered(z.shape, 0.02)
    start = fill_by_mcmd(z, ~known).values
    told = []

    class Watch:
        stop_after = np.inf

        def report(self, fraction):
            told.append(fraction)

        def cancelled(self):
            return len(told) > self.stop_after

    converge(start, known, progress=Watch())
    assert told == sorted(told)
    assert told[-1] == 1
    assert len(told) > 50
    told.clear()
    watch = Watch()
    watch.stop_after = 5
    with pytest.raises(Cancelled):
        converge(start, known, progress=watch)
    assert len(told) < 10


def test_pixel_size_must_be_usable():
    with pytest.raises(InputError, match="positive"):
        converge(np.zeros((4, 4)), np.eye(4, dtype=bool), pixel_size=0.0)
