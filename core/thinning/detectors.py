"""Detectors: how much each cell of a terrain tells of its shape.

A detector gives every cell a score; those of the largest scores are to be kept.
"""

import math
from functools import partial

import numpy as np

from demsmith.core import parallel
from demsmith.core.progress import SILENT, Span
from demsmith.core.strips import strips

# Of `ridges`; docs/thinning.md tells how they were measured.
_SMOOTHING = 0.3
_POWER = 0.75
_EVEN = 0.05
_LARGEST_SIGMA = 16.0  # cells

# Numbers of the R2 sequence: 1/p and 1/p² with p³ = p + 1, the plastic number.
_R2 = (0.7548776662466927, 0.5698402909980532)


def sobel_scores(elevation, pixel_size, *, threads=None, progress=SILENT):
    """Score cells by the magnitude of the gradient (Belhadj 2007, "silhouette" detector).

    The gradient is Sobel's, in ground metres: it marks steep cells, not crests and thalwegs.

    Parameters
    ----------
    elevation : (H, W) array
        Elevations [m], finite everywhere.
    pixel_size : (array, array)
        Ground metres per cell east-west and north-south, by row.
    threads : int, optional
    progress : Progress

    Returns
    -------
    (H, W) float32 array
        Rise by run, 0 or more.
    """
    scores = np.empty(elevation.shape, np.float32)

    def score(rows):
        dx, dy = (size[rows, None] for size in pixel_size)
        scores[rows] = _gradient(_surroundings(elevation, rows, 1), dx, dy)

    _by_strips(score, elevation.shape, threads, progress)
    return scores


def ridge_scores(elevation, known, pixel_size, share, *, threads=None, progress=SILENT):
    """Score cells so that the kept ones crowd on crests and valleys and thin out on even ground.

    The measure of a ridge or valley is the largest principal curvature by magnitude, that is
    across the line, of the terrain smoothed to the detail that the share can carry: by 0.3 of the
    mean distance between kept cells. The density of kept cells follows its 0.75th power (a
    piecewise linear surface has the least squared error at about 2/3), plus 5 % of the mean for
    ground without curvature. They are spread at that density by dithering: a cell's density is
    divided by its number in a low-discrepancy sequence over rows and columns (Roberts 2018, "The
    unreasonable effectiveness of quasirandom sequences", R2), so that cells of equal density are
    kept at even distances. Keeping all cells along the lines themselves, after non-maximum
    suppression, was tried and is worse: see docs/thinning.md.

    Parameters
    ----------
    elevation, pixel_size, threads, progress
        As `sobel_scores`.
    known : (H, W) bool array
        The cells whose mean density counts.
    share : float
        The share of the cells that will be kept.

    Returns
    -------
    (H, W) float32 array
        Above 0.
    """
    scores = np.empty(elevation.shape, np.float32)
    sums = []

    def measure(rows):
        dx, dy = (size[rows].mean() for size in pixel_size)
        scores[rows] = _curvature(elevation, rows, dx, dy, share) ** _POWER
        sums.append(scores[rows].sum(dtype=np.float64, where=known[rows]))

    def dither(rows):
        scores[rows] = (scores[rows] + even) / _r2_numbers(rows, scores.shape[1])

    _by_strips(measure, elevation.shape, threads, Span(progress, 0, 0.8))
    # fsum: the sum must not depend on the order in which threads come to an end.
    even = _EVEN * math.fsum(sums) / np.count_nonzero(known) or 1.0
    _by_strips(dither, elevation.shape, threads, Span(progress, 0.8, 1))
    return scores


def random_scores(shape, seed, *, threads=None, progress=SILENT):
    """Score cells at random, uniformly.

    A cell's score is its number, in scan order, in the stream of PCG64, which NumPy promises never
    to change.

    Parameters
    ----------
    shape : (int, int)
    seed : int or sequence of int
    threads, progress
        As `sobel_scores`.

    Returns
    -------
    (H, W) float32 array
        From 0 to below 1.
    """
    scores = np.empty(shape, np.float32)

    def score(rows):
        cells = scores[rows]
        stream = np.random.PCG64(seed)
        stream.advance(rows.start * shape[1])
        raw = stream.random_raw(cells.size).reshape(cells.shape)
        cells[...] = (raw >> np.uint64(40)) * 2.0**-24

    _by_strips(score, shape, threads, progress)
    return scores


def _by_strips(work, shape, threads, progress):
    parallel.run(
        [partial(work, rows) for rows in strips(shape)], threads=threads, progress=progress
    )


def _surroundings(elevation, rows, reach):
    """Give rows and ``reach`` cells around them; beyond the raster its slopes go on."""
    above, below = max(rows.start - reach, 0), min(rows.stop + reach, elevation.shape[0])
    missing = (reach - (rows.start - above), reach - (below - rows.stop))
    return np.pad(
        elevation[above:below].astype(np.float64), (missing, (reach, reach)),
        mode="reflect", reflect_type="odd",
    )  # fmt: skip


def _gradient(block, dx, dy):
    """Magnitude of Sobel's gradient of a block with a frame of one cell."""
    from scipy.ndimage import sobel

    across, down = sobel(block, axis=1)[1:-1, 1:-1], sobel(block, axis=0)[1:-1, 1:-1]
    return np.hypot(across / (8 * dx), down / (8 * dy))


def _curvature(elevation, rows, dx, dy, share):
    """Largest principal curvature by magnitude [1/m] of some rows of the smoothed terrain."""
    from scipy.ndimage import gaussian_filter

    sigma = _SMOOTHING * np.sqrt(dx * dy / share)
    sigma = np.minimum((sigma / dy, sigma / dx), _LARGEST_SIGMA)
    # Beyond four deviations a Gaussian is nought; the differences take one cell more.
    reach = int(np.ceil(4 * sigma.max())) + 1
    z = gaussian_filter(_surroundings(elevation, rows, reach), sigma)
    z = z[reach - 1 : z.shape[0] - reach + 1, reach - 1 : z.shape[1] - reach + 1]
    z_xx = (z[1:-1, 2:] - 2 * z[1:-1, 1:-1] + z[1:-1, :-2]) / dx**2
    z_yy = (z[2:, 1:-1] - 2 * z[1:-1, 1:-1] + z[:-2, 1:-1]) / dy**2
    z_xy = (z[2:, 2:] - z[2:, :-2] - z[:-2, 2:] + z[:-2, :-2]) / (4 * dx * dy)
    # The larger by magnitude of the eigenvalues of [[z_xx, z_xy], [z_xy, z_yy]].
    return np.abs(z_xx + z_yy) / 2 + np.hypot((z_xx - z_yy) / 2, z_xy)


def _r2_numbers(rows, columns):
    """Give the cells of some rows their numbers in (0, 1] of the R2 sequence."""
    row, column = np.arange(rows.start, rows.stop)[:, None], np.arange(columns)
    return 1 - (_R2[0] * column + _R2[1] * row) % 1
