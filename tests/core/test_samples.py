"""From samples to terrain: what becomes of points, lines, cells, sketches and noise."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from demsmith import Grid, Samples, from_samples
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.samples import PRESETS, SampleOptions, to_cells
from demsmith.core.samples.presets import with_preset

GRID = Grid.of_extent((0, 0, 1200, 1600), (10, 20))  # 80 rows, 120 columns
VARIANTS = ("converged", "relaxed", "weighted", "paper")


def centres(grid):
    """x and y of every cell's centre, each of the grid's shape."""
    row, column = np.indices(grid.shape)
    return grid.xy(row, column)


def some_cells(grid, share, *, seed=0):
    """Indices of a random share of the cells."""
    count = int(share * np.prod(grid.shape))
    return np.random.default_rng(seed).permutation(np.prod(grid.shape))[:count]


def points_of(grid, elevations, chosen):
    """(N, 3) points at the centres of the chosen cells."""
    x, y = centres(grid)
    return np.column_stack([each.ravel()[chosen] for each in (x, y, elevations)])


def only(samples, grid=GRID, **options):
    """Rows, columns and elevations of the cells that samples make known."""
    gridded = to_cells(samples, grid, **options)
    row, column = np.nonzero(gridded.known)
    return row.tolist(), column.tolist(), gridded.values[row, column].tolist()


# --- physics -------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", ["converged", "relaxed"])
def test_a_plane_comes_back_in_metres(variant):
    """The cells are twice as high as wide: in cells the plane would be another."""
    x, y = centres(GRID)
    plane = 200 + 0.5 * x - 0.25 * y
    chosen = some_cells(GRID, 0.05)
    made = from_samples(points_of(GRID, plane, chosen), GRID, variant=variant)
    inner = (slice(8, -8), slice(8, -8))
    error = np.sqrt(np.mean((made.values - plane)[inner] ** 2))
    assert error < 0.01 * np.ptp(plane)
    assert made.values.dtype == np.float32
    assert made.cells_known == made.samples == chosen.size


def test_distance_is_of_the_ground():
    """Cells three times as high as wide: the terrain is that of square ones, seen more coarsely."""
    fine, coarse = (Grid.of_extent((0, 0, 1200, 1200), cell) for cell in ((10, 10), (10, 30)))
    x, y = centres(coarse)
    points = points_of(coarse, 300 + 200 * np.sin(x / 150 + y / 250), some_cells(coarse, 0.02))
    expected = from_samples(points, fine).values[1::3]
    right = from_samples(points, coarse).values - expected
    in_cells = Grid.of_extent((0, 0, 120, 40), 1)
    wrong = from_samples(points / [10, 30, 1], in_cells).values - expected
    assert np.square(right).mean() < 0.3 * np.square(wrong).mean()


@pytest.mark.parametrize("variant", VARIANTS)
def test_known_cells_keep_their_elevation(variant):
    x, y = centres(GRID)
    ground = 300 + 100 * np.sin(x / 150) * np.cos(y / 260)
    chosen = some_cells(GRID, 0.1)
    made = from_samples(points_of(GRID, ground, chosen), GRID, variant=variant)
    np.testing.assert_array_equal(
        made.values.ravel()[chosen], ground.ravel()[chosen].astype(np.float32)
    )
    assert set(np.flatnonzero(made.known)) == set(chosen)
    assert np.isfinite(made.values).all()
    assert abs(made.values - ground).max() < 150


def test_one_sample_is_a_flat_country():
    made = from_samples([(5, 5, 70)], GRID)
    np.testing.assert_array_equal(made.values, 70)


# --- points --------------------------------------------------------------------------------------


def test_points_of_one_cell_are_averaged():
    samples = Samples([(11, 1599, 10.0), (19, 1581, 40.0), (15, 1590, 10.0), (55, 5, 7.0)])
    gridded = to_cells(samples, GRID)
    assert only(samples) == ([0, 79], [1, 5], [20.0, 7.0])
    assert (gridded.shared, gridded.deviation) == (1, 20.0)
    (note,) = from_samples(samples, GRID).notes
    assert note.startswith("1 cell holds several points") and "20 m" in note


def test_edges_belong_to_the_outermost_cells():
    corners = [(0, 0, 1), (1200, 0, 2), (0, 1600, 3), (1200, 1600, 4)]
    assert only(Samples(corners)) == ([0, 0, 79, 79], [0, 119, 0, 119], [3, 4, 1, 2])


def test_points_outside_and_unusable_are_counted():
    samples = [
        (5, 5, 1.0), (-1, 5, 2.0), (5, 1601, 3.0), (15, 5, np.nan), (np.inf, 5, 1), (5, 5, 1e31),
    ]  # fmt: skip
    made = from_samples(samples, GRID)
    assert (made.samples, made.samples_outside, made.cells_known) == (1, 2, 1)
    outside, unusable = made.notes
    assert outside.startswith("2 of 6 samples lie outside")
    assert unusable.startswith("3 of 6 samples have no finite")


def test_a_grid_whose_first_row_is_the_southern_one():
    north_up = Grid((4, 5), (0, 10, 0, 40, 0, -10))
    south_up = Grid((4, 5), (0, 10, 0, 0, 0, 10))
    points = [(5, 5, 1.0), (45, 5, 2.0), (25, 35, 9.0)]
    sketch = np.array([[5.0, np.nan], [np.nan, np.nan]])
    a, b = (to_cells(Samples(points), grid, sketch) for grid in (north_up, south_up))
    np.testing.assert_array_equal(a.known, b.known[::-1])
    np.testing.assert_array_equal(a.values, b.values[::-1])
    assert a.known.sum() == 3 + 5 - 1 and a.values[0].tolist() == [5, 5, 9, 0, 0]


# --- lines ---------------------------------------------------------------------------------------


def test_elevation_along_a_line():
    """Two vertices, ten cells apart: the cells between lie on the straight line."""
    rows, columns, z = only(Samples(lines=[[(5, 10, 100), (105, 10, 200)]]))
    assert (rows, columns) == ([79] * 11, list(range(11)))
    np.testing.assert_allclose(z, np.arange(100, 201, 10))


def test_a_steep_line_has_one_cell_in_each_row():
    rows, columns, z = only(Samples(lines=[[(5, 10, 0), (25, 210, 100)]]))
    assert rows == list(range(69, 80))
    assert np.diff(columns).max() <= 0 and set(columns) == {0, 1, 2}
    np.testing.assert_allclose(z, np.arange(100, -1, -10), atol=1e-4)


def test_lines_are_cut_at_the_grids_edge():
    rows, columns, z = only(Samples(lines=[[(-1000, 810, -1000), (3000, 810, 3000)]]))
    assert (rows, columns) == ([39] * 120, list(range(120)))
    np.testing.assert_allclose(z, np.arange(5, 1200, 10), atol=1e-3)
    assert only(Samples(lines=[[(-1e12, 9, 1), (-50, 1e12, 2)]])) == ([], [], [])


def test_a_line_across_the_grid_counts_though_its_vertices_lie_outside():
    across = [(-500, 810, 300), (1700, 830, 300)]
    beyond = [(-500, 5000, 400), (600, 5200, 400), (1700, 5000, 400)]
    for kind in ("lines", "contours"):
        made = from_samples(Samples([(5, 5, 200)], **{kind: [beyond, across]}), GRID)
        assert (made.samples, made.samples_outside) == (3, 3)
        assert made.notes == ("3 of 6 samples lie outside the grid; left out",)


@pytest.mark.parametrize(
    "line", [[(14, 33, 7)], [(14, 33, 7), (14, 33, 7)], [(11, 22, 7), (12, 23, 7)]]
)
def test_a_line_within_a_cell_is_one_sample(line):
    assert only(Samples(lines=[line])) == ([78], [1], [7])


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-5, 25)] * 2), min_size=2, max_size=6))
def test_lines_by_hand(vertices):
    """Every segment, at the centres of the columns or rows along which it runs."""
    vertices = np.array(vertices)
    expected = set()
    for (x0, y0), (x1, y1) in itertools.pairwise(vertices):
        flat = abs(x1 - x0) >= abs(y1 - y0)
        a, b, c, d = (x0, x1, y0, y1) if flat else (y0, y1, x0, x1)
        for cell in range(20):
            if min(a, b) <= cell + 0.5 <= max(a, b):
                t = (cell + 0.5 - a) / (b - a) if a != b else 0.0
                beside = int(np.floor(c + t * (d - c)))
                if 0 <= beside < 20:
                    expected.add((beside, cell) if flat else (cell, beside))
    gridded = to_cells(
        Samples(lines=[np.column_stack([vertices, np.full(len(vertices), 3.0)])]), Grid((20, 20))
    )
    found = set(zip(*map(list, np.nonzero(gridded.known)), strict=True))
    assert found == expected or (not expected and len(found) <= 1)
    np.testing.assert_allclose(gridded.values[gridded.known], 3.0)


def test_a_ridge_stands_out():
    ridge = [(100, 800, 500), (1100, 800, 700)]
    frame = [(0, 0, 0), (1199, 0, 0), (1199, 1599, 0), (0, 1599, 0), (0, 0, 0)]
    made = from_samples(Samples(lines=[ridge, frame]), GRID)
    assert made.values[40, 20:100].min() > made.values[20, 20:100].max()
    assert np.all(np.diff(made.values[40, 20:100]) > 0)


# --- precedence ----------------------------------------------------------------------------------


def test_who_is_believed():
    """Points before cells before lines before contours before the sketch."""

    def line(x, z):
        return [(0, 10, z), (x, 10, z)]

    cells = np.full(GRID.shape, np.nan)
    cells[79, :20] = 3
    samples = Samples(
        points=[(5, 5, 4)], lines=[line(400, 2)], contours=[line(800, 1)], cells=cells
    )
    made = from_samples(samples, GRID, sketch=np.full((8, 12), 0.5))
    assert made.values[79, [0, 10, 30, 60, 110]].tolist() == [4, 3, 2, 1, 0.5]
    assert made.known.all()


# --- cells ---------------------------------------------------------------------------------------


def test_cells_of_the_grid_itself():
    grid = Grid((9, 9))
    cells = np.ma.masked_less(np.add.outer(np.arange(9), np.arange(9)) % 5 * 10 - 10, 0)
    made = from_samples(Samples(cells=cells), grid)
    np.testing.assert_array_equal(made.known, ~cells.mask)
    np.testing.assert_array_equal(made.values[made.known], cells.compressed())
    assert made.samples == made.cells_known == cells.count()


@pytest.mark.parametrize(
    ("dtype", "kept"),
    [("int16", "float32"), ("float32", "float32"), ("int32", "float64"), ("float64", "float64")],
)
def test_cells_keep_their_digits(dtype, kept):
    cells = np.ma.masked_array(np.full((5, 5), 20_000_001, dtype="int64"), np.eye(5, dtype=bool))
    cells = (cells // (1 if dtype in ("int32", "float64") else 1000)).astype(dtype)
    made = from_samples(Samples(cells=cells), Grid((5, 5)))
    assert made.values.dtype == kept
    np.testing.assert_array_equal(made.values[~cells.mask], cells.compressed())


def test_elevations_are_taken_away():
    line = [(0, 10, 1), (50, 10, 2), (90, 10, 3)]
    samples = Samples([(1, 2, 3), (4, 5, 6)], [line], [line[:1]], [[7.0]])
    left = samples.without(np.array([True, False, False, True, False, True]))
    np.testing.assert_array_equal(left.points[:, 2], [np.nan, 6])
    np.testing.assert_array_equal(left.lines[0][:, 2], [1, np.nan, 3])
    np.testing.assert_array_equal(left.contours[0][:, 2], [np.nan])
    np.testing.assert_array_equal(left.vertices()[:, :2], samples.vertices()[:, :2])
    assert left.cells == [[7.0]] and samples.points[0, 2] == 3


def test_samples_are_put_together():
    nan = np.nan
    one = Samples([(1, 2, 3)], cells=[[1.0, nan], [nan, nan]])
    two = Samples(lines=[[(0, 0, 0), (1, 1, 1)]], cells=[[9.0, 2.0], [nan, nan]])
    both = one + two
    assert len(both) == 1 + 2 + 2
    np.testing.assert_array_equal(both.cells, [[1, 2], [nan, nan]])
    with pytest.raises(InputError, match="shapes"):
        one + Samples(cells=np.zeros((3, 3)))


# --- sketches ------------------------------------------------------------------------------------


def test_a_sketch_is_stretched_over_the_grid():
    sketch = np.array([[100.0, np.nan], [np.nan, 300.0]])
    made = from_samples(None, GRID, sketch=sketch)
    assert (made.values[:40, :60] == 100).all() and (made.values[40:, 60:] == 300).all()
    assert made.known.sum() == made.known.size // 2
    assert made.samples == 0 and made.cells_known == GRID.shape.rows * GRID.shape.columns // 2
    assert 100 < made.values[20, 90] < 300


def test_sketches_of_no_use():
    with pytest.raises(InputError, match="no cell of the grid is painted"):
        from_samples(None, GRID, sketch=np.full((3, 3), np.nan))
    with pytest.raises(InputError, match=r"shape \(3,\)"):
        from_samples(None, GRID, sketch=np.zeros(3))


# --- presets and noise ---------------------------------------------------------------------------


def test_every_preset_runs_and_differs():
    x, y = centres(GRID)
    points = points_of(GRID, 500 + 200 * np.sin(x / 200) + y / 10, some_cells(GRID, 0.02))
    made = {name: from_samples(points, GRID, preset=name).values for name in ("none", *PRESETS)}
    assert len({values.tobytes() for values in made.values()}) == len(PRESETS) + 1
    for values in made.values():
        assert np.isfinite(values).all()
        column, row = (points[:, 0] // 10).astype(int), 79 - (points[:, 1] // 20).astype(int)
        np.testing.assert_array_equal(values[row, column], points[:, 2].astype(np.float32))


def test_a_preset_is_a_set_of_parameters():
    options = with_preset(SampleOptions(preset="figure-12a"))
    named = (options.variant, options.l, options.l_bu, options.h, options.r_t, options.r_s)
    assert named == ("paper", 1.1, 20, 0.45, 0.2, 1)
    points = [(5, 5, 0), (1195, 1595, 90), (605, 305, 30)]
    by_name = from_samples(points, GRID, preset="figure-12a").values
    by_hand = from_samples(
        points, GRID, variant="paper", l=1.1, l_bu=20, h=0.45, r_t=0.2, r_s=1
    ).values
    np.testing.assert_array_equal(by_name, by_hand)


def test_an_option_of_ones_own_wins_over_the_preset():
    options = with_preset(SampleOptions(preset="figure-11a", l_bu=3, variant="weighted", seed=4))
    assert (options.variant, options.l, options.l_bu, options.r_s) == ("weighted", 1, 3, 0.5)
    assert options.seed == 4
    assert with_preset(options) == options
    with pytest.raises(InputError, match="variant relaxed"):
        from_samples([(5, 5, 5)], GRID, preset="smooth", variant="relaxed")


def test_what_is_given_wins_even_if_it_is_the_default():
    points = [(5, 5, 0), (1195, 1595, 90), (605, 305, 30)]
    smooth = from_samples(points, GRID, preset="figure-12a", r_s=0).values
    by_hand = from_samples(points, GRID, variant="paper", l=1.1, l_bu=20).values
    np.testing.assert_array_equal(smooth, by_hand)
    rough = from_samples(None, GRID, relief=100.0, h=0.5).values
    assert not np.array_equal(rough, from_samples(None, GRID, relief=100.0).values)
    for options in ({"r_s": 0.0}, {"preset": "smooth"}):
        with pytest.raises(InputError, match="no cell is known"):
            from_samples(None, GRID, **options)


def test_curves_are_refused_by_the_name_of_the_variant():
    with pytest.raises(InputError, match="'converged' has no such curve"):
        from_samples([(5, 5, 5), (605, 305, 30)], GRID, l=1.0)


def test_the_median_filter_takes_out_single_cells():
    """Figure 13 ends with a median filter: what stands alone against its neighbours is gone."""
    points = [(5, 5, 0), (1195, 1595, 900), (605, 305, 300), (205, 1305, 100)]
    rough = from_samples(
        points, GRID, variant="paper", l=3, l_bu=7.5, h=0.5, r_t=0.1, r_s=1.3
    ).values
    smooth = from_samples(points, GRID, preset="figure-13")
    changed = rough != smooth.values
    assert not changed[smooth.known].any() and changed.mean() > 0.5
    windows = np.lib.stride_tricks.sliding_window_view(rough, (3, 3))
    expected = np.median(windows, axis=(2, 3))
    free = ~smooth.known[1:-1, 1:-1]
    np.testing.assert_array_equal(smooth.values[1:-1, 1:-1][free], expected[free])


def test_terrain_of_noise_alone():
    grid = Grid.of_extent((0, 0, 3840, 3840), 30)
    made = from_samples(None, grid)
    assert not made.known.any() and made.notes == ()
    assert 300 < np.ptp(made.values) < 3000
    np.testing.assert_allclose(
        np.ptp(from_samples(None, grid, relief=100).values), np.ptp(made.values) / 10, rtol=1e-3
    )
    rough = from_samples(None, grid, h=0.2).values
    assert np.abs(np.diff(rough)).mean() > 2 * np.abs(np.diff(made.values)).mean()


def test_noise_is_of_its_seed_and_nothing_else():
    grid = Grid.of_extent((0, 0, 3000, 2000), 10)
    made = {
        (seed, threads): from_samples(None, grid, seed=seed, threads=threads).values.tobytes()
        for seed, threads in ((1, 1), (1, 2), (1, 5), (2, 1))
    }
    assert made[1, 1] == made[1, 2] == made[1, 5] != made[2, 1]


@pytest.mark.parametrize("variant", VARIANTS)
def test_threads_do_not_matter(variant):
    x, y = centres(GRID)
    points = points_of(GRID, x + y, some_cells(GRID, 0.05))
    one, two = (
        from_samples(points, GRID, variant=variant, r_s=0.1, threads=n).values for n in (1, 2)
    )
    np.testing.assert_array_equal(one, two)


# --- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("samples", "said"),
    [
        ([], "there are no samples"),
        (Samples(), "there are no samples"),
        ([(5000, 5, 1)], "none of 1 samples lies in the grid: they are at x 5000 to 5000"),
        ([(5, 5, np.nan), (1, np.inf, 2)], "none of 2 samples has finite"),
        (np.zeros((4, 2)), r"points has shape \(4, 2\)"),
        ([("a", "b", "c")], "no number"),
        (np.zeros(3), r"points has shape \(3,\)"),
    ],
)
def test_samples_of_no_use(samples, said):
    with pytest.raises(InputError, match=said):
        from_samples(samples, GRID)


def test_samples_of_the_wrong_kind():
    with pytest.raises(InputError, match="contour 1 runs from 5 to 6 m"):
        Samples(contours=[[(0, 0, 1), (1, 1, 1)], [(0, 0, 5), (1, 1, 6)]])
    with pytest.raises(InputError, match="line 0 has shape"):
        Samples(lines=[(0, 0, 1)])
    with pytest.raises(InputError, match="do not have the grid's shape"):
        from_samples(Samples(cells=np.zeros((3, 3))), GRID)
    with pytest.raises(InputError, match="2-D"):
        Samples(cells=np.zeros(4))


def test_options_of_no_use():
    with pytest.raises(InputError, match="unexpected keyword argument 'colour'"):
        from_samples(None, GRID, colour="red")
    with pytest.raises(InputError, match="preset is 'figure-9'"):
        from_samples(None, GRID, preset="figure-9")
    with pytest.raises(InputError, match="not both"):
        from_samples(None, GRID, options=SampleOptions(), seed=3)


def test_cancel():
    class Stop:
        def __init__(self):
            self.seen = []

        def report(self, fraction):
            self.seen.append(fraction)

        def cancelled(self):
            return len(self.seen) > 3

    with pytest.raises(Cancelled):
        from_samples([(5, 5, 1), (900, 900, 3)], GRID, progress=Stop())
