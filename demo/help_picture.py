"""Draw the picture of the QGIS tool's help panel: a part of the demo's tile, holed and filled.

Run it from anywhere: ``.venv/bin/python demo/help_picture.py``.
"""

from pathlib import Path

import numpy as np
from picture import relief

import demsmith
from demo import SEED, jacksboro
from demsmith.core.voids.validation import punch_voids

TARGET = Path(__file__).parents[1] / "algorithms" / "help" / "fillvoids.png"
WINDOW = np.s_[120:250, 0:225]
CELL = (74.4, 92.5)  # ground metres of 3″ at 36.6° N, east-west and north-south


def main():
    """Make the two panels, one above the other, and save them."""
    from matplotlib.pyplot import imsave

    ground, _ = jacksboro()
    void = punch_voids(ground, seed=SEED)
    filled = demsmith.fill_voids(ground, void, pixel_size=CELL).values
    before = relief(ground, CELL, void)[WINDOW]
    gap = np.ones((6, *before.shape[1:]))
    imsave(TARGET, np.vstack([before, gap, relief(filled, CELL)[WINDOW]]))


if __name__ == "__main__":
    main()
