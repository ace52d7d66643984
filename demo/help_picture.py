"""Draw the pictures of the QGIS tools' help panels, from a part of the demo's tile.

Run it from anywhere: ``.venv/bin/python demo/help_picture.py``.
"""

from pathlib import Path

import numpy as np
from picture import relief

import demsmith
from demo import SEED, jacksboro
from demsmith.core.raster import Grid
from demsmith.core.report.pictures import UNCERTAINTY, coloured
from demsmith.core.samples import Samples, to_cells
from demsmith.core.validation import punch_voids

FOLDER = Path(__file__).parents[1] / "algorithms" / "help"
WINDOW = np.s_[120:250, 0:225]
CELL = (74.4, 92.5)  # ground metres of 3″ at 36.6° N, east-west and north-south
POINTS_SHARE = 0.05
CONTOUR_INTERVAL = 100  # metres
PAPER = 0.2
TINT = 0.75  # share of the colours of uncertainty over grey relief
SEAM = 3  # cells between the tiles of a mosaic


def main():
    """Draw all."""
    ground, _ = jacksboro()
    draw_fill(ground)
    draw_reconstruction(ground)
    draw_mosaic(ground[WINDOW])
    draw_samples(ground[WINDOW].astype(np.float64))


def draw_fill(ground):
    """Draw ground with holes above, filled below."""
    void = punch_voids(ground, seed=SEED)
    filled = demsmith.fill_voids(ground, void, pixel_size=CELL).values
    _save("fillvoids.png", relief(ground, CELL, void)[WINDOW], relief(filled, CELL)[WINDOW])


def draw_reconstruction(ground):
    """Draw ground with holes above; below how wrong their fill may be, from yellow to violet."""
    void = punch_voids(ground, seed=SEED)
    grid = Grid(ground.shape, (0, CELL[0], 0, 0, 0, -CELL[1]))
    done = demsmith.reconstruct(ground, void, grid=grid)
    top = np.percentile(done.sigma[void], 95)
    colour = coloured(done.sigma / top, UNCERTAINTY) / 255
    below = relief(done.values, CELL, gray=True)
    below[void] += TINT * (colour - below)[void]
    _save("reconstructsrtm.png", relief(ground, CELL, void)[WINDOW], below[WINDOW])


def draw_mosaic(ground):
    """Draw four tiles with holes above, apart; below filled, without seams."""
    void = punch_voids(ground, seed=SEED)
    rows, columns = (side // 2 for side in ground.shape)
    row, column = np.indices(ground.shape)
    void |= np.hypot(row - rows, (column - columns) / 1.4) < 10  # where all four meet
    filled = demsmith.reconstruct(ground, void).values
    above = relief(ground, CELL, void)
    above[rows - SEAM // 2 : rows + SEAM // 2 + 1] = 1
    above[:, columns - SEAM // 2 : columns + SEAM // 2 + 1] = 1
    _save("reconstructmosaic.png", above, relief(filled, CELL))


def draw_samples(ground):
    """Draw contour lines in the west and points in the east above, the terrain of them below."""
    rows, columns = ground.shape
    grid = Grid(ground.shape, (0, CELL[0], 0, rows * CELL[1], 0, -CELL[1]))
    samples = Samples(
        points=_points(ground, grid), contours=_contours(ground[:, : columns // 2], grid)
    )
    known = to_cells(samples, grid).known
    above = np.where(known[..., None], relief(ground, CELL), PAPER)
    _save(
        "reconstructfromsamples.png",
        above,
        relief(demsmith.from_samples(samples, grid).values, CELL),
    )


def _points(ground, grid):
    """Give random cells of the eastern half as points."""
    chosen = np.random.default_rng(SEED).random(ground.shape) < POINTS_SHARE
    chosen[:, : ground.shape[1] // 2] = False
    row, column = np.nonzero(chosen)
    return np.column_stack([*grid.xy(row, column), ground[chosen]])


def _contours(ground, grid):
    from contourpy import contour_generator

    generator = contour_generator(z=ground)
    levels = np.arange(ground.min(), ground.max()) // CONTOUR_INTERVAL * CONTOUR_INTERVAL
    return [
        np.column_stack([*grid.xy(line[:, 1], line[:, 0]), np.full(len(line), level)])
        for level in np.unique(levels)[1:]
        for line in generator.lines(level)
    ]


def _save(name, above, below):
    """Save two pictures of the same size, one above the other."""
    from matplotlib.pyplot import imsave

    gap = np.ones((6, *above.shape[1:]))
    imsave(FOLDER / name, np.vstack([above, gap, below]))


if __name__ == "__main__":
    main()
