"""The report of a reconstruction: what was void, what it was filled by, how wrong it may be."""

import math
from dataclasses import asdict

import numpy as np

from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.report.blocks import (
    Chart,
    Column,
    Facts,
    Gallery,
    Note,
    Numbers,
    Section,
    Table,
    table_of,
)
from demsmith.core.report.charts import COLORS, hexadecimal, scatter, shares
from demsmith.core.report.comparison import comparison_blocks
from demsmith.core.report.numbers import is_number, size_class, written
from demsmith.core.report.report import Report
from demsmith.core.report.scene import close_up, overview
from demsmith.core.voids.sizes import SIZE_CLASSES
from demsmith.core.voids.sources import LEFT, ORIGINAL, SOURCES

_MOST_ROWS = 25
_MOST_REMOVED = 50
_MOST_DOTS = 1500
_COLOR_OF = {source.name: hexadecimal(source.color) for source in SOURCES}
_AUXILIARY_TITLES = {"name": "Auxiliary", "path": "File", "accepted": "Used", "reason": "Why"}


def reconstruction_report(
    *, facts, voids, cells_by_source, scene, close_ups=(), options=None, warnings=(), faults=(),
    removed=(), auxiliaries=(), validation=None, title="Reconstruction", progress=SILENT,
):  # fmt: skip
    """Make the report of a reconstruction.

    Parameters
    ----------
    facts : mapping of str to value
        What was done when to which file, by names for people: input, output, CRS, time taken.
    voids : sequence of mappings
        The rows of the table of voids, as `demsmith.core.voids.VoidTable.rows` gives them; the
        name of the ``method`` and the ``expected_error`` (RMSE) of each void are shown where
        known.
    cells_by_source : mapping of int to int
        Cells of the raster by the codes of the source map.
    scene : Scene
        The raster, or a shrunk copy of a huge one.
    close_ups : sequence of (mapping, Scene)
        Rows of voids, and windows around these: `striking_voids`, `Scene.window_around`.
    options : mapping, optional
    warnings : sequence of str
    faults, auxiliaries : sequence of mappings
        A row for each kind of fault that was found, with its number of ``cells``, and for each
        auxiliary raster; their keys become columns.
    removed : sequence of mappings
        A row for each known cell that was not believed, the most changed first: ``row``,
        ``column``, ``x``, ``y``, the elevations ``before`` and ``after``, and the ``reason``.
    validation : Comparison, optional
    title : str
    progress : Progress

    Returns
    -------
    Report

    Raises
    ------
    Cancelled
        If ``progress`` asks to stop.
    """
    voids = list(voids)
    ground = overview(scene, progress=Span(progress, 0, 0.6))
    sections = [
        Section("", [Numbers(_headline(voids, cells_by_source, scene.unit)), *_cautions(warnings)]),
        Section("The ground", [ground, *_sources(cells_by_source)]),
        _close_ups(close_ups, scene.unit, Span(progress, 0.6, 1)),
        _expected(voids, scene.unit),
        _validation(validation),
        _listed("Auxiliary rasters", auxiliaries, _AUXILIARY_TITLES),
        _faults(faults, removed, scene.unit),
        _largest(voids, scene.unit),
        Section("What was done", [Facts(dict(facts)), *([Facts(options)] if options else [])]),
    ]
    data = {
        "title": title,
        "facts": dict(facts),
        "options": dict(options or {}),
        "warnings": list(warnings),
        "cells_by_source": {
            source.name: cells_by_source[source.code]
            for source in SOURCES
            if cells_by_source.get(source.code)
        },
        "expected_error": expected_error(voids),
        "expected_error_by_size": _by_size(voids),
        "faults": list(faults),
        "removed_cells": list(removed),
        "auxiliaries": list(auxiliaries),
        "validation": asdict(validation) if validation else None,
        "void_table": voids,
    }
    name = str(next(iter(facts.values()), ""))
    return Report(title, name, [section for section in sections if section], data)


