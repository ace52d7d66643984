"""What void cells hold is kept, and no other cell becomes void."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from demsmith.core.errors import InputError
from demsmith.core.raster import BandMeta
from demsmith.core.sct.marks import Marks, marks_of, packed_classes, unpacked_classes

NAN = np.nan


def of(values, void, nodata=None):
    values = np.asarray(values)
    meta = BandMeta(dtype=values.dtype, nodata=nodata)
    return marks_of(values, np.asarray(void, bool), meta)


def test_without_voids_there_is_nothing_to_keep():
    marks, notes = of(np.arange(256, dtype=np.uint8).reshape(16, 16), np.zeros((16, 16)))
    assert (marks.values.size, marks.nodata, notes) == (0, None, [])


@pytest.mark.parametrize(
    ("values", "nodata", "kept", "tag"),
    [
        (np.int16([[-9999, 5]]), -9999, [-9999], -9999),
        (np.int16([[-32768, 5]]), None, [-32768], None),
        (np.float32([[NAN, 5]]), None, [NAN], None),
        (np.float32([[NAN, 5]]), -9999, [NAN], -9999),
        (np.float32([[-3.4028235e38, 5]]), -9999, [np.float32(-3.4028235e38)], -9999),
        (np.float32([[7, 5]]), None, [NAN], NAN),  # void by an option: a tag is chosen
        (np.int16([[7, 5]]), None, [-32768], -32768),
        (np.int16([[7, 5]]), -9999, [-9999], -9999),
        (np.uint8([[7, 5]]), None, [255], 255),
    ],
)
def test_marks(values, nodata, kept, tag):
    marks, _ = of(values, [[True, False]], nodata)
    np.testing.assert_array_equal(marks.values, np.array(kept, values.dtype))
    np.testing.assert_equal(marks.nodata, tag)


def test_a_void_by_an_option_is_told():
    _, notes = of(np.int16([[7, 5]]), [[True, False]], -9999)
    assert notes == [
        "1 cells are voids by a mask or an option, or hold one of many huge numbers; they get the "
        "value -9999"
    ]


def test_no_value_left():
    values = np.arange(256, dtype=np.uint8).reshape(16, 16)
    void = np.zeros(values.shape, bool)
    void[3, 3] = True
    with pytest.raises(InputError, match="uint8 has no value left"):
        of(values, void)


def test_several_kinds_of_voids_keep_theirs():
    values = np.float32([[NAN, -9999, 5, NAN], [1e38, -np.inf, 7, NAN]])
    void = ~np.isfinite(values) | (values == -9999) | (values > 1e30)
    marks, notes = of(values, void, -9999)
    assert marks.values.size == 4
    assert "4 different values" in notes[0]
    classes = marks.classes(values, np.where(void, 0, values), void)
    decoded = np.where(void, np.float32(0), values)
    marks.apply(decoded, void, classes)
    np.testing.assert_array_equal(decoded, values)


@given(
    hnp.arrays(np.int16, (4, 6), elements=st.integers(-6, 6)),
    hnp.arrays(np.int16, (4, 6), elements=st.integers(-3, 3)),
    st.sampled_from([0, 2, -32768]),
)
def test_no_value_falls_on_the_tag_and_errors_do_not_grow(values, errors, tag):
    void = values == tag
    if void.all():
        return
    marks = Marks(np.array([tag], np.int16), np.int16(tag))
    decoded = values + errors
    classes = marks.classes(values, decoded, void)
    result = decoded.copy()
    marks.apply(result, void, classes)
    np.testing.assert_array_equal(result == tag, void)
    before = np.abs(decoded.astype(int) - values)
    after = np.abs(result.astype(int) - values)
    assert (after <= np.maximum(before, 0))[~void].all()


def test_sentinels_are_marks_too():
    marks = Marks(np.array([], np.int16))
    values = np.int16([[-32768, -32767, -32766]])
    marks.apply(values, np.zeros(values.shape, bool))
    assert values.tolist() == [[-32766, -32766, -32766]]


def test_floats_move_by_a_digit():
    marks = Marks(np.array([0], np.float32), np.float32(0))
    values = np.float32([[0, 0]])
    marks.apply(values, np.zeros(values.shape, bool), np.uint8([[0, 255]]))
    assert 0 < values[0, 0] < 1e-40
    assert -1e-40 < values[0, 1] < 0


def test_marks_at_the_ends_of_a_type():
    for mark, other in ((0, 1), (255, 254)):
        marks = Marks(np.array([mark], np.uint8), np.uint8(mark))
        values = np.uint8([[mark]])
        marks.apply(values, np.zeros((1, 1), bool), np.uint8([[255]]))
        assert values[0, 0] == other


def test_classes_of_a_tile_come_back():
    classes = np.random.default_rng(0).integers(0, 3, (7, 9)).astype(np.uint8)
    np.testing.assert_array_equal(unpacked_classes(packed_classes(classes), (7, 9)), classes)
    assert packed_classes(np.zeros((7, 9), np.uint8)) == b""
    assert not unpacked_classes(b"", (7, 9)).any()
    for data, shape in ((packed_classes(classes), (7, 8)), (packed_classes(classes)[:-3], (7, 9)),
                        (b"x" * 20, (7, 9))):  # fmt: skip
        with pytest.raises(InputError):
            unpacked_classes(data, shape)


def test_a_class_beyond_the_marks_is_no_crash():
    marks = Marks(np.array([5, 6], np.int16))
    values = np.zeros((1, 2), np.int16)
    marks.apply(values, np.ones((1, 2), bool), np.uint8([[1, 200]]))
    assert values.tolist() == [[6, 6]]
