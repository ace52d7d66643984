"""``demsmith relief``."""

from cyclopts import App

from demsmith.core.cli.common import VERB, InputFile, OutputFile, Run, Source
from demsmith.core.cli.parameters import parameters
from demsmith.core.relief import ReliefOptions, relief_file

_Options = parameters(ReliefOptions, group=VERB, advanced=VERB)

app = App(
    name="relief",
    help_epilogue="""\
Everything is measured in metres on the ground, also in geographic coordinates.

Examples:
  demsmith relief N37W004.hgt slope.tif
  demsmith relief dem.tif shade.tif --kind hillshade --exaggeration 2 --multidirectional
  demsmith relief dem.tif ridges.tif --kind position --radius 300
""",
)


@app.default
def relief(
    input: InputFile,  # noqa: A002
    output: OutputFile,
    /,
    *,
    options: _Options = _Options(),  # noqa: B008, frozen
    source: Source = Source(),  # noqa: B008, frozen
    run: Run = Run(),  # noqa: B008, frozen
):
    """Make slope, aspect, hillshade, mean deviation or topographic position."""
    with run.progress("looking at the ground") as progress:
        result = relief_file(
            input, output, options=options,
            band=source.band, nodata=source.nodata, below=source.below, above=source.above,
            mask=source.mask, threads=run.threads, overwrite=run.overwrite,
            creation_options=run.creation_option, progress=progress,
        )  # fmt: skip
    run.tell(result, _summary(result))


def _summary(result):
    """Tell in a line what was done."""
    found = (
        "level everywhere"
        if result.minimum is None
        else f"from {result.minimum:.4g} to {result.maximum:.4g}"
    )
    return f"{result.kind} {found} in {result.seconds:.1f} s -> {result.output}"
