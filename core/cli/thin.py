"""``demsmith thin``."""

from typing import Annotated

from cyclopts import App, Parameter

from demsmith.core.cli.common import VERB, InputFile, OutputFile, Run, Source
from demsmith.core.cli.parameters import parameters
from demsmith.core.thinning import ThinOptions, thin_file

_Options = parameters(ThinOptions, group=VERB, advanced=VERB)

app = App(
    name="thin",
    help_epilogue="""\
Kept cells have their exact values, all others become nodata. To rebuild the terrain:
demsmith samples THINNED REBUILT.

Examples:
  demsmith thin N37W004.hgt thinned.tif --share 0.05
  demsmith thin dem.tif thinned.tif --detector random --seed 7 --points thinned.gpkg
""",
)


@app.default
def thin(
    input: InputFile,  # noqa: A002
    output: OutputFile,
    /,
    *,
    options: _Options = _Options(),  # noqa: B008, frozen
    points: Annotated[
        str | None,
        Parameter(
            group=VERB,
            help="Points of the kept cells to write as well: .gpkg, .geojson or .csv.",
        ),
    ] = None,
    source: Source = Source(),  # noqa: B008, frozen
    run: Run = Run(),  # noqa: B008, frozen
):
    """Keep only the cells of a raster that carry its shape, or a random share."""
    with run.progress("thinning") as progress:
        result = thin_file(
            input, output, options=options, points=points,
            band=source.band, nodata=source.nodata, below=source.below, above=source.above,
            mask=source.mask, threads=run.threads, overwrite=run.overwrite,
            creation_options=run.creation_option, progress=progress,
        )  # fmt: skip
    run.tell(result, _summary(result))


def _summary(result):
    """Tell in a line what was done."""
    return (
        f"kept {result.cells_kept} of {result.cells_known} known cells "
        f"({100 * result.share:.3g} %) in {result.seconds:.1f} s -> {result.output}"
    )
