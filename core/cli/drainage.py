"""``demsmith drainage``."""

from typing import Annotated

from cyclopts import App, Group, Parameter

from demsmith.core.cli.common import VERB, InputFile, OutputFile, Run, Source
from demsmith.core.cli.parameters import parameters
from demsmith.core.hydrology import DrainageOptions, drainage_file

_MORE = Group("More outputs", sort_key=1.5)

_Options = parameters(DrainageOptions, group=VERB, advanced=VERB)

app = App(
    name="drainage",
    help_epilogue="""\
OUTPUT holds the upstream area of each cell, with the cell's own, in ground units.

Examples:
  demsmith drainage N37W004.hgt area.tif
  demsmith drainage dem.tif area.tif --method mfd --specific sca.tif --log log.tif
  demsmith drainage dem.tif area.tif --depressions breach --streams streams.gpkg --threshold 5e5
  demsmith drainage filled.tif area.tif --flags flags.tif --filled-mask sources.tif
""",
)


def _input(help_text):
    return Parameter(group=VERB, help=help_text)


def _more(help_text):
    return Parameter(group=_MORE, help=help_text)


@app.default
def drainage(
    input: InputFile,  # noqa: A002
    output: OutputFile,
    /,
    *,
    options: _Options = _Options(),  # noqa: B008, frozen
    weights: Annotated[
        str | None,
        _input("Raster on the same grid of what each cell adds instead of its area, 0 or more."),
    ] = None,
    filled_mask: Annotated[
        str | None,
        _input(
            "Raster on the same grid that is not 0 where elevations were filled, such as the "
            "source map of fill; for --flags."
        ),
    ] = None,
    log: Annotated[str | None, _more("Common logarithm of the upstream area, .tif.")] = None,
    specific: Annotated[
        str | None,
        _more("Specific catchment area, upstream area by width of flow [m²/m], .tif."),
    ] = None,
    standard_error: Annotated[
        str | None, _more("Standard error of the upstream area, of method particles, .tif.")
    ] = None,
    directions: Annotated[
        str | None,
        _more("Flow directions by D8: 1 east, 2 south-east, 4 south, ... 128 north-east, .tif."),
    ] = None,
    flags: Annotated[
        str | None,
        _more(
            "What a catchment has in it, .tif: 1 raster's edge or void, 2 filled cells, 4 changed "
            "depressions, and their sums."
        ),
    ] = None,
    conditioned: Annotated[
        str | None, _more("Elevations after the treatment of depressions, .tif.")
    ] = None,
    stream_mask: Annotated[str | None, _more("1 in streams, else 0, .tif.")] = None,
    streams: Annotated[
        str | None,
        _more(
            "Streams as lines between confluences, with Strahler's order, length and upstream "
            "area: .gpkg or .geojson."
        ),
    ] = None,
    coarse: Annotated[
        str | None,
        _more("Largest upstream area of each block of cells (--coarse-factor), .tif."),
    ] = None,
    source: Source = Source(),  # noqa: B008, frozen
    run: Run = Run(),  # noqa: B008, frozen
):
    """Tell how much ground drains through each cell, and where its streams are."""
    with run.progress("draining") as progress:
        result = drainage_file(
            input, output, options=options, weights=weights, filled_mask=filled_mask, log=log,
            specific=specific, standard_error=standard_error, directions=directions, flags=flags,
            conditioned=conditioned, stream_mask=stream_mask, streams=streams, coarse=coarse,
            band=source.band, nodata=source.nodata, below=source.below, above=source.above,
            mask=source.mask, threads=run.threads, overwrite=run.overwrite,
            creation_options=run.creation_option, progress=progress,
        )  # fmt: skip
    run.tell(result, _summary(result, "" if weights else f" {options.unit}"))


def _summary(result, unit):
    """Tell in a line what was done."""
    streams = ""
    if result.links is not None:
        streams = (
            f", {result.links} stream links of {result.stream_length_m / 1000:.5g} km, "
            f"order up to {result.highest_order},"
        )
    return (
        f"drained {result.cells - result.cells_void} cells, {result.cells_changed} of them changed "
        f"in depressions, largest upstream area {result.largest_area:.6g}{unit}{streams} "
        f"in {result.seconds:.1f} s -> {result.output}"
    )
