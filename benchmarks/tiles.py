"""The real tiles that benchmarks run on: ``../shared/data`` beside the repository."""

from pathlib import Path

import numpy as np

from demsmith.core import raster

DATA = Path(__file__).resolve().parents[1].parent / "shared" / "data"

VOID_FREE = {
    "sierra_nevada": "sierra_nevada/N37W004.hgt",
    "white_mountains": "white_mountains/N44W072.hgt",
    "kossou_plain": "kossou_plain/n07_w006_3arc_v2.tif",
    "bigtujunga_utm": "bigtujunga_utm/bigtujunga.tif",
}
RAW = {
    "pyrenees_raw": "pyrenees_raw/N42E001.hgt",
    "catalonia_raw": "catalonia_raw/N41E001.hgt",
    "rainier_raw": "rainier_raw/mt_rainier_90m_N46W122.tif",
    "pair_naples (raw)": "pair_naples/raw/N40E014.hgt",
    "vancouver_raw": "vancouver_raw/N49W124.tif",
    "mindoro_raw": "mindoro_raw/N13E120.hgt",
    "saotome_raw": "saotome_raw/n00_e006_3arc_v2.dt1",
    "taunus_raw": "taunus_raw/N50E008.hgt",
    "sthelens_usgsdem": "sthelens_usgsdem/SainteHelens.dem",
    "multi_stormlake (orig)": "multi_stormlake/storml_elev_orig.tif",
    "edge (zero nodata, NaN)": "edge/dtm_philondenx_1m_zero_nodata.tif",
}


def void_free(name):
    """Read a void-free tile: float32 elevations and ground metres per pixel by row."""
    tile = raster.read(DATA / VOID_FREE[name])
    return tile.values.astype(np.float32), tuple(tile.grid.pixel_size_m())


def large():
    """Give ``sierra_nevada`` mirrored 3 x 3 and cut to 3601 x 3601, and its pixel sizes."""
    values, (dx, dy) = void_free("sierra_nevada")
    around = np.pad(values, values.shape, mode="symmetric")[:3601, :3601]
    sizes = tuple(np.pad(size, size.size, mode="symmetric")[:3601] for size in (dx, dy))
    return np.ascontiguousarray(around), sizes
