"""Reading: formats, bands, properties, and bad files."""

import shutil

import numpy as np
import pytest
from support import WGS84_3ARC, hills, make_raster, truncate

from demsmith.core.errors import Cancelled, InputError
from demsmith.core.raster import read, read_grid

gdal = pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

ONE_DEGREE = (10 - 0.5 / 1200, 1 / 1200, 0.0, 50 + 0.5 / 1200, 0.0, -1 / 1200)


@pytest.mark.parametrize(
    ("driver", "name"),
    [
        ("GTiff", "dem.tif"),
        ("AAIGrid", "dem.asc"),
        ("EHdr", "dem.bil"),
        ("EHdr", "dem.flt"),
        ("ENVI", "dem.img"),
        ("HFA", "dem.img"),
        ("GSBG", "dem.grd"),
        ("XYZ", "dem.xyz"),
        ("netCDF", "dem.nc"),
    ],
)
def test_formats(tmp_path, driver, name):
    if gdal.GetDriverByName(driver) is None:
        pytest.skip(f"this GDAL has no driver {driver}")
    ground = hills(dtype=np.float32 if name.endswith(".flt") else np.int16)
    path = make_raster(tmp_path / name, ground, driver=driver)
    raster = read(path)
    np.testing.assert_array_equal(raster.values, ground)
    assert raster.grid.geotransform == pytest.approx(WGS84_3ARC, abs=1e-9)
    assert not raster.void.any()


def test_dted(tmp_path):
    ground = hills(1201, 1201)
    ground[5, 6:9] = -32767
    path = make_raster(tmp_path / "n49.dt1", ground, driver="DTED", geotransform=ONE_DEGREE)
    raster = read(path)
    np.testing.assert_array_equal(raster.values, ground)
    assert raster.void.sum() == 3
    assert raster.meta.unit == "m"


def test_vrt_and_its_missing_source(tmp_path):
    ground = hills()
    source = make_raster(tmp_path / "dem.tif", ground, nodata=-1)
    path = str(tmp_path / "dem.vrt")
    made = gdal.Translate(path, source, format="VRT")
    del made
    np.testing.assert_array_equal(read(path).values, ground)
    (tmp_path / "dem.tif").unlink()
    with pytest.raises(InputError, match="dem.vrt"):
        read(path)


@pytest.mark.parametrize(
    "dtype", ["uint8", "uint16", "int16", "uint32", "int32", "int64", "float32", "float64"]
)
def test_data_type_is_kept(tmp_path, dtype):
    ground = (hills() % 200).astype(dtype)
    raster = read(make_raster(tmp_path / "dem.tif", ground))
    assert raster.values.dtype == raster.meta.dtype == dtype
    np.testing.assert_array_equal(raster.values, ground)


def test_complex_is_refused(tmp_path):
    path = make_raster(tmp_path / "slc.tif", hills(dtype=np.complex64))
    with pytest.raises(InputError, match="CFloat32 numbers"):
        read(path)


def test_integers_beyond_floating_point_are_refused_unless_void(tmp_path):
    ground = hills(dtype=np.int64)
    ground[3, 3] = 2**60
    path = make_raster(tmp_path / "dem.tif", ground)
    with pytest.raises(InputError, match=r"beyond 2\^53"):
        read(path)
    assert read(path, nodata=[2**60]).void.sum() == 1


def test_one_chosen_band(tmp_path):
    bands = np.stack([hills(seed=1), hills(seed=2)])
    path = make_raster(tmp_path / "two.tif", bands)
    np.testing.assert_array_equal(read(path, band=2).values, bands[1])
    for wrong in (0, 3, -1, 1.5):
        with pytest.raises(InputError, match=f"band {wrong} asked, '.*two.tif' has 2"):
            read(path, band=wrong)


def test_larger_than_one_block(tmp_path):
    ground = hills(2500, 1100)
    options = ["TILED=YES", "COMPRESS=DEFLATE"]
    raster = read(make_raster(tmp_path / "large.tif", ground, options=options, nodata=0))
    np.testing.assert_array_equal(raster.values, ground)
    np.testing.assert_array_equal(raster.void, ground == 0)


