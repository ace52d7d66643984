"""What a mosaic made, all together: the virtual raster, the layer of voids, the report."""

import os
import time
from collections import Counter
from dataclasses import asdict, dataclass, fields

import numpy as np

import demsmith
from demsmith.core import raster
from demsmith.core.mosaic.views import load_view, view_step
from demsmith.core.mosaic.workplace import load, load_facts
from demsmith.core.reconstruction.parts import large_note
from demsmith.core.reconstruction.removed import largest_changes
from demsmith.core.reconstruction.report import auxiliary_rows, fault_rows
from demsmith.core.reconstruction.table import tabulate
from demsmith.core.report import Scene, reconstruction_report
from demsmith.core.voids.sources import LEFT, ORIGINAL, SOURCES
from demsmith.core.voids.table import VoidTable

_PATHS = ("input", "output", "source_map", "uncertainty")


@dataclass(frozen=True)
class MosaicResult:
    """What the reconstruction of a mosaic did.

    Attributes
    ----------
    output : str
        The folder.
    vrt, voids_layer, report : str or None
        Paths in it.
    seconds : float
        Of this run alone, if it went on from an earlier one.
    version : str
        Demsmith's.
    tiles : tuple of dict
        For each, the paths ``input``, ``output``, and ``source_map`` and ``uncertainty`` where
        wanted, and its ``cells_void``, ``cells_filled``, ``cells_unfilled`` and
        ``cells_replaced``: known ones that got the elevation of another tile.
    voids, largest_void : int
        Number of voids of the whole, cells of the largest.
    cells, cells_void, cells_filled, cells_unfilled : int
        Of all tiles; a cell of two tiles counts twice.
    cells_by_source : dict
        Cells of all tiles by the names of the source map's classes.
    cells_faulty : int
        Known cells of all tiles that were not believed, and filled.
    auxiliaries : tuple of dict
        How each was aligned: see `demsmith.core.auxiliary.Alignment`.
    warnings : tuple of str
        One sentence each.
    table : VoidTable
        The voids; rows and columns count from the first cell of the whole.
    """

    output: str
    vrt: str | None
    voids_layer: str | None
    report: str
    seconds: float
    version: str
    tiles: tuple
    voids: int
    largest_void: int
    cells: int
    cells_void: int
    cells_filled: int
    cells_unfilled: int
    cells_by_source: dict
    cells_faulty: int
    auxiliaries: tuple
    warnings: tuple
    table: VoidTable

    def as_dict(self):
        """Give everything but the table as a dict that JSON can hold."""
        return {
            field.name: getattr(self, field.name) for field in fields(self) if field.name != "table"
        }


def summarise(work, plan, extents, patches, written, large, begin):
    """Write what is told of the whole, and tell it.

    Parameters
    ----------
    work : demsmith.core.mosaic.work.Work
    plan : Plan
    extents : VoidExtents
    patches, written : list of str
        Results of filling and of writing the tiles.
    large : (M,) int64 array
        The voids that were left because they are too large.
    begin : float
        `time.perf_counter` when all began.

    Returns
    -------
    MosaicResult
    """
    layout, grid = work.layout, work.layout.tiles.grid
    facts = [load_facts(path) for path in written]
    table = tabulate(
        plan, extents, np.arange(len(extents)), [_Judged(path) for path in patches], grid
    )
    counts = np.sum([each["counts"] for each in facts], axis=0)
    warnings = [note for each in facts for note in each["notes"]]
    warnings += [_disagreement(each) for each in facts if each["replaced"]]
    if large.size:
        warnings.append(large_note(extents.cells[large]))
    made = layout.summaries
    vrt_note = raster.write_vrt(made["vrt"], [paths["output"] for paths in layout.outputs])
    if vrt_note:
        warnings.append(vrt_note)
    if "voids_layer" in made:
        raster.write_polygons(made["voids_layer"], extents, grid, vars(table), overwrite=True)
    result = MosaicResult(
        output=layout.folder,
        vrt=None if vrt_note else made["vrt"],
        voids_layer=made.get("voids_layer"),
        report=made["report"],
        seconds=round(time.perf_counter() - begin, 3),
        version=demsmith.__version__,
        tiles=tuple(_row(each) for each in facts),
        voids=len(table),
        largest_void=int(table.cells.max(initial=0)),
        cells=int(counts.sum()),
        **_cell_counts(counts, sum(each["replaced"] for each in facts)),
        cells_by_source={
            source.name: int(counts[source.code]) for source in SOURCES if counts[source.code]
        },
        cells_faulty=_faulty(facts).total(),
        auxiliaries=tuple(plan.alignments()),
        warnings=tuple(warnings),
        table=table,
    )
    _write_report(work, plan, result, counts, written, facts)
    return result