def striking_voids(voids, *, largest=3, uncertain=3):
    """Choose the voids that close-ups should show.

    Parameters
    ----------
    voids : sequence of mappings
        As in `reconstruction_report`.
    largest, uncertain : int
        As many of the largest, and of the other ones of largest expected error.

    Returns
    -------
    list of int
        Their places in ``voids``.

    Examples
    --------
    >>> striking_voids([{"cells": 1}, {"cells": 9}, {"cells": 3}], largest=2)
    [1, 2]
    """
    order = sorted(range(len(voids)), key=lambda at: -voids[at]["cells"])
    doubtful = [at for at in order[largest:] if is_number(voids[at].get("expected_error"))]
    doubtful.sort(key=lambda at: -voids[at]["expected_error"])
    return order[:largest] + doubtful[:uncertain]


def expected_error(voids):
    """Give the expected root mean square error of all cells of some voids; None if unknown.

    Examples
    --------
    >>> expected_error([{"cells": 1, "expected_error": 1.0}, {"cells": 1, "expected_error": 7.0}])
    5.0
    """
    judged = [row for row in voids if is_number(row.get("expected_error"))]
    if not judged:
        return None
    squares = sum(row["cells"] * row["expected_error"] ** 2 for row in judged)
    return math.sqrt(squares / sum(row["cells"] for row in judged))


def _headline(voids, cells_by_source, unit):
    cells = sum(cells_by_source.values())
    left = cells_by_source.get(LEFT, 0)
    void = cells - cells_by_source.get(ORIGINAL, 0)
    share = f"{written(100.0 * void / max(1, cells))} % of all cells"
    items = [
        ("Voids", written(len(voids)), None),
        ("Void cells", written(void), share),
        ("Filled", written(void - left), f"{written(100.0 * (void - left) / max(1, void))} %"),
        ("Left as they were", written(left), "void cells"),
        ("Largest void", written(max((row["cells"] for row in voids), default=0)), "cells"),
    ]
    error = expected_error(voids)
    if error is not None:
        items.append(
            ("Expected error", f"±\u00a0{written(error)}\u00a0{unit}", "RMSE of the filled cells")
        )
    return items


def _cautions(warnings):
    return [Note(warning, warning=True) for warning in warnings]


def _sources(cells_by_source):
    parts = [
        (source.name, cells_by_source[source.code], hexadecimal(source.color))
        for source in SOURCES[1:]
        if cells_by_source.get(source.code)
    ]
    if not parts:
        return []
    told = ", ".join(f"{name} {written(cells)} cells" for name, cells, _ in parts)
    return [Chart(shares(parts, description=told), "What the void cells were filled by")]


def _close_ups(close_ups, unit, progress):
    pictures = []
    for number, (row, scene) in enumerate(close_ups):
        checkpoint(progress, number / len(close_ups))
        name = f"Void {row['id']} ({written(row['cells'])} cells)"
        told = f"After{_by(row)}"
        if is_number(row.get("expected_error")):
            told += f"; expected error ±\u00a0{written(row['expected_error'])}\u00a0{unit}"
        pictures += close_up(scene, name, told)
    if not pictures:
        return None
    return Section("The largest and the most uncertain voids", [Gallery(pictures, columns=4)])


def _by(row):
    return f", {row['method']}" if row.get("method") else ""


def _expected(voids, unit):
    judged = [row for row in voids if is_number(row.get("expected_error"))]
    if not judged:
        return None
    rows = [
        {**each, "size": size_class(each["smallest"], each["largest"])} for each in _by_size(voids)
    ]
    columns = [
        Column("size", "Void size"), Column("voids", "Voids"), Column("cells", "Cells"),
        Column("median", f"Median [{unit}]"), Column("rmse", f"RMSE of cells [{unit}]"),
        Column("worst", f"Worst void [{unit}]"),
    ]  # fmt: skip
    drawing = scatter(
        _dots(judged), across="cells of the void", up="expected error", unit=unit,
        description="Expected error of each void against its size, coloured by method",
    )  # fmt: skip
    return Section(
        "How wrong the fill may be",
        [
            Chart(drawing, "Expected error (RMSE) of each void by its size"),
            Table(columns, rows, "Expected error by void size"),
        ],
    )


