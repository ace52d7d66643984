"""``demsmith validate``."""

from typing import Annotated

from cyclopts import App, Parameter

from demsmith.core.cli.common import VERB, InputFile, Run, Source
from demsmith.core.cli.parameters import parameters
from demsmith.core.validation import METHODS, ValidateOptions, validate_file

_Options = parameters(ValidateOptions, group=VERB, advanced=VERB)

app = App(
    name="validate",
    help_epilogue="""\
Known ground is hidden in artificial voids, which have the shapes of the raster's own and lie where
it is as steep as around these. Each method fills them, and the errors are told by void size.

Examples:
  demsmith validate N42E001.hgt
  demsmith validate N37W004.hgt --voids-from N42E001.hgt --methods mcmd,gdal --report report.json
""",
)

_LEGEND = """\
RMSE, bias, MAE and max: of the elevation, in its unit. slope: RMSE of the slope [percent].
68 %, 95 %: cells within the interval that the method states for so many. s: seconds for a fill."""


def _words(_, tokens):
    """Read the words, separated by commas, of every time the option is given."""
    return tuple(word.strip() for token in tokens for word in token.value.split(","))


def _output(help_text):
    return Parameter(group=VERB, help=help_text)


@app.default
def validate(
    input: InputFile,  # noqa: A002
    /,
    *,
    methods: Annotated[
        tuple[str, ...] | None,
        Parameter(
            group=VERB,
            help=f"Methods to compare, by commas: {', '.join(METHODS)}. Default: all.",
            converter=_words,
            n_tokens=1,
            negative=(),
            show_default=False,
        ),
    ] = None,
    voids_from: Annotated[
        str | None,
        Parameter(
            group=VERB,
            help="Raster whose voids' shapes the artificial ones have; the input's own if not "
            "given or, if it has none, a mixture as of the SRTM.",
        ),
    ] = None,
    options: _Options = _Options(),  # noqa: B008, frozen
    table: Annotated[
        str | None, _output("Table of the errors to write: .csv, .gpkg or .geojson.")
    ] = None,
    report: Annotated[
        str | None, _output("Report to write, by its name's end: .html or .json.")
    ] = None,
    error_map: Annotated[
        str | None,
        _output("GeoTIFF to write: filled less true elevation by the first of the methods."),
    ] = None,
    source: Source = Source(),  # noqa: B008, frozen
    run: Run = Run(),  # noqa: B008, frozen
):
    """Tell how wrong fills of a raster are, by void size."""
    with run.progress("validating") as progress:
        result = validate_file(
            input, output=table, methods=methods, voids_from=voids_from, options=options,
            report=report, error_map=error_map, band=source.band, nodata=source.nodata,
            below=source.below, above=source.above, mask=source.mask, threads=run.threads,
            overwrite=run.overwrite, creation_options=run.creation_option, progress=progress,
        )  # fmt: skip
    if not (run.json or run.quiet):
        _show(result)
    run.tell(result, _summary(result))


def _show(result):
    """Print the errors as a table on standard output."""
    from rich.console import Console

    console = Console()
    if not console.is_terminal:
        console.width = 120  # a file has no width: nothing is to be cut there
    console.print(_table(result))
    console.print(_LEGEND, markup=False, highlight=False)


def _table(result):
    """Make the table of errors: void sizes below each other, in each all methods."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("void size", no_wrap=True)
    for header in ("RMSE", "bias", "MAE", "max", "slope", "68 %", "95 %", "s"):
        table.add_column(header, justify="right", no_wrap=True)
    for number, size in enumerate(result.scores[0].errors):
        counted = max((score.errors[number] for score in result.scores), key=lambda e: e.cells)
        table.add_row(f"{size.name} ({counted.voids} voids)", style="bold")
        for score in result.scores:
            table.add_row(*_row(score, score.errors[number]))
        table.add_section()
    return table


def _row(score, error):
    return (
        f"  {score.title}",
        *(_number(x) for x in (error.rmse, error.bias, error.mae, error.max_error)),
        _number(100 * error.slope_rmse),
        *(_percent(share) for share in (error.within_68, error.within_95)),
        _number(score.seconds) if error is score.errors[-1] else "",
    )


def _number(value):
    return "-" if value != value else f"{value:.1f}"


def _percent(share):
    return "-" if share != share else f"{100 * share:.0f} %"


def _summary(result):
    """Tell in a line what was found."""
    written = [path for path in (result.output, result.report, result.error_map) if path]
    return (
        f"hid {result.cells_hidden} cells in {result.holes} artificial voids; best {result.best}, "
        f"RMSE {result.rmse:.2f}, in {result.seconds:.1f} s"
        + (f" -> {', '.join(written)}" if written else "")
    )
