"""``demsmith fill``."""

from typing import Annotated

from cyclopts import App, Parameter

from demsmith.core.cli.common import MCMD, VERB, InputFile, Maps, OutputFile, Run, Source
from demsmith.core.cli.parameters import parameters
from demsmith.core.voids import FillOptions, fill_file

_Options = parameters(FillOptions, group=VERB, advanced=MCMD)

app = App(
    name="fill",
    help_epilogue="""\
Voids are the cells that the file marks as nodata, NaN, and those that hold the common marks -32768
and -32767 even without a tag. Every known cell keeps its value.

Examples:
  demsmith fill N42E001.hgt filled.tif
  demsmith fill dem.tif filled.tif --nodata -9999 --interior-only --source-map source.tif
""",
)


@app.default
def fill(
    input: InputFile,  # noqa: A002
    output: OutputFile,
    /,
    *,
    options: _Options = _Options(),  # noqa: B008, frozen
    maps: Maps = Maps(),  # noqa: B008, frozen
    source_map: Annotated[
        str | None,
        Parameter(
            group=VERB,
            help="GeoTIFF to write: 0 original, 2 void left, others by what a cell was filled.",
        ),
    ] = None,
    uncertainty: Annotated[
        str | None,
        Parameter(
            group=VERB,
            help="GeoTIFF to write: standard error to expect in filled cells, 0 in known ones.",
        ),
    ] = None,
    report: Annotated[
        str | None,
        Parameter(group=VERB, help="JSON file to write: the result, the options and all voids."),
    ] = None,
    source: Source = Source(),  # noqa: B008, frozen
    run: Run = Run(),  # noqa: B008, frozen
):
    """Fill the voids of a raster file."""
    with run.progress("filling voids") as progress:
        result = fill_file(
            input, output, options=options, maps=maps.paths(), source_map=source_map,
            uncertainty=uncertainty, report=report, band=source.band, nodata=source.nodata,
            below=source.below, above=source.above,
            mask=source.mask, threads=run.threads, overwrite=run.overwrite,
            creation_options=run.creation_option, progress=progress,
        )  # fmt: skip
    run.tell(result, _summary(result))


def _summary(result):
    """Tell in a line what was done."""
    if not result.voids:
        done = "no voids to fill"
    else:
        done = (
            f"filled {_count(result.cells_filled, 'cell')} in {_count(result.voids, 'void')} "
            f"(largest {result.largest_void})"
        )
    if result.cells_unfilled:
        done += f", left {_count(result.cells_unfilled, 'cell')} unfilled"
    if result.tuning and result.tuning["accepted"]:
        done += f", {result.tuning['summary']}"
    return f"{done} in {result.seconds:.1f} s -> {result.output}"


def _count(number, noun):
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
