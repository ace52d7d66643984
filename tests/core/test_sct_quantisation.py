"""Values as whole numbers of a unit: whatever the numbers are wrong by, the bound holds."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from demsmith.core.errors import InputError
from demsmith.core.sct.quantisation import MOST_UNITS, quantised, quantised_finely


def worst(values, max_error):
    """Give the largest error when every number is off by all that is allowed, both ways."""
    void = np.zeros(values.shape, bool)
    quantisation, error = quantised(values, void, max_error)
    units = quantisation.units(values, void)
    off = [units - error, units + error, units]
    decoded = [quantisation.values(each.astype(np.int32)) for each in off]
    return max(np.abs(each.astype(np.float64) - values).max() for each in decoded), error


def floats(dtype, width, low=-9000, high=9000):
    return hnp.arrays(dtype, (3, 5), elements=st.floats(low, high, width=width))


@settings(max_examples=200)
@given(floats(np.float32, 32), st.floats(1e-2, 1e4))
def test_the_bound_holds_for_float32(values, max_error):
    assert worst(values, max_error)[0] <= max_error


@settings(max_examples=200)
@given(floats(np.float64, 64), st.floats(1e-4, 1e4))
def test_the_bound_holds_for_float64(values, max_error):
    assert worst(values, max_error)[0] <= max_error


@settings(max_examples=100)
@given(
    st.sampled_from([np.uint8, np.int8, np.uint16, np.int16, np.uint32, np.int64]).flatmap(
        lambda kind: hnp.arrays(kind, (3, 5), elements=st.integers(0, 100))
    ),
    st.floats(0, 300),
)
def test_the_bound_holds_for_integers(values, max_error):
    largest, error = worst(values, max_error)
    assert largest <= max_error
    assert error == min(np.floor(max_error), int(values.max()) - int(values.min()))


@pytest.mark.parametrize("divisor", [1, 10, 100, 1000])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_decimals_are_kept_exactly(dtype, divisor):
    whole = np.random.default_rng(1).integers(-900, 9000, (40, 50))
    whole[0, 0] += 1 - whole[0, 0] % 10  # no multiple of a coarser step
    values = (whole / divisor).astype(dtype)
    void = np.zeros(values.shape, bool)
    quantisation, error = quantised(values, void, 0)
    assert (quantisation.divisor, error) == (divisor, 0)
    np.testing.assert_array_equal(
        quantisation.values(quantisation.units(values, void)), values, strict=True
    )


def test_whole_floats_use_the_whole_bound():
    values = np.arange(100, dtype=np.float32).reshape(10, 10)
    quantisation, error = quantised(values, np.zeros(values.shape, bool), 1)
    assert (quantisation.unit / quantisation.divisor, error) == (1, 1)
    assert worst(values, 1)[0] == 1


def test_other_floats_use_nearly_all_of_the_bound():
    values = np.random.default_rng(2).normal(500, 100, (50, 50)).astype(np.float32)
    quantisation, error = quantised(values, np.zeros(values.shape, bool), 2)
    assert 3.999 < (2 * error + 1) * quantisation.unit / quantisation.divisor <= 4


def test_voids_do_not_count():
    values = np.array([[1e30, 5.5, np.nan, -np.inf]], np.float32)
    void = np.array([[True, False, True, True]])
    quantisation, _ = quantised(values, void, 0)
    assert quantisation.divisor == 10
    np.testing.assert_array_equal(quantisation.units(values, void), 0)


def test_one_value():
    for value in (0, 7, -1234.5678):
        for dtype in (np.float32, np.float64):
            assert worst(np.full((2, 2), value, dtype), 0.01)[0] <= 0.01
        quantisation = quantised_finely(np.full((2, 2), value, np.float32), np.zeros((2, 2), bool))
        units = quantisation.units(np.full((2, 2), value, np.float32), np.zeros((2, 2), bool))
        assert np.abs(quantisation.values(units) - value).max() <= 1e-6 * abs(value)


def test_fine_units_are_no_loss_beside_a_base():
    values = np.random.default_rng(3).normal(500, 100, (50, 50)).astype(np.float32)
    void = np.zeros(values.shape, bool)
    quantisation = quantised_finely(values, void)
    error = quantisation.values(quantisation.units(values, void)) - values.astype(np.float64)
    assert np.sqrt(np.mean(error**2)) < 1e-6 * np.ptp(values)
    whole = np.rint(values)
    assert quantised_finely(whole, void).unit == 1
    assert quantised_finely(whole.astype(np.int16), void).unit == 1


@pytest.mark.parametrize(
    ("values", "max_error", "said"),
    [
        (np.float32([[0.1234567, 9000.11]]), 0, "maximum error of 0 is possible: allow"),
        (np.float32([[0.1234567, 9000.11]]), 1e-5, "own last digits: allow at least"),
        (np.int64([[0, 1 << 40]]), 1, "too far for a maximum error of 1: allow at least"),
        (np.float64([[0, 1e12]]), 0.01, "too far"),
    ],
)
def test_what_cannot_be_is_refused(values, max_error, said):
    with pytest.raises(InputError, match=said):
        quantised(values, np.zeros(values.shape, bool), max_error)


def test_the_error_that_a_refusal_names_is_possible():
    for values, max_error in (
        (np.float32([[0.1234567, 9000.11]]), 0),
        (np.float32([[0.1234567, 9000.11]]), 1e-5),
        (np.float32([[0.1234567, 9e8]]), 0),
    ):
        with pytest.raises(InputError) as refusal:
            quantised(values, np.zeros(values.shape, bool), max_error)
        words = str(refusal.value).split()
        quantised(values, np.zeros(values.shape, bool), float(words[-1]))


def test_decoded_numbers_never_leave_the_type():
    values = np.array([[0, 250]], np.uint8)
    quantisation, _ = quantised(values, np.zeros(values.shape, bool), 100)
    numbers = np.array([[-100, 350]], np.int32)
    np.testing.assert_array_equal(quantisation.values(numbers), [[0, 255]])
    most = np.array([[-MOST_UNITS, MOST_UNITS]], np.int32)
    assert quantisation.values(most).tolist() == [[0, 255]]