def test_properties(tmp_path):
    def setup(dataset):
        band = dataset.GetRasterBand(1)
        band.SetUnitType("ft")
        band.SetScale(0.5)
        band.SetOffset(10)
        band.SetDescription("bare ground")
        band.SetMetadata({"SENSOR": "lidar", "STATISTICS_MAXIMUM": "7"})

    path = make_raster(
        tmp_path / "dem.tif", hills(), nodata=-5, setup=setup,
        metadata={"AREA_OR_POINT": "Point", "AUTHOR": "me"},
    )  # fmt: skip
    raster = read(path)
    meta = raster.meta
    assert (meta.unit, meta.scale, meta.offset, meta.nodata) == ("ft", 0.5, 10, -5)
    assert meta.description == "bare ground"
    assert meta.band_metadata == {"SENSOR": "lidar"}
    assert meta.area_or_point == "Point"
    assert meta.dataset_metadata == {"AUTHOR": "me"}
    assert meta.real(np.array([4])) == 12
    assert raster.source == path


def test_vertical_datum_of_an_old_geotiff(tmp_path):
    path = make_raster(
        tmp_path / "dem.tif",
        hills(),
        crs="EPSG:32633+5773",
        geotransform=(5e5, 30, 0, 4e6, 0, -30),
        options=["GEOTIFF_VERSION=1.0"],
    )
    assert "EGM96" in read(path).grid.crs


def test_south_up(tmp_path):
    south_up = (10.0, 0.1, 0.0, 40.0, 0.0, 0.1)
    raster = read(make_raster(tmp_path / "dem.tif", hills(), geotransform=south_up))
    assert raster.grid.geotransform == pytest.approx(south_up)
    assert raster.grid.south_up


def test_rotated_is_refused(tmp_path):
    path = make_raster(tmp_path / "dem.tif", hills(), geotransform=(10, 0.1, 0.02, 50, 0.02, -0.1))
    with pytest.raises(InputError, match="dem.tif' cannot be used: it is rotated.*gdalwarp"):
        read(path)


def test_no_crs(tmp_path):
    metres = (5e5, 30, 0, 4e6, 0, -30)
    raster = read(make_raster(tmp_path / "dem.tif", hills(), crs="", geotransform=metres))
    (note,) = raster.notes
    assert "has no CRS; its coordinates are taken as metres" in note
    assert "degrees" not in note
    degrees = read(make_raster(tmp_path / "deg.tif", hills(), crs=""))
    assert "look like degrees" in degrees.notes[0]


def test_no_geotransform(tmp_path):
    raster = read(make_raster(tmp_path / "dem.tif", hills(), crs="", geotransform=None))
    assert "no georeference; distances are counted in pixels" in raster.notes[0]
    assert raster.grid.pixel_size_m().dx[0] == 1
    assert not raster.grid.georeferenced


def test_crs_without_geotransform_is_kept_but_not_measured_by(tmp_path):
    raster = read(make_raster(tmp_path / "dem.tif", hills(), geotransform=None))
    assert "distances are counted in pixels" in raster.notes[0]
    assert "4326" in raster.grid.crs
    assert raster.grid.pixel_size_m().dy[0] == 1


def test_ground_control_points_only(tmp_path):
    def setup(dataset):
        points = [gdal.GCP(10, 50, 0, 0, 0), gdal.GCP(11, 50, 0, 80, 0), gdal.GCP(10, 49, 0, 0, 60)]
        dataset.SetGCPs(points, dataset.GetProjection())

    path = make_raster(tmp_path / "dem.tif", hills(), crs="", geotransform=None, setup=setup)
    raster = read(path)
    assert "ground control points but no geotransform" in raster.notes[0]
    assert raster.meta.gcps[1] == (0, 80, 11, 50, 0)


def test_mercator_is_mentioned(tmp_path):
    place = (1e6, 30, 0, 6e6, 0, -30)
    path = make_raster(tmp_path / "dem.tif", hills(), crs="EPSG:3857", geotransform=place)
    assert "Mercator" in read(path).notes[0]
    path = make_raster(tmp_path / "utm.tif", hills(), crs="EPSG:32633", geotransform=place)
    assert read(path).notes == ()


def test_one_pixel(tmp_path):
    raster = read(make_raster(tmp_path / "dem.tif", np.array([[7]], np.int16), nodata=7))
    assert raster.void.tolist() == [[True]]


def test_unicode_and_spaces(tmp_path):
    folder = tmp_path / "Höhen modelle"
    folder.mkdir()
    path = make_raster(folder / "Größe 高.tif", hills())
    assert read(folder / "Größe 高.tif").source == path


