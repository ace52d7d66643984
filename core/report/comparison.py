"""Methods compared by the size of the voids they filled: tables with the best marked, charts."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from demsmith.core.report.blocks import Chart, Column, Table
from demsmith.core.report.charts import bars, calibration
from demsmith.core.report.numbers import is_number


@dataclass(frozen=True)
class Comparison:
    """How wrong methods are where the truth is known.

    Attributes
    ----------
    classes : sequence of str
        Names of the classes of void sizes.
    rmse : mapping of str to sequence of float or None
        A root mean square error per class, by method.
    bias, slope_rmse : mapping, optional
        As ``rmse``: mean error, and root mean square error of the slope [m/m].
    voids, cells : sequence of int, optional
        How many were filled per class.
    nominal : sequence of float
        Shares that intervals of the uncertainty promise, 0 to 1.
    held : mapping of str to sequence of float or None
        The shares of cells they hold, by class or other name.
    unit : str
        Of the errors.
    """

    classes: Sequence
    rmse: dict
    bias: dict = field(default_factory=dict)
    slope_rmse: dict = field(default_factory=dict)
    voids: Sequence = ()
    cells: Sequence = ()
    nominal: Sequence = ()
    held: dict = field(default_factory=dict)
    unit: str = "m"


def comparison_blocks(comparison):
    """Make the blocks that show a comparison: charts first, then tables.

    Parameters
    ----------
    comparison : Comparison

    Returns
    -------
    list
        Of blocks, for a `Section`.
    """
    unit = comparison.unit
    blocks = [
        Chart(
            bars(
                comparison.classes, comparison.rmse, unit=unit,
                description="Bars of the error of each method by void size; the numbers are in "
                "the table below",
            ),
            "Root mean square error of each method by void size. Lower is better.",
        ),
        _errors_and_counts(comparison),
    ]  # fmt: skip
    if comparison.slope_rmse:
        caption = "RMSE of the slope [m/m]; ★ marks the best of each class"
        blocks.append(_table(comparison, comparison.slope_rmse, caption, 4))
    if comparison.bias:
        caption = f"Bias: mean of filled less true elevation [{unit}]; ★ marks the smallest"
        blocks.append(_table(comparison, comparison.bias, caption, 2))
    if comparison.held:
        blocks += _calibration_blocks(comparison)
    return blocks


def _errors_and_counts(comparison):
    caption = f"RMSE [{comparison.unit}]; ★ marks the best of each class"
    table = _table(comparison, comparison.rmse, caption)
    counts = [
        {"method": title, **dict(zip(comparison.classes, numbers, strict=True))}
        for title, numbers in (("(voids)", comparison.voids), ("(cells)", comparison.cells))
        if numbers
    ]
    return replace(table, rows=[*table.rows, *counts])


def _table(comparison, errors, caption, digits=None):
    rows = [
        {"method": method, **dict(zip(comparison.classes, values, strict=True))}
        for method, values in errors.items()
    ]
    best = {
        (_smallest([row[name] for row in rows]), name)
        for name in comparison.classes
        if len(rows) > 1
    }
    columns = [Column("method", "Method")]
    columns += [Column(name, name, digits) for name in comparison.classes]
    return Table(columns, rows, caption, frozenset(best))


def _smallest(values):
    """Give the place of the number nearest to 0; None if there is none."""
    places = [at for at, value in enumerate(values) if is_number(value)]
    return min(places, key=lambda at: abs(values[at]), default=None)


def _percent(share):
    return 100.0 * share if is_number(share) else None


def _calibration_blocks(comparison):
    titles = [f"{100 * share:.3g} % interval" for share in comparison.nominal]
    rows = [
        {"class": name, **dict(zip(titles, map(_percent, shares), strict=True))}
        for name, shares in comparison.held.items()
    ]
    columns = [Column("class", "Void size"), *(Column(title, title, 1) for title in titles)]
    drawing = calibration(
        comparison.nominal, comparison.held,
        description="Share of cells within each interval against the share it promises; the "
        "numbers are in the table below",
    )  # fmt: skip
    return [
        Chart(drawing, "How far the uncertainty can be trusted: on the dashed line, an interval "
              "holds as many true elevations as it promises; below it, too few."),
        Table(columns, rows, "Cells whose true elevation is within the interval [%]"),
    ]  # fmt: skip
