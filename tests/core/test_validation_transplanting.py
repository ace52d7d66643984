"""Void shapes: cut out of a raster, and laid onto known ground."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import disc, fractal, holed, plane
from support import shared_data

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.progress import Span
from demsmith.core.validation import (
    SIZE_CLASSES,
    VoidShape,
    single_holes,
    transplant_voids,
    void_shapes,
)
from demsmith.core.validation.slope import slopes
from demsmith.core.voids import find_voids


class Recorder:
    """A progress that remembers, and stops at ``stop``."""

    def __init__(self, stop=2.0):
        self.stop, self.seen = stop, [0.0]

    def report(self, fraction):
        self.seen.append(fraction)

    def cancelled(self):
        return self.seen[-1] >= self.stop


def outlines(void):
    """The shapes of a mask's voids, each in the least of its eight turns, as comparable bytes."""
    shapes = [shape.cells for shape in void_shapes(np.pad(void, 1))]
    return sorted(
        min(_key(VoidShape(cells).turned(turn).cells) for turn in range(8)) for cells in shapes
    )


def _key(cells):
    return cells.shape, np.packbits(cells).tobytes()


def hilly(rows=300, columns=300, seed=1):
    """Ground that is flat in the west and steep in the east."""
    return fractal((rows, columns), seed=seed, relief=3000) * np.linspace(0.02, 1, columns)


def l_shape():
    return VoidShape(np.array([[1, 1, 1, 1, 1], [1, 0, 0, 0, 0], [1, 0, 0, 0, 0]], bool))


# --- cutting out ---------------------------------------------------------------------------------


def test_shapes_are_those_of_the_voids_inside():
    void = holed((40, 60), (5, 9, 10, 12), (20, 21, 30, 37), (0, 4, 50, 55))
    void[9, 10] = True
    hook, line = void_shapes(void)
    np.testing.assert_array_equal(hook.cells, [[1, 1]] * 4 + [[1, 0]])
    assert (line.cells.shape, line.size) == ((1, 7), 7)
    assert np.isnan([hook.slope, line.slope]).all()


def test_a_ring_keeps_its_island():
    void = holed((20, 20), (5, 10, 5, 10)) & ~holed((20, 20), (6, 9, 6, 9))
    (ring,) = void_shapes(void)
    assert ring.size == 16
    assert not ring.cells[1:4, 1:4].any()


def test_the_slope_around_a_void_on_a_plane_is_the_plane_s_in_ground_units():
    ground = plane((60, 60), slope=(30.0, 80.0))
    void = disc((60, 60), (30, 30), 8)
    rubbish = np.where(void, -32768, ground)
    dx, dy = np.linspace(50, 70, 60), np.full(60, 90.0)
    (shape,) = void_shapes(void, rubbish, pixel_size=(dx, dy))
    expected = np.hypot(80 / dx[18:43], 30 / 90)
    assert expected.min() < shape.slope < expected.max()
    assert void_shapes(void, rubbish)[0].slope == pytest.approx(np.hypot(30, 80))


def test_a_raster_without_voids_has_no_shapes():
    assert void_shapes(np.zeros((9, 9), bool)) == ()
    assert void_shapes(np.ones((9, 9), bool)) == ()


# --- laying --------------------------------------------------------------------------------------


def test_transplanted_shapes_are_the_shapes():
    shapes = (l_shape(), VoidShape(disc((9, 9), (4, 4), 4)), VoidShape(np.ones((1, 3), bool)))
    void = transplant_voids(hilly(), np.ones((300, 300), bool), shapes, share=0.02)
    known = {_key_of(shape) for shape in shapes}
    assert set(outlines(void)) == known
    assert void.mean() == pytest.approx(0.02, rel=0.02)


def _key_of(shape):
    return min(_key(shape.turned(turn).cells) for turn in range(8))


def test_unturned_shapes_stand_as_they_stood():
    void = transplant_voids(
        hilly(), np.ones((300, 300), bool), [l_shape()], count=8, share=0.1, turned=False
    )
    assert [len(find_voids(void)), void.sum()] == [8, 8 * 7]
    for shape in void_shapes(void):
        np.testing.assert_array_equal(shape.cells, l_shape().cells)
    turned = transplant_voids(hilly(), np.ones((300, 300), bool), [l_shape()], count=30, share=0.1)
    assert len({_key(shape.cells) for shape in void_shapes(turned)}) == 8


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 1000), share=st.floats(0.01, 0.3))
def test_holes_lie_on_known_ground_and_touch_nothing(seed, share):
    known = ~holed((120, 140), (30, 60, 20, 40), (0, 5, 100, 140), (90, 91, 90, 91))
    shapes = (l_shape(), VoidShape(disc((11, 11), (5, 5), 5)), VoidShape(np.ones((1, 1), bool)))
    void = transplant_voids(hilly(120, 140), known, shapes, share=share, seed=seed)
    assert void.any() and not void[~known].any()
    assert not void[[0, 1, -1, -2]].any() and not void[:, [0, 1, -1, -2]].any()
    from scipy.ndimage import label, maximum_filter

    far = maximum_filter(~known, 5)
    assert not (void & far).any()  # two known cells beside real voids,
    pieces, count = label(void, np.ones((3, 3)))
    for piece in range(1, count + 1):  # and beside each other
        assert set(np.unique(pieces[maximum_filter(pieces == piece, 5)])) <= {0, piece}


