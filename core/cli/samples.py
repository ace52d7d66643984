"""``demsmith samples``."""

from typing import Annotated, Literal

from cyclopts import App, Group, Parameter

from demsmith.core.cli.common import MCMD, VERB, Maps, Run, Source
from demsmith.core.cli.parameters import parameters
from demsmith.core.errors import InputError
from demsmith.core.samples import SampleOptions, samples_file
from demsmith.core.samples.sketch import BACKGROUNDS

_GRID = Group("Which grid is made", sort_key=2)
_SKETCH = Group("Sketch", help="An image whose brightness is elevation.", sort_key=2)
_Options = parameters(SampleOptions, group=VERB, advanced=MCMD)

app = App(
    name="samples",
    usage="Usage: demsmith samples [INPUT...] OUTPUT [--option value]...",
    help_epilogue="""\
INPUT is a table of points (.csv, .txt, .xyz), a vector layer of points and of ridge and valley
lines, or a raster of which some cells are known. Without any, and without contours and sketch, the
terrain is fractal noise. The grid is that of --like, or made by --extent and --resolution, or that
of a raster input; without --extent it covers all samples.

Examples:
  demsmith samples points.csv dem.tif --resolution 10 --crs EPSG:32631
  demsmith samples peaks.gpkg dem.tif --contours contours.gpkg --field height --like old.tif
  demsmith samples thinned.tif dem.tif
  demsmith samples dem.tif --sketch ridges.png --sketch-high 2000 --extent 0 0 9000 9000
  demsmith samples dem.tif --extent 0 0 30000 30000 --resolution 30 --relief 1500 --seed 7
""",
)


@app.default
def samples(
    *paths: Annotated[
        str,
        Parameter(name="INPUT... OUTPUT", help="Files of samples, and the GeoTIFF to write, .tif."),
    ],
    options: _Options = _Options(),  # noqa: B008, frozen
    contours: Annotated[
        tuple[str, ...],
        Parameter(
            group=VERB, metavar="FILE", negative=(), show_default=False,
            help="Vector file of contour lines; repeat for more.",
        ),
    ] = (),
    field: Annotated[
        str | None,
        Parameter(group=VERB, help="Attribute or column of the elevations, if not the geometry."),
    ] = None,
    layer: Annotated[
        str | None, Parameter(group=VERB, help="Layer of the vector files, if not the first.")
    ] = None,
    source_map: Annotated[
        str | None,
        Parameter(group=VERB, help="GeoTIFF to write: 0 sample, 1 made between samples."),
    ] = None,
    like: Annotated[
        str | None, Parameter(group=_GRID, help="Raster whose grid and CRS to take.")
    ] = None,
    extent: Annotated[
        tuple[float, float, float, float] | None,
        Parameter(
            group=_GRID, metavar="XMIN YMIN XMAX YMAX", allow_leading_hyphen=True, negative=(),
            help="Extent of the grid, in units of its CRS.",
        ),
    ] = None,
    resolution: Annotated[
        float | None, Parameter(group=_GRID, help="Side of a cell, in units of the CRS.")
    ] = None,
    crs: Annotated[
        str, Parameter(
            group=_GRID, show_default=False,
            help="CRS of the grid, such as EPSG:32631; that of the first input if not given.",
        ),
    ] = "",
    source_crs: Annotated[
        str, Parameter(
            group=_GRID, show_default=False,
            help="CRS of inputs that do not tell theirs; the grid's if not given.",
        ),
    ] = "",
    sketch: Annotated[
        str | None, Parameter(group=_SKETCH, help="Image that covers the grid.")
    ] = None,
    sketch_low: Annotated[
        float, Parameter(group=_SKETCH, allow_leading_hyphen=True, help="Elevation of black [m].")
    ] = 0.0,
    sketch_high: Annotated[
        float, Parameter(group=_SKETCH, allow_leading_hyphen=True, help="Elevation of white [m].")
    ] = 1000.0,
    sketch_background: Annotated[
        Literal[tuple(BACKGROUNDS)],
        Parameter(
            group=_SKETCH,
            help="What is unpainted in an image without transparency; else it is the transparent.",
        ),
    ] = "black",
    maps: Maps = Maps(),  # noqa: B008, frozen
    source: Source = Source(),  # noqa: B008, frozen
    run: Run = Run(),  # noqa: B008, frozen
):  # fmt: skip
    """Make terrain from points, lines, contours, a thinned raster, a sketch, or noise alone."""
    if not paths:
        raise InputError("an OUTPUT is needed: the GeoTIFF to write")
    *inputs, output = paths
    with run.progress("making terrain") as progress:
        result = samples_file(
            inputs, output, options=options, contours=contours, field=field, layer=layer,
            source_crs=source_crs, sketch=sketch, sketch_low=sketch_low, sketch_high=sketch_high,
            sketch_background=sketch_background, like=like, extent=extent, resolution=resolution,
            crs=crs, band=source.band, nodata=source.nodata, below=source.below,
            above=source.above, mask=source.mask, maps=maps.paths(), source_map=source_map,
            threads=run.threads, overwrite=run.overwrite,
            creation_options=run.creation_option, progress=progress,
        )  # fmt: skip
    run.tell(result, _summary(result))


def _summary(result):
    """Tell in a line what was done."""
    whence = f"from {result.samples} samples" if result.samples else "from the sketch"
    done = f"made {result.rows} × {result.columns} cells"
    if result.cells_known:
        done += f", {result.cells_known} of them {whence}"
    done += ","
    if result.tuning and result.tuning["accepted"]:
        done += f" {result.tuning['summary']},"
    return f"{done} in {result.seconds:.1f} s -> {result.output}"
