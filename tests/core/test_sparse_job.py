"""Learning from files to a file: what is read, written, told, and all or nothing."""

import json
import os

import numpy as np
import pytest
from scenes import fractal
from support import digest, make_raster

import demsmith
from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.sparse import learn, learn_file, read_dictionary
from demsmith.core.sparse.options import LearnOptions, StoreOptions

pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

GROUND = np.rint(fractal((90, 110), seed=2, relief=300)).astype(np.int16)
FEW = LearnOptions(atoms=12, iterations=4)
METRES = (500_000.0, 30.0, 0.0, 5_000_000.0, 0.0, -30.0)


def tile(path, values=GROUND, **options):
    return make_raster(path, values, **{"geotransform": METRES, "crs": "EPSG:32631", **options})


def test_learns_as_the_array_function_does(tmp_path):
    values = GROUND.copy()
    values[30:34, 50:60] = -9999
    source = tile(tmp_path / "in.tif", values, nodata=-9999)
    before = digest(source)
    result = learn_file(source, tmp_path / "out.dsd", options=FEW)
    learned = learn(values, values == -9999, options=FEW, pixel_size=30.0)
    dictionary = read_dictionary(tmp_path / "out.dsd")
    np.testing.assert_allclose(dictionary.samples, learned.dictionary.samples, atol=1e-6)
    assert dictionary.cell_size == (30, 30)
    assert (result.atoms, result.side_rows, result.side_columns) == (12, 10, 10)
    assert (result.discs, result.discs_skipped) == (learned.discs, learned.discs_skipped)
    assert result.discs_skipped > 0
    assert result.errors == learned.errors
    assert result.rmse == min(learned.errors)
    assert result.bytes == os.path.getsize(tmp_path / "out.dsd")
    assert json.loads(json.dumps(result.as_dict()))["version"] == demsmith.__version__
    assert digest(source) == before


def test_several_exemplars_are_told_apart_and_unlike_ones_named(tmp_path):
    sources = [
        tile(tmp_path / "a.tif"),
        tile(tmp_path / "b.tif", -GROUND, geotransform=(0, 90.0, 0, 0, 0, -90.0)),
    ]
    options = LearnOptions(method="constrained", atoms=30, iterations=2)
    result = learn_file(sources, tmp_path / "out.dsd", options=options)
    dictionary = read_dictionary(tmp_path / "out.dsd")
    assert {dictionary.provenance(i).exemplar for i in range(30)} == {"a.tif", "b.tif"}
    (warning,) = result.warnings
    assert "90 by 90 m" in warning
    alike = learn_file([sources[0]] * 2, tmp_path / "two.dsd", options=FEW)
    assert alike.warnings == ()


def test_a_complete_dictionary_holds_its_exemplar(tmp_path):
    source = tile(tmp_path / "a.tif")
    options = LearnOptions(method="complete", radius=120.0, factor=2)
    result = learn_file(source, tmp_path / "out.dsd", options=options)
    assert (result.rmse, result.errors, result.cell_size) == (None, (), (60, 60))
    assert (result.side_rows, result.factor) == (4, 2)
    dictionary = read_dictionary(tmp_path / "out.dsd")
    expected = learn(GROUND, options=options, pixel_size=30.0).dictionary
    np.testing.assert_array_equal(dictionary.samples, expected.samples)
    np.testing.assert_array_equal(dictionary.high([5]), expected.high([5]))
    assert result.bytes < GROUND.nbytes


def test_scale_and_radius_are_in_metres(tmp_path):
    def scaled(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(100)

    plain = learn_file(tile(tmp_path / "a.tif"), tmp_path / "a.dsd", options=FEW)
    tenth = learn_file(tile(tmp_path / "b.tif", setup=scaled), tmp_path / "b.dsd", options=FEW)
    assert tenth.rmse == pytest.approx(plain.rmse / 10, rel=1e-3)
    geographic = make_raster(tmp_path / "c.tif", GROUND)  # 3", 50° N: 60 by 93 m
    result = learn_file(
        geographic, tmp_path / "c.dsd", options=LearnOptions(atoms=8, radius=300.0, iterations=1)
    )
    assert (result.side_rows, result.side_columns) == (6, 10)


def test_stored_precision_and_threads(tmp_path):
    source = tile(tmp_path / "a.tif")
    paths = [tmp_path / f"{n}.dsd" for n in range(3)]
    learn_file(source, paths[0], options=FEW, threads=1)
    learn_file(source, paths[1], options=FEW, threads=2)
    learn_file(source, paths[2], options=FEW, store=StoreOptions(precision="int8"))
    assert digest(paths[0]) == digest(paths[1])
    assert os.path.getsize(paths[2]) < 0.5 * os.path.getsize(paths[0])


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        (dict(inputs=[]), InputError, "at least one raster"),
        (dict(inputs="none.tif"), InputError, "none.tif"),
        (dict(output="out.tif"), InputError, "end its name in .dsd"),
        (dict(output="none/out.dsd"), OutputError, "no folder"),
        (dict(band=2), InputError, "band 2"),
        (dict(below=99999), InputError, "a.tif': no disc"),
        (dict(options=LearnOptions(atoms=4000)), InputError, "4000 atoms cannot be learned"),
        (dict(options=LearnOptions(sparsity=0)), InputError, "sparsity is 0"),
        (dict(store=StoreOptions(precision="x")), InputError, "precision is 'x'"),
    ],
)
def test_errors_leave_nothing(tmp_path, monkeypatch, change, error, message):
    tile(tmp_path / "a.tif")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(error, match=message):
        learn_file(**{"inputs": "a.tif", "output": "out.dsd", **change})
    assert os.listdir(tmp_path) == ["a.tif"]


def test_what_is_there_stays_unless_it_may_be_overwritten(tmp_path):
    source, output = tile(tmp_path / "a.tif"), tmp_path / "out.dsd"
    output.write_bytes(b"precious")
    with pytest.raises(OutputError, match="exists"):
        learn_file(source, output, options=FEW)
    assert output.read_bytes() == b"precious"
    learn_file(source, output, options=FEW, overwrite=True)
    assert len(read_dictionary(output)) == 12


@pytest.mark.parametrize("stop", [0.05, 0.2, 0.6, 0.94])
def test_cancel_leaves_nothing(tmp_path, stop):
    class Stop:
        told = 0

        def report(self, fraction):
            assert fraction >= self.told
            self.told = fraction

        def cancelled(self):
            return self.told >= stop

    source = tile(tmp_path / "a.tif")
    with pytest.raises(Cancelled):
        learn_file(source, tmp_path / "out.dsd", options=FEW, progress=Stop())
    assert os.listdir(tmp_path) == ["a.tif"]
