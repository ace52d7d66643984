"""``demsmith proceduralize``."""

from typing import Annotated

from cyclopts import App, Parameter

from demsmith.core.cli.common import VERB, Run, Source
from demsmith.core.cli.parameters import parameters
from demsmith.core.errors import InputError
from demsmith.core.procedural import OutputOptions, ProceduralizeOptions, proceduralize_file

_Options = parameters(ProceduralizeOptions, group=VERB, advanced=VERB)
_Outputs = parameters(OutputOptions, group=VERB, advanced=VERB)

app = App(
    name="proceduralize",
    help_epilogue="""\
A model (.dsp) holds parameters of noise functions, not cells; it is evaluated at any resolution.

Examples:
  demsmith proceduralize N37W004.hgt sierra.dsp
  demsmith proceduralize N37W004.hgt sierra.dsp --raster fine.tif --scale 4
  demsmith proceduralize sierra.dsp finer.tif --scale 8
""",
)


@app.default
def proceduralize(
    input: Annotated[  # noqa: A002
        str,
        Parameter(name="INPUT", help="Elevation raster to model, or a model (.dsp) to evaluate."),
    ],
    output: Annotated[
        str,
        Parameter(name="OUTPUT", help="Model to write, .dsp; of a model, the GeoTIFF, .tif."),
    ],
    /,
    *,
    options: _Options = _Options(),  # noqa: B008, frozen
    outputs: _Outputs = _Outputs(),  # noqa: B008, frozen
    raster: Annotated[
        str | None,
        Parameter(group=VERB, help="GeoTIFF of the model's elevations to write as well, .tif."),
    ] = None,
    source: Source = Source(),  # noqa: B008, frozen
    run: Run = Run(),  # noqa: B008, frozen
):
    """Model terrain by noise functions, and evaluate models at any resolution."""
    if input.lower().endswith(".dsp"):
        if raster is not None:
            raise InputError("of a model, the GeoTIFF is OUTPUT: leave out --raster")
        paths = dict(raster_output=output)
    else:
        paths = dict(output=output, raster_output=raster)
    with run.progress("modelling") as progress:
        result = proceduralize_file(
            input, **paths, options=options, outputs=outputs,
            band=source.band, nodata=source.nodata, below=source.below, above=source.above,
            mask=source.mask, threads=run.threads, overwrite=run.overwrite,
            creation_options=run.creation_option, progress=progress,
        )  # fmt: skip
    run.tell(result, _summary(result))


def _summary(result):
    """Tell in a line what was done."""
    made = ", ".join(path for path in (result.output, result.raster) if path)
    if result.output is None:
        return f"evaluated {result.discs} discs in {result.seconds:.1f} s -> {made}"
    quality = f", {result.psnr:.1f} dB" if result.psnr is not None else ""
    return (
        f"modelled {result.cells_known} cells by {result.discs} discs of {result.atoms} functions "
        f"in {result.bytes} bytes: RMSE {result.rmse:.3g}{quality} in {result.seconds:.1f} s "
        f"-> {made}"
    )
