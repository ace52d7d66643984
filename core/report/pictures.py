"""Pictures of ground: shaded relief with tints, voids, sources or uncertainty laid over it."""

import math
from typing import NamedTuple

import numpy as np

from demsmith.core.images import encode_jpeg
from demsmith.core.relief import gradient, light

LARGEST = 900
"""Pixels of the longer side of a picture of a whole raster."""

VOID_COLOR = (214, 24, 111)
"""Of the voids in a picture of the ground before."""

LEFT_COLOR = (24, 24, 28)
"""Of voids that were left as they were."""

SEA_COLOR = (172, 204, 226)
"""Of ground that is just 0 high, as the SRTM has the sea."""

TINTS = (
    (0.0, (150, 184, 142)), (0.12, (184, 204, 152)), (0.28, (224, 218, 166)),
    (0.46, (226, 196, 150)), (0.64, (205, 170, 140)), (0.82, (214, 200, 190)),
    (1.0, (250, 249, 247)),
)  # fmt: skip
"""Hypsometric tints from low to high, those of ``styles/terrain.qml``."""

UNCERTAINTY = (
    (0.0, (255, 247, 188)), (0.25, (254, 196, 79)), (0.5, (236, 112, 20)),
    (0.75, (177, 36, 70)), (1.0, (84, 14, 92)),
)  # fmt: skip
"""Colours from a small to a large uncertainty, those of ``styles/uncertainty.qml``."""

# Azimuths of the lights and their weights: mostly from the north-west, so that no slope is black
# and ridges along the main light still show (after Mark 1992, USGS Open-File Report 92-422).
_LIGHTS = ((225.0, 0.18), (270.0, 0.24), (315.0, 0.4), (360.0, 0.18))
_ALTITUDE = 45.0


class Shading(NamedTuple):
    """How ground is shaded, so that several pictures of it can be compared.

    Attributes
    ----------
    low, high : float
        Elevations of the first and the last tint.
    exaggeration : float
        Factor of the slopes.
    """

    low: float
    high: float
    exaggeration: float


class Ground(NamedTuple):
    """The ground of a picture, its pixels square.

    Attributes
    ----------
    elevation : (h, w) float32 array
        NaN where there is none.
    side : float
        Ground metres of a pixel.
    """

    elevation: np.ndarray
    side: float


class Frame:
    """A raster's cells seen as the pixels of a picture, square on the ground.

    Parameters
    ----------
    shape : (rows, columns)
        The raster's.
    pixel_size : (float or array, float or array)
        Ground metres per cell, east-west and north-south, as `Grid.pixel_size_m` gives; their
        means are used.
    longest : int
        Pixels of the picture's longer side.
    """

    def __init__(self, shape, pixel_size, *, longest=LARGEST):
        width, height = (float(np.mean(size)) for size in pixel_size)
        extent = shape[0] * height, shape[1] * width
        self.side = max(extent) / longest
        self.shape = tuple(max(1, round(length / self.side)) for length in extent)
        self._rows = _overlaps(shape[0], self.shape[0])
        self._columns = _overlaps(shape[1], self.shape[1]).T
        # Lit pixel by pixel, cells larger than pixels would look like steps.
        cells = math.floor(max(extent) / max(width, height))
        self._coarse = Frame(shape, pixel_size, longest=cells) if cells < longest else self

    def mean(self, values):
        """Give each pixel the mean of the (H, W) array's cells in it, weighted by area."""
        return np.asarray(self._rows @ np.asarray(values, np.float32) @ self._columns)

    def mean_where(self, values, mask):
        """As `mean` of those cells alone where ``mask`` is True; NaN where there is none."""
        share = self.mean(mask)
        total = self.mean(np.where(mask, values, 0))
        return np.divide(total, share, out=np.full(self.shape, np.nan, np.float32), where=share > 0)

    def ground(self, values, void):
        """Give the `Ground` of elevations that are unknown where ``void`` is True.

        Its pixels are not smaller than cells: bring pictures of it to this frame by `fitted`.
        """
        return Ground(self._coarse.mean_where(values, ~void), self._coarse.side)

    def fitted(self, picture):
        """Enlarge a picture of the `ground` to the pixels of this frame."""
        from scipy.ndimage import zoom

        factors = np.divide(self.shape, picture.shape[:2])
        if (factors == 1).all():
            return picture
        return zoom(picture, (*factors, 1), order=1, mode="nearest", grid_mode=True)


