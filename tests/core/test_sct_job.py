"""From file to file: trees of patches, dictionaries, real terrain, cancel."""

import os

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from support import hills, make_raster, shared_data

import demsmith
from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError
from demsmith.core.sct import (
    CompressOptions,
    DecompressOptions,
    compress_file,
    decompress_file,
    info_file,
)
from demsmith.core.sparse.dictionary_file import write_dictionary
from demsmith.core.sparse.learning import learn


@pytest.fixture
def dem(tmp_path):
    rough = gaussian_filter(np.random.default_rng(0).normal(0, 1, (120, 150)), 1.2)
    ground = (hills(120, 150) + 15 / rough.std() * rough).astype(np.int16)
    ground[10:23, 20:44] = -9999
    return make_raster(tmp_path / "dem.tif", ground, nodata=-9999)


@pytest.fixture
def compress(tmp_path, dem):
    def run(dictionary=None, **options):
        options = CompressOptions(effort="low", **options)
        return compress_file(
            dem, tmp_path / "x.sct", options=options, dictionary=dictionary, overwrite=True
        )

    return run


@pytest.fixture(scope="module")
def dictionary(tmp_path_factory):
    path = tmp_path_factory.mktemp("dictionary") / "hills.dsd"
    learned = learn(
        hills(120, 150, dtype=np.float32), atoms=12, sparsity=2, iterations=4,
        pixel_size=(60.0, 92.6),
    )  # fmt: skip
    write_dictionary(path, learned.dictionary)
    return str(path)


def decoded(tmp_path, **options):
    decompress_file(
        tmp_path / "x.sct", tmp_path / "back.tif", options=DecompressOptions(**options),
        overwrite=True,
    )  # fmt: skip
    return raster.read(tmp_path / "back.tif")


def test_a_tree_of_patches(compress, dem, tmp_path):
    result = compress(atoms=16, sparsity=2)
    assert (result.tree, result.mode, result.max_error) == ("patches", "tree", None)
    one, two = raster.read(dem), decoded(tmp_path)
    np.testing.assert_array_equal(one.void, two.void)
    wrong = (one.values.astype(float) - two.values)[~one.void]
    assert np.sqrt(np.mean(wrong**2)) == pytest.approx(result.rmse)
    assert result.rmse < 12
    assert info_file(tmp_path / "x.sct").bytes_by_section["discs"] > 0


def test_more_atoms_a_patch_are_closer(compress):
    few, many = (compress(sparsity=sparsity, atoms=32) for sparsity in (1, 6))
    assert many.rmse < 0.9 * few.rmse
    assert many.bytes > few.bytes


def test_a_larger_radius_is_coarser(compress, tmp_path):
    errors, discs = [], []
    for radius in (250, 900):
        errors.append(compress(radius=radius, sparsity=1, atoms=16).rmse)
        discs.append(info_file(tmp_path / "x.sct").bytes_by_section["discs"])
    assert errors[0] < errors[1]
    assert discs[1] < discs[0] / 4


def test_a_tree_of_patches_within_an_error(compress, dem, tmp_path):
    result = compress(sparsity=1, atoms=16, max_error=3)
    assert (result.tree, result.mode, result.max_error) == ("patches", "max-error", 3)
    one, two = raster.read(dem), decoded(tmp_path)
    wrong = np.abs(one.values.astype(float) - two.values)[~one.void]
    assert wrong.max() == result.max_error_measured <= 3


def test_a_dictionary(compress, dictionary):
    result = compress(dictionary)
    assert result.tree == "patches"
    assert result.rmse < 40
    with pytest.raises(InputError, match="atoms is 16, but the dictionary"):
        compress(dictionary, atoms=16)
    with pytest.raises(InputError, match=r"none\.dsd"):
        compress("none.dsd")


@pytest.mark.parametrize("effort", ["low", "normal"])
@pytest.mark.parametrize("shape", [(40, 50), (6, 7), (1, 30)])
def test_where_nothing_can_be_learned_atoms_are_waves(tmp_path, shape, effort):
    options = CompressOptions(sparsity=3, effort=effort)
    flat, hilly = np.full(shape, 500, np.int16), hills(*shape)
    for ground in (flat, hilly):
        path = make_raster(tmp_path / "dem.tif", ground)
        result = compress_file(path, tmp_path / "x.sct", options=options, overwrite=True)
        assert result.tree == "patches"
        wrong = decoded(tmp_path).values - ground.astype(float)
        assert np.sqrt(np.mean(wrong**2)) == pytest.approx(result.rmse)
        assert result.rmse <= 0.1 * max(np.std(ground), 5)


