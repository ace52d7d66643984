"""A file at any scale: planes stay planes, windows agree, voids stay where they are."""

import numpy as np
import pytest
from support import hills

from demsmith.core.errors import InputError
from demsmith.core.raster import BandMeta, Grid, Raster
from demsmith.core.sct import CompressOptions, decoded_at, open_sct
from demsmith.core.sct.coding import coded
from demsmith.core.sct.file import write_sct
from demsmith.core.sct.scaling import resampled

SHAPE = (280, 330)
GRID = Grid(SHAPE, (500000.0, 30.0, 0.0, 4600000.0, 0.0, -20.0), "EPSG:32631")


def file_of(folder, values, void=None, **meta):
    void = np.zeros(SHAPE, bool) if void is None else void
    made = coded(
        Raster(values, void, GRID, BandMeta(dtype=values.dtype, **meta)),
        CompressOptions(max_error=0.01, effort="low"),
    )
    path = str(folder / "x.sct")
    write_sct(path, **made.parts())
    return path


def plane(x, y):
    return (x - 500000) / 30 * 2 - (y - 4600000) / 20 * 3


@pytest.fixture(scope="module")
def flat(tmp_path_factory):
    rows, columns = np.indices(SHAPE)
    values = plane(*GRID.xy(rows, columns)).astype(np.float32)
    with open_sct(file_of(tmp_path_factory.mktemp("flat"), values)) as file:
        yield file


@pytest.fixture(scope="module")
def hilly(tmp_path_factory):
    values = hills(*SHAPE, dtype=np.float32)
    void = np.zeros(SHAPE, bool)
    void[64:128, 100:161] = True
    values[void] = -9999
    with open_sct(file_of(tmp_path_factory.mktemp("hilly"), values, void, nodata=-9999)) as file:
        yield file


ALL = slice(0, SHAPE[0]), slice(0, SHAPE[1])


@pytest.mark.parametrize("scale", [0.03, 1 / 16, 0.125, 0.25, 0.4, 0.5, 0.77, 1, 1.5, 2, 3.3])
def test_a_plane_stays_where_it_is(flat, scale):
    made, _ = decoded_at(flat, *ALL, scale)
    assert made.grid.shape == tuple(max(1, round(side * scale)) for side in SHAPE)
    rows, columns = np.indices(made.grid.shape)
    right = plane(*made.grid.xy(rows, columns))
    # Near the edges the surface goes on level, and a coarse one has hardly a middle.
    rim = [max(2, round(side * (0.12 if scale < 0.3 else 0.02))) for side in made.grid.shape]
    middle = tuple(slice(each, -each) for each in rim)
    assert np.abs(made.values - right)[middle].max() < (0.05 if scale >= 0.7 else 3)
    assert made.values.dtype == np.float32


def test_the_extent_is_that_of_the_window(flat):
    window = slice(30, 97), slice(10, 200)
    for scale in (0.3, 1, 2.5):
        made, _ = decoded_at(flat, *window, scale)
        part = GRID.part(*window)
        for grid in (made.grid, part):
            x, width, _, y, _, height = grid.geotransform
            ends = x + width * grid.shape.columns, y + height * grid.shape.rows
            assert (x, y, *ends) == pytest.approx((500300, 4599400, 506000, 4598060))


@pytest.mark.parametrize("scale", [0.125, 0.5, 2])
def test_a_window_agrees_with_the_whole(hilly, scale):
    whole, _ = decoded_at(hilly, slice(0, 280), slice(0, 320), scale)
    for rows, columns in ((slice(40, 136), slice(64, 200)), (slice(200, 280), slice(0, 64))):
        part, _ = decoded_at(hilly, rows, columns, scale)
        place = tuple(slice(round(s.start * scale), round(s.stop * scale)) for s in (rows, columns))
        np.testing.assert_array_equal(part.void, whole.void[place])
        np.testing.assert_allclose(part.values, whole.values[place], rtol=1e-6)


@pytest.mark.parametrize("scale", [0.25, 0.4, 1, 2])
def test_voids_stay_where_they_are(hilly, scale):
    made, _ = decoded_at(hilly, *ALL, scale)
    rows, columns = (
        np.floor((np.arange(count) + 0.5) * side / count)
        for count, side in zip(made.grid.shape, SHAPE, strict=True)
    )
    void = (rows[:, None] >= 64) & (rows[:, None] < 128) & (columns >= 100) & (columns < 161)
    np.testing.assert_array_equal(made.void, void)


def test_overviews_resemble_means(hilly):
    whole = hilly.read().values
    made, _ = decoded_at(hilly, slice(0, 64), slice(0, 320), 1 / 8)
    means = whole[:64, :320].reshape(8, 8, 40, 8).mean(axis=(1, 3))
    assert np.abs(made.values - means).max() < 0.05 * np.ptp(means)


def test_all_void(tmp_path):
    values = hills(*SHAPE, dtype=np.float32)
    void = np.zeros(SHAPE, bool)
    void[:100] = True
    with open_sct(file_of(tmp_path, values, void, nodata=-9999)) as file:
        read, unknown = resampled(file, slice(0, 40), slice(0, 40), (10, 10))
        assert unknown.all()
        assert not read.any()


def test_threads_change_nothing(hilly):
    one, two = (resampled(hilly, *ALL, (500, 600), threads=threads) for threads in (1, 2))
    np.testing.assert_array_equal(one[0], two[0])
    np.testing.assert_array_equal(one[1], two[1])


@pytest.mark.parametrize(
    ("rows", "columns", "scale", "said"),
    [
        (slice(0, 281), slice(0, 10), 1, "are no part of 280 × 330 cells"),
        (slice(5, 5), slice(0, 10), 2, "are no part of"),
        (slice(0, 280), slice(0, 330), 256, "choose a smaller scale"),
    ],
)
def test_refused(flat, rows, columns, scale, said):
    with pytest.raises(InputError, match=said):
        decoded_at(flat, rows, columns, scale)


def test_control_points_move_along(tmp_path):
    gcps = ((10.0, 20.0, 1.0, 2.0, 0.0),)
    path = file_of(tmp_path, hills(*SHAPE), gcps=gcps, rpc={"LINE_OFF": "3"})
    with open_sct(path) as file:
        made, notes = decoded_at(file, slice(4, 100), slice(8, 100), 2)
        assert made.meta.gcps == ((12.0, 24.0, 1.0, 2.0, 0.0),)
        assert made.meta.rpc == {}
        assert "RPC" in notes[0]
        assert decoded_at(file, *ALL, 1)[0].meta == file.meta