def _overlaps(cells, pixels):
    """Sparse (pixels, cells) matrix: the share that each cell has in each pixel."""
    from scipy.sparse import csr_matrix

    edges = np.linspace(0, cells, pixels + 1)
    cuts = np.union1d(edges, np.arange(cells + 1))
    middles = (cuts[:-1] + cuts[1:]) / 2
    pixel = np.searchsorted(edges, middles) - 1
    weights = (np.diff(cuts) * pixels / cells).astype(np.float32)
    return csr_matrix((weights, (pixel, middles.astype(int))), shape=(pixels, cells))


def shading_of(ground):
    """Choose tints and exaggeration that suit some ground.

    Parameters
    ----------
    ground : Ground

    Returns
    -------
    Shading
        Flat ground is exaggerated, at most tenfold; steep ground is halved at most.
    """
    known = ground.elevation[np.isfinite(ground.elevation)]
    if not known.size:
        return Shading(0.0, 1.0, 1.0)
    low, high = (float(level) for level in np.percentile(known, (0.5, 99.5)))
    steep = float(np.nanpercentile(np.hypot(*_gradient(ground)), 85))
    exaggeration = min(max(0.55 / steep, 0.5), 10.0) if steep > 0 else 1.0
    return Shading(low, max(high, low + 1.0), exaggeration)


def relief(ground, shading, *, tinted=True):
    """Shade ground by four lights, in hypsometric tints or in pale grey.

    Parameters
    ----------
    ground : Ground
    shading : Shading
    tinted : bool
        Grey instead, for colours to be laid over.

    Returns
    -------
    (h, w, 3) float32 array
        Red, green and blue, 0 to 255; `LEFT_COLOR` where there is no elevation.
    """
    light = _light(ground, shading.exaggeration)[..., None]
    if tinted:
        level = (ground.elevation - shading.low) / (shading.high - shading.low)
        colour = np.where(
            (ground.elevation == 0)[..., None], np.float32(SEA_COLOR), coloured(level, TINTS)
        )
    else:
        colour = np.float32(226)
    # The light that level ground gets leaves the tint as it is.
    level_light = math.sin(math.radians(_ALTITUDE))
    lit = colour * np.clip(0.22 + 0.78 * light / level_light, 0, 1.25)
    lit = np.where(np.isfinite(ground.elevation)[..., None], lit, np.float32(LEFT_COLOR))
    return np.clip(lit, 0, 255).astype(np.float32)


def _light(ground, exaggeration):
    """Light that falls on each pixel, 0 to 1; on level ground where there is no elevation."""
    east, north = (exaggeration * np.nan_to_num(slope) for slope in _gradient(ground))
    return sum(
        weight * light(east, north, azimuth=azimuth, altitude=_ALTITUDE)
        for azimuth, weight in _LIGHTS
    )


def _gradient(ground):
    """Slopes toward the east and the north; NaN where there is no elevation."""
    side = np.full(len(ground.elevation), ground.side)
    return gradient(ground.elevation, ~np.isfinite(ground.elevation), side, side)


def coloured(level, stops):
    """Give each number the colour of a ramp.

    Parameters
    ----------
    level : (h, w) array
        0 to 1, and clipped to that.
    stops : sequence of (float, (red, green, blue))
        In rising order.

    Returns
    -------
    (h, w, 3) float32 array
    """
    places = [place for place, _ in stops]
    channels = zip(*(colour for _, colour in stops), strict=True)
    mixed = [np.interp(np.clip(level, 0, 1), places, channel) for channel in channels]
    return np.stack(mixed, axis=-1).astype(np.float32)


def laid_over(picture, colour, share):
    """Lay a colour, or a picture of colours, over a picture.

    Parameters
    ----------
    picture : (h, w, 3) array
    colour : (3,) or (h, w, 3) array
    share : (h, w) array
        Opacity, 0 to 1.

    Returns
    -------
    (h, w, 3) float32 array
    """
    share = np.asarray(share, np.float32)[..., None]
    return picture + share * (np.asarray(colour, np.float32) - picture)


def visible(share, *, least=0.65):
    """Lift the shares of a mask in each pixel, so that what is smaller than a pixel is seen."""
    return np.where(share > 1e-6, np.maximum(share, least), 0)


def encoded(picture):
    """Encode an (h, w, 3) array of 0 to 255 as the bytes of a JPEG."""
    return encode_jpeg(np.rint(np.clip(picture, 0, 255)).astype(np.uint8))
