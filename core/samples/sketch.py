"""Painted sketches: images whose brightness is elevation."""

import numpy as np

from demsmith.core.errors import InputError

BACKGROUNDS = {"black": 0.0, "white": 1.0, "none": None}
"""What is unpainted in an image without transparency, by the luminance that it has."""


def read_sketch(path, *, low=0.0, high=1000.0, background="black"):
    """Read the elevations that an image paints.

    Parameters
    ----------
    path : path
        Any image that OpenImageIO reads.
    low, high : float
        Elevation [m] of black and of white.
    background : {"black", "white", "none"}
        Which pixels are not painted in an image without transparency; in one with, they are
        those that are wholly transparent.

    Returns
    -------
    (h, w) float64 array
        Elevations [m], NaN where nothing is painted.

    Raises
    ------
    InputError
        If the image cannot be read, or nothing is painted on it.
    DependencyError
        If OpenImageIO is missing.
    """
    from demsmith.core.images import read_image

    if background not in BACKGROUNDS:
        raise InputError(f"background is {background!r}; choose one of {', '.join(BACKGROUNDS)}")
    if not (np.isfinite(low) and np.isfinite(high)):
        raise InputError(f"a sketch's elevations from {low} to {high} m must be finite")
    luminance, alpha = read_image(path)
    painted = np.isfinite(luminance)
    if alpha is not None:
        painted &= alpha > 0
    elif BACKGROUNDS[background] is not None:
        painted &= ~np.isclose(luminance, BACKGROUNDS[background], rtol=0, atol=1e-9)
    if not painted.any():
        what = "transparent" if alpha is not None else background
        raise InputError(f"nothing is painted on '{path}': all of it is {what}")
    return np.where(painted, low + luminance * (high - low), np.nan)


def laid_over(sketch, grid):
    """Lay a sketch over a grid, north up; each cell takes the pixel at its centre.

    Parameters
    ----------
    sketch : (h, w) float array
        NaN where nothing is painted.
    grid : Grid

    Returns
    -------
    (H, W) float array

    Raises
    ------
    InputError
        If the sketch is no 2-D array.
    """
    sketch = np.asarray(sketch, np.float64)
    if sketch.ndim != 2 or not sketch.size:
        raise InputError(f"the sketch has shape {sketch.shape}; give a 2-D array of elevations")
    rows, columns = (
        ((np.arange(cells) + 0.5) * pixels / cells).astype(np.int64)
        for cells, pixels in zip(grid.shape, sketch.shape, strict=True)
    )
    return sketch[np.ix_(rows[::-1] if grid.south_up else rows, columns)]
