"""``demsmith mosaic``."""

from typing import Annotated

from cyclopts import App, Parameter

from demsmith.core.cli.common import RUN, VERB, Auxiliaries, Cells, Run
from demsmith.core.cli.parameters import parameters, whole_number
from demsmith.core.cli.reconstruct import told_of_cells
from demsmith.core.errors import InputError
from demsmith.core.mosaic import reconstruct_mosaic
from demsmith.core.reconstruction import ReconstructOptions

_Options = parameters(ReconstructOptions, group=VERB, advanced=VERB)

app = App(
    name="mosaic",
    help_epilogue="""\
The folder gets a GeoTIFF for each tile, mosaic.vrt over all of them, and the report mosaic.html.
A run that was stopped or killed goes on where it was when the same command is given again.

Examples:
  demsmith mosaic tiles/ filled/
  demsmith mosaic 'tiles/N4*.hgt' filled/ --workers 4 --source-map --uncertainty
  demsmith mosaic tiles.vrt filled/ --scheduler tcp://10.0.0.1:8786
""",
)


def _flag(help_text):
    return Parameter(group=VERB, negative=(), show_default=False, help=help_text)


@app.default
def mosaic(
    *paths: Annotated[
        str,
        Parameter(
            name="INPUT... FOLDER",
            help="Tiles, folders, patterns, VRTs, or .txt lists of tiles; last, where to write.",
        ),
    ],
    aux: Auxiliaries = (),
    options: _Options = _Options(),  # noqa: B008, frozen
    source_map: Annotated[
        bool, _flag("Write NAME_source.tif for each tile: where each cell is from.")
    ] = False,
    uncertainty: Annotated[
        bool, _flag("Write NAME_uncertainty.tif: standard error of the filled cells.")
    ] = False,
    voids_layer: Annotated[bool, _flag("Write voids.gpkg: polygons of the voids.")] = False,
    workers: Annotated[
        int | None,
        Parameter(
            group=RUN,
            converter=whole_number,
            show_default=lambda _: "one for each core",
            help="Processes side by side; 0: none but this one.",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        Parameter(
            group=RUN,
            help="Work on the Dask cluster at this address, tcp://HOST:PORT; its machines must "
            "see all files under the same paths.",
        ),
    ] = None,
    source: Cells = Cells(),  # noqa: B008, frozen
    run: Run = Run(),  # noqa: B008, frozen
):
    """Reconstruct the voids of many tiles as if they were one raster."""
    if len(paths) < 2:
        raise InputError("give one tile or more, and the folder to write to")
    with run.progress("reconstructing tiles") as progress:
        result = reconstruct_mosaic(
            paths[:-1], paths[-1], options=options, auxiliaries=aux,
            band=source.band, nodata=source.nodata, below=source.below, above=source.above,
            source_map=source_map, uncertainty=uncertainty, voids_layer=voids_layer,
            workers=workers, scheduler=scheduler, threads=run.threads, overwrite=run.overwrite,
            creation_options=run.creation_option, progress=progress,
        )  # fmt: skip
    run.tell(result, _summary(result))


def _summary(result):
    """Tell in a line what was done."""
    done = (
        f"filled {result.cells_filled} cells in {result.voids} voids of {len(result.tiles)} tiles"
        f"{told_of_cells(result)}"
    )
    return f"{done} in {result.seconds:.1f} s -> {result.output}"
