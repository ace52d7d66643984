"""What holds of every fill: known cells, types, layouts, threads."""

import itertools
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import disc, fractal, holed, plane

from demsmith.core.voids import FILLED, LEFT, ORIGINAL, fill_voids
from demsmith.core.voids.accurate import SOURCE_OF_METHOD

VARIANTS = ("relaxed", "weighted", "paper")
ENGINES = {
    "accurate": {}, "relaxed": dict(method="mcmd"), "weighted": dict(variant="weighted"),
    "paper": dict(variant="paper"),
}  # fmt: skip
every_engine = pytest.mark.parametrize("engine", ENGINES)
every_method = pytest.mark.parametrize("method", ["auto", "mcmd"])
SCHEMES = ("triangle-edge", "diamond-square")
DTYPES = (
    "int8", "uint8", "int16", ">i2", "uint16", "int32", ">i4", "uint32", "int64", "uint64",
    "float16", "float32", ">f4", "float64", ">f8", "longdouble",
)  # fmt: skip
LAYOUTS = ("C", "fortran", "steps", "reversed", "read-only")


def laid_out(values, layout):
    if layout == "fortran":
        return np.asfortranarray(values)
    if layout == "steps":
        return np.repeat(np.repeat(values, 2, 0), 3, 1)[::2, ::3]
    if layout == "reversed":
        return values[::-1, ::-1].copy()[::-1, ::-1]
    if layout == "read-only":
        values = values.copy()
        values.flags.writeable = False
    return values


@st.composite
def rasters(draw):
    """A raster with at least one known and one void cell."""
    shape = draw(
        st.sampled_from([(1, 2), (1, 40), (40, 1), (2, 2), (3, 3), (5, 4), (17, 17), (33, 70)])
        | st.tuples(st.integers(1, 60), st.integers(2, 60))
    )
    rng = np.random.default_rng(draw(st.integers(0, 1000)))
    share = draw(st.sampled_from([0.0, 0.05, 0.5, 0.95, 1.0]))
    void = rng.random(shape) < share
    first, second = rng.permutation(void.size)[:2]
    void.flat[first], void.flat[second] = True, False  # share 1: all but one
    dtype = np.dtype(draw(st.sampled_from(DTYPES)))
    values = (rng.random(shape) * 100).astype(dtype)
    if dtype.kind != "u":
        values = values - np.asarray(50, dtype)
    values[void] = values.dtype.type(77)
    return values.astype(dtype), void


@given(
    rasters(), st.sampled_from(sorted(ENGINES)), st.sampled_from(SCHEMES),
    st.sampled_from([0.0, 0.3]), st.sampled_from(LAYOUTS), st.booleans(),
)  # fmt: skip
def test_every_void_is_filled_and_no_known_cell_changed(
    raster, engine, scheme, r_s, layout, float_output
):
    values, void = raster
    given_ = laid_out(values, layout)
    own = {} if engine == "accurate" else dict(scheme=scheme, r_s=r_s)
    before, void_before = values.tobytes(), void.tobytes()
    filled = fill_voids(
        given_, laid_out(void, layout), float_output=float_output, pixel_size=(30.0, 31.0),
        **ENGINES[engine], **own,
    )  # fmt: skip
    assert np.ascontiguousarray(given_).tobytes() == before == values.tobytes()
    assert void.tobytes() == void_before
    out = filled.values
    if float_output and values.dtype.kind != "f":
        assert out.dtype == (np.float32 if values.dtype.itemsize <= 2 else np.float64)
        np.testing.assert_array_equal(out[~void], values[~void])
    else:
        assert out.dtype == values.dtype
        assert out[~void].tobytes() == values[~void].tobytes()
    assert np.isfinite(out.astype(np.float64)).all()
    assert filled.cells_filled == void.sum()
    assert not filled.left().any()
    source = filled.source()
    if engine == "accurate":
        assert np.isin(source[void], SOURCE_OF_METHOD).all()
        np.testing.assert_array_equal(filled.sigma > 0, void)
    else:
        assert (source[void] == FILLED).all() and filled.sigma is None
    assert (source[~void] == ORIGINAL).all()
    if r_s == 0 and engine in ("weighted", "paper"):
        # Means of known cells: nothing beyond them.
        known = values[~void].astype(np.float64)
        assert out[void].min() >= known.min() - 1e-3 and out[void].max() <= known.max() + 1e-3


