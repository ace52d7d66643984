"""``demsmith compress``."""

from typing import Annotated

from cyclopts import App, Parameter

from demsmith.core.cli.common import VERB, FileRun, InputFile, Source
from demsmith.core.cli.parameters import parameters
from demsmith.core.sct import CompressOptions, compress_file

_Options = parameters(CompressOptions, group=VERB, advanced=VERB)

app = App(
    name="compress",
    help_epilogue="""\
By default no cell is wrong by more than 1 in the raster's unit. Voids, georeference and metadata
are kept. To get the raster back: demsmith decompress OUTPUT raster.tif.

Examples:
  demsmith compress N37W004.hgt N37W004.sct --max-error 0
  demsmith compress dem.tif dem.sct --ratio 100
  demsmith compress dem.tif dem.sct --atoms 128 --sparsity 2 --radius 150
""",
)


@app.default
def compress(
    input: InputFile,  # noqa: A002
    output: Annotated[
        str, Parameter(name="OUTPUT", help="Sparse Construction Tree to write, .sct.")
    ],
    /,
    *,
    options: _Options = _Options(),  # noqa: B008, frozen
    dictionary: Annotated[
        str | None,
        Parameter(
            group=VERB,
            help="Dictionary (.dsd, made by demsmith learn) for a tree of patches.",
        ),
    ] = None,
    source: Source = Source(),  # noqa: B008, frozen
    run: FileRun = FileRun(),  # noqa: B008, frozen
):
    """Compress an elevation raster within a guaranteed error."""
    with run.progress("compressing") as progress:
        result = compress_file(
            input, output, options=options, dictionary=dictionary,
            band=source.band, nodata=source.nodata, below=source.below, above=source.above,
            mask=source.mask, threads=run.threads, overwrite=run.overwrite, progress=progress,
        )  # fmt: skip
    run.tell(result, _summary(result))


def _summary(result):
    """Tell in a line what was done."""
    return (
        f"{result.bytes_raw} bytes to {result.bytes} ({result.ratio:.3g} to 1, "
        f"{result.bits_per_cell:.3g} bits per cell), maximum error "
        f"{result.max_error_measured:.6g}, in {result.seconds:.1f} s -> {result.output}"
    )
