"""Maps of parameters in raster files: how front ends ask for them, and reading them."""

from dataclasses import dataclass

import numpy as np

from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.mcmd.maps import MAP_NAMES, Maps
from demsmith.core.mcmd.options import McmdOptions
from demsmith.core.options import option, specifications
from demsmith.core.progress import SILENT, Span
from demsmith.core.raster.grid import check_same_grid

_TOLERANCE = 0.1  # pixels by which a map may lie beside the elevations


def _file(name):
    """Make the option of a front end that names a map's file."""
    (spec,) = (spec for spec in specifications(McmdOptions) if spec.name == name)
    return option(
        str, None, f"Map of {spec.title[0].lower()}{spec.title[1:]}",
        f"Raster on the grid of the elevations that gives {name} cell by cell, from "
        f"{spec.minimum:g} to {spec.maximum:g}. Not given, or no data: the number holds.",
        advanced=True,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class MapFiles:
    """The files of `Maps`, as front ends ask for them."""

    l_map: str = _file("l")
    l_bu_map: str = _file("l_bu")
    h_map: str = _file("h")
    r_s_map: str = _file("r_s")
    r_t_map: str = _file("r_t")

    def paths(self):
        """Give the paths that were given by the names `Maps` has for them.

        Examples
        --------
        >>> MapFiles(r_s_map="rough.tif").paths()
        {'r_s': 'rough.tif'}
        """
        named = {name: getattr(self, f"{name}_map") for name in MAP_NAMES}
        return {name: path for name, path in named.items() if path}


def read_maps(paths, grid, *, progress=SILENT):
    """Read maps from raster files.

    Parameters
    ----------
    paths : mapping of str to path
        By the names of `Maps`.
    grid : Grid
        The elevations'.
    progress : Progress

    Returns
    -------
    Maps
        Scale and offset applied; NaN where a file has no data.

    Raises
    ------
    InputError
        If a name is no map's, a file cannot be read, or it is not on ``grid``. A file without
        georeference need only have its shape.
    """
    unknown = ", ".join(sorted(set(paths) - set(MAP_NAMES)))
    if unknown:
        raise InputError(f"there is no map of {unknown}, only of {', '.join(MAP_NAMES)}")
    maps = {}
    for n, (name, path) in enumerate(paths.items()):
        part = Span(progress, n / len(paths), (n + 1) / len(paths))
        maps[name] = _read_map(name, path, grid, part)
    return Maps(**maps)


def _read_map(name, path, grid, progress):
    source = raster.read(path, progress=progress)
    check_same_grid(
        source.grid, grid, what=f"the map of {name}, '{path}',", whose="the elevations",
        tolerance=_TOLERANCE,
    )  # fmt: skip
    values = source.meta.real(source.values.astype(np.float64))
    values[source.void] = np.nan
    return values
