"""Streams: which cells, links between confluences, orders, lengths; written as lines."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import fractal

from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.hydrology import drainage_area, find_streams
from demsmith.core.raster import write_lines

ROW = {1: 0, 2: 1, 4: 1, 8: 1, 16: 0, 32: -1, 64: -1, 128: -1}
COLUMN = {1: 1, 2: 1, 4: 0, 8: -1, 16: -1, 32: -1, 64: 0, 128: 1}


def forest(shape, seed):
    """Random directions without cycles, each cell's to a neighbour of lower rank, and the areas."""
    rng = np.random.default_rng(seed)
    rank = rng.permutation(shape[0] * shape[1]).reshape(shape)
    directions = np.zeros(shape, np.uint8)
    for cell in np.ndindex(shape):
        lower = [code for code in ROW if rank_below(rank, cell, code) < rank[cell]]
        if lower and rng.random() < 0.98:
            directions[cell] = rng.choice(lower)
    area = rng.uniform(0.5, 1.5, shape)
    for cell in sorted(np.ndindex(shape), key=lambda cell: -rank[cell]):
        if directions[cell]:
            area[below(cell, directions[cell])] += area[cell]
    return directions, area


def below(cell, code):
    return cell[0] + ROW[code], cell[1] + COLUMN[code]


def rank_below(rank, cell, code):
    row, column = below(cell, code)
    inside = 0 <= row < rank.shape[0] and 0 <= column < rank.shape[1]
    return rank[row, column] if inside else rank.size


def links_of(streams):
    """Cells of each link as tuples."""
    ends = streams.first_cell
    return [[tuple(cell) for cell in streams.cells[a:b].tolist()] for a, b in pairwise(ends)]


def order_by_hand(cell, donors):
    """Strahler's order of a stream cell, straight from its definition."""
    orders = sorted((order_by_hand(donor, donors) for donor in donors[cell]), reverse=True)
    if not orders:
        return 1
    return orders[0] + (orders.count(orders[0]) > 1)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("threshold", [0.0, 3.0, 20.0])
def test_a_network_is_what_its_definition_says(seed, threshold):
    directions, area = forest((17, 23), seed)
    dx, dy = np.linspace(20, 30, 17), np.linspace(28, 33, 17)
    streams = find_streams(directions, area, threshold=threshold, pixel_size=(dx, dy))
    np.testing.assert_array_equal(streams.mask, area >= threshold)
    cells = [tuple(cell) for cell in np.argwhere(streams.mask).tolist()]
    donors = {cell: [] for cell in cells}
    for cell in cells:
        if directions[cell]:
            donors[below(cell, directions[cell])].append(cell)
    links = links_of(streams)
    drawn = set()
    for number, link in enumerate(links):
        for here, there in pairwise(link):
            assert below(here, directions[here]) == there
            drawn.add(here)
        assert len(donors[link[0]]) != 1
        assert all(len(donors[cell]) == 1 for cell in link[1:-1])
        assert len(donors[link[-1]]) > 1 or directions[link[-1]] == 0
        into = streams.downstream[number]
        assert (into == 0) == (directions[link[-1]] == 0)
        if into:
            assert links[into - 1][0] == link[-1]
        joins = len(donors[link[-1]]) > 1
        assert streams.area[number] == area[link[-2] if joins else link[-1]]
        # What a link's last cell above the confluence has, the whole link has.
        assert streams.order[number] == order_by_hand(link[0], donors)
        steps = [
            np.hypot(
                (dx[a[0]] + dx[b[0]]) / 2 * (b[1] - a[1]), (dy[a[0]] + dy[b[0]]) / 2 * (b[0] - a[0])
            )
            for a, b in pairwise(link)
        ]
        assert streams.length[number] == pytest.approx(sum(steps), rel=1e-12)
    # Every stream cell that drains on is drawn once.
    assert drawn == {cell for cell in cells if directions[cell]}
    assert sum(len(link) - 1 for link in links) == len(drawn)
    starts = [link[0] for link in links]
    assert starts == sorted(starts)


