"""Points and lines with elevations, as any file of samples gives them."""

from dataclasses import dataclass

import numpy as np

from demsmith.core.progress import SILENT
from demsmith.core.raster.crs import crs_units, reproject

ELEVATION_NAMES = (
    "z", "elev", "elevation", "ele", "alt", "altitude", "contour", "level", "height", "h",
)  # fmt: skip
"""Names by which a column is known to hold elevations, in lower case, the surest first."""


@dataclass(frozen=True, eq=False)
class Features:
    """What a file of samples holds; immutable.

    Attributes
    ----------
    points : ndarray of float64, shape (N, 3)
        x, y, z of each point, all finite.
    lines : tuple of ndarray of float64, each of shape (M, 3), M >= 2
        x, y, z of the vertices of each line, all finite; rings of polygons are lines too.
    crs : str
        WKT of the coordinates, or the CRS asked for as it was given; empty if unknown.
    notes : tuple of str
        What was chosen or left out, for the user to know.
    """

    points: np.ndarray
    lines: tuple
    crs: str = ""
    notes: tuple = ()


def columns_named(names, wanted):
    """Find the columns, or attributes, that have one of the names wanted, in any case.

    Returns
    -------
    list of int
        Their numbers, in the order of ``wanted``.
    """
    plain = [name.strip().lower() for name in names]
    return [plain.index(name) for name in wanted if name in plain]


def in_crs(vertices, *, source, target, progress=SILENT):
    """Bring vertices into a CRS; their elevations stay as they are.

    Parameters
    ----------
    vertices : ndarray of float64, shape (N, 3)
    source, target : str
        CRS they are in and the one asked for; either may be empty.

    Returns
    -------
    vertices : ndarray of float64, shape (N, 3)
        x and y are NaN where the target does not reach.
    crs : str
        The CRS they are in now.
    notes : list of str

    Raises
    ------
    InputError
        As `reproject`.
    """
    if not target:
        return vertices, source, []
    if not source:
        return vertices, target, ["it has no CRS; its coordinates are taken to be the output's"]
    xy = reproject(vertices[:, :2], source, target, progress=progress)
    units = [crs_units(crs).vertical_unit for crs in (source, target)]
    notes = []
    if None not in units and units[0] != units[1]:
        notes.append(
            f"its heights are in units of {units[0]:.6g} m, those of the output's CRS in "
            f"{units[1]:.6g} m; they are taken as they are"
        )
    return np.column_stack([xy, vertices[:, 2]]), target, notes
