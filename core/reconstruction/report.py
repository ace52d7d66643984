"""The report of a reconstructed file."""

import os
from dataclasses import asdict

import numpy as np

from demsmith.core.report import Scene, reconstruction_report, striking_voids


def write_reports(paths, result, options, own, made, boxes):
    """Write the page or the numbers of a reconstruction, as asked for.

    Parameters
    ----------
    paths : mapping of str to str
        Unfinished paths: ``report`` and, of a page, its ``numbers``.
    result : ReconstructResult
    options : ReconstructOptions
    own : Raster
        As it was read.
    made : Assembled
    boxes : (V, 4) int array
        First and one past the last row, first and one past the last column of each void.
    """
    rows = list(result.table.rows())
    unit = own.meta.unit or "m"
    scene = Scene(
        own.meta.real(made.values), made.sources, own.grid.pixel_size_m(), made.sigma, unit
    )
    report = reconstruction_report(
        facts=_facts(result, own), voids=rows,
        cells_by_source=dict(enumerate(np.bincount(made.sources.ravel()).tolist())),
        scene=scene, options=asdict(options), warnings=result.warnings,
        faults=fault_rows(made.removed.counts()), removed=made.removed.rows(own.grid),
        auxiliaries=auxiliary_rows(result.auxiliaries),
        close_ups=[
            (rows[void], scene.window_around(boxes[void, :2], boxes[void, 2:]))
            for void in striking_voids(rows)
        ],
    )  # fmt: skip
    for path in (paths["report"], paths.get("numbers")):
        if path:
            write = report.write_html if path.lower().endswith(".html") else report.write_json
            write(path)


_FAULTS = {"spike": "Spikes", "well": "Wells", "rim of a void": "Rims of voids"}


def fault_rows(counts):
    """Give what a report lists of known cells that were not believed.

    Parameters
    ----------
    counts : mapping of str to int
        Cells by the reason, see `demsmith.core.reconstruction.removed.RemovedCells`.
    """
    return [
        {"fault": f"{name}: known cells that were not believed, and filled", "cells": counts[why]}
        for why, name in _FAULTS.items()
        if counts.get(why)
    ]


_ALIGNMENT = {
    "shift_east": "_m", "shift_north": "_m", "bias": "_m", "tilt_east": "_m_per_km",
    "tilt_north": "_m_per_km", "vertical_scale": "", "blur_east": "_m", "blur_north": "_m",
    "spread_before": "_m", "spread_after": "_m", "correlation": "", "roughness": "",
}  # fmt: skip


def auxiliary_rows(alignments):
    """Give what a report lists of the auxiliaries, by the names it knows."""
    return [
        {
            "name": f"auxiliary {number}",
            "path": each["path"],
            "accepted": each["accepted"],
            "reason": each["reason"],
            **{f"{name}{unit}": each[name] for name, unit in _ALIGNMENT.items()},
        }
        for number, each in enumerate(alignments, start=1)
    ]


def _facts(result, own):
    return {
        "Input": own.source,
        "Output": result.output,
        "Cells": f"{own.grid.shape.rows} × {own.grid.shape.columns}",
        "Neighbours": ", ".join(map(os.path.basename, result.neighbours)) or "none",
        "Seconds": result.seconds,
        "Demsmith": result.version,
    }
