"""The two sides of contour lines, which midpoint displacement by itself cannot tell apart.

Around one fixed elevation the passes of MCMD have one behaviour, so the ground beside a contour
falls on both sides or on none: terraces, and flat summits within the highest contour. The paper
names this limit and asks for another treatment first (Belhadj 2007, conclusion). Here the cells
beside the contours take their elevations from the surface of least bending through all samples,
which is uphill on one side and downhill on the other; the passes go on from there.
"""

from dataclasses import replace

import numpy as np

from demsmith.core.samples.reconstruction import reconstruct

REACH_CELLS = 2


def with_sides(values, known, contour, *, options, **surroundings):
    """Make the cells beside contour lines known.

    Parameters
    ----------
    values : (H, W) float array
        Elevations [m]; only known cells are read.
    known, contour : (H, W) bool arrays
        Cells with a sample, and those of a contour line.
    options : SampleOptions
        Of the surface: datum, tension.
    **surroundings
        ``pixel_size``, ``threads``, ``progress`` as in `reconstruct`.

    Returns
    -------
    values, known : (H, W) arrays
        With `REACH_CELLS` cells on either side of the contours.
    """
    from scipy.ndimage import binary_dilation

    smooth = replace(options, variant="converged", preset="none", l=0.0, l_bu=0.0, r_s=0.0)
    surface = reconstruct(values, known, options=smooth, **surroundings)
    if options.datum is not None:
        np.maximum(surface, options.datum, out=surface)  # the passes' curves begin there
    beside = binary_dilation(contour, np.ones((3, 3), bool), REACH_CELLS) & ~known
    return np.where(beside, surface, values), known | beside
