"""Drainage of arrays: what may be given, what comes out, and what is refused."""

import tracemalloc

import numpy as np
import pytest
from scenes import disc, fractal

import demsmith
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.hydrology import DrainageOptions, drainage_area
from demsmith.core.hydrology.coarse import block_maxima

METHODS = ("d8", "dinf", "mfd", "particles")
SHAPE = (40, 50)
VOID = disc(SHAPE, (12, 30), 4)
GROUND = np.rint(fractal(SHAPE, seed=3, relief=400))


def test_it_is_public():
    assert demsmith.drainage_area is drainage_area


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("depressions", ["fill", "breach"])
def test_all_water_leaves(method, depressions):
    """What flows out at the edge and into voids is what fell."""
    area = np.linspace(80, 120, SHAPE[0])
    drained = drainage_area(
        GROUND, VOID, pixel_size=10, cell_area=area, method=method, depressions=depressions,
        particles=20_000,
    )  # fmt: skip
    fell = (area[:, None] * ~VOID).sum()
    if method == "d8":
        assert drained.area[drained.directions == 0].sum() == pytest.approx(fell, rel=1e-9)
    assert np.nanmax(drained.area) < fell
    assert np.array_equal(np.isnan(drained.area), VOID)
    assert (drained.directions[VOID] == 247).all()
    if method != "particles":
        own = np.broadcast_to(area[:, None], SHAPE)[~VOID]
        assert (drained.area[~VOID] >= own * (1 - 1e-6)).all()


@pytest.mark.parametrize("masked", [False, True])
@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "int32", "int64", "float64"])
def test_types_and_masks_do_not_matter(dtype, masked):
    values = np.rint(GROUND / 2).astype(dtype)
    expected = drainage_area(values.astype(np.float32), VOID)
    drained = drainage_area(
        np.ma.MaskedArray(values, VOID) if masked else values, None if masked else VOID, threads=1
    )
    np.testing.assert_array_equal(drained.area, expected.area)
    np.testing.assert_array_equal(drained.directions, expected.directions)


def test_what_is_given_stays_as_it_is():
    values, void = GROUND.astype(np.float32), VOID.copy()
    weights = np.ones(SHAPE)
    weights[VOID] = np.nan
    for depressions in ("fill", "breach", "keep"):
        drainage_area(values, void, weights=weights, depressions=depressions)
    np.testing.assert_array_equal(values, GROUND)
    np.testing.assert_array_equal(void, VOID)
    assert np.isnan(weights[VOID]).all()


def test_cells_that_are_changed():
    for depressions, sign in (("fill", 1), ("breach", -1)):
        drained = drainage_area(GROUND, VOID, depressions=depressions)
        moved = np.where(VOID, 0, drained.conditioned - GROUND)
        np.testing.assert_array_equal(drained.changed(), moved != 0)
        assert (sign * moved).max() > 0
    assert not drainage_area(GROUND, VOID, depressions="keep").changed().any()


@pytest.mark.parametrize("method", METHODS)
def test_specific_area_of_a_slope_is_its_length(method):
    falls = np.repeat(np.arange(30.0, 0, -1)[:, None], 12, axis=1)
    drained = drainage_area(falls, pixel_size=(20, 5), method=method, unit="km2", exponent=30)
    inner = drained.specific()[:, 3:-3]
    if method != "particles":
        np.testing.assert_allclose(inner[:-1, 0], 5 * np.arange(1, 30), rtol=0.01)
    weighed = drainage_area(
        falls, pixel_size=(20, 5), method=method, weights=np.full(falls.shape, 100.0), exponent=30
    )
    np.testing.assert_allclose(weighed.specific()[:, 3:-3], inner, rtol=1e-5)


def test_memory_is_little():
    """Beside the elevations, 16 bytes a cell at the worst moment."""
    ground = np.tile(fractal((512, 512), seed=1), (4, 2)).astype(np.float32)
    void = np.zeros(ground.shape, bool)
    for method in ("d8", "dinf", "mfd"):
        drainage_area(ground, void, method=method, threads=1)  # kernels, loaded, take memory too
        tracemalloc.start()
        drainage_area(ground, void, method=method, threads=1)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak / ground.size < 16.5, method


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (dict(values=np.zeros(5)), "2-D"),
        (dict(void=np.zeros((4, 4), bool)), "void has shape"),
        (dict(void=np.ones(SHAPE, bool)), "every cell is a void"),
        (dict(pixel_size=0), "pixel_size must be positive"),
        (dict(cell_area=np.ones(7)), "cell_area by row has shape"),
        (dict(cell_area=-1.0), "cell_area must be positive"),
        (dict(weights=np.ones((3, 3))), "weights has shape"),
        (dict(weights=np.full(SHAPE, -0.5)), "such as -0.5"),
        (dict(weights=np.full(SHAPE, np.inf)), "such as inf"),
        (dict(method="d4"), "d4"),
        (dict(max_depth=-1), "max_depth is -1"),
        (dict(threads=0), "threads is 0"),
        (dict(options=DrainageOptions(), unit="km2"), "not both"),
        (dict(slope=3), "drainage_area"),
    ],
)
def test_refused(arguments, said):
    arguments = {"values": GROUND, **arguments}
    with pytest.raises(InputError, match=said):
        drainage_area(arguments.pop("values"), **arguments)


def test_a_specific_area_is_none_of_cells():
    with pytest.raises(InputError, match="needs unit m2 or km2"):
        drainage_area(GROUND, unit="cells").specific()


class Stop:
    """Cancels at a fraction of the way."""

    def __init__(self, at):
        self.at, self.last = at, 0

    def report(self, fraction):
        assert fraction >= self.last
        self.last = fraction

    def cancelled(self):
        return self.last >= self.at


@pytest.mark.parametrize("at", [0, 0.3, 0.55, 0.65])
@pytest.mark.parametrize("method", METHODS)
def test_cancelled(at, method):
    ground = np.tile(GROUND, (40, 4))
    with pytest.raises(Cancelled):
        drainage_area(ground, method=method, particles=200_000, progress=Stop(at))


def test_maxima_of_blocks():
    values = np.arange(35.0).reshape(5, 7)
    values[:2, :3] = np.nan
    assert block_maxima(values, 2)[0, 0] != block_maxima(values, 2)[0, 0]
    assert block_maxima(values, 10).tolist() == [[34]]
    assert block_maxima(values, 3).tolist() == [[16, 19, 20], [30, 33, 34]]
