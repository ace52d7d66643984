"""``demsmith reconstruct``."""

from typing import Annotated

from cyclopts import App, Parameter

from demsmith.core.cli.common import VERB, Auxiliaries, InputFile, OutputFile, Run, Source
from demsmith.core.cli.parameters import parameters
from demsmith.core.reconstruction import ReconstructOptions, reconstruct_file
from demsmith.core.voids.sources import NEIGHBOUR, SOURCES

_Options = parameters(ReconstructOptions, group=VERB, advanced=VERB)

app = App(
    name="reconstruct",
    help_epilogue="""\
Known cells keep their values, but for spikes and wells, which are removed and filled too
(--no-outliers leaves them); the report lists them. The source map says of each cell where it comes
from.

Examples:
  demsmith reconstruct N42E001.hgt filled.tif --neighbours tiles/ --report report.html
  demsmith reconstruct N42E001.hgt filled.tif --source-map source.tif --uncertainty sigma.tif
""",
)


def _output(help_text):
    return Parameter(group=VERB, help=help_text)


@app.default
def reconstruct(
    input: InputFile,  # noqa: A002
    output: OutputFile,
    /,
    *,
    aux: Auxiliaries = (),
    neighbours: Annotated[
        str | None,
        Parameter(group=VERB, help="Folder with tiles beside the input, for voids at its edges."),
    ] = None,
    options: _Options = _Options(),  # noqa: B008, frozen
    source_map: Annotated[str | None, _output("GeoTIFF to write: where each cell is from.")] = None,
    uncertainty: Annotated[
        str | None, _output("GeoTIFF to write: standard error of the filled cells.")
    ] = None,
    voids_layer: Annotated[
        str | None, _output("Polygons of the voids to write: .gpkg or .geojson.")
    ] = None,
    report: Annotated[
        str | None, _output("Report to write: .html (and .json beside it), or .json alone.")
    ] = None,
    source: Source = Source(),  # noqa: B008, frozen
    run: Run = Run(),  # noqa: B008, frozen
):
    """Reconstruct the voids of an elevation raster, with an error for every cell."""
    with run.progress("reconstructing") as progress:
        result = reconstruct_file(
            input, output, options=options, auxiliaries=aux, neighbours=neighbours,
            source_map=source_map, uncertainty=uncertainty, voids_layer=voids_layer, report=report,
            band=source.band, nodata=source.nodata, below=source.below, above=source.above,
            mask=source.mask, threads=run.threads, overwrite=run.overwrite,
            creation_options=run.creation_option, progress=progress,
        )  # fmt: skip
    run.tell(result, _summary(result))


def _summary(result):
    """Tell in a line what was done."""
    done = f"filled {result.cells_filled} cells in {result.voids} voids{told_of_cells(result)}"
    return f"{done} in {result.seconds:.1f} s -> {result.output}"


def told_of_cells(result):
    """Tell how many cells are from elsewhere than interpolation, were replaced, and left."""
    told = [
        f"{source.name}: {result.cells_by_source[source.name]}"
        for source in SOURCES
        if source.code >= NEIGHBOUR and source.name in result.cells_by_source
    ]
    done = f" ({', '.join(told)})" if told else ""
    if result.cells_faulty:
        done += f", {result.cells_faulty} of them known before and not believed"
    if result.cells_unfilled:
        done += f", left {result.cells_unfilled} cells"
    return done
