"""``demsmith reconstruct`` on rasters made on the spot."""

import json
import os

import numpy as np
import pytest
from support import WGS84_3ARC, digest, hills, make_raster

from demsmith.core import raster
from demsmith.core.options import specifications
from demsmith.core.reconstruction import ReconstructOptions


@pytest.fixture
def dem(tmp_path):
    ground = hills()
    ground[10:13, 20:24] = -9999
    ground[58:, 40:44] = -9999
    return make_raster(tmp_path / "dem.tif", ground, nodata=-9999)


@pytest.fixture
def output(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder / "filled.tif"


def test_summary(demsmith, dem, output):
    before = digest(dem)
    status, out, err = demsmith("reconstruct", dem, output, "--method", "mcmd")
    assert (status, out) == (0, "")
    assert err.startswith("filled 20 cells in 2 voids in ")
    assert err.endswith(f" s -> {output}\n")
    assert not raster.read(output).void.any()
    assert digest(dem) == before


def test_json_and_all_outputs(demsmith, dem, output):
    names = {"--source-map": "s.tif", "--uncertainty": "u.tif", "--voids-layer": "v.gpkg",
             "--report": "r.html"}  # fmt: skip
    words = [word for flag, name in names.items() for word in (flag, output.parent / name)]
    status, out, err = demsmith(
        "reconstruct", dem, output, "--json", "--interior-only", *words, "--neighbours",
        output.parent.parent,
    )  # fmt: skip
    result = json.loads(out)
    assert status == 0
    assert "no neighbour" in err
    assert (result["voids"], result["cells_filled"], result["cells_unfilled"]) == (2, 12, 8)
    assert {"output", "seconds", "version", "warnings", "cells_by_source"} < set(result)
    made = {name for name in os.listdir(output.parent) if not name.endswith(".aux.xml")}
    assert made == {"filled.tif", "r.json", *names.values()}
    sigma = raster.read(output.parent / "u.tif")
    filled = raster.read(output.parent / "s.tif").values > 2
    assert (sigma.values[filled] > 0).all()


def test_every_option_of_the_core_is_one_here(demsmith):
    status, out, _ = demsmith("reconstruct", "--help")
    assert status == 0
    words = set(out.split())
    flags = {"--" + (spec.flag or spec.name).replace("_", "-")
             for spec in specifications(ReconstructOptions)}  # fmt: skip
    assert flags | {"--aux", "--neighbours", "--source-map", "--uncertainty", "--mask"} <= words


def test_what_is_on_by_default_can_be_turned_off(demsmith, tmp_path, output):
    ground = hills().astype(np.float32)
    ground[30, 30] += 900
    dem = make_raster(tmp_path / "spiked.tif", ground)
    kept = []
    for words in ((), ("--no-outliers",)):
        assert demsmith("reconstruct", dem, output, "--overwrite", *words).status == 0
        kept.append(raster.read(output).values[30, 30] == ground[30, 30])
    assert kept == [False, True]


def test_summary_tells_where_cells_are_from_and_which_were_removed(demsmith, tmp_path, output):
    west, east = tmp_path / "west", tmp_path / "east"
    ground = hills(200, 260).astype(np.float32)
    ground[:, :100] = 7
    ground[60, 150] += 900
    ground[30:34, 40:44] = ground[100:105, 199] = -9999
    x, step, _, y, *_ = WGS84_3ARC
    there = x + 190 * step, step, 0, y, 0, -step
    for folder, values, place in (
        (west, ground[:, :200], WGS84_3ARC), (east, hills(200, 260)[:, 190:], there),
    ):  # fmt: skip
        folder.mkdir()
        make_raster(folder / "dem.tif", values, geotransform=place, nodata=-9999)
    words = "--method", "mcmd", "--neighbours", east
    _, _, err = demsmith("reconstruct", west / "dem.tif", output, *words)
    told = "filled 22 cells in 2 voids (neighbouring tile: 5, water held flat: 16), 1 of them "
    assert err.splitlines()[-1].startswith(told + "known before and not believed in ")
    _, _, err = demsmith("mosaic", west, tmp_path / "out", "--method", "mcmd", "--workers", 0)
    told = "filled 22 cells in 3 voids of 1 tiles (water held flat: 16), 1 of them known before"
    assert told in err


def test_auxiliary_fills_what_no_interpolation_could_know(demsmith, tmp_path, output):
    rng = np.random.default_rng(0)
    truth = np.cumsum(np.cumsum(rng.normal(size=(300, 300)), 0), 1)
    truth = (500 + 300 * (truth - truth.mean()) / truth.std()).astype(np.float32)
    truth += 20 * np.sin(np.arange(300) / 3) * np.sin(np.arange(300)[:, None] / 4)
    holed = truth.copy()
    holed[100:140, 120:170] = -9999
    dem = make_raster(tmp_path / "holed.tif", holed, nodata=-9999)
    aux = make_raster(tmp_path / "aux.tif", truth + 7)
    errors = []
    for words in ((), ("--aux", aux)):
        told = demsmith("reconstruct", dem, output, "--overwrite", "--json", *words)
        assert told.status == 0
        made = raster.read(output).values[100:140, 120:170]
        errors.append(np.abs(made - truth[100:140, 120:170]).mean())
    assert errors[1] < 0.3 * errors[0]
    (alignment,) = json.loads(told.out)["auxiliaries"]
    assert alignment["path"] == aux
    assert alignment["accepted"]
    assert abs(alignment["bias"] - 7) < 0.5


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--aux", "nowhere.tif"), "nowhere.tif"),
        (("--aux", "dem.tif", "--method", "mcmd"), "auxiliary needs the method auto"),
        (("--method", "magic"), "magic"),
        (("--report", "report.pdf"), "report.pdf"),
        (("--neighbours", "nowhere"), "nowhere"),
        (("--band", 3), "band 3"),
        (("--below", 99999), "every cell is a void"),
    ],
)
def test_refused(demsmith, dem, output, words, said, monkeypatch):
    monkeypatch.chdir(os.path.dirname(dem))
    status, out, err = demsmith("reconstruct", dem, output, *words)
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert said in err
    assert os.listdir(output.parent) == []
