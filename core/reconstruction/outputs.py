"""The files of a reconstruction: checked before the work, written after it."""

import os
from dataclasses import replace

import numpy as np

from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span
from demsmith.core.raster.layers import check_layer_output
from demsmith.core.voids.sources import SOURCE_COLORS, SOURCE_NAMES

_RASTERS = ("output", "source_map", "uncertainty")
_REPORTS = (".html", ".json")


def check_outputs(paths, *, inputs, overwrite, crs=""):
    """Refuse outputs that cannot be written, before any work is done for them.

    Parameters
    ----------
    paths : dict
        By name: ``output``, ``source_map``, ``uncertainty``, ``voids_layer``, ``report``; None
        for what is not wanted.
    inputs : list of path
    overwrite : bool
    crs : str
        The input's, which a layer must be able to tell.

    Returns
    -------
    dict
        The paths of all files as text; a page's numbers are ``numbers``.

    Raises
    ------
    InputError, OutputError
        See `demsmith.core.raster.check_output`.
    """
    paths = {name: os.fspath(path) for name, path in paths.items() if path}
    if paths.get("report", "").lower().endswith(".html"):
        paths["numbers"] = os.path.splitext(paths["report"])[0] + ".json"
    for name, path in paths.items():
        if name in _RASTERS:
            raster.check_output(path, inputs=inputs, overwrite=overwrite)
        elif name == "voids_layer":
            check_layer_output(path, crs=crs, inputs=inputs, overwrite=overwrite)
        else:
            if not path.lower().endswith(_REPORTS):
                raise InputError(f"report '{path}' must end in one of {', '.join(_REPORTS)}")
            raster.check_place(path, inputs=inputs, overwrite=overwrite)
    if len({os.path.realpath(path) for path in paths.values()}) < len(paths):
        raise InputError("the outputs must be different files")
    return paths


def refuse_uncertainty(options, wanted):
    """Refuse to write an uncertainty that nobody knows.

    Raises
    ------
    InputError
        If it is ``wanted`` and the method is MCMD.
    """
    if wanted and options.method == "mcmd":
        raise InputError("an uncertainty needs the method auto")


def write_tile(paths, own, made, *, creation_options=(), threads=None, progress=SILENT):
    """Write the rasters of a tile.

    Parameters
    ----------
    paths : mapping of str to str
        Unfinished paths of ``output`` and, where wanted, ``source_map`` and ``uncertainty``.
    own : Raster
        The tile as it was read.
    made : Assembled
    creation_options, threads, progress
        As in `demsmith.core.raster.write`.

    Raises
    ------
    OutputError
        If one cannot be written to its end.
    Cancelled
        If ``progress`` asks to stop.
    """
    writing = dict(threads=threads, overwrite=True, creation_options=creation_options)
    raster.write(
        paths["output"], made.values, like=own, void=made.left, dtype=made.values.dtype,
        progress=Span(progress, 0, 0.5), **writing,
    )  # fmt: skip
    if "source_map" in paths:
        raster.write(
            paths["source_map"], made.sources, like=own, dtype="uint8", nodata=None,
            description="source", same_quantity=False, color_table=SOURCE_COLORS,
            categories=SOURCE_NAMES, progress=Span(progress, 0.5, 0.7), **writing,
        )  # fmt: skip
    if "uncertainty" in paths:
        raster.write(
            paths["uncertainty"], made.sigma, void=np.isnan(made.sigma),
            like=_as_uncertainty(own), nodata=-1.0, description="standard error",
            progress=Span(progress, 0.7, 1), **writing,
        )  # fmt: skip


def _as_uncertainty(own):
    """Give the tile's properties, but for those that belong to its elevations."""
    meta = replace(
        own.meta, dtype=np.dtype(np.float32), nodata=None, scale=1.0, offset=0.0,
        band_metadata={}, color_table={}, categories=(),
    )  # fmt: skip
    return replace(own, meta=meta)
