"""Filling the real tiles: nothing left, nothing known changed, nothing absurd."""

import numpy as np
import pytest
from support import digest, shared_data

from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.voids import FillOptions, fill_file, fill_voids

pytest.importorskip("osgeo.gdal", reason="GDAL is missing")

RAW = [
    "pyrenees_raw/N42E001.hgt",
    "catalonia_raw/N41E001.hgt",
    "rainier_raw/mt_rainier_90m_N46W122.tif",
    "pair_naples/raw/N40E014.hgt",
    "vancouver_raw/N49W124.tif",
    "mindoro_raw/N13E120.hgt",
    "saotome_raw/n00_e006_3arc_v2.dt1",
    "taunus_raw/N50E008.hgt",
    "sthelens_usgsdem/SainteHelens.dem",
    "multi_stormlake/storml_elev_orig.tif",
    "edge/dtm_philondenx_1m_zero_nodata.tif",
    "edge/no_srs.tif",
    "edge/tiny_6x4.tif",
    "edge/skinny_8x160.tif",
]


every_method = pytest.mark.parametrize("method", ["auto", "mcmd"])


def same_crs(one, other):
    """The same in meaning: GeoTIFF keeps a code, not the words of the text."""
    from osgeo import osr

    if not one or not other:
        return one == other
    systems = [osr.SpatialReference(wkt=text) for text in (one, other)]
    for system in systems:
        system.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    return bool(systems[0].IsSame(systems[1], ["IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES"]))


@pytest.mark.parametrize(
    "options",
    [{}, dict(method="mcmd"), dict(variant="weighted"), dict(variant="paper")],
    ids=["accurate", "relaxed", "weighted", "paper"],
)
@pytest.mark.parametrize("name", RAW)
def test_raw_tiles(tmp_path, name, options):
    path = shared_data(name)
    fingerprint, before = digest(path), raster.read(path)
    result = fill_file(path, tmp_path / "out.tif", options=FillOptions(**options))
    after = raster.read(tmp_path / "out.tif")
    assert not after.void.any() and result.cells_unfilled == 0
    assert result.cells_filled == before.void.sum()
    assert after.values.dtype == before.values.dtype
    np.testing.assert_array_equal(after.values[~before.void], before.values[~before.void])
    assert after.grid.shape == before.grid.shape
    assert after.grid.geotransform == before.grid.geotransform
    assert same_crs(before.grid.crs, after.grid.crs)
    assert digest(path) == fingerprint
    known = before.values[~before.void].astype(np.float64)
    filled = after.values[before.void]
    if filled.size:
        room = 0.05 * np.ptp(known)
        assert known.min() - room <= filled.min() and filled.max() <= known.max() + room


@every_method
def test_voids_overshoot_their_rims_little(method):
    """Of 671 real voids of the Pyrenees, no filled cell lies beyond its rim by more than the rim's
    relief, and 95 % of the voids stay within a quarter of it.
    """
    tile = raster.read(shared_data("pyrenees_raw/N42E001.hgt"))
    filled = fill_voids(
        tile.values, tile.void, method=method, pixel_size=tile.grid.pixel_size_m(),
        float_output=True,
    )  # fmt: skip
    labels = filled.voids.labels[tile.void] - 1
    values = filled.values[tile.void]
    low, high = np.full(len(filled.voids), np.inf), np.full(len(filled.voids), -np.inf)
    np.minimum.at(low, labels, values)
    np.maximum.at(high, labels, values)
    relief = np.maximum(filled.rims.high - filled.rims.low, 10)
    beyond = np.maximum(filled.rims.low - low, high - filled.rims.high) / relief
    assert beyond.max() < 1
    assert np.quantile(beyond, 0.95) < 0.25


def test_all_nodata_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"all_nodata\.tif.*every cell is a void"):
        fill_file(shared_data("edge/all_nodata.tif"), tmp_path / "out.tif")
    assert list(tmp_path.iterdir()) == []


@every_method
@pytest.mark.parametrize("half", ["west", "south"])
def test_half_a_tile_void(half, method):
    """Extrapolated: within the known range and a tenth of it, and level far from the rim."""
    tile = raster.read(shared_data("sierra_nevada/N37W004.hgt"))
    void = np.zeros(tile.values.shape, bool)
    void[(slice(None), slice(0, 600)) if half == "west" else (slice(601, None),)] = True
    size = tile.grid.pixel_size_m()
    filled = fill_voids(tile.values, void, method=method, pixel_size=size).values
    known = tile.values[~void]
    room = 0.1 * np.ptp(known)
    assert filled[void].min() >= known.min() - room and filled[void].max() <= known.max() + room
    assert np.unique(filled[void]).size > 50
