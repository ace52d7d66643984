"""The ground that compression is judged on: every elevation raster of the shared data, and `large`.

Left out are the samples of ``edge`` of a few hundred cells, where a file is all header.
"""

import functools
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import tiles

from demsmith.core import raster

LARGE = "large"
SRTM = {
    "sierra_nevada": "sierra_nevada/N37W004.hgt",
    "white_mountains": "white_mountains/N44W072.hgt",
    "kossou_plain": "kossou_plain/n07_w006_3arc_v2.tif",
    "pyrenees_raw": "pyrenees_raw/N42E001.hgt",
    "catalonia_raw": "catalonia_raw/N41E001.hgt",
    "rainier_raw": "rainier_raw/mt_rainier_90m_N46W122.tif",
    "pair_naples (raw)": "pair_naples/raw/N40E014.hgt",
    "pair_naples (filled)": "pair_naples/filled/N40E014.hgt",
    "vancouver_raw": "vancouver_raw/N49W124.tif",
    "mindoro_raw": "mindoro_raw/N13E120.hgt",
    "saotome_raw": "saotome_raw/n00_e006_3arc_v2.dt1",
    "taunus_raw": "taunus_raw/N50E008.hgt",
    "pair_sangabriel (NASADEM)": "pair_sangabriel/nasadem_1s.tif",
    "bigtujunga_utm": "bigtujunga_utm/bigtujunga.tif",
}
SMALL = {
    "sthelens_usgsdem": "sthelens_usgsdem/SainteHelens.dem",
    "pair_bigbutte (SRTM)": "pair_bigbutte/big_butte_small_SRTM_utm12.tif",
    "multi_stormlake": "multi_stormlake/storml_elev.tif",
    "multi_stormlake (orig)": "multi_stormlake/storml_elev_orig.tif",
}
FLOAT = {
    "pair_sangabriel (Copernicus)": "pair_sangabriel/copernicus_glo30_1s.tif",
    "pair_bigbutte (NED)": "pair_bigbutte/big_butte_NED_utm12.tif",
    "gabilan_lidar1m": "gabilan_lidar1m/gabilan.bil",
    "slovenia_lidar1m": "slovenia_lidar1m/TM1_564_146.tif",
    "multi_tahoe (bare earth)": "multi_tahoe/tahoe_lidar_bareearth.tif",
    "multi_tahoe (highest hit)": "multi_tahoe/tahoe_lidar_highesthit.tif",
    "edge (zero nodata, NaN)": "edge/dtm_philondenx_1m_zero_nodata.tif",
}
PATHS = SRTM | SMALL | FLOAT
NAMES = (*SRTM, *SMALL, LARGE, *FLOAT)
INTEGER_ERRORS = (0, 1, 2, 5, 10, 20)
FLOAT_ERRORS = (0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10, 20)


@dataclass(frozen=True, eq=False)
class Ground:
    """A raster to be compressed.

    Attributes
    ----------
    name : str
    band : Raster
        As read; of `large`, as `tiles.large` makes it, in int16.
    values : (H, W) int32 or float64 array
        Elevations [m]; int32 if all are whole numbers, whatever the band's type.
    """

    name: str
    band: raster.Raster
    values: np.ndarray

    @property
    def void(self):
        """Where nothing is known, (H, W) bool."""
        return self.band.void

    @property
    def whole(self):
        """Whether all elevations are whole numbers."""
        return self.values.dtype.kind == "i"

    @property
    def errors(self):
        """The greatest errors [m] that are asked for."""
        return INTEGER_ERRORS if self.whole else FLOAT_ERRORS

    @property
    def cells(self):
        """Number of cells, voids too: bits per cell are of these."""
        return self.values.size

    @property
    def relief(self):
        """Range of the elevations [m], the peak of PSNR."""
        known = self.values[~self.void]
        return float(known.max() - known.min())

    def psnr(self, rmse):
        """Give a root mean square error [m] in dB below the relief."""
        return float(20 * np.log10(self.relief / rmse)) if rmse else float("inf")

    def file(self, folder):
        """Give the path of the raster; `large` is written into the folder."""
        if self.name in PATHS:
            return tiles.DATA / PATHS[self.name]
        path = Path(folder) / f"{self.name}.tif"
        if not path.exists():
            raster.write(path, self.band.values, like=self.band)
        return path


@functools.lru_cache(maxsize=2)
def ground(name):
    """Read a raster."""
    band = _large() if name == LARGE else raster.read(tiles.DATA / PATHS[name])
    known = np.where(band.void, band.values[~band.void].min(), band.values)
    if np.array_equal(known, np.rint(known)):
        return Ground(name, band, known.astype(np.int32))
    return Ground(name, band, known.astype(np.float64))


def _large():
    like = raster.read(tiles.DATA / PATHS["sierra_nevada"])
    values = tiles.large()[0].astype(np.int16)
    return replace(
        like,
        values=values,
        void=np.zeros(values.shape, bool),
        grid=replace(like.grid, shape=values.shape),
    )