@every_method
@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("dtype", ["int16", ">i2", "float32", ">f4", "float64", ">f8"])
def test_layout_and_byte_order_do_not_matter(dtype, layout, method):
    truth, void = fractal((40, 50)).astype(dtype), disc((40, 50), (20, 20), 9)
    native = truth.astype(np.dtype(dtype).newbyteorder("="))
    plain = fill_voids(native, void, method=method).values
    other = fill_voids(laid_out(truth, layout), laid_out(void, layout), method=method).values
    np.testing.assert_array_equal(other, plain)


@every_method
def test_integers_are_rounded_to_the_nearest(method):
    truth, void = fractal((60, 60)), disc((60, 60), (30, 30), 12)
    whole = np.rint(truth).astype(np.int16)
    in_float = fill_voids(whole, void, method=method, float_output=True).values
    in_int = fill_voids(whole, void, method=method).values
    np.testing.assert_array_equal(in_int, np.rint(in_float).astype(np.int16))
    assert (in_float[void] != np.rint(in_float[void])).any()


@every_method
@pytest.mark.parametrize(("dtype", "top"), [("uint8", 255), ("int8", 127), ("int16", 32767)])
def test_overshoot_stops_at_the_types_limits(dtype, top, method):
    """A dome that rises beyond the limit must not wrap around to the other end."""
    row, column = np.indices((40, 40)) - 20
    dome = top + 30 - 0.3 * (row**2 + column**2)
    void = holed(dome.shape, (9, 32, 9, 32))
    ground = np.maximum(np.where(void, 0, dome), np.iinfo(dtype).min).astype(dtype)
    real = fill_voids(ground.astype(np.float64), void, method=method).values
    assert real[void].max() > top + 1
    filled = fill_voids(ground, void, method=method).values
    np.testing.assert_array_equal(filled[void], np.rint(np.minimum(real, top)).astype(dtype)[void])


# --- where voids come from -----------------------------------------------------------------------


@every_method
def test_nan_and_infinity_are_voids(method):
    truth = plane((30, 30))
    values = truth.copy()
    values[4:7, 5:9], values[20, 20], values[21, 20] = np.nan, np.inf, -np.inf
    filled = fill_voids(values, method=method)
    assert filled.cells_filled == 14
    assert abs(filled.values - truth).max() < 0.5


@pytest.mark.parametrize("dtype", ["int16", "float32"])
def test_masked_cells_are_voids(dtype):
    """As rasterio reads them: the data below a mask is no ground."""
    truth, void = plane((30, 30)).astype(dtype), disc((30, 30), (15, 15), 5)
    masked = np.ma.masked_array(np.where(void, -999, truth).astype(dtype), void)
    filled = fill_voids(masked)
    assert type(filled.values) is np.ndarray
    assert filled.cells_filled == void.sum()
    np.testing.assert_array_equal(filled.values, fill_voids(truth, void).values)


def test_integers_without_a_mask_have_no_voids():
    filled = fill_voids(np.arange(12, dtype=np.int16).reshape(3, 4))
    assert filled.cells_filled == 0 and len(filled.voids) == 0
    np.testing.assert_array_equal(filled.values, np.arange(12).reshape(3, 4))


@pytest.mark.parametrize("r_s", [0.0, 0.1])
@every_engine
def test_what_lies_in_a_void_does_not_matter(engine, r_s):
    truth, void = fractal((40, 50)), disc((40, 50), (20, 20), 9)
    plain = fill_voids(truth, void, r_s=r_s, **ENGINES[engine]).values
    for rubbish in (np.nan, -3.4e38, np.inf):
        spoilt = np.where(void, rubbish, truth)
        again = fill_voids(spoilt, void, r_s=r_s, **ENGINES[engine]).values
        np.testing.assert_array_equal(again, plain)


# --- which voids, and where to -------------------------------------------------------------------