@pytest.mark.parametrize("fraction", [0.95, 0.4, 0.01])
@pytest.mark.parametrize(
    ("driver", "name", "options"),
    [
        ("GTiff", "plain.tif", ()),
        ("GTiff", "tiled.tif", ("TILED=YES", "COMPRESS=DEFLATE")),
        ("AAIGrid", "dem.asc", ()),
        ("EHdr", "dem.bil", ()),
        ("ENVI", "dem.img", ()),
        ("HFA", "dem.img", ()),
    ],
)
def test_truncated_files_are_errors(tmp_path, capfd, driver, name, options, fraction):
    ground = hills(300, 400)
    path = make_raster(tmp_path / name, ground, driver=driver, options=options)
    truncate(path, fraction)
    with pytest.raises(InputError, match=r"truncated|damaged"):
        read(path)
    assert capfd.readouterr() == ("", "")


def test_truncated_dted(tmp_path):
    path = make_raster(
        tmp_path / "n49.dt1", hills(1201, 1201), driver="DTED", geotransform=ONE_DEGREE
    )
    truncate(path, 0.6)
    with pytest.raises(InputError, match="truncated or damaged"):
        read(path)


def test_no_such_file(tmp_path):
    with pytest.raises(InputError, match="nowhere.tif' does not exist"):
        read(tmp_path / "nowhere.tif")


def test_empty_file_folder_and_text(tmp_path, capfd):
    (tmp_path / "empty.tif").touch()
    with pytest.raises(InputError, match="is empty"):
        read(tmp_path / "empty.tif")
    with pytest.raises(InputError, match="is a folder"):
        read(tmp_path)
    (tmp_path / "text.tif").write_text("no raster at all")
    with pytest.raises(InputError, match="not a raster in a format that GDAL knows"):
        read(tmp_path / "text.tif")
    assert capfd.readouterr() == ("", "")


def test_virtual_path_that_is_not_there():
    with pytest.raises(InputError, match="/vsimem/nothing.tif"):
        read("/vsimem/nothing.tif")


def test_same_errors_where_gdal_raises_exceptions(tmp_path):
    path = make_raster(tmp_path / "dem.tif", hills(300, 400))
    good = str(tmp_path / "good.tif")
    shutil.copy(path, good)
    truncate(path, 0.5)
    before = gdal.GetUseExceptions()
    gdal.UseExceptions()
    try:
        assert read(good).values.shape == (300, 400)
        with pytest.raises(InputError, match="truncated or damaged"):
            read(path)
        with pytest.raises(InputError, match="format"):
            read(__file__)
        assert gdal.GetUseExceptions()
    finally:
        if not before:
            gdal.DontUseExceptions()


def test_the_input_and_its_folder_stay_as_they_are(tmp_path):
    path = tmp_path / "dem.tif"
    make_raster(path, hills(), nodata=-1)
    before = path.read_bytes()
    read(path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["dem.tif"]
    assert path.read_bytes() == before


def test_cancelled(tmp_path):
    class Impatient:
        def report(self, fraction):
            raise AssertionError("reported after it was cancelled")

        def cancelled(self):
            return True

    path = make_raster(tmp_path / "dem.tif", hills())
    with pytest.raises(Cancelled):
        read(path, progress=Impatient())


def test_progress_only_grows_and_stays_below_one(tmp_path):
    reports = []

    class Listening:
        report = staticmethod(reports.append)

        def cancelled(self):
            return False

    read(make_raster(tmp_path / "dem.tif", hills(2500, 1100)), progress=Listening())
    assert reports == sorted(reports)
    assert reports[0] > 0
    assert reports[-1] <= 1


def test_a_grid_is_read_without_the_values(tmp_path):
    path = make_raster(tmp_path / "dem.tif", hills(200, 300), options=["COMPRESS=DEFLATE"])
    grid = read(path).grid
    truncate(path, 0.9)
    with pytest.raises(InputError, match="cannot be read between"):
        read(path)
    assert read_grid(path) == grid


def test_grids_that_cannot_be_read(tmp_path):
    rotated = make_raster(tmp_path / "r.tif", hills(), geotransform=(0, 1, 0.5, 0, 0.5, -1))
    with pytest.raises(InputError, match="r.tif' cannot be used: it is rotated"):
        read_grid(rotated)
    with pytest.raises(InputError, match="does not exist"):
        read_grid(tmp_path / "none.tif")
