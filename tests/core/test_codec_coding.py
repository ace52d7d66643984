"""Coded rasters: the error's bound, windows, voids, determinism, hostile params."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from demsmith.core.codec import CodecOptions, Decoder, encode
from demsmith.core.errors import Cancelled, InputError

QUICK = dict(effort="low", tile=64)


def _terrain(shape=(150, 210), seed=0, noise=2.0):
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    waves = 300 * np.sin(rows / 41) * np.cos(columns / 57) + 800
    return (waves + np.random.default_rng(seed).normal(0, noise, shape)).astype(np.int32)


def _voids(shape, seed=3):
    void = np.random.default_rng(seed).random(shape) < 0.02
    void[10:40, 20:90] = True
    return void


def _decoded(encoded, **options):
    decoder = Decoder(encoded.params, encoded.part, **options)
    return decoder.window(0, decoder.shape[0], 0, decoder.shape[1])


def _size(encoded):
    return sum(len(part) for parts in encoded.sections.values() for part in parts)


@pytest.mark.parametrize("error", [0, 1, 5, 40])
@pytest.mark.parametrize("with_voids", [False, True])
def test_no_cell_is_wrong_by_more_than_the_error(error, with_voids):
    values = _terrain()
    void = _voids(values.shape) if with_voids else np.zeros(values.shape, bool)
    values[void] = -32768
    encoded = encode(values, void, options=CodecOptions(max_error=error, **QUICK))
    decoded, unknown = _decoded(encoded)
    assert np.array_equal(unknown, void)
    assert np.abs(decoded - values)[~void].max() <= error
    if error:  # and the bound is made use of
        assert np.abs(decoded - values)[~void].max() > error // 2


@given(
    arrays.arrays(
        np.int32, arrays.array_shapes(min_dims=2, max_dims=2, max_side=70),
        elements=st.integers(-(2**30), 2**30),
    ),
    st.sampled_from([0, 1, 1000, 2**29]),
)  # fmt: skip
@settings(max_examples=40, deadline=None)
def test_any_numbers_are_kept_within_the_error(values, error):
    void = np.zeros(values.shape, bool)
    encoded = encode(values, void, options=CodecOptions(max_error=error, **QUICK))
    decoded, _ = _decoded(encoded)
    assert np.abs(decoded.astype(np.int64) - values).max() <= error


def test_windows_are_cut_from_the_whole():
    values, void = _terrain(), _voids((150, 210))
    for options in (dict(max_error=3), dict(rmse=2.0)):
        encoded = encode(values, void, options=CodecOptions(**options, **QUICK))
        whole, unknown = _decoded(encoded)
        decoder = Decoder(encoded.params, encoded.part)
        for row0, row1, col0, col1 in ((0, 1, 0, 1), (60, 70, 60, 140), (149, 150, 0, 210)):
            part, part_void = decoder.window(row0, row1, col0, col1)
            assert np.array_equal(part, whole[row0:row1, col0:col1])
            assert np.array_equal(part_void, unknown[row0:row1, col0:col1])


def test_encoding_leaves_the_values_alone():
    values = _terrain((64, 60))  # a single tile: its cells are no copy by themselves
    before = values.copy()
    encode(values, np.zeros(values.shape, bool), options=CodecOptions(max_error=9, **QUICK))
    assert np.array_equal(values, before)


def test_same_bytes_for_any_number_of_threads():
    values, void = _terrain(), _voids((150, 210))
    options = CodecOptions(max_error=4, tile=64)
    one, three = (encode(values, void, options=options, threads=n) for n in (1, 3))
    assert one.params == three.params and one.sections == three.sections
    assert np.array_equal(_decoded(one, threads=1)[0], _decoded(one, threads=3)[0])


def test_larger_errors_make_smaller_files_and_noise_sets_the_price():
    void = np.zeros((150, 210), bool)
    sizes = [
        _size(encode(_terrain(), void, options=CodecOptions(max_error=error, **QUICK)))
        for error in (0, 1, 2, 5, 20)
    ]
    assert sizes == sorted(sizes, reverse=True) and sizes[-1] < sizes[0] / 6
    # Entropy of the noise, which no prediction avoids, and not much more.
    bits = np.log2(2 * np.sqrt(2 * np.pi * np.e))
    assert bits * void.size / 8 < sizes[0] < 1.15 * bits * void.size / 8


def test_prediction_stays_around_the_tree_and_does_not_add_up():
    # A ramp without noise: each cell follows from its neighbours.
    rows, columns = np.mgrid[:256, :256]
    values = (3 * rows + 5 * columns).astype(np.int32)
    encoded = encode(values, np.zeros(values.shape, bool), options=CodecOptions(max_error=0))
    assert _size(encoded) < 900
    assert np.array_equal(_decoded(encoded)[0], values)


def test_the_sea_stays_flat_and_costs_nothing():
    values = np.maximum(_terrain((256, 256)) - 800, 0)
    void = np.zeros(values.shape, bool)
    encoded = encode(values, void, options=CodecOptions(max_error=2))
    decoded, _ = _decoded(encoded)
    sea = values == 0
    inner = (
        sea & np.roll(sea, 8, 0) & np.roll(sea, -8, 0) & np.roll(sea, 8, 1) & np.roll(sea, -8, 1)
    )
    assert inner.sum() > 5000
    assert np.mean(decoded[inner] == 0) > 0.97
    flat = encode(np.zeros((512, 512), np.int32) + 7, np.zeros((512, 512), bool),
                  options=CodecOptions(max_error=0))  # fmt: skip
    assert _size(flat) < 500


@pytest.mark.parametrize("rmse", [0.8, 5.0])
def test_a_tree_alone_has_the_error_asked_for(rmse):
    values, void = _terrain(), np.zeros((150, 210), bool)
    encoded = encode(values, void, options=CodecOptions(rmse=rmse, **QUICK))
    error = _decoded(encoded)[0] - values
    assert 0.8 * rmse < np.sqrt(np.mean(error.astype(float) ** 2)) < rmse + 0.3
    assert "residual" not in encoded.sections


def test_a_tree_alone_has_the_size_asked_for():
    values, void = _terrain(), np.zeros((150, 210), bool)
    size = _size(encode(values, void, options=CodecOptions(bytes=1500, **QUICK)))
    assert 1450 < size <= 1500
    with pytest.raises(InputError, match="no tree is as small"):
        encode(values, void, options=CodecOptions(bytes=1, **QUICK))


def test_surface_and_overviews_without_the_residual():
    values, void = _terrain((256, 256)), np.zeros((256, 256), bool)
    encoded = encode(values, void, options=CodecOptions(max_error=8, **QUICK))
    without = {name: parts for name, parts in encoded.sections.items() if name != "residual"}
    decoder = Decoder(encoded.params, lambda name, index: without[name][index])
    assert np.sqrt(np.mean((decoder.surface(0, 256, 0, 256) - values) ** 2)) < 20
    overview = decoder.surface(0, 32, 0, 32, level=3)
    means = values.reshape(32, 8, 32, 8).mean(axis=(1, 3))
    assert np.sqrt(np.mean((overview - means) ** 2)) < 15


def test_nothing_known_and_cancelled():
    values = _terrain()
    with pytest.raises(InputError, match="every cell is void"):
        encode(values, np.ones(values.shape, bool), options=CodecOptions(max_error=1))

    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    void = np.zeros(values.shape, bool)
    with pytest.raises(Cancelled):
        encode(values, void, options=CodecOptions(max_error=1), progress=Stop())
    encoded = encode(values, void, options=CodecOptions(max_error=1, **QUICK))
    with pytest.raises(Cancelled):
        Decoder(encoded.params, encoded.part).window(0, 9, 0, 9, progress=Stop())


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rows", 0), ("rows", "150"), ("columns", 2**60), ("tile", 31), ("tile", 40),
        ("offset", 2**40), ("error", -2), ("tree", "oak"), ("step", float("nan")), ("step", 0.0),
        ("levels", 99), ("weights", b""), ("weights", b"\xff" * 46), ("voids", 7), ("rows", True),
        ("plain", 2**40),
    ],
)  # fmt: skip
def test_params_that_cannot_be_are_refused(name, value):
    values = _terrain((64, 64))
    encoded = encode(values, np.zeros((64, 64), bool), options=CodecOptions(max_error=1, **QUICK))
    with pytest.raises(InputError, match="damaged file"):
        Decoder(encoded.params | {name: value}, encoded.part)


def test_wild_values_leave_the_prediction_within_bounds():
    """Jumps of all that an int32 holds, among level ground: weights that learn would burst."""
    rng = np.random.default_rng(2)
    values = rng.choice([-(2**30), 0, 1, 2**30], (64, 64), p=[0.02, 0.48, 0.48, 0.02])
    values = values.astype(np.int32)
    encoded = encode(values, np.zeros((64, 64), bool), options=CodecOptions(max_error=0, **QUICK))
    assert np.array_equal(_decoded(encoded)[0], values)


def test_damaged_parts_decode_to_something_within_bounds():
    values, void = _terrain((130, 130)), _voids((130, 130))
    encoded = encode(values, void, options=CodecOptions(max_error=6, **QUICK))
    rng = np.random.default_rng(5)
    for _ in range(20):
        broken = {
            name: [rng.integers(0, 256, len(part) // 2, dtype=np.uint8).tobytes() for part in parts]
            for name, parts in encoded.sections.items()
        }
        decoder = Decoder(encoded.params, lambda name, index, parts=broken: parts[name][index])
        decoded, _ = decoder.window(0, 130, 0, 130)
        assert decoded.shape == (130, 130)
