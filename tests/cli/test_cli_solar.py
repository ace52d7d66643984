"""``demsmith solar`` on rasters made on the spot."""

import json
import os

import numpy as np
import pytest
from gdal_reading import read
from support import digest, hills, make_raster

from demsmith.core.options import specifications
from demsmith.core.solar import SolarOptions

DAY = ("--date", "2024-03-20", "--step", 2)


@pytest.fixture
def dem(tmp_path):
    ground = 4 * hills(30, 40) - 800
    ground[10:13, 20:24] = -9999
    return make_raster(tmp_path / "dem.tif", ground, nodata=-9999)


@pytest.fixture
def output(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder / "light.tif"


def known(path):
    values, tag, _, _ = read(path)
    return values[values != tag]


def test_summary(demsmith, dem, output):
    before = digest(dem)
    status, out, err = demsmith("solar", dem, output, *DAY)
    assert (status, out) == (0, "")
    light = known(output)
    assert light.size == 30 * 40 - 12
    span = f"{light.min():.4g} to {light.max():.4g} Wh/m²/day"
    assert err.startswith(f"sunlight {span}, mean {light.mean():.4g}, by ")
    assert err.endswith(f" s -> {output}\n")
    assert digest(dem) == before


def test_json(demsmith, dem, output):
    hours = output.with_name("hours.tif")
    status, out, err = demsmith("solar", dem, output, "--json", *DAY, "--hours", hours)
    result = json.loads(out)
    assert (status, err) == (0, "")
    assert (result["output"], result["hours"], result["shadow"]) == (str(output), str(hours), None)
    assert (result["cells"], result["cells_void"]) == (1200, 12)
    assert result["unit"] == "Wh/m²/day"
    assert result["mean"] == pytest.approx(known(output).mean(), rel=1e-5)
    assert {"seconds", "version", "warnings", "instants"} < set(result)
    assert 8 < known(hours).mean() <= 12


def test_ways_to_say_the_same_day(demsmith, dem, output):
    made = set()
    for words in (
        ("--date", "2024-03-20"), ("--day", 80), ("--day", 80, "--year", 2024),
        ("--range", "2024-03-20", "2024-03-20"),
    ):  # fmt: skip
        assert demsmith("solar", dem, output, "--overwrite", "--step", 2, *words).status == 0
        made.add(known(output).tobytes())
    assert len(made) == 1


def test_ways_to_say_the_same_instant(demsmith, dem, output):
    made = set()
    for when in ("2024-03-20T08:00", "2024-03-20T08:00Z", "2024-03-20T10:00+02:00"):
        assert demsmith("solar", dem, output, "--overwrite", "--instant", when).status == 0
        made.add(known(output).tobytes())
    assert len(made) == 1


def test_a_year_is_the_mean_of_days_and_may_be_a_power(demsmith, dem, output):
    year = ("--annual", "--year", 2023, "--every", 91, "--step", 2, "--overwrite")
    assert demsmith("solar", dem, output, *year, "--json").status == 0
    sums = known(output)
    status, out, _ = demsmith("solar", dem, output, *year, "--watts", "--json")
    assert (status, json.loads(out)["unit"]) == (0, "W/m²")
    np.testing.assert_allclose(known(output), sums / 24, rtol=1e-6)


def test_every_option_of_the_core_is_one_here_and_matters(demsmith, dem, output):
    words = {
        "--step": ("--step", 1),
        "--atmosphere": ("--atmosphere", "ineichen"),
        "--linke": ("--linke", 5),
        "--albedo": ("--albedo", 0.6),
        "--shadows": ("--no-shadows",),
        "--diffuse-model": ("--diffuse-model", "isotropic"),
        "--hidden-sky": ("--hidden-sky",),
        "--directions": ("--hidden-sky", "--directions", 8),
        "--curvature": ("--no-curvature", "--horizons", output.with_name("horizons.tif")),
    }
    assert set(words) == {
        f"--{(spec.flag or spec.name).replace('_', '-')}" for spec in specifications(SolarOptions)
    }
    made = {}
    for name, options in {"default": (), **words}.items():
        command = ("solar", dem, output, "--date", "2024-12-20", "--overwrite", *options)
        more = () if "--step" in options else ("--step", 2)
        assert demsmith(*command, *more).status == 0, name
        made[name] = known(output).tobytes()
    # The Earth's curvature hides nothing on 4 km; that it reaches the core is seen elsewhere.
    assert len(set(made.values())) >= len(made) - 1


def test_source_and_run_options_matter(demsmith, tmp_path, dem, output):
    mask = np.zeros((30, 40), np.uint8)
    mask[:, :20] = 1
    mask = make_raster(tmp_path / "mask.tif", mask)
    done = demsmith(
        "solar", dem, output, *DAY, "--mask", mask, "--threads", 1, "--quiet",
        "--creation-option", "COMPRESS=LZW",
    )  # fmt: skip
    assert done == (0, "", "")
    assert known(output).size == 30 * 20 - 12


def test_all_further_outputs_of_an_instant(demsmith, dem, output):
    names = ("beam", "diffuse", "reflected", "shadow", "sky-view", "horizons")
    paths = {name: output.with_name(f"{name}.tif") for name in names}
    words = [word for name, path in paths.items() for word in (f"--{name}", path)]
    status, out, _ = demsmith(
        "solar", dem, output, "--instant", "2024-12-20T09:00Z", "--json", *words
    )
    assert status == 0
    told = json.loads(out)
    assert all(told[name.replace("-", "_")] == str(path) for name, path in paths.items())
    parts = sum(known(paths[name]) for name in ("beam", "diffuse", "reflected"))
    np.testing.assert_allclose(known(output), parts, rtol=1e-5)


def test_a_picture_of_heights_gets_its_light(demsmith, tmp_path, output):
    """No CRS, no geotransform: the latitude is told."""
    dem = make_raster(
        tmp_path / "heights.tif", hills(30, 40), crs="", geotransform=(0, 1, 0, 0, 0, 1)
    )
    assert "latitude" in demsmith("solar", dem, output, *DAY).err
    light = []
    for latitude in (-60, 0):
        done = demsmith("solar", dem, output, *DAY, "--latitude", latitude, "--overwrite")
        assert done.status == 0
        light.append(known(output).mean())
    assert light[0] < 0.8 * light[1]


def test_help(demsmith):
    status, out, err = demsmith("solar", "--help")
    assert (status, err) == (0, "")
    assert {"--instant", "--day", "--range", "--annual", "--linke", "--sky-view"} <= set(
        out.split()
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "give one of instant, day, date, range and annual"),
        (("--day", 3, "--annual"), "day and annual are given"),
        (("--day", 400), "1 to 366"),
        (("--day", 1.5), "'1.5' is no whole number"),
        ((*DAY, "--directions", 4.5), "'4.5' is no whole number"),
        (("--date", "20.3.2024"), "is no date"),
        (("--instant", "2024-03-20"), "no date and time"),
        (("--range", "2024-03-20"), "range"),
        ((*DAY, "--shadow", "{folder}/s.tif"), "shadow mask is of an instant"),
        ((*DAY[:2], "--step", 0), "step is 0"),
        ((*DAY, "--atmosphere", "thick"), "thick"),
        ((*DAY, "--linke", 0), "linke is 0"),
        ((*DAY, "--beam", "{folder}/beam.jpg"), "must be a GeoTIFF"),
        ((*DAY, "--latitude", 47), "itself tells where it lies"),
        ((*DAY, "--band", 3), "band 3"),
        ((*DAY, "--below", 99999), "every cell is a void"),
    ],
)  # fmt: skip
def test_refused(demsmith, dem, output, words, said):
    words = [str(word).format(folder=output.parent) for word in words]
    status, out, err = demsmith("solar", dem, output, *words)
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert said in err
    assert os.listdir(output.parent) == []


def test_existing_output_stays(demsmith, dem, output):
    output.write_text("precious")
    outcome = demsmith("solar", dem, output, *DAY)
    assert outcome.status == 2
    assert "--overwrite" in outcome.err
    assert output.read_text() == "precious"
