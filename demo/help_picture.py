"""Draw the pictures of the QGIS tools' help panels, from a part of the demo's tile.

Run it from anywhere: ``.venv/bin/python demo/help_picture.py``.
"""

from pathlib import Path

import numpy as np
from picture import relief

import demsmith
from demo import SEED, jacksboro
from demsmith.core.raster import Grid
from demsmith.core.samples import Samples, to_cells
from demsmith.core.voids.validation import punch_voids

FOLDER = Path(__file__).parents[1] / "algorithms" / "help"
WINDOW = np.s_[120:250, 0:225]
CELL = (74.4, 92.5)  # ground metres of 3″ at 36.6° N, east-west and north-south
POINTS_SHARE = 0.05
CONTOUR_INTERVAL = 100  # metres
PAPER = 0.2


def main():
    """Draw all."""
    ground, _ = jacksboro()
    draw_fill(ground)
    draw_samples(ground[WINDOW].astype(np.float64))


def draw_fill(ground):
    """Draw ground with holes above, filled below."""
    void = punch_voids(ground, seed=SEED)
    filled = demsmith.fill_voids(ground, void, pixel_size=CELL).values
    _save("fillvoids.png", relief(ground, CELL, void)[WINDOW], relief(filled, CELL)[WINDOW])


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
