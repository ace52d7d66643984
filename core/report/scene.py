"""The pictures of a reconstruction: the ground before and after, its sources, its uncertainty."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.report.blocks import Gallery, Picture
from demsmith.core.report.charts import hexadecimal, legend, ramp
from demsmith.core.report.markup import joined
from demsmith.core.report.numbers import written
from demsmith.core.report.pictures import (
    LARGEST,
    LEFT_COLOR,
    UNCERTAINTY,
    VOID_COLOR,
    Frame,
    coloured,
    encoded,
    laid_over,
    relief,
    shading_of,
    visible,
)
from demsmith.core.voids.sources import LEFT, ORIGINAL, SOURCES

_CLOSE = 480
"""Pixels of the longer side of a close-up."""


@dataclass(frozen=True)
class Scene:
    """What pictures of a reconstruction are drawn from; of a huge raster, a shrunk copy.

    Attributes
    ----------
    values : (H, W) array
        Elevations afterwards.
    source : (H, W) uint8 array
        Source map: `demsmith.core.voids.sources`.
    pixel_size : (float or array, float or array)
        Ground metres per cell, east-west and north-south, as `Grid.pixel_size_m` gives.
    sigma : (H, W) array or None
        1-sigma uncertainty of the cells that are not original.
    unit : str
        Of elevations and uncertainty.
    """

    values: np.ndarray
    source: np.ndarray
    pixel_size: tuple
    sigma: np.ndarray | None = None
    unit: str = "m"

    def window(self, rows, columns):
        """Give the part of the scene in two slices."""
        dx, dy = (size[rows] if np.ndim(size) else size for size in self.pixel_size)
        sigma = None if self.sigma is None else self.sigma[rows, columns]
        return Scene(
            self.values[rows, columns], self.source[rows, columns], (dx, dy), sigma, self.unit
        )

    def window_around(self, rows, columns, *, margin=0.8, least=40):
        """Give the part around a box, as much wider as ``margin`` says, and at least so many cells.

        Parameters
        ----------
        rows, columns : (int, int)
            First and one past the last of the box.
        margin : float
            Share of the box's longer side that is added all around.
        least : int
            Cells of a side of the part, where the scene has as many.
        """
        longest = max(rows[1] - rows[0], columns[1] - columns[0])
        half = max(round((0.5 + margin) * longest), least // 2)
        spans = []
        for (first, last), cells in zip((rows, columns), self.values.shape, strict=True):
            middle = (first + last) // 2
            start = max(0, min(middle - half, cells - 2 * half))
            spans.append(slice(start, start + 2 * half))
        return self.window(*spans)


def overview(scene, *, progress=SILENT):
    """Draw before, after, source map and, if it is known, uncertainty.

    Parameters
    ----------
    scene : Scene
    progress : Progress

    Returns
    -------
    Gallery

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop.
    """
    frame = Frame(scene.values.shape, scene.pixel_size, longest=LARGEST)
    ground = frame.ground(scene.values, scene.source == LEFT)
    shading = shading_of(ground)
    checkpoint(progress, 0.4)
    lit, grey = (frame.fitted(relief(ground, shading, tinted=tinted)) for tinted in (True, False))
    checkpoint(progress, 0.5)
    heights = f"{written(shading.low)} to {written(shading.high)} {scene.unit}"
    pictures = [
        _before(scene, frame, lit, "Before: voids in magenta"),
        Picture(
            encoded(lit), "Shaded relief of the elevations afterwards",
            f"After; tints from {heights}" + _exaggerated(shading),
        ),
    ]  # fmt: skip
    checkpoint(progress, 0.6)
    pictures.append(_sources(scene, frame, grey))
    checkpoint(progress, 0.8)
    if scene.sigma is not None:
        pictures.append(_uncertainty(scene, frame, grey))
    checkpoint(progress, 1.0)
    return Gallery(pictures)


def close_up(scene, name, told):
    """Draw a void before and after.

    Parameters
    ----------
    scene : Scene
        A window around the void.
    name, told : str
        Of the void, and what is to be told of it.

    Returns
    -------
    list of Picture
    """
    frame = Frame(scene.values.shape, scene.pixel_size, longest=_CLOSE)
    ground = frame.ground(scene.values, scene.source == LEFT)
    lit = frame.fitted(relief(ground, shading_of(ground)))
    after = Picture(encoded(lit), f"Shaded relief of {name} afterwards", told)
    return [_before(scene, frame, lit, f"{name}, before"), after]


def _exaggerated(shading):
    shown = written(shading.exaggeration, 1)
    return "" if shown == "1.0" else f", slopes times {shown}"


def _before(scene, frame, lit, caption):
    # The ground below the voids is not seen; it only keeps their rims from being shaded as cliffs.
    share = frame.mean(scene.source != ORIGINAL)
    alt = "Shaded relief of the elevations before, with voids as magenta patches"
    return Picture(encoded(laid_over(lit, VOID_COLOR, visible(share))), alt, caption)


def _sources(scene, frame, grey):
    """Colour each pixel by the commonest source of its cells that are not original."""
    largest, colour = np.zeros(frame.shape, np.float32), np.zeros((*frame.shape, 3), np.float32)
    total = frame.mean(scene.source != ORIGINAL)
    shown = []
    cells = np.bincount(scene.source[scene.source != ORIGINAL], minlength=256)
    for source in SOURCES:
        if not cells[source.code]:
            continue
        share = frame.mean(scene.source == source.code)
        colour[share > largest] = LEFT_COLOR if source.code == LEFT else source.color[:3]
        largest = np.maximum(largest, share)
        shown.append(source)
    names = [source.name for source in shown]
    colours = [hexadecimal(source.color) for source in shown]
    return Picture(
        encoded(laid_over(grey, colour, 0.9 * visible(total))),
        "Map of where the elevations come from: " + (", ".join(names) or "all are original"),
        "Where the elevations come from", legend(names, colours),
    )  # fmt: skip


def _uncertainty(scene, frame, grey):
    known = np.isfinite(scene.sigma) & (scene.source != ORIGINAL) & (scene.source != LEFT)
    sigma = frame.mean_where(np.where(known, scene.sigma, 0), known)
    high = float(np.percentile(scene.sigma[known], 98)) if known.any() else 1.0
    high = high or 1.0
    colour = coloured(np.nan_to_num(sigma) / high, UNCERTAINTY)
    return Picture(
        encoded(laid_over(grey, colour, visible(frame.mean(known), least=0.85))),
        f"Map of the uncertainty of the filled elevations, up to {written(high)} {scene.unit}",
        "Uncertainty (1 sigma) of the filled elevations",
        joined(" ", ramp(UNCERTAINTY, 0.0, high, scene.unit)),
    )  # fmt: skip
