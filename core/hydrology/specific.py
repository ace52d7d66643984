"""Specific catchment area: upstream area by width of the flow's cross section."""

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.hydrology.surfaces import by_row
from demsmith.core.hydrology.traversal import Surface, in_strips
from demsmith.core.progress import SILENT

_DIAGONAL = 2 | 8 | 32 | 128


def specific_area(area, directions, dx, dy, *, threads=None, progress=SILENT):
    """Divide upstream area by D8 by the width that it flows through.

    The width is the cell's area by the length of its step, from its middle to that of the cell it
    drains to. So a cell stands for a strip of ground along its step, and on a plane that falls in
    one of the eight directions the result is the exact distance to the upper edge.

    Parameters
    ----------
    area : (H, W) array
        As `demsmith.core.hydrology.accumulation.accumulate_d8` gives it [m²].
    directions : (H, W) uint8 array
        ESRI's codes. Where there is none, the width is the root of the cell's area.
    dx, dy : (H,) arrays
        Ground metres per cell of each row, along the row and across.
    threads : int, optional
    progress : Progress

    Returns
    -------
    (H, W) float32 array
        In the unit of ``area`` a metre.

    Raises
    ------
    InputError
        If the arrays do not fit.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> specific_area(np.array([[5.0, 10.0]]), np.array([[1, 1]], np.uint8), [5.0], [1.0])
    array([[ 5., 10.]], dtype=float32)
    """
    directions = np.asarray(directions)
    if directions.shape != area.shape:
        raise InputError(f"directions have shape {directions.shape}, the area {area.shape}")
    dx, dy = by_row(dx, "dx", len(area)), by_row(dy, "dy", len(area))
    specific = np.empty(area.shape, np.float32)

    def divide(rows):
        east, south = dx[rows, None], dy[rows, None]
        code = directions[rows]
        step = np.where(code & 17, east, south)
        step = np.where(code & _DIAGONAL, np.hypot(east, south), step)
        step = np.where(code == 0, np.sqrt(east * south), step)
        specific[rows] = area[rows] * step / (east * south)

    in_strips(divide, area.shape, threads=threads, progress=progress)
    return specific


def specific_area_of_shares(
    area, filled, flat, void, dx, dy, *, exponent=None, threads=None, progress=SILENT
):
    """Divide upstream area by MFD or D-infinity by the width that it flows through.

    As `specific_area`, but a cell's step is the mean of the ways to all its receivers, by their
    shares. On a plane that falls in any direction the result is the exact distance to the upper
    edge, where that is so wide that all water comes from it.

    Parameters
    ----------
    area : (H, W) array
        As `accumulate_mfd` or `accumulate_dinf` of `demsmith.core.hydrology.accumulation` give it.
    filled, flat, void, dx, dy
        What it was made from.
    exponent : float, optional
        Of MFD; None for D-infinity.
    threads : int, optional
    progress : Progress

    Returns
    -------
    (H, W) float32 array
        In the unit of ``area`` a metre. Where water goes nowhere, the width is the root of the
        cell's area.

    Raises
    ------
    InputError
        If the arrays do not fit.
    Cancelled
        If ``progress`` asks to stop.
    """
    from demsmith.core.hydrology._specific import mean_steps

    ground = Surface(filled, flat, void, dx, dy)
    if area.shape != ground.z.shape:
        raise InputError(f"the area has shape {area.shape}, the elevations {ground.z.shape}")
    dx, dy = by_row(dx, "dx", len(area)), by_row(dy, "dy", len(area))
    power = np.float32(-1 if exponent is None else exponent)
    specific = np.empty(area.shape, np.float32)

    def divide(rows):
        mean_steps(
            ground.z, ground.flat, ground.void, ground.ways, power, dx, dy, rows.start, rows.stop,
            specific,
        )  # fmt: skip
        step, east_south = specific[rows], (dx * dy)[rows, None]
        step = np.where(step > 0, step, np.sqrt(east_south))
        specific[rows] = area[rows] * step / east_south

    in_strips(divide, area.shape, threads=threads, progress=progress)
    return specific
