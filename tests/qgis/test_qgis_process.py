"""The plugin in the real `qgis_process`, as a user installs it."""

import json

import numpy as np
from gdal_reading import read

VOID = -32768


def test_the_tool_is_listed_with_its_words(qgis_process):
    told = json.loads(qgis_process("--json", "help", "demsmith:fillvoids").stdout)
    assert told["provider_details"]["name"] == "Demsmith"
    assert {"INPUT", "METHOD", "OUTPUT", "L_BU"} <= set(told["parameters"])
    assert {"CELLS_FILLED", "WARNINGS"} <= set(told["outputs"])


def test_fills_a_tile(qgis_process, holed, tmp_path):
    source, values = holed
    target = tmp_path / "filled.tif"
    done = qgis_process(
        "--json", "run", "demsmith:fillvoids", f"--INPUT={source}", "--VARIANT=weighted",
        f"--OUTPUT={target}",
    )  # fmt: skip
    results = json.loads(done.stdout)["results"]
    assert results["OUTPUT"] == str(target)
    assert (results["CELLS_FILLED"], results["CELLS_UNFILLED"]) == (58, 0)
    filled = read(str(target))[0]
    assert np.array_equal(filled[values != VOID], values[values != VOID])
    assert not (filled == VOID).any()


def test_says_what_is_wrong(qgis_process, holed, tmp_path):
    target = tmp_path / "filled.tif"
    done = qgis_process(
        "run", "demsmith:fillvoids", f"--INPUT={holed[0]}", "--BAND=4", f"--OUTPUT={target}"
    )
    assert "band 4 asked" in done.stdout + done.stderr
    assert not target.exists()