@every_engine
@pytest.mark.parametrize("dtype", ["int16", "float32"])
def test_selection(engine, dtype):
    truth = fractal((60, 60)).astype(dtype)
    edge, small, large = (
        holed((60, 60), box) for box in ((0, 3, 10, 12), (20, 22, 20, 23), (40, 50, 30, 44))
    )
    values = np.where(edge | small | large, np.asarray(-5, dtype), truth)
    every = fill_voids(values, edge | small | large, **ENGINES[engine])
    cases = {
        (): edge | small | large,
        (("interior_only", True),): small | large,
        (("max_size", 6),): edge | small,
        (("max_size", 5),): holed((60, 60)),
        (("interior_only", True), ("max_size", 6)): small,
    }
    for options, wanted in cases.items():
        filled = fill_voids(values, edge | small | large, **ENGINES[engine], **dict(options))
        np.testing.assert_array_equal(filled.values, np.where(wanted, every.values, values))
        np.testing.assert_array_equal(
            filled.source(),
            np.where(wanted | (every.source() == ORIGINAL), every.source(), LEFT),
        )
        np.testing.assert_array_equal(filled.left(), (edge | small | large) & ~wanted)
        assert filled.cells_filled == wanted.sum()


@every_method
@pytest.mark.parametrize("layout", ["C", "fortran", "steps", "reversed"])
@pytest.mark.parametrize("dtype", ["int16", "float32", ">f4", "float64"])
def test_in_place_and_into_another_array(dtype, layout, method):
    truth, void = fractal((40, 50)).astype(dtype), disc((40, 50), (20, 20), 9)
    expected = fill_voids(truth, void, method=method).values
    values = laid_out(truth.copy(), layout)
    assert fill_voids(values, void, method=method, out=values).values is values
    np.testing.assert_array_equal(values, expected)
    target = laid_out(np.zeros_like(truth), layout)
    source = truth.copy()
    assert fill_voids(source, void, method=method, out=target).values is target
    np.testing.assert_array_equal(target, expected)
    np.testing.assert_array_equal(source, truth)


# --- threads and repetition ----------------------------------------------------------------------


@pytest.mark.parametrize("r_s", [0.0, 0.3])
@pytest.mark.parametrize(("variant", "scheme"), list(itertools.product(VARIANTS, SCHEMES)))
def test_same_bytes_whatever_the_threads(variant, scheme, r_s):
    rng = np.random.default_rng(1)
    truth = fractal((300, 310)).astype(np.float32)
    void = (rng.random(truth.shape) < 0.1) | disc(truth.shape, (150, 150), 60)
    options = dict(method="mcmd", variant=variant, scheme=scheme, r_s=r_s, seed=5)
    fills = {
        fill_voids(truth, void, threads=threads, **options).values.tobytes()
        for threads in (1, 2, 5, None, 1)
    }
    assert len(fills) == 1


def test_wide_levels_are_cut_into_blocks_without_a_trace(monkeypatch):
    """A lattice large enough for several blocks a level, one thread and four."""
    truth = fractal((1300, 1300)).astype(np.float32)
    void = np.random.default_rng(0).random(truth.shape) < 0.5
    for variant in ("weighted", "paper"):
        one, four = (
            fill_voids(truth, void, variant=variant, threads=threads).values for threads in (1, 4)
        )
        np.testing.assert_array_equal(one, four)


def test_same_bytes_whatever_the_threads_learned_or_not():
    truth = fractal((200, 210)).astype(np.float32)
    void = (np.random.default_rng(1).random(truth.shape) < 0.03) | disc(truth.shape, (90, 90), 20)
    one, *others = (fill_voids(truth, void, threads=threads) for threads in (1, 2, 5))
    for other in others:
        assert other.values.tobytes() == one.values.tobytes()
        assert other.sigma.tobytes() == one.sigma.tobytes()
        np.testing.assert_array_equal(other.choices.error, one.choices.error)


@every_method
def test_calls_from_many_threads(method):
    truth, void = fractal((80, 80)), disc((80, 80), (40, 40), 20)
    expected = fill_voids(truth, void, method=method).values
    results = [None] * 4

    def work(n):
        results[n] = fill_voids(truth, void, method=method, threads=2).values

    workers = [threading.Thread(target=work, args=(n,)) for n in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    for result in results:
        np.testing.assert_array_equal(result, expected)
