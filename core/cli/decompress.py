"""``demsmith decompress``."""

from typing import Annotated

from cyclopts import App, Parameter

from demsmith.core.cli.common import VERB, Run
from demsmith.core.cli.parameters import parameters, whole_number
from demsmith.core.sct import DecompressOptions, decompress_file

_Options = parameters(DecompressOptions, group=VERB, advanced=VERB)


def _whole_numbers(kind, tokens):
    return tuple(whole_number(kind, [token]) for token in tokens)


app = App(
    name="decompress",
    help_epilogue="""\
Only what is asked for is decoded. An OUTPUT that ends in .vrt becomes a virtual raster by which
GDAL's tools read the .sct file where it is, with the environment variable
GDAL_VRT_PYTHON_TRUSTED_MODULES=demsmith.core.sct.pixels and Demsmith in their Python.

Examples:
  demsmith decompress N37W004.sct N37W004.tif
  demsmith decompress dem.sct part.tif --window 1000 2000 512 512
  demsmith decompress dem.sct overview.tif --scale 0.125
""",
)


@app.default
def decompress(
    input: Annotated[str, Parameter(name="INPUT", help="Sparse Construction Tree, .sct.")],  # noqa: A002
    output: Annotated[str, Parameter(name="OUTPUT", help="GeoTIFF, .tif, or .vrt, to write.")],
    /,
    *,
    window: Annotated[
        tuple[int, int, int, int] | None,
        Parameter(
            group=VERB,
            metavar="XOFF YOFF XSIZE YSIZE",
            converter=_whole_numbers,
            negative=(),
            show_default=False,
            help="First column and row, number of columns and rows to decode. Default: all.",
        ),
    ] = None,
    options: _Options = _Options(),  # noqa: B008, frozen
    run: Run = Run(),  # noqa: B008, frozen
):
    """Decompress an .sct file, or any window of it, at any scale."""
    with run.progress("decompressing") as progress:
        result = decompress_file(
            input, output, options=options, window=window, threads=run.threads,
            overwrite=run.overwrite, creation_options=run.creation_option, progress=progress,
        )  # fmt: skip
    run.tell(result, _summary(result))


def _summary(result):
    """Tell in a line what was done."""
    bound = "" if result.max_error is None else f", maximum error {result.max_error:g}"
    return (
        f"{result.rows} × {result.columns} cells{bound}, in {result.seconds:.1f} s "
        f"-> {result.output}"
    )
