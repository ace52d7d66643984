"""``demsmith info``."""

import json
from typing import Annotated

from cyclopts import App, Parameter

from demsmith.core.cli.common import RUN
from demsmith.core.sct import info_file

app = App(name="info")


@app.default
def info(
    input: Annotated[str, Parameter(name="INPUT", help="Sparse Construction Tree, .sct.")],  # noqa: A002
    /,
    *,
    as_json: Annotated[
        bool,
        Parameter(name="--json", group=RUN, negative=(), show_default=False, help="Print as JSON."),
    ] = False,
):
    """Tell what an .sct file holds, how small it is and how exact."""
    told = info_file(input)
    if as_json:
        print(json.dumps(told.as_dict(), allow_nan=False))
        return
    for name, value in _lines(told):
        print(f"{name + ':':<15} {value}")


def _lines(told):
    """List names and values, in reading order."""
    unit = f" {told.unit}" if told.unit else ""
    yield "file", f"{told.input}, written by {told.written_by or 'an unknown program'}"
    yield "size", f"{told.rows} rows × {told.columns} columns, {told.type}, nodata {told.nodata}"
    yield "CRS", _crs_name(told.crs)
    yield "geotransform", told.geotransform or "none"
    yield "known cells", f"{told.cells_known} of {told.cells}"
    yield "range", f"{told.low:g} to {told.high:g}{unit}"
    yield "tree", f"{told.tree}, tiles of {told.tile} × {told.tile} cells"
    wanted = "" if told.wanted is None else f" {told.wanted:g}"
    yield "made by", f"{told.mode}{wanted}"
    bound = "none" if told.max_error is None else f"{told.max_error:g}{unit}"
    yield "maximum error", f"{bound}; measured {told.max_error_measured:.6g}{unit}"
    yield "RMSE", f"{told.rmse:.6g}{unit}; of the tree alone {told.tree_rmse:.6g}{unit}"
    yield "PSNR", "no error" if told.psnr is None else f"{told.psnr:.2f} dB"
    yield "bytes", f"{told.bytes}, {told.ratio:.4g} to 1, {told.bits_per_cell:.4g} bits per cell"
    for section, size in told.bytes_by_section.items():
        yield f"  {section}", size


def _crs_name(crs):
    """Give a code, or the name in WKT."""
    if not crs:
        return "unknown"
    return crs.split('"')[1] if '"' in crs else crs
