"""Slope and aspect: how steep ground is, and which way it falls."""

import numpy as np

from demsmith.core.options import validate
from demsmith.core.progress import SILENT
from demsmith.core.relief.gradient import from_gradient
from demsmith.core.relief.options import ReliefOptions

_OWN = ReliefOptions()


def slope(
    values, void=None, *, unit=_OWN.unit, method=_OWN.method, pixel_size=None, threads=None,
    progress=SILENT,
):  # fmt: skip
    """Tell how steep the ground is.

    Parameters
    ----------
    values : (H, W) array of a real or integer type
        Elevations [m].
    void : (H, W) bool array, optional
        True where there is no elevation. Cells that are not finite are voids in any case, and
        those of a masked array where this is not given.
    unit : str
        ``degrees``, or ``percent``: 100 times rise by run.
    method : str
        ``horn`` or ``zevenbergen-thorne``; `demsmith.core.relief.gradient` tells their sources,
        and what is done beside voids and at edges.
    pixel_size : float, (float, float) or (array, array), optional
        Ground metres per cell: both ways, or east-west and north-south, each one number or one by
        row, as `Grid.pixel_size_m` gives. Default: 1.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress, optional

    Returns
    -------
    (H, W) float32 array
        0 to 90 degrees, or 0 percent and more; NaN in voids.

    Raises
    ------
    InputError
        If the arrays do not fit or an option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    A ramp of 30 m in 30 m:

    >>> print(slope([[0, 30, 60]], pixel_size=30))
    [[45. 45. 45.]]
    """
    validate(ReliefOptions(unit=unit, method=method))

    def steepness(east, north):
        run = np.sqrt(east * east + north * north)
        return run * 100 if unit == "percent" else np.degrees(np.arctan(run))

    return from_gradient(
        steepness, values, void, pixel_size=pixel_size, method=method, threads=threads,
        progress=progress,
    )  # fmt: skip


def aspect(
    values, void=None, *, method=_OWN.method, pixel_size=None, south_up=False, threads=None,
    progress=SILENT,
):  # fmt: skip
    """Tell which way the ground falls.

    Parameters
    ----------
    values, void, method, pixel_size, threads, progress
        As of `slope`.
    south_up : bool
        Whether the first row is the southern one.

    Returns
    -------
    (H, W) float32 array
        Where water runs to, in degrees clockwise from the grid's north, 0 or more and below 360:
        90 is a slope that faces east. NaN in voids and where the ground is level.

    Raises
    ------
    InputError
        If the arrays do not fit or an option is out of range.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> print(aspect([[20, 10, 0], [20, 10, 0]]))
    [[90. 90. 90.]
     [90. 90. 90.]]
    """
    validate(ReliefOptions(method=method))

    def direction(east, north):
        angle = np.degrees(np.arctan2(-east, -north))
        np.add(angle, 360, out=angle, where=angle < 0)
        np.abs(angle, out=angle)  # no -0
        angle[angle >= 360] = 0  # what was just west of north, rounded
        angle[(east == 0) & (north == 0)] = np.nan
        return angle

    return from_gradient(
        direction, values, void, pixel_size=pixel_size, method=method, south_up=south_up,
        threads=threads, progress=progress,
    )  # fmt: skip
