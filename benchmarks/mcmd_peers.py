"""Other ways from scattered samples to a raster, to be compared with.

Each takes a `Scattered` and gives the elevations of its removed cells and the seconds it took.
"""

import time
from dataclasses import dataclass

import numpy as np
from osgeo import gdal, ogr

gdal.UseExceptions()
gdal.SetConfigOption("GDAL_NUM_THREADS", "2")

NEIGHBOURS = 64
NEAREST_POINTS = 12
SEARCH_CELLS = 20  # from 3 % of cells on there are always twelve so near


@dataclass(frozen=True, eq=False)
class Scattered:
    """Ground of which some cells are known.

    Attributes
    ----------
    truth : (H, W) float32 array
        Elevations [m].
    known : (H, W) bool array
    scored : (H, W) bool array
        The removed cells, whose truth is there to compare with.
    sizes : (H,) and (H,) arrays
        Ground metres per cell, east-west and north-south.
    """

    truth: np.ndarray
    known: np.ndarray
    scored: np.ndarray
    sizes: tuple

    @classmethod
    def at_random(cls, truth, sizes, cells, seed):
        """Keep so many cells at random."""
        known = np.zeros(truth.size, bool)
        known[np.random.default_rng(seed).choice(truth.size, cells, replace=False)] = True
        known = known.reshape(truth.shape)
        return cls(truth, known, ~known, sizes)

    @property
    def cell(self):
        """Ground metres per cell in the middle row."""
        return tuple(float(size[len(size) // 2]) for size in self.sizes)

    def xy(self, cells):
        """Give the centres of cells in ground metres, (N, 2)."""
        row, column = np.nonzero(cells)
        return np.column_stack([column * self.cell[0], -row * self.cell[1]])

    def samples(self):
        """Give the known cells' centres and elevations."""
        return self.xy(self.known), self.truth[self.known].astype(np.float64)

    def rmse(self, elevations):
        """Score elevations of the removed cells [m]."""
        error = elevations - self.truth[self.scored].astype(np.float64)
        return float(np.sqrt(np.mean(error**2)))


def timed(work):
    """Give what a function returns, and the seconds it took."""
    begin = time.perf_counter()
    result = work()
    return result, time.perf_counter() - begin


def linear(ground):
    """SciPy's linear interpolation in Delaunay triangles; beyond their hull the nearest sample."""
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

    (points, values), wanted = ground.samples(), ground.xy(ground.scored)

    def work():
        found = LinearNDInterpolator(points, values)(wanted)
        beyond = np.isnan(found)
        found[beyond] = NearestNDInterpolator(points, values)(wanted[beyond])
        return found

    return timed(work)


def radial(ground):
    """SciPy's radial basis functions: thin plate splines of the 64 nearest samples."""
    from scipy.interpolate import RBFInterpolator

    (points, values), wanted = ground.samples(), ground.xy(ground.scored)
    return timed(lambda: RBFInterpolator(points, values, neighbors=NEIGHBOURS)(wanted))


def gdal_linear(ground):
    """Interpolate by GDAL Grid, linear in Delaunay triangles."""
    return _gdal_grid(ground, "linear:radius=-1")


def gdal_inverse(ground):
    """Interpolate by GDAL Grid, inverse squared distances of the nearest samples."""
    radius = SEARCH_CELLS * max(ground.cell)
    return _gdal_grid(ground, f"invdistnn:power=2:max_points={NEAREST_POINTS}:radius={radius}")


def _gdal_grid(ground, algorithm):
    (rows, columns), (dx, dy) = ground.truth.shape, ground.cell
    source = _as_layer(*ground.samples())
    made, seconds = timed(
        lambda: gdal.Grid(
            "",
            source,
            format="MEM",
            width=columns,
            height=rows,
            outputType=gdal.GDT_Float32,
            outputBounds=[-dx / 2, dy / 2, (columns - 0.5) * dx, (0.5 - rows) * dy],
            algorithm=algorithm,
        )
    )
    return made.ReadAsArray()[ground.scored], seconds


def _as_layer(points, values):
    """Give points as a vector dataset in memory."""
    dataset = gdal.GetDriverByName("Memory").Create("", 0, 0, 0, gdal.GDT_Unknown)
    layer = dataset.CreateLayer("samples", geom_type=ogr.wkbPoint25D)
    for (x, y), z in zip(points.tolist(), values.tolist(), strict=True):
        feature = ogr.Feature(layer.GetLayerDefn())
        point = ogr.Geometry(ogr.wkbPoint25D)
        point.AddPoint(x, y, z)
        feature.SetGeometryDirectly(point)
        layer.CreateFeature(feature)
    return dataset