def _dots(judged):
    """Group voids by method; of very many, take the largest and every n-th of the others."""
    judged = sorted(judged, key=lambda row: -row["cells"])
    judged = judged[: _MOST_DOTS // 3] + judged[_MOST_DOTS // 3 :: len(judged) // _MOST_DOTS + 1]
    order = {source.name: source.code for source in SOURCES}
    methods = {str(row.get("method") or "all") for row in judged}
    methods = sorted(methods, key=lambda name: (order.get(name, len(order)), name))
    dots = {}
    for number, method in enumerate(methods):
        chosen = [row for row in judged if str(row.get("method") or "all") == method]
        sizes, errors = ([row[key] for row in chosen] for key in ("cells", "expected_error"))
        dots[method] = sizes, errors, _COLOR_OF.get(method, COLORS[number % len(COLORS)])
    return dots


def _by_size(voids):
    """Summarise the expected errors of each class of void sizes, and of all."""
    found = []
    for smallest, largest in (*SIZE_CLASSES, (1, None)):
        top = math.inf if largest is None else largest
        inside = [row for row in voids if smallest <= row["cells"] <= top]
        errors = [row["expected_error"] for row in inside if is_number(row.get("expected_error"))]
        found.append({
            "smallest": smallest, "largest": largest, "voids": len(inside),
            "cells": sum(row["cells"] for row in inside),
            "median": float(np.median(errors)) if errors else None,
            "rmse": expected_error(inside), "worst": max(errors, default=None),
        })  # fmt: skip
    return found


def _validation(validation):
    if validation is None:
        return None
    told = Note(
        "Voids like the raster's own were punched into known ground, filled, and compared with it."
    )
    return Section("Tried on known ground", [told, *comparison_blocks(validation)])


def _listed(title, rows, titles):
    return Section(title, [table_of(rows, titles)]) if rows else None


def _faults(faults, removed, unit):
    if not faults:
        return None
    blocks = [table_of(faults)]
    if removed:
        total = sum(row["cells"] for row in faults)
        blocks.append(_removed(removed, total, unit))
    return Section("Faults", blocks)


def _removed(removed, total, unit):
    shown = removed[:_MOST_REMOVED]
    columns = [
        Column("tile", "Tile"), Column("row", "Row"), Column("column", "Column"),
        Column("x", "x", 5), Column("y", "y", 5), Column("before", f"Was [{unit}]"),
        Column("after", f"Is [{unit}]"), Column("reason", "Why"),
    ]  # fmt: skip
    columns = [column for column in columns if column.name in shown[0]]
    listed = "all" if len(removed) == total else f"the {written(len(removed))} most changed"
    caption = f"The {len(shown)} most changed of {written(total)} cells; the JSON report has "
    return Table(columns, shown, caption + listed)


def _largest(voids, unit):
    largest = sorted(voids, key=lambda row: -row["cells"])[:_MOST_ROWS]
    if not largest:
        return None
    columns = [
        Column("id", "Void"), Column("x", "x", 5), Column("y", "y", 5), Column("cells", "Cells"),
        Column("area_m2", "Area [m²]", 0), Column("rim_relief", f"Relief of rim [{unit}]"),
        Column("expected_error", f"Expected error [{unit}]"), Column("method", "Filled by"),
        Column("touches_edge", "At edge"),
    ]  # fmt: skip
    columns = [column for column in columns if column.name in largest[0]]
    count = f"The {len(largest)} largest of {written(len(voids))}; the JSON report has all"
    return Section("Voids", [Table(columns, largest, count)])
