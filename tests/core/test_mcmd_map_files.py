"""Maps in files: read on the elevations' grid or refused, and filling from file to file by them."""

import json
import os

import numpy as np
import pytest
from scenes import disc, fractal
from support import WGS84_3ARC, digest, fill_by_mcmd, make_raster

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.mcmd import MapFiles, Maps, McmdOptions, read_maps
from demsmith.core.mcmd.maps import MAP_NAMES
from demsmith.core.options import specifications
from demsmith.core.raster import Grid
from demsmith.core.voids import FillOptions, fill_file

SHAPE = (40, 50)
GRID = Grid(SHAPE, WGS84_3ARC, "EPSG:4326")
STEP = np.where(np.arange(SHAPE[1]) < 25, 0.0, 0.4) * np.ones(SHAPE)


@pytest.fixture
def dem(tmp_path):
    ground = np.rint(fractal(SHAPE, seed=2)).astype(np.int16)
    ground[disc(SHAPE, (20, 25), 12)] = -32768
    return make_raster(tmp_path / "dem.tif", ground, nodata=-32768)


@pytest.fixture
def rough(tmp_path):
    return make_raster(tmp_path / "rough.tif", STEP.astype(np.float32))


def moved(pixels):
    x, width, _, y, _, height = WGS84_3ARC
    return (x + pixels * width, width, 0.0, y, 0.0, height)


# --- reading -------------------------------------------------------------------------------------


def test_reads_what_is_given(tmp_path, rough):
    scaled = np.full(SHAPE, 20, np.int16)
    scaled[3, 4] = -1

    def setup(dataset):
        dataset.GetRasterBand(1).SetScale(0.01)
        dataset.GetRasterBand(1).SetOffset(0.1)

    h = make_raster(tmp_path / "h.tif", scaled, nodata=-1, setup=setup)
    maps = read_maps({"r_s": rough, "h": h}, GRID)
    np.testing.assert_array_equal(maps.r_s, STEP.astype(np.float32))
    assert np.isnan(maps.h[3, 4]) and np.isnan(maps.h).sum() == 1
    assert maps.h[0, 0] == pytest.approx(0.3)
    assert maps.l is None and maps.l_bu is None and maps.r_t is None
    assert read_maps({}, GRID) == Maps()


def test_refuses_another_grid(tmp_path):
    for pixels in (-0.09, 0.09):
        near = make_raster(tmp_path / "near.tif", STEP, geotransform=moved(pixels))
        assert read_maps({"h": near}, GRID).h.shape == SHAPE
    for pixels in (-0.2, 0.2, 10):
        far = make_raster(tmp_path / "far.tif", STEP, geotransform=moved(pixels))
        with pytest.raises(InputError, match=r"map of h, '.*far.tif', lies elsewhere .*gdalwarp"):
            read_maps({"h": far}, GRID)
    x, width, _, y, _, height = WGS84_3ARC
    wide = make_raster(tmp_path / "wide.tif", STEP, geotransform=(x, width * 1.01, 0, y, 0, height))
    with pytest.raises(InputError, match="lies elsewhere"):
        read_maps({"h": wide}, GRID)
    small = make_raster(tmp_path / "small.tif", STEP[:, 1:])
    with pytest.raises(InputError, match=r"small.tif', has 40 × 49 cells, the elevations 40 × 50"):
        read_maps({"h": small}, GRID)


def test_a_picture_without_place_needs_the_shape_alone(tmp_path):
    picture = make_raster(
        tmp_path / "painted.png", STEP.astype(np.uint8), driver="PNG", geotransform=None, crs=""
    )
    np.testing.assert_array_equal(read_maps({"r_t": picture}, GRID).r_t, STEP.astype(np.uint8))


def test_refuses_names_and_files_that_are_none(tmp_path):
    with pytest.raises(InputError, match="no map of seed, tension, only of l, l_bu, h, r_s, r_t"):
        read_maps({"tension": "x.tif", "seed": "y.tif"}, GRID)
    with pytest.raises(InputError, match="does not exist"):
        read_maps({"h": tmp_path / "none.tif"}, GRID)


def test_front_ends_ask_for_every_map():
    specs = specifications(MapFiles)
    assert [spec.name for spec in specs] == [f"{name}_map" for name in MAP_NAMES]
    options = {spec.name: spec for spec in specifications(McmdOptions)}
    for spec, name in zip(specs, MAP_NAMES, strict=True):
        assert options[name].title[1:] in spec.title
        assert f"from {options[name].minimum:g} to {options[name].maximum:g}." in spec.help
    given = {f"{name}_map": f"{name}.tif" for name in MAP_NAMES}
    assert MapFiles(**given).paths() == {name: f"{name}.tif" for name in MAP_NAMES}
    assert MapFiles(h_map="").paths() == {}


# --- filling -------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", ["relaxed", "weighted", "paper"])
def test_fill_as_the_array_function_does(tmp_path, dem, rough, variant):
    before = digest(rough)
    fill_file(
        dem, tmp_path / "out.tif", options=FillOptions(variant=variant), maps={"r_s": rough},
        report=tmp_path / "report.json",
    )  # fmt: skip
    source = raster.read(dem)
    expected = fill_by_mcmd(
        source.values, source.void, variant=variant, maps=Maps(r_s=STEP.astype(np.float32)),
        pixel_size=source.grid.pixel_size_m(),
    ).values  # fmt: skip
    np.testing.assert_array_equal(raster.read(tmp_path / "out.tif").values, expected)
    assert json.loads((tmp_path / "report.json").read_text())["maps"] == {"r_s": rough}
    assert digest(rough) == before


def test_a_map_is_an_input_and_stays(tmp_path, dem, rough):
    before = digest(rough)
    with pytest.raises(InputError, match="is an input"):
        fill_file(dem, rough, maps={"r_s": rough}, overwrite=True)
    assert digest(rough) == before


def test_nothing_is_written_by_a_wrong_map(tmp_path, dem):
    out = tmp_path / "out"
    out.mkdir()
    negative = make_raster(tmp_path / "negative.tif", STEP - 1)
    for name, words in (("r_s", "map of r_s is -1 at row 0, column 0"), ("l", "no such curve")):
        with pytest.raises(InputError, match=words):
            fill_file(dem, out / "o.tif", maps={name: negative})
    assert os.listdir(out) == []


def test_cancel_while_maps_are_read(tmp_path, dem, rough):
    class Impatient:
        seen = 0.0

        def report(self, fraction):
            self.seen = fraction

        def cancelled(self):
            return self.seen > 0.1

    impatient = Impatient()
    with pytest.raises(Cancelled):
        fill_file(dem, tmp_path / "o.tif", maps={"r_s": rough}, progress=impatient)
    assert 0.1 < impatient.seen < 0.15
    assert not (tmp_path / "o.tif").exists()