class _Judged:
    """What a saved patch knows of its voids, without their cells."""

    def __init__(self, path):
        self._path = path

    def __getattr__(self, name):
        return load(self._path, name)[0]


def _row(facts):
    paths = {name: path for name, path in facts.items() if name in _PATHS}
    counts = _cell_counts(facts["counts"], facts["replaced"])
    return {**paths, **counts, "cells_replaced": facts["replaced"]}


def _faulty(facts):
    """Count the known cells of all tiles that were not believed, by the reason."""
    return sum((Counter(each["faulty"]) for each in facts), Counter())


def _removed(facts):
    """List the most changed of them, each with its tile."""
    return largest_changes(
        [{"tile": os.path.basename(each["input"]), **row} for row in each["removed"]]
        for each in facts
    )


def _disagreement(facts):
    return (
        f"'{facts['input']}': {facts['replaced']} known cells are known otherwise by a tile that "
        "comes before it, whose elevations they were given"
    )


def _cell_counts(counts, replaced):
    void = int(sum(counts) - counts[ORIGINAL] - replaced)
    left = int(counts[LEFT])
    return dict(cells_void=void, cells_filled=void - left, cells_unfilled=left)


def _write_report(work, plan, result, counts, written, facts):
    report = reconstruction_report(
        facts={
            "Output": result.output,
            "Tiles": len(result.tiles),
            "Cells": "{} × {}".format(*work.layout.tiles.shape),
            "Seconds": result.seconds,
            "Demsmith": result.version,
        },
        voids=list(result.table.rows()),
        cells_by_source=dict(enumerate(counts.tolist())),
        scene=_scene(work.layout.tiles, plan, written),
        options=asdict(work.options),
        warnings=result.warnings,
        faults=fault_rows(_faulty(facts)),
        removed=_removed(facts),
        auxiliaries=auxiliary_rows(result.auxiliaries),
        title="Reconstruction of a mosaic",
    )
    report.data["tiles"] = list(result.tiles)
    report.write_html(work.layout.summaries["report"], overwrite=True)
    report.write_json(work.layout.summaries["numbers"], overwrite=True)


def _scene(tiles, plan, written):
    """Put the views of the tiles together to a small picture of all."""
    step = view_step(tiles.shape)
    shape = tuple(-(-length // step) for length in tiles.shape)
    values, sigma = (np.full(shape, np.nan, np.float32) for _ in range(2))
    sources = np.full(shape, ORIGINAL, np.uint8)
    for path in written:
        view = load_view(path)
        height, width = view.sources.shape
        part = slice(view.row, view.row + height), slice(view.column, view.column + width)
        values[part], sigma[part], sources[part] = view.values, view.sigma, view.sources
    known = ~np.isnan(values)
    values[~known] = values[known].min() if known.any() else 0
    pixel_size = tuple(size[::step] * step for size in plan.pixel_size)
    unit = tiles.tiles[0].meta.unit or "m"
    return Scene(values, sources, pixel_size, sigma, unit)
