"""How good fills are: against the truth, GDAL's, and the other variants."""

import numpy as np
import pytest
from scenes import fractal
from support import shared_data

from demsmith.core import raster
from demsmith.core.raster.peer import gdal_fill
from demsmith.core.validation import errors_by_size, punch_voids
from demsmith.core.voids import fill_voids

ENGINES = {
    "accurate": {}, "relaxed": dict(method="mcmd"), "weighted": dict(variant="weighted"),
    "paper": dict(variant="paper"),
}  # fmt: skip


def ground(exponent):
    """Fractal ground of 90 m cells, and SRTM-like voids."""
    truth = fractal((700, 700), seed=1, relief=2500, exponent=exponent).astype(np.float32)
    return truth, punch_voids(truth, seed=3)


def rmse(filled, truth, void):
    return np.array([error.rmse for error in errors_by_size(filled, truth, void)])


def by_gdal(truth, void):
    pytest.importorskip("osgeo.gdal", reason="GDAL is missing")
    return gdal_fill(truth, void)[0]


@pytest.mark.parametrize("exponent", [2.0, 1.7])
def test_fractal_ground(exponent):
    """Never worse than GDAL, a quarter better in small voids; each variant better than the one it
    improves on, and the accurate engine better than all in every class.
    """
    truth, void = ground(exponent)
    error = {
        engine: rmse(fill_voids(truth, void, **options).values, truth, void)
        for engine, options in ENGINES.items()
    }
    gdal = rmse(by_gdal(truth, void), truth, void)
    assert (error["relaxed"] <= gdal).all(), (error["relaxed"], gdal)
    assert error["relaxed"][0] <= 0.75 * gdal[0]
    assert (error["accurate"] < error["relaxed"]).all(), (error["accurate"], error["relaxed"])
    assert error["relaxed"][-1] < error["weighted"][-1] < error["paper"][-1]


@pytest.mark.parametrize(
    "name",
    [
        "sierra_nevada/N37W004.hgt",
        "white_mountains/N44W072.hgt",
        "kossou_plain/n07_w006_3arc_v2.tif",
        "bigtujunga_utm/bigtujunga.tif",
    ],
)
def test_real_ground(name):
    """What the README promises of the fast engine: three masks pooled, no class of voids worse
    than by GDAL.
    """
    tile = raster.read(shared_data(name))
    truth, pixel_size = tile.values.astype(np.float32), tile.grid.pixel_size_m()
    masks = [punch_voids(truth, seed=seed) for seed in range(3)]

    def error(**options):
        return pooled(
            lambda void: fill_voids(truth, void, pixel_size=pixel_size, **options).values,
            truth, masks,
        )  # fmt: skip

    relaxed = error(method="mcmd")
    gdal = pooled(lambda void: by_gdal(truth, void), truth, masks)
    assert (relaxed <= gdal).all(), (relaxed, gdal)
    # The reference variants come behind in this order; on the plain they are even within 1 %.
    weighted, paper = error(variant="weighted")[-1], error(variant="paper")[-1]
    assert relaxed[-1] < min(weighted, paper)
    assert weighted < 1.01 * paper


def pooled(fill, truth, masks):
    """The RMSE by size class over all masks."""
    squares, cells = np.zeros(5), np.zeros(5)
    for void in masks:
        errors = errors_by_size(fill(void), truth, void)
        squares += [error.rmse**2 * error.cells for error in errors]
        cells += [error.cells for error in errors]
    return np.sqrt(squares / cells)


def test_scattered_cells_can_be_rebuilt():
    """The paper's figure 10: ground from 3.4 % of its cells. The bottom-up pass is made for it."""
    truth = fractal((257, 257), seed=2)
    void = np.random.default_rng(0).random(truth.shape) > 0.034
    for variant, bound in (("weighted", 0.02), ("paper", 0.025)):
        filled = fill_voids(truth, void, variant=variant).values
        assert np.sqrt(((filled - truth)[void] ** 2).mean()) < bound * np.ptp(truth)
