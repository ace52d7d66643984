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
        faults=fault_rows(result.cells_faulty), auxiliaries=auxiliary_rows(result.auxiliaries),
        close_ups=[
            (rows[void], scene.window_around(boxes[void, :2], boxes[void, 2:]))
            for void in striking_voids(rows)
        ],
    )  # fmt: skip
    for path in (paths["report"], paths.get("numbers")):
        if path:
            write = report.write_html if path.lower().endswith(".html") else report.write_json
            write(path)


def fault_rows(cells):
    """Give what a report lists of known cells that were not believed."""
    return [{"fault": "Known cells that were not believed, and filled", "cells": cells}]


def auxiliary_rows(alignments):
    """Give what a report lists of the auxiliaries, by the names it knows."""
    return [
        {
            "name": f"auxiliary {number}",
            "path": each["path"],
            "accepted": each["accepted"],
            "reason": each["reason"],
            "shift_east_m": each["shift_east"],
            "shift_north_m": each["shift_north"],
            "bias_m": each["bias"],
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
