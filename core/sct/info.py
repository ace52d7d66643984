"""What an `.sct` file is and how it was made, without decoding it."""

import math
import os
from dataclasses import dataclass, fields

from demsmith.core.sct.file import open_sct


@dataclass(frozen=True)
class Info:
    """What is told of an `.sct` file.

    Attributes
    ----------
    input : str
    written_by : str
    rows, columns : int
    crs : str
        Code or WKT; empty if unknown.
    geotransform : tuple of 6 floats or None
    type, unit : str
        Of the values.
    nodata : float, int, str or None
        The tag; NaN is text.
    scale, offset : float
        A stored value ``v`` means ``v * scale + offset``.
    low, high : float
        Range of the raster's values, in its unit.
    cells, cells_known : int
    tree : str
        ``pyramid`` or ``patches``.
    tile : int
        Cells along the side of the squares that are decoded on their own.
    mode : str
        What was asked for: ``max-error``, ``ratio``, ``psnr`` or ``tree``.
    wanted : float or None
        How much of it.
    max_error : float or None
        The bound that the file keeps, in the raster's unit.
    max_error_measured, rmse, psnr
        Measured when it was made; the PSNR against the raster's range [dB].
    tree_rmse : float
        Of the tree alone, without the residual, in the raster's unit.
    bytes, bytes_raw : int
        Of the file, and of the raster's cells in memory.
    bytes_by_section : dict of str to int
    ratio, bits_per_cell : float
    warnings : tuple of str
        None ever.
    """

    input: str
    written_by: str
    rows: int
    columns: int
    crs: str
    geotransform: tuple | None
    type: str
    unit: str
    nodata: float | int | str | None
    scale: float
    offset: float
    low: float
    high: float
    cells: int
    cells_known: int
    tree: str
    tile: int
    mode: str
    wanted: float | None
    max_error: float | None
    max_error_measured: float
    rmse: float
    psnr: float | None
    tree_rmse: float
    bytes: int
    bytes_raw: int
    bytes_by_section: dict
    ratio: float
    bits_per_cell: float
    warnings: tuple = ()

    def as_dict(self):
        """Give everything as a dict that JSON can hold."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def info_file(input):  # noqa: A002
    """Tell what an `.sct` file holds.

    Parameters
    ----------
    input : path

    Returns
    -------
    Info

    Raises
    ------
    InputError
        If it is no `.sct` file, or a damaged one.
    """
    with open_sct(input) as file:
        grid, meta, made = file.grid, file.meta, file.made
        cells = grid.shape.rows * grid.shape.columns
        raw = cells * meta.dtype.itemsize
        number = isinstance(meta.nodata, float) and not math.isfinite(meta.nodata)
        return Info(
            input=os.fspath(input),
            written_by=file.by,
            rows=grid.shape.rows,
            columns=grid.shape.columns,
            crs=grid.crs,
            geotransform=grid.geotransform if grid.georeferenced else None,
            type=str(meta.dtype),
            unit=meta.unit,
            nodata=str(meta.nodata) if number else meta.nodata,
            scale=meta.scale,
            offset=meta.offset,
            low=made.low,
            high=made.high,
            cells=cells,
            cells_known=made.cells_known,
            tree=file.decoder.tree,
            tile=file.decoder.tiling.side,
            mode=made.mode,
            wanted=made.wanted,
            max_error=made.wanted if made.mode == "max-error" else None,
            max_error_measured=made.max_error,
            rmse=made.rmse,
            psnr=made.psnr,
            tree_rmse=made.tree_rmse,
            bytes=file.size,
            bytes_raw=raw,
            bytes_by_section=file.bytes_by_section(),
            ratio=raw / file.size,
            bits_per_cell=8 * file.size / cells,
        )
