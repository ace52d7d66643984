"""The demo's picture: a tile with its voids, filled, and how far off the fill is."""

import numpy as np

_VOID = (0.86, 0.13, 0.16)


def draw(path, *, holed, void, filled, error, cell, title, caption):
    """Draw before, after and error side by side.

    Parameters
    ----------
    path : path
        PNG to write.
    holed, filled : (H, W) arrays
        Elevations [m]; ``holed`` is only looked at where ``void`` is False.
    void : (H, W) bool array
    error : (H, W) array or None
        Filled less true elevation [m] in the voids, NaN elsewhere.
    cell : (float, float)
        Ground metres per cell, east-west and north-south.
    title, caption : str
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    panels = [("voids", relief(holed, cell, void)), ("filled by Demsmith", relief(filled, cell))]
    count = len(panels) + (error is not None)
    aspect = filled.shape[0] * cell[1] / (filled.shape[1] * cell[0])
    width = 5.0
    size = (count * width, 0.93 * aspect * width + 0.75)
    figure, axes = plt.subplots(1, count, figsize=size, dpi=85, layout="constrained")
    for axis, (name, image) in zip(axes, panels, strict=False):
        axis.imshow(image, aspect=cell[1] / cell[0], interpolation="lanczos")
        axis.set_title(name, fontsize=11)
    if error is not None:
        _draw_error(figure, axes[-1], filled, error, cell)
    for axis in axes:
        axis.set_axis_off()
    figure.suptitle(title, fontsize=13)
    figure.supxlabel(caption, fontsize=9)
    figure.savefig(path)
    plt.close(figure)


def _draw_error(figure, axis, filled, error, cell):
    top = max(float(np.nanpercentile(np.abs(error), 99)), 1.0)
    axis.imshow(relief(filled, cell, gray=True), aspect=cell[1] / cell[0], alpha=0.45)
    shown = axis.imshow(error, cmap="RdBu_r", vmin=-top, vmax=top, aspect=cell[1] / cell[0])
    axis.set_title("error: filled less true elevation", fontsize=11)
    bar = figure.colorbar(shown, ax=axis, shrink=0.8, pad=0.01)
    bar.set_label("m", rotation=0)


def relief(values, cell, void=None, *, gray=False):
    """Shade elevations as seen from above, lit from the north-west; voids in red."""
    from matplotlib.colors import LightSource
    from matplotlib.pyplot import get_cmap

    z = np.asarray(values, np.float64)
    known = np.ones(z.shape, bool) if void is None else ~void
    # Voids take the ground's mean, so that their edges do not blind the shading.
    z = np.where(known, z, z[known].mean())
    low, high = np.percentile(z[known], (0.5, 99.5))
    light = LightSource(azdeg=315, altdeg=45)
    shade = light.hillshade(z, vert_exag=1.5, dx=cell[0], dy=cell[1])
    if gray:
        return np.repeat(shade[..., None], 3, axis=2)
    colour = get_cmap("gist_earth")(0.25 + 0.68 * np.clip((z - low) / max(high - low, 1), 0, 1))
    image = light.blend_soft_light(colour[..., :3], shade[..., None])
    image[~known] = _VOID
    return np.clip(image, 0, 1)
