"""The report of a validation: methods beside each other by the size of the voids."""

from dataclasses import asdict

from demsmith.core.report import (
    Comparison,
    Facts,
    Note,
    Numbers,
    Report,
    Section,
    comparison_blocks,
)
from demsmith.core.report.numbers import size_class, written

_INTERVALS = (0.68, 0.95)


def validation_report(result, *, options, source, voids_from=None, band=1, unit="m"):
    """Make the report of a validation.

    Parameters
    ----------
    result : ValidateResult
    options : ValidateOptions
    source : str
        Path of the raster.
    voids_from : str, optional
        Path of the raster whose voids' shapes were taken.
    band : int
    unit : str
        Of the elevations.

    Returns
    -------
    demsmith.core.report.Report
    """
    told = (
        "Known ground was hidden in artificial voids, filled by each method, and compared with "
        "what it was. " + _ORIGINS[result.shapes_from]
    )
    facts = {
        "Raster": source, "Band": band, "Shapes of voids from": voids_from,
        "Table": result.output, "Map of errors": result.error_map, "Time [s]": result.seconds,
        **{score.title + ", one fill [s]": score.seconds for score in result.scores},
    }  # fmt: skip
    sections = [
        Section("", [
            Numbers(_headline(result, unit)),
            *(Note(warning, warning=True) for warning in result.warnings),
        ]),
        Section("Error by size of void", [Note(told), *comparison_blocks(_compare(result, unit))]),
        Section("What was done", [Facts(facts), Facts(asdict(options))]),
    ]  # fmt: skip
    data = {
        **result.as_dict(), "input": source, "band": band, "voids_from": voids_from,
        "options": asdict(options),
    }  # fmt: skip
    return Report("Validation of fills", source, sections, data)


_ORIGINS = {
    "own": "The artificial voids have the shapes of the raster's own, and lie where the ground is "
    "as steep as around these.",
    "other": "The artificial voids have the shapes of another raster's, and lie where the ground "
    "is as steep as around these.",
    "mixture": "The artificial voids are a mixture of small and large ones as the SRTM has, more "
    "of them on steep ground.",
}


def _headline(result, unit):
    best = next(score for score in result.scores if score.method == result.best)
    return [
        ("Least error", f"{written(result.rmse)} {unit}", f"RMSE of {best.title}, all sizes"),
        ("Artificial voids", written(result.holes), "over all masks"),
        ("Hidden cells", written(result.cells_hidden), "whose elevations are known"),
    ]


def _compare(result, unit):
    scores = result.scores
    fullest = max(scores, key=lambda score: score.errors[-1].cells).errors
    sizes = [size_class(each.smallest, each.largest) for each in fullest]

    def of_all(name):
        return {score.title: [getattr(each, name) for each in score.errors] for score in scores}

    return Comparison(
        classes=sizes, rmse=of_all("rmse"), bias=of_all("bias"), slope_rmse=of_all("slope_rmse"),
        voids=[each.voids for each in fullest], cells=[each.cells for each in fullest],
        nominal=_INTERVALS, held=_held(scores, sizes), unit=unit,
    )  # fmt: skip


def _held(scores, sizes):
    """Give the shares that intervals hold, by method that states any, and size."""
    stating = [score for score in scores if score.states_intervals]
    return {
        size if len(stating) == 1 else f"{score.title}, {size}": (each.within_68, each.within_95)
        for score in stating
        for size, each in zip(sizes, score.errors, strict=True)
    }