def test_the_same_seed_gives_the_same_holes():
    ground, known = hilly(), np.ones((300, 300), bool)
    shapes = void_shapes(disc((60, 60), (30, 30), 6), plane((60, 60)))
    first, again, other = (transplant_voids(ground, known, shapes, seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


@pytest.mark.parametrize("quantile", [0.1, 0.5, 0.9])
def test_holes_lie_where_the_ground_is_as_steep_as_around_the_real_voids(quantile):
    """Far nearer to the wanted slope than places taken at random are."""
    ground, known = hilly(), np.ones((300, 300), bool)
    slope = float(np.quantile(slopes(ground, known), quantile))
    cells = disc((9, 9), (4, 4), 3)
    matched = transplant_voids(ground, known, [VoidShape(cells, slope)], count=20)
    random = transplant_voids(ground, known, [VoidShape(cells)], count=20)

    def apart(void):
        return np.mean([abs(shape.slope - slope) for shape in void_shapes(void, ground)])

    assert apart(matched) < 0.2 * apart(random)


def test_level_ground_is_left_alone_where_shapes_lay_on_slopes():
    ground = np.where(np.arange(200) < 150, 0.0, 10.0 * (np.arange(200) - 150))
    ground = np.broadcast_to(ground, (200, 200))
    void = transplant_voids(ground, np.ones((200, 200), bool), [VoidShape(l_shape().cells, 10.0)])
    assert void[:, 150:].mean() > 0.03
    assert not void[:, :145].any()
    level = transplant_voids(0 * ground, np.ones((200, 200), bool), [l_shape()])
    assert level.mean() > 0.04


def test_every_size_class_has_its_holes():
    sizes = (3, 8, 18, 40)
    shapes = [VoidShape(np.ones((1, 2), bool))] * 500
    shapes += [VoidShape(disc((2 * r + 1,) * 2, (r, r), r)) for r in sizes]
    void = transplant_voids(hilly(1000, 1000), np.ones((1000, 1000), bool), shapes, share=0.1)
    cells = find_voids(void).cells
    counts = [((cells >= low) & (cells <= (high or np.inf))).sum() for low, high in SIZE_CLASSES]
    assert min(counts) >= 15
    assert sum(counts) == len(cells)


def test_count_limits_the_holes_and_shares_them_among_the_sizes():
    shapes = [VoidShape(np.ones((1, 2), bool))] * 50 + [VoidShape(np.ones((5, 5), bool))]
    void = transplant_voids(hilly(), np.ones((300, 300), bool), shapes, count=12)
    cells = find_voids(void).cells
    assert len(cells) == 12
    assert (cells == 25).sum() >= 3


def test_shapes_without_a_place_are_left_out():
    known = np.ones((30, 30), bool)
    shapes = [VoidShape(np.ones((29, 29), bool)), VoidShape(np.ones((40, 2), bool))]
    assert not transplant_voids(np.zeros((30, 30)), known, shapes, share=0.99).any()
    assert not transplant_voids(np.zeros((1, 1)), known[:1, :1], shapes, share=0.99).any()


def test_bad_input_is_refused():
    ground, known = np.zeros((9, 9)), np.ones((9, 9), bool)
    with pytest.raises(InputError, match="no void whose shape"):
        transplant_voids(ground, known, ())
    for share in (0, 1, -1):
        with pytest.raises(InputError, match="share is"):
            transplant_voids(ground, known, [l_shape()], share=share)


def test_progress_rises_and_cancel_stops():
    ground, known, progress = hilly(), np.ones((300, 300), bool), Recorder()
    transplant_voids(ground, known, [l_shape()], progress=Span(progress, 0, 1))
    assert progress.seen == sorted(progress.seen) and progress.seen[-1] == 1
    with pytest.raises(Cancelled):
        transplant_voids(ground, known, [l_shape()], progress=Recorder(stop=0.5))


def test_real_voids_onto_another_tile():
    """The Pyrenees' voids on the Sierra Nevada: their shapes, and on ground as steep."""
    source = raster.read(shared_data("pyrenees_raw/N42E001.hgt"))
    target = raster.read(shared_data("sierra_nevada/N37W004.hgt"))
    shapes = void_shapes(source.void, source.values, pixel_size=source.grid.pixel_size_m())
    size = target.grid.pixel_size_m()
    void = transplant_voids(target.values, ~target.void, shapes, pixel_size=size)
    assert void.mean() == pytest.approx(0.05, abs=0.002)
    cells = find_voids(void).cells
    for low, high in SIZE_CLASSES:
        assert ((cells >= low) & (cells <= (high or np.inf))).sum() >= 20
    around = np.mean([each.slope for each in void_shapes(void, target.values, pixel_size=size)])
    everywhere = np.nanmean(slopes(target.values, ~target.void, pixel_size=size))
    assert around > 1.8 * everywhere


# --- single holes --------------------------------------------------------------------------------


def test_single_holes_have_the_sizes_asked_for_and_are_compact():
    void = single_holes(np.ones((500, 500), bool), cells=(30, 900, 5000), count=3, seed=2)
    voids = find_voids(void)
    assert sorted(voids.cells) == [30] * 3 + [900] * 3 + [5000] * 3
    for shape in void_shapes(void):
        assert max(shape.cells.shape) < 3 * np.sqrt(shape.size)
    np.testing.assert_array_equal(
        single_holes(np.ones((500, 500), bool), cells=(30, 900, 5000), count=3, seed=2), void
    )
    assert len(set(outlines(void))) == 9


def test_single_holes_keep_to_known_ground():
    known = ~holed((100, 100), (0, 100, 0, 60))
    void = single_holes(known, cells=200, count=2)
    assert void.sum() == 400 and not void[:, :62].any()
    with pytest.raises(InputError, match="at least 1"):
        single_holes(known, cells=0)
