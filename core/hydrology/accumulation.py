"""Upstream area: what every cell holds and all above it, by D8, D-infinity or MFD."""

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.hydrology.directions import VOID_CODE
from demsmith.core.hydrology.traversal import Surface, in_strips, traverse
from demsmith.core.progress import SILENT, Span


def accumulate_d8(directions, weights, *, threads=None, progress=SILENT):
    """Add up weights along D8 directions.

    Parameters
    ----------
    directions : (H, W) uint8 array
        ESRI's codes, as `demsmith.core.hydrology.d8_directions` gives them: 1 east (the next
        column), 2 south-east, 4 south (the next row), ... 128 north-east; 0 for nowhere and 247
        for a void. Codes may lead off the raster or into a void.
    weights : (H,) or (H, W) array
        What each cell adds, or each of a row: its area [m²], or 1 to count cells.
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    (H, W) float64 array
        Sum of the weights of the cell and of all that drain through it; 0 at voids.

    Raises
    ------
    InputError
        If the arrays do not fit, a weight is not finite, there is another code, or cells drain in
        a circle.
    Cancelled
        If ``progress`` asks to stop.

    Examples
    --------
    >>> accumulate_d8(np.array([[1, 4, 247], [1, 1, 0]], np.uint8), np.ones(2))
    array([[1., 2., 0.],
           [1., 4., 5.]])
    """
    from demsmith.core.hydrology import _d8_accumulation as kernels

    directions = np.asarray(directions)
    if directions.ndim != 2 or directions.dtype != np.uint8:
        raise InputError(
            f"directions have {directions.ndim} dimensions of {directions.dtype}; "
            "give ESRI's codes as two of uint8"
        )
    directions = np.ascontiguousarray(directions)
    void = directions == VOID_CODE
    area = initial(weights, void, threads=threads, progress=Span(progress, 0, 0.2))
    del void
    donors = np.empty(directions.shape, np.uint8)
    wrong = []

    def count(rows):
        bad = kernels.count_donors_d8(directions, rows.start, rows.stop, donors)
        if bad >= 0:
            wrong.append(bad)

    in_strips(count, directions.shape, threads=threads, progress=Span(progress, 0.2, 0.4))
    if wrong:
        row, column = divmod(min(wrong), directions.shape[1])
        raise InputError(
            f"directions hold {directions[row, column]} at row {row}, column {column}; ESRI's codes"
            f" are 0, 1, 2, 4, 8, 16, 32, 64, 128, and {VOID_CODE} for voids"
        )
    traverse(
        lambda reach, patience: kernels.drain(
            directions, reach.rows, reach.free, reach.place, patience, donors, area
        ),
        directions.shape, threads=threads, progress=Span(progress, 0.4, 1),
    )  # fmt: skip
    _refuse_circles(donors)
    return area


def _refuse_circles(donors):
    """Refuse directions by which some cells wait for each other."""
    from demsmith.core.hydrology._receivers import DONE

    waiting = donors < DONE
    if waiting.any():
        row, column = (int(place) for place in np.argwhere(waiting)[0])
        raise InputError(
            f"directions lead in a circle: the cell at row {row}, column {column} is on it or "
            "below it; make them anew from elevations"
        )


