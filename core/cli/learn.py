"""``demsmith learn``."""

from typing import Annotated

from cyclopts import App, Parameter

from demsmith.core.cli.common import VERB, Cells, FileRun
from demsmith.core.cli.parameters import parameters
from demsmith.core.errors import InputError
from demsmith.core.sparse.job import learn_file
from demsmith.core.sparse.options import LearnOptions, StoreOptions

_Options = parameters(LearnOptions, group=VERB, advanced=VERB)
_Store = parameters(StoreOptions, group=VERB, advanced=VERB)

app = App(
    name="learn",
    help_epilogue="""\
A dictionary is used by: demsmith compress INPUT OUTPUT --dictionary DICTIONARY.

Examples:
  demsmith learn N42E001.hgt pyrenees.dsd
  demsmith learn alps1.tif alps2.tif alps.dsd --atoms 256 --sparsity 4
  demsmith learn lidar.tif lidar.dsd --method constrained --factor 4 --radius 40
""",
)


@app.default
def learn(
    *paths: Annotated[
        str,
        Parameter(
            name="INPUT... OUTPUT",
            help="Elevation rasters to learn from; last, the dictionary to write, .dsd.",
        ),
    ],
    options: _Options = _Options(),  # noqa: B008, frozen
    store: _Store = _Store(),  # noqa: B008, frozen
    source: Cells = Cells(),  # noqa: B008, frozen
    run: FileRun = FileRun(),  # noqa: B008, frozen
):
    """Learn a dictionary of terrain shapes from exemplars."""
    if len(paths) < 2:
        raise InputError("give rasters to learn from and, last, the dictionary to write")
    *inputs, output = paths
    with run.progress("learning") as progress:
        result = learn_file(
            inputs, output, options=options, store=store,
            band=source.band, nodata=source.nodata, below=source.below, above=source.above,
            threads=run.threads, overwrite=run.overwrite, progress=progress,
        )  # fmt: skip
    run.tell(result, _summary(result))


def _summary(result):
    """Tell in a line what was done."""
    error = "" if result.rmse is None else f", error {result.rmse:.4g} m"
    return (
        f"{result.atoms} atoms of {result.side_rows} x {result.side_columns} cells from "
        f"{result.discs} discs{error}, {result.bytes} bytes in {result.seconds:.1f} s "
        f"-> {result.output}"
    )
