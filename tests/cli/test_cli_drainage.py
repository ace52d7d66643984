"""``demsmith drainage`` on rasters made on the spot."""

import json
import os

import numpy as np
import pytest
from scenes import fractal
from support import digest, make_raster

from demsmith.core import raster
from demsmith.core.hydrology import DrainageOptions, drainage_area
from demsmith.core.options import specifications

SQUARE = (500_000.0, 30.0, 0.0, 4_700_000.0, 0.0, -30.0)
GROUND = np.rint(fractal((40, 50), seed=3, relief=400)).astype(np.int16)
RASTERS = (
    "log", "specific", "directions", "flags", "conditioned", "stream-mask", "coarse",
)  # fmt: skip


@pytest.fixture
def dem(tmp_path):
    ground = GROUND.copy()
    ground[10:13, 20:24] = -9999
    return make_raster(
        tmp_path / "dem.tif", ground, nodata=-9999, geotransform=SQUARE, crs="EPSG:32631"
    )


@pytest.fixture
def output(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder / "area.tif"


def test_summary(demsmith, dem, output):
    before = digest(dem)
    status, out, err = demsmith("drainage", dem, output)
    assert (status, out) == (0, "")
    assert err.startswith("drained 1988 cells, ")
    assert " changed in depressions, largest upstream area " in err
    assert " m2 in " in err
    assert err.endswith(f" s -> {output}\n")
    drained = drainage_area(GROUND, raster.read(dem).void, pixel_size=30)
    np.testing.assert_array_equal(raster.read(output).values[~drained.void],
                                  drained.area[~drained.void])  # fmt: skip
    assert digest(dem) == before


def test_json_with_every_output(demsmith, dem, output):
    files = {name: output.with_name(f"{name}.tif") for name in RASTERS}
    files["streams"] = output.with_name("streams.gpkg")
    words = [word for name, path in files.items() for word in (f"--{name}", path)]
    status, out, err = demsmith("drainage", dem, output, "--json", "--threshold", 9000, *words)
    result = json.loads(out)
    assert (status, err) == (0, "")
    assert (result["cells"], result["cells_void"]) == (2000, 12)
    assert result["output"] == str(output)
    for name, path in files.items():
        assert result[name.replace("-", "_")] == str(path)
        assert path.exists()
    assert result["standard_error"] is None
    assert result["links"] > 3
    assert result["stream_length_m"] > 100
    assert {"seconds", "version", "warnings", "cells_changed", "largest_area"} < set(result)


def test_streams_are_in_the_summary(demsmith, dem, output):
    streams = output.with_suffix(".geojson")
    status, _, err = demsmith("drainage", dem, output, "--streams", streams, "--threshold", 9000)
    assert status == 0
    assert " stream links of " in err
    assert ", order up to " in err
    status, _, err = demsmith(
        "drainage", dem, output, "--streams", streams, "--threshold", 1e12, "--overwrite"
    )
    assert status == 0
    assert err.startswith("warning: no stream")


def test_every_option_of_the_core_is_one_here_and_matters(demsmith, dem, output):
    made = {
        "--unit": ("--unit", "cells"),
        "--method": ("--method", "particles"),
        "--particles": ("--method", "particles", "--particles", 1000),
        "--seed": ("--method", "particles", "--seed", 3),
        "--exponent": ("--method", "mfd", "--exponent", 4),
        "mfd": ("--method", "mfd"),
        "dinf": ("--method", "dinf"),
        "": (),
        "--depressions": ("--depressions", "keep"),
        "breach": ("--depressions", "breach"),
        "--max-length": ("--depressions", "breach", "--max-length", 50),
        "--max-depth": ("--max-depth", 1),
        "--threshold": ("--threshold", 5000),
        "--coarse-factor": ("--coarse-factor", 5),
    }
    words = {f"--{spec.name.replace('_', '-')}" for spec in specifications(DrainageOptions)}
    assert words == {name for name in made if name.startswith("--")}
    others = output.with_name("mask.tif"), output.with_name("coarse.tif")
    seen = set()
    for options in made.values():
        done = demsmith(
            "drainage", dem, output, "--overwrite", "--stream-mask", others[0], "--coarse",
            others[1], *options,
        )  # fmt: skip
        assert done.status == 0, done.err
        seen.add(tuple(raster.read(path).values.tobytes() for path in (output, *others)))
    assert len(seen) == len(made)


def test_source_and_run_options_matter(demsmith, tmp_path, dem, output):
    mask = np.zeros(GROUND.shape, np.uint8)
    mask[:, :20] = 1
    mask = make_raster(tmp_path / "mask.tif", mask, geotransform=SQUARE, crs="EPSG:32631")
    done = demsmith(
        "drainage", dem, output, "--mask", mask, "--above", 300, "--threads", 1, "--quiet",
        "--creation-option", "COMPRESS=LZW",
    )  # fmt: skip
    assert done == (0, "", "")
    known = ~raster.read(output).void
    assert not known[:, :20].any()
    assert raster.read(dem).values[known].max() < 300


def test_weights_and_filled_cells(demsmith, tmp_path, dem, output):
    ones = make_raster(
        tmp_path / "ones.tif", np.full(GROUND.shape, 2, np.uint8), geotransform=SQUARE,
        crs="EPSG:32631",
    )  # fmt: skip
    flags = output.with_name("flags.tif")
    done = demsmith(
        "drainage", dem, output, "--weights", ones, "--filled-mask", ones, "--flags", flags
    )
    assert done.status == 0
    assert "m2" not in done.err
    drained = drainage_area(GROUND, raster.read(dem).void, unit="cells")
    np.testing.assert_array_equal(raster.read(output).values[~drained.void],
                                  2 * drained.area[~drained.void])  # fmt: skip
    flags = raster.read(flags)
    assert (flags.values[~flags.void] & 2 > 0).all()


def test_help(demsmith):
    status, out, err = demsmith("drainage", "--help")
    assert (status, err) == (0, "")
    assert {"--method", "--depressions", "--streams", "--filled-mask", "--json"} <= set(out.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--method", "d9"), "d9"),
        (("--unit", "acres"), "acres"),
        (("--exponent", -1), "exponent is -1"),
        (("--standard-error", "error.tif"), "no standard error"),
        (("--streams", "streams.shp"), "shapefile"),
        (("--filled-mask", "no.tif"), "for the flags"),
        (("--weights", "no.tif"), "no.tif"),
        (("--band", 3), "band 3"),
        (("--below", 99999), "every cell is a void"),
    ],
)
def test_refused(demsmith, dem, output, words, said):
    status, out, err = demsmith("drainage", dem, output, *words)
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert said in err
    assert os.listdir(output.parent) == []


def test_existing_output_stays(demsmith, dem, output):
    output.write_text("precious")
    outcome = demsmith("drainage", dem, output)
    assert outcome.status == 2
    assert "--overwrite" in outcome.err
    assert output.read_text() == "precious"