def accumulate_mfd(
    filled, flat, void, dx, dy, weights, *, exponent=1.1, threads=None, progress=SILENT
):
    """Add up weights that part among all lower neighbours: multiple flow directions.

    A neighbour's share grows with a power of the slope down to it (Freeman 1991; Holmgren 1994).
    Freeman chose the exponent 1.1 so that water spreads evenly on a cone, with the same for the
    sides and the corners of a cell and without the contour lengths of Quinn et al. (1991); so it is
    here on square cells. Where cells are longer one way, shares are multiplied by the sides of the
    cell with its corners cut off, so that water still goes down the slope; those of a square are
    all the same.

    Parameters
    ----------
    filled, flat, void, dx, dy
        As of `demsmith.core.hydrology.d8_directions`. Where ``flat`` is not 0, it is the elevation
        among cells of the same elevation.
    weights : (H,) or (H, W) array
        What each cell adds, or each of a row: its area [m²], or 1 to count cells.
    exponent : float
        0 (all lower neighbours get the same) to 100 (nearly D8).
    threads : int, optional
        Default: one for each core. The result does not depend on it.
    progress : Progress

    Returns
    -------
    (H, W) float64 array
        Sum of the weights of the cell and of what comes from above; 0 at voids. Shares are exact to
        some 1e-6, and add up to 1 in double precision, so that none of the weight is lost.

    Raises
    ------
    InputError
        If the arrays do not fit, a weight is not finite, or the exponent is out of range.
    Cancelled
        If ``progress`` asks to stop.

    References
    ----------
    Freeman, T. G. (1991), Calculating catchment area with divergent flow based on a regular grid,
    Computers & Geosciences 17, 413-422.
    Holmgren, P. (1994), Multiple flow direction algorithms for runoff modelling in grid based
    elevation models: an empirical evaluation, Hydrological Processes 8, 327-334.
    Quinn, P., Beven, K., Chevallier, P. and Planchon, O. (1991), The prediction of hillslope flow
    paths for distributed hydrological modelling using digital terrain models, Hydrological
    Processes 5, 59-79.

    Examples
    --------
    >>> z = np.array([[3.0, 9, 3], [2, 4, 2], [2, 1, 2]])
    >>> one = np.ones(3)
    >>> accumulate_mfd(z, None, np.zeros((3, 3), bool), one, one, one).round(2)
    array([[1.29, 1.  , 1.29],
           [2.69, 1.18, 2.69],
           [1.15, 9.  , 1.15]])
    """
    check_exponent(exponent)
    ground = Surface(filled, flat, void, dx, dy)
    return _accumulate(ground, weights, exponent, threads, progress)


def accumulate_dinf(filled, flat, void, dx, dy, weights, *, threads=None, progress=SILENT):
    """Add up weights that go down the steepest slope of eight facets: D-infinity.

    Each cell drains to the one or two neighbours about the direction of the steepest of the eight
    triangles around it (Tarboton 1997), in shares by the angles to them. Slopes are by ground
    metres; where cells are longer one way, the angles are those of the raster stretched to square
    cells, by which water goes better down the slope of a plane. Where several slopes are the
    steepest, each gets as much: Tarboton takes the first, which a mirrored raster would turn into
    another.

    Parameters, result and errors are those of `accumulate_mfd`.

    References
    ----------
    Tarboton, D. G. (1997), A new method for the determination of flow directions and upslope areas
    in grid digital elevation models, Water Resources Research 33, 309-319.

    Examples
    --------
    From the first cell it is 10 m down to the east and from there 4 m on to the south, so that
    arctan(0.4) / 45° of its water goes south-east:

    >>> z = np.array([[20.0, 10.0], [30.0, 6.0]])
    >>> one = np.ones(2)
    >>> accumulate_dinf(z, None, np.zeros((2, 2), bool), one, one, one).round(3)
    array([[1.   , 1.516],
           [1.   , 4.   ]])
    """
    ground = Surface(filled, flat, void, dx, dy)
    return _accumulate(ground, weights, None, threads, progress)


def check_exponent(exponent):
    """Refuse an exponent that is not from 0 to 100."""
    if not 0 <= exponent <= 100:
        raise InputError(f"exponent is {exponent}; it must be from 0 to 100")


def _accumulate(ground, weights, exponent, threads, progress):
    """Add up weights by MFD, or by D-infinity if the exponent is None."""
    from demsmith.core.hydrology._dispersal import disperse

    donors = ground.donors(exponent, threads=threads, progress=Span(progress, 0, 0.15))
    area = initial(weights, ground.void, threads=threads, progress=Span(progress, 0.15, 0.2))
    power = np.float32(-1 if exponent is None else exponent)
    traverse(
        lambda reach, patience: disperse(
            ground.z, ground.flat, ground.ways, power, reach.rows, reach.free, reach.place,
            reach.stack, patience, donors, area,
        ),
        area.shape, threads=threads, progress=Span(progress, 0.2, 1),
    )  # fmt: skip
    return area


def initial(weights, void, *, threads=None, progress=SILENT):
    """Give each cell its own weight, 0 at voids, as (H, W) float64; refuse what is not finite."""
    weights = np.asarray(weights)
    if weights.shape not in (void.shape, void.shape[:1]):
        raise InputError(
            f"weights have shape {weights.shape}; give one for each cell, {void.shape}, or for "
            f"each row, {void.shape[:1]}"
        )
    by_cell = weights if weights.ndim == 2 else weights[:, None]
    area = np.empty(void.shape)

    def start(rows):
        area[rows] = by_cell[rows]
        np.copyto(area[rows], 0, where=void[rows])
        if not np.isfinite(area[rows].sum()):
            raise InputError("weights must be finite at all cells that are no voids")

    in_strips(start, void.shape, threads=threads, progress=progress)
    return area
