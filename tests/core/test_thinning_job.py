"""Thinning from file to file: values, tags, points, and all outputs or none."""

import os

import numpy as np
import pytest
from gdal_reading import read
from scenes import disc, fractal
from support import digest, make_raster

from demsmith.core import raster
from demsmith.core.errors import Cancelled, InputError, OutputError
from demsmith.core.thinning import ThinOptions, thin, thin_file

pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

SHAPE = (60, 80)
VOID = disc(SHAPE, (30, 30), 9)
KNOWN = int((~VOID).sum())


def tile(path, *, dtype="int16", nodata=-32768, setup=None):
    values = np.rint(fractal(SHAPE, seed=2, relief=200)).astype(dtype)
    values[VOID] = nodata
    return make_raster(path, values, nodata=nodata, setup=setup)


def stored(path):
    """Values, kept cells, nodata tag."""
    values, tag, _, _ = read(path)
    return values, np.isfinite(values) if tag != tag else values != tag, tag


@pytest.mark.parametrize(
    ("dtype", "nodata"),
    [("uint8", 255), ("int16", -32768), ("uint16", 0), ("int32", -9999), ("float32", -9999)],
)
def test_thins_as_the_array_function_does(tmp_path, dtype, nodata):
    source = tile(tmp_path / "in.tif", dtype=dtype, nodata=nodata)
    before = digest(source)
    result = thin_file(source, tmp_path / "out.tif", options=ThinOptions(share=0.05))
    tif = raster.read(source)
    expected = thin(tif.values, tif.void, share=0.05, pixel_size=tif.grid.pixel_size_m())
    values, kept, tag = stored(tmp_path / "out.tif")
    np.testing.assert_array_equal(kept, expected.kept)
    assert values[kept].tobytes() == tif.values[kept].tobytes()
    assert values.dtype == dtype
    assert tag == nodata
    assert (result.cells, result.cells_known) == (4800, int((~tif.void).sum()))
    assert result.cells_kept == kept.sum() == int(0.05 * result.cells_known)
    assert result.output == str(tmp_path / "out.tif")
    assert result.points is None
    assert raster.read(tmp_path / "out.tif").grid == tif.grid
    assert digest(source) == before


def test_a_tile_without_a_tag_gets_one_that_no_kept_cell_has(tmp_path):
    for dtype in ("uint8", "int16", "float32"):
        values = fractal(SHAPE, relief=255).astype(dtype)
        source = make_raster(tmp_path / "in.tif", values)
        thin_file(source, tmp_path / "out.tif", options=ThinOptions(share=0.02), overwrite=True)
        out, kept, tag = stored(tmp_path / "out.tif")
        assert tag is not None
        assert kept.sum() == 96
        np.testing.assert_array_equal(out[kept], values[kept])


def test_voids_named_by_the_user_become_nodata(tmp_path):
    values = np.rint(fractal(SHAPE, relief=200)).astype(np.int16) + 1
    values[VOID] = -9999
    source = make_raster(tmp_path / "in.tif", values, nodata=0)
    result = thin_file(source, tmp_path / "out.tif", nodata=(-9999,))
    out, kept, tag = stored(tmp_path / "out.tif")
    assert (tag, result.cells_known) == (0, KNOWN)
    assert not (kept & VOID).any()
    assert (out[~kept] == 0).all()


@pytest.mark.parametrize("extension", ["gpkg", "geojson", "csv"])
def test_points_are_the_kept_cells(tmp_path, extension):
    def decimetres(dataset):
        dataset.GetRasterBand(1).SetScale(0.1)
        dataset.GetRasterBand(1).SetOffset(100.0)

    source = tile(tmp_path / "in.tif", setup=decimetres)
    points = tmp_path / f"points.{extension}"
    result = thin_file(source, tmp_path / "out.tif", points=points)
    assert result.points == str(points)
    values, kept, _ = stored(tmp_path / "out.tif")
    features = raster.read_samples_file(points)
    x, y = raster.read(source).grid.xy(*np.nonzero(kept))
    assert len(features.points) == result.cells_kept
    np.testing.assert_allclose(
        features.points, np.column_stack([x, y, values[kept] * 0.1 + 100]), rtol=0, atol=1e-9
    )


def test_rebuilds_from_its_output(tmp_path):
    """`fill` takes the output as it is, and keeps its cells."""
    from demsmith.core.voids import FillOptions, fill_file

    source = tile(tmp_path / "in.tif")
    thin_file(source, tmp_path / "out.tif", options=ThinOptions(share=0.2))
    options = FillOptions(method="mcmd")
    result = fill_file(tmp_path / "out.tif", tmp_path / "rebuilt.tif", options=options)
    values, kept, _ = stored(tmp_path / "out.tif")
    rebuilt = stored(tmp_path / "rebuilt.tif")[0]
    assert result.cells_unfilled == 0
    np.testing.assert_array_equal(rebuilt[kept], values[kept])
    error = (rebuilt - stored(source)[0].astype(float))[~VOID]
    assert np.sqrt((error**2).mean()) < 2


class Stop:
    """Cancels at a fraction of the way."""

    def __init__(self, at):
        self.at, self.last = at, 0

    def report(self, fraction):
        self.last = fraction

    def cancelled(self):
        return self.last >= self.at


@pytest.mark.parametrize("older", [False, True])
@pytest.mark.parametrize("at", [0.1, 0.5, 0.84, 1.0])
def test_cancelled_leaves_nothing(tmp_path, older, at):
    source = tile(tmp_path / "in.tif")
    folder = tmp_path / "out"
    folder.mkdir()
    if older:
        (folder / "out.tif").write_text("older")
        (folder / "points.gpkg").write_text("older")
    with pytest.raises(Cancelled):
        thin_file(
            source, folder / "out.tif", points=folder / "points.gpkg", overwrite=older,
            progress=Stop(at),
        )  # fmt: skip
    assert sorted(os.listdir(folder)) == (["out.tif", "points.gpkg"] if older else [])
    assert all((folder / name).read_text() == "older" for name in os.listdir(folder))


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        (dict(output="out.png"), InputError, "must be a GeoTIFF"),
        (dict(output="in.tif"), InputError, "is an input"),
        (dict(output="none/out.tif"), OutputError, "no folder"),
        (dict(points="points.xyz"), InputError, "points.xyz"),
        (dict(points="none/points.gpkg"), OutputError, "no folder"),
        (dict(band=2), InputError, "band 2"),
        (dict(below=1e5), InputError, "in.tif': every cell is a void"),
        (dict(options=ThinOptions(share=2)), InputError, "share is 2"),
        (dict(creation_options=["COMPRESS=MAGIC"]), InputError, "creation option"),
    ],
)
def test_what_cannot_be_done_is_said_and_leaves_nothing(tmp_path, arguments, error, said):
    source = tile(tmp_path / "in.tif")
    arguments = {"output": "out.tif", "points": "points.gpkg", "overwrite": True, **arguments}
    for name in ("output", "points"):
        arguments[name] = tmp_path / arguments[name]
    with pytest.raises(error, match=said):
        thin_file(source, **arguments)
    assert os.listdir(tmp_path) == ["in.tif"]