@pytest.mark.parametrize(
    ("radius", "said"),
    [
        (1e-4, r"a radius of 0\.0001 m is .* cells of .* m, less than one: give a larger radius"),
        (1e5, r"a radius of 100000 m is .* cells of .* m, more than the 256 that a disc may have"),
    ],
)
def test_a_radius_no_disc_can_have_is_told_in_cells(compress, radius, said):
    with pytest.raises(InputError, match=said):
        compress(radius=radius)


def test_a_dictionary_that_is_too_coarse_is_told(tmp_path, dictionary):
    fine = make_raster(
        tmp_path / "fine.tif", hills(40, 40), geotransform=(5e5, 0.5, 0, 4.6e6, 0, -0.5),
        crs="EPSG:32631",
    )  # fmt: skip
    said = r"the radius of the discs of '.*hills.dsd', of 4\d\d m is .* more than the 256 that"
    with pytest.raises(InputError, match=said):
        compress_file(fine, tmp_path / "x.sct", dictionary=dictionary)


def test_a_radius_of_a_cell_is_enough(compress):
    assert compress(radius=93, sparsity=1, atoms=4).rmse < compress(sparsity=1, atoms=4).rmse


def test_an_older_virtual_raster_is_warned_of(compress, tmp_path):
    assert compress(vrt=False).warnings == ()
    (tmp_path / "x.sct.vrt").touch()
    (warning,) = compress(vrt=False).warnings
    assert "x.sct.vrt' describes the file that was here before" in warning
    assert compress().warnings == ()


@pytest.mark.parametrize("window", [(1.5, 2, 3, 4), (1, 2, 3), "1234", (1, 2, 3, None)])
def test_a_window_is_four_whole_numbers(compress, tmp_path, window):
    compress()
    with pytest.raises(InputError, match="give four whole numbers"):
        decompress_file(tmp_path / "x.sct", tmp_path / "back.tif", window=window)
    assert not (tmp_path / "back.tif").exists()


@pytest.mark.parametrize("scale", [0.25, 0.5, 2])
def test_overviews_of_patches_lie_where_they_should(compress, dem, tmp_path, scale):
    compress(sparsity=4, atoms=32)
    made = decoded(tmp_path, scale=scale)
    whole = raster.read(dem)
    places = [
        np.floor((np.arange(count) + 0.5) * side / count).astype(int)
        for count, side in zip(made.values.shape, whole.values.shape, strict=True)
    ]
    right = whole.values[np.ix_(*places)].astype(float)
    known = ~made.void & ~whole.void[np.ix_(*places)]
    wrong = (made.values - right)[known]
    assert np.sqrt(np.mean(wrong**2)) < 0.04 * np.ptp(right[known])


def test_real_terrain(tmp_path):
    path = shared_data("pyrenees_raw/N42E001.hgt")
    one = raster.read(path, window=(slice(300, 620), slice(100, 420)))
    crop = make_raster(tmp_path / "crop.tif", one.values, nodata=-32768)
    for max_error, most in ((0, 5.5), (2, 3.1), (10, 1.5)):
        result = compress_file(
            crop, tmp_path / "x.sct", overwrite=True,
            options=CompressOptions(max_error=max_error, effort="low"),
        )  # fmt: skip
        assert result.max_error_measured <= max_error
        assert result.bits_per_cell < most
        two = decoded(tmp_path)
        np.testing.assert_array_equal(one.void, two.void)
        assert np.abs(one.values.astype(int) - two.values)[~one.void].max() <= max_error


class _Stop:
    def __init__(self, after):
        self._after = after

    def report(self, fraction):
        self._after -= 1

    def cancelled(self):
        return self._after < 0


@pytest.mark.parametrize("after", [0, 3, 12])
def test_cancel_leaves_nothing(dem, tmp_path, after):
    before = set(os.listdir(tmp_path))
    with pytest.raises(Cancelled):
        compress_file(dem, tmp_path / "x.sct", progress=_Stop(after))
    assert set(os.listdir(tmp_path)) == before


def test_scale_and_offset_count_in_the_error(tmp_path):
    def stretch(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(100)

    dem = make_raster(tmp_path / "dem.tif", hills(90, 90), setup=stretch)
    result = compress_file(
        dem, tmp_path / "x.sct", options=CompressOptions(max_error=0.5, effort="low")
    )
    assert 0.3 < result.max_error_measured <= 0.5
    two = decoded(tmp_path)
    assert np.abs(raster.read(dem).values.astype(int) - two.values).max() == 5
    assert (two.meta.scale, two.meta.offset) == (0.1, 100)


def test_public_names():
    assert demsmith.compress_file is compress_file
    assert demsmith.decompress_file is decompress_file
    assert demsmith.open_sct.__module__ == "demsmith.core.sct.file"