@given(st.integers(0, 2**32 - 1), st.sampled_from([(1, 9), (9, 1), (6, 7), (1, 1)]))
def test_links_do_not_depend_on_the_way_they_are_found(seed, shape):
    directions, area = forest(shape, seed)
    one = find_streams(directions, area, threshold=2, threads=1)
    two = find_streams(directions, area, threshold=2, threads=2)
    for name in ("cells", "first_cell", "downstream", "order", "length", "area"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    assert len(one) == len(one.length) == len(one.first_cell) - 1
    # Strahler's order of what leaves is no more than its heads allow: 2^(order - 1) of them.
    heads = np.count_nonzero(one.order == 1)
    assert one.order.max(initial=0) <= 1 + np.log2(max(heads, 1))


def test_a_comb_has_the_orders_of_the_paper():
    """Two of first order make one of second, which a further one of first does not raise."""
    directions = np.array(
        [
            [2, 0, 8, 0, 0, 0],
            [0, 4, 0, 0, 8, 0],
            [0, 4, 0, 8, 0, 0],
            [0, 2, 4, 0, 0, 0],
            [0, 0, 4, 0, 0, 0],
            [0, 0, 0, 0, 0, 0],
        ],
        np.uint8,
    )
    area = np.where(directions > 0, 1.0, 0.0)
    area[1, 1], area[2, 1], area[3, 1], area[2, 3], area[3, 2] = 3, 4, 5, 2, 3
    area[4, 2], area[5, 2] = 9, 10
    streams = find_streams(directions, area, threshold=1, pixel_size=10)
    starts = [link[0] for link in links_of(streams)]
    assert starts == [(0, 0), (0, 2), (1, 1), (1, 4), (4, 2)]
    assert streams.order.tolist() == [1, 1, 2, 1, 2]
    assert streams.downstream.tolist() == [3, 3, 5, 5, 0]
    diagonal = 10 * np.sqrt(2)
    lengths = [diagonal, diagonal, 20 + diagonal, 10 + 2 * diagonal, 10]
    np.testing.assert_allclose(streams.length, lengths, rtol=1e-12)
    assert streams.area.tolist() == [1, 1, 5, 3, 10]


@pytest.mark.parametrize("depressions", ["fill", "breach"])
@pytest.mark.parametrize("size", [(1, 1), (0.6, 1), (1, 0.3)])
def test_streams_do_not_cross(depressions, size):
    """Where one crosses a corner, none crosses it the other way, on slopes and on flats."""
    ground = np.rint(fractal((90, 80), seed=5, relief=60))
    codes = drainage_area(ground, depressions=depressions, pixel_size=size).directions
    falling = (codes[:-1, :-1] == 2) | (codes[1:, 1:] == 32)
    rising = (codes[:-1, 1:] == 8) | (codes[1:, :-1] == 128)
    assert falling.sum() > 100 < rising.sum()
    assert not (falling & rising).any()


def test_no_streams():
    streams = find_streams(np.zeros((4, 5), np.uint8), np.ones((4, 5)), threshold=2)
    assert len(streams) == 0
    assert not streams.mask.any()
    assert all(column.size == 0 for column in streams.columns.values())


def test_arrays_must_fit():
    with pytest.raises(InputError, match="differ in shape"):
        find_streams(np.zeros((4, 5), np.uint8), np.ones((5, 4)))


def test_cancelled():
    class Stop:
        def report(self, fraction):
            pass

        def cancelled(self):
            return True

    with pytest.raises(Cancelled):
        find_streams(np.zeros((4, 5), np.uint8), np.ones((4, 5)), progress=Stop())


# --- lines on disk -------------------------------------------------------------------------------

XY = np.array([(5.0, 45.0), (5.1, 45.2), (5.2, 45.3), (9, 8), (7, 6.125)])
COLUMNS = {"link": [1, 2], "length_m": [12.5, np.nan], "name": ["a", "b"]}


def lines(path):
    gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
    dataset = gdal.OpenEx(str(path), gdal.OF_VECTOR)
    layer = dataset.GetLayer(0)
    found = [(each.GetGeometryRef().GetPoints(), each.items()) for each in layer]
    authority = layer.GetSpatialRef() and layer.GetSpatialRef().GetAuthorityCode(None)
    layer = dataset = None
    return found, authority


@pytest.mark.parametrize("name", ["lines.gpkg", "lines.geojson"])
def test_lines_are_written_with_their_attributes(tmp_path, name):
    path = write_lines(tmp_path / name, XY, [0, 3, 5], COLUMNS, crs="EPSG:4326")
    found, authority = lines(path)
    assert authority == "4326"
    assert [points for points, _ in found] == [
        [tuple(place) for place in XY[:3]], [tuple(place) for place in XY[3:]]
    ]  # fmt: skip
    assert [items["link"] for _, items in found] == [1, 2]
    assert [items["length_m"] for _, items in found] == [12.5, None]
    assert [items["name"] for _, items in found] == ["a", "b"]


def test_a_layer_without_lines(tmp_path):
    path = write_lines(tmp_path / "none.gpkg", np.empty((0, 2)), [0], {"link": np.arange(0)})
    assert lines(path) == ([], None)


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        (dict(name="lines.shp"), InputError, "gpkg"),
        (dict(name="none/lines.gpkg"), OutputError, "no folder"),
        (dict(first_vertex=[0, 4, 5]), InputError, "two vertices"),
        (dict(columns={"link": [1]}), InputError, "for each of 2 lines"),
        (dict(name="lines.geojson", crs='LOCAL_CS["x",UNIT["metre",1]]'), InputError, "EPSG"),
    ],
)
def test_lines_refused(tmp_path, arguments, error, said):
    pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
    given = {"name": "lines.gpkg", "first_vertex": [0, 3, 5], "columns": COLUMNS, **arguments}
    with pytest.raises(error, match=said):
        write_lines(
            tmp_path / given["name"], XY, given["first_vertex"], given["columns"],
            crs=given.get("crs", ""),
        )  # fmt: skip
    assert list(tmp_path.iterdir()) == []
