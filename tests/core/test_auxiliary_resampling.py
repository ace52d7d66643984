"""An auxiliary raster on the target's cells: places, voids, windows, sharpness."""

import numpy as np
import pytest
from array_sources import source
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import fractal
from support import make_raster

from demsmith.core.auxiliary import Resampler, open_auxiliary
from demsmith.core.errors import InputError
from demsmith.core.raster import Grid

METRES = Grid((90, 110), (500_000.0, 30.0, 0.0, 4_600_000.0, 0.0, -30.0), "EPSG:32631")
DEGREES = Grid((300, 360), (2.95, 1 / 3600, 0.0, 41.58, 0.0, -1 / 3600), "EPSG:4326")


def coordinates(grid):
    rows, columns = np.indices(grid.shape)
    return grid.xy(rows, columns)


def test_the_same_grid_gives_the_same_elevations():
    ground = fractal(tuple(METRES.shape))
    values, void = Resampler(source(ground, METRES), METRES).window(0, 0, METRES.shape)
    assert not void.any()
    np.testing.assert_allclose(values, ground, atol=1e-6)


@pytest.mark.parametrize(("there", "factor"), [(DEGREES, 1.0), (DEGREES, 0.3048)])
def test_another_crs_is_looked_up_where_proj_says(there, factor):
    pyproj = pytest.importorskip("pyproj")
    east, north = pyproj.Transformer.from_crs(there.crs, METRES.crs, always_xy=True).transform(
        *coordinates(there)
    )
    for theirs, ours in zip((east, north), coordinates(METRES), strict=True):
        values, void = Resampler(source(theirs, there), METRES, factor).window(0, 0, METRES.shape)
        assert not void.any()
        np.testing.assert_allclose(values / factor, ours, atol=0.05)  # metres


@settings(max_examples=15, deadline=None)
@given(
    row=st.integers(-20, 60), column=st.integers(-20, 80), rows=st.integers(1, 40),
    columns=st.integers(1, 40), shift=st.tuples(st.floats(-5, 5), st.floats(-5, 5)),
    ratio=st.sampled_from([1, 7]),
)  # fmt: skip
def test_a_cell_does_not_depend_on_the_window_asked_for(row, column, rows, columns, shift, ratio):
    x, width, _, y, _, height = METRES.geotransform
    coarse = Grid((60, 60), (x, ratio * width, 0, y, 0, ratio * height), METRES.crs)
    ground = fractal(tuple(DEGREES.shape))
    resampler = Resampler(source(ground, DEGREES), coarse)
    values, void = resampler.window(-20, -20, (120, 140), shift=shift)
    part, part_void = resampler.window(row, column, (rows, columns), shift=shift)
    inside = np.s_[row + 20 : row + 20 + rows, column + 20 : column + 20 + columns]
    assert part.tobytes() == values[inside].tobytes()
    assert part_void.tobytes() == void[inside].tobytes()


def test_a_shift_looks_further_on():
    ground = fractal(tuple(METRES.shape))
    values, void = Resampler(source(ground, METRES), METRES).window(
        0, 0, METRES.shape, shift=(2, -3)
    )
    np.testing.assert_allclose(values[:-2, 3:], ground[2:, :-3], atol=1e-6)
    assert void[-2:].all()
    assert void[:, :3].all()
    assert not void[:-2, 3:].any()


@pytest.mark.parametrize("ratio", [2, 3, 10, 27])
def test_finer_cells_are_averaged_and_do_not_alias(ratio):
    x, width, _, y, _, height = METRES.geotransform
    side = 40
    fine = Grid(
        (side * ratio, side * ratio), (x, width / ratio, 0, y, 0, height / ratio), METRES.crs
    )
    slope = np.add.outer(np.arange(side * ratio), 2.0 * np.arange(side * ratio)) / ratio
    board = 50.0 * (np.indices(fine.shape).sum(axis=0) % 2 * 2 - 1)
    target = Grid((side, side), METRES.geotransform, METRES.crs)
    values, _ = Resampler(source(slope + board, fine), target).window(0, 0, (side, side))
    middle = 0.5 - 0.5 / ratio
    wanted = np.add.outer(np.arange(side) + middle, 2.0 * (np.arange(side) + middle))
    np.testing.assert_allclose(values[4:-4, 4:-4], wanted[4:-4, 4:-4], atol=5)


def test_voids_stay_voids_and_so_do_cells_that_need_them():
    ground, void = fractal(tuple(METRES.shape)), np.zeros(METRES.shape, bool)
    void[40, 50] = True
    resampler = Resampler(source(np.where(void, -32768, ground), METRES, void), METRES)
    _, unknown = resampler.window(0, 0, METRES.shape)
    assert np.array_equal(unknown, void)
    values, unknown = resampler.window(0, 0, METRES.shape, shift=(0.5, 0.5))
    assert unknown[38:42, 48:52].all()
    assert np.count_nonzero(unknown[30:50, 40:60]) == 16
    assert values.min() > -100


def test_nothing_is_known_outside():
    far = Grid((5, 5), (700_000.0, 30.0, 0.0, 4_600_000.0, 0.0, -30.0), METRES.crs)
    values, void = Resampler(source(fractal((5, 5)), far), METRES).window(0, 0, (9, 9))
    assert void.all()
    assert not values.any()


def test_one_without_crs_is_refused():
    bare = Grid(METRES.shape, METRES.geotransform, "")
    with pytest.raises(InputError, match="has no CRS"):
        Resampler(source(fractal(tuple(METRES.shape)), bare), METRES).window(0, 0, (9, 9))


def test_a_file_in_feet_is_read_in_metres(tmp_path):
    osgeo = pytest.importorskip("osgeo.gdal")
    assert osgeo
    ground = fractal((40, 50)).astype(np.float32)
    path = make_raster(
        tmp_path / "feet.tif", ground / 0.3048, geotransform=METRES.geotransform, crs=METRES.crs,
        setup=lambda dataset: dataset.GetRasterBand(1).SetUnitType("ft"),
    )  # fmt: skip
    values, _ = open_auxiliary([path], METRES).window(0, 0, (40, 50))
    np.testing.assert_allclose(values, ground, atol=0.01)
    values, _ = open_auxiliary([path], METRES, unit=0.3048).window(0, 0, (40, 50))
    np.testing.assert_allclose(values, ground / 0.3048, atol=0.01)
