"""The slope of ground that is known in part."""

import numpy as np

from demsmith.core.pixel_size import metres
from demsmith.core.progress import SILENT
from demsmith.core.thinning.detectors import sobel_scores


def slopes(values, known, *, pixel_size=None, threads=None, progress=SILENT):
    """Slope by the 3 x 3 cells around each (Horn 1981, "Hill shading and the reflectance map").

    Parameters
    ----------
    values : (H, W) array
        Elevations [m].
    known : (H, W) bool array
    pixel_size : optional
        Ground metres per cell, see `demsmith.core.mcmd.lattice.metres`.
    threads : int, optional
    progress : Progress

    Returns
    -------
    (H, W) float32 array
        Rise by run; NaN where one of the 3 x 3 cells is unknown.
    """
    kind = np.promote_types(values.dtype, np.float32)
    ground = np.where(known, values, np.array(np.nan, kind))
    return sobel_scores(
        ground, metres(ground.shape, pixel_size), threads=threads, progress=progress
    )
