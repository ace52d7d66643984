"""The ground that void filling is judged on, and the voids that are cut into it."""

import functools
from dataclasses import dataclass

import numpy as np
import tiles

from demsmith.core import raster
from demsmith.core.validation import punch_voids, single_holes, transplant_voids, void_shapes

# Every tile of the shared data without voids, and those that come in pairs. The margins of
# St. Helens, which are nodata, are cut off.
PATHS = tiles.VOID_FREE | {
    "pair_naples (filled)": "pair_naples/filled/N40E014.hgt",
    "pair_sangabriel (NASADEM)": "pair_sangabriel/nasadem_1s.tif",
    "pair_bigbutte (NED)": "pair_bigbutte/big_butte_NED_utm12.tif",
    "sthelens_usgsdem": "sthelens_usgsdem/SainteHelens.dem",
    "gabilan_lidar1m": "gabilan_lidar1m/gabilan.bil",
    "slovenia_lidar1m": "slovenia_lidar1m/TM1_564_146.tif",
    "pair_sangabriel (Copernicus)": "pair_sangabriel/copernicus_glo30_1s.tif",
    "pair_bigbutte (SRTM)": "pair_bigbutte/big_butte_small_SRTM_utm12.tif",
    "multi_tahoe (bare earth)": "multi_tahoe/tahoe_lidar_bareearth.tif",
}
INTERIORS = {"sthelens_usgsdem": (slice(4, 464), slice(5, 322))}
KINDS = ("mixture", "transplanted", "single")
SEEDS = (0, 1, 2)
SHARE = 0.05  # of the cells that are cut out, about
SHAPES = ("pyrenees_raw", "vancouver_raw", "rainier_raw", "saotome_raw")
SINGLE_HOLES = (1500, 2500, 4000, 6500, 10_000)


@dataclass(frozen=True, eq=False)
class Tile:
    """Ground without voids.

    Attributes
    ----------
    name : str
    values : (H, W) float32 array
        Elevations [m].
    grid : Grid
    """

    name: str
    values: np.ndarray
    grid: raster.Grid

    @property
    def pixel_size(self):
        """Ground metres per cell by row, east-west and north-south."""
        return tuple(self.grid.pixel_size_m())


@functools.lru_cache(maxsize=1)
def tile(name):
    """Read a tile."""
    band = raster.read(tiles.DATA / PATHS[name])
    rows, columns = INTERIORS.get(name, (slice(None), slice(None)))
    values = np.ascontiguousarray(band.values[rows, columns], np.float32)
    x, dx, _, y, _, dy = band.grid.geotransform
    corner = (x + (columns.start or 0) * dx, dx, 0.0, y + (rows.start or 0) * dy, 0.0, dy)
    return Tile(name, values, raster.Grid(values.shape, corner, band.grid.crs))


@functools.lru_cache(maxsize=1)
def mask(name, kind, seed):
    """Cut voids of one of `KINDS` into a tile: a bool array."""
    ground = tile(name)
    known = np.ones(ground.values.shape, bool)
    if kind == "mixture":
        return punch_voids(ground.values, seed=seed)
    if kind == "transplanted":
        return transplant_voids(
            ground.values,
            known,
            real_shapes(),
            share=SHARE,
            seed=seed,
            pixel_size=ground.pixel_size,
        )
    fitting = np.cumsum(SINGLE_HOLES) <= SHARE * known.size
    sets = int(SHARE * known.size / sum(SINGLE_HOLES))
    return single_holes(
        known, cells=np.compress(fitting, SINGLE_HOLES), count=max(1, sets), seed=seed
    )


@functools.cache
def real_shapes():
    """Cut the shapes of the voids out of the raw tiles."""
    shapes = []
    for name in SHAPES:
        band = raster.read(tiles.DATA / tiles.RAW[name])
        shapes += void_shapes(band.void, band.values, pixel_size=band.grid.pixel_size_m())
    return tuple(shapes)
