"""Reading one band of a raster file, and finding its voids."""

import os

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.raster._gdal import load, numpy_type
from demsmith.core.raster.crs import crs_units
from demsmith.core.raster.grid import NO_GEOTRANSFORM, Grid, Shape, check_same_grid
from demsmith.core.raster.nodata import VoidFinder, metres_per_unit
from demsmith.core.raster.opening import choose_band, opened
from demsmith.core.raster.raster import BandMeta, Raster

_BLOCK_CELLS = 1 << 21
_MASK_TOLERANCE = 0.51  # pixels: programs disagree on whether a coordinate is a corner or a centre
_EXACT_INTEGERS = 1 << 53  # every integer up to here is a float64


def read(
    path, *, band=1, nodata=(), below=None, above=None, mask=None, window=None, progress=SILENT
):
    """Read one band of anything GDAL opens, or a part of it.

    Voids are the cells that the file marks by its nodata tag, mask or alpha band; NaN and
    infinite ones; those named by the options; and those that hold -32768 or -32767 in signed
    integers or magnitudes beyond 1e30 in floats, tagged or not.

    Parameters
    ----------
    path : str or path-like
        File, GDAL name (``/vsizip/...``), .hgt tile, or zip archive that holds one raster.
    band : int
        Number of the band, from 1.
    nodata : float or iterable of float
        Stored values that mean void, besides the file's nodata tag.
    below, above : float
        Cells whose real value (scale and offset applied) is at or below ``below``, at or above
        ``above``, are voids.
    mask : str or path-like
        Raster of the same size whose non-zero cells are voids here.
    window : (slice, slice), optional
        Rows and columns to read. Default: all.
    progress : Progress
        Told how much has been read.

    Returns
    -------
    Raster
        ``notes`` names what is odd.

    Raises
    ------
    InputError
        If the file is missing, damaged, truncated, rotated or complex, has no such band or
        window, or the mask does not fit.
    """
    path = os.fspath(path)
    rules = dict(nodata=nodata, below=below, above=above)
    with opened(path) as (heard, holder):
        return _read_band(path, holder[0], band, heard, progress, rules, mask, window)


def read_grid(path):
    """Read where the cells of a raster lie, and nothing of what they hold.

    Parameters
    ----------
    path : str or path-like
        As in `read`.

    Returns
    -------
    Grid

    Raises
    ------
    InputError
        If the file is missing, damaged, rotated or holds no band.
    """
    return read_header(path)[0]


def read_header(path, *, band=1):
    """Read what a file says of one of its bands, and nothing of what that holds.

    Parameters
    ----------
    path, band
        As in `read`.

    Returns
    -------
    grid : Grid
    meta : BandMeta

    Raises
    ------
    InputError
        If the file is missing, damaged, rotated or complex, or has no such band.
    """
    path = os.fspath(path)
    with opened(path) as (_, holder):
        chosen = choose_band(holder[0], band, path)
        meta, _ = _band_meta(holder[0], chosen, path)
        grid, _, _ = _grid(holder[0], path)
        del chosen  # it must not outlive its dataset
        return grid, meta


def _read_band(path, dataset, number, heard, progress, rules, mask, window):
    band = choose_band(dataset, number, path)
    meta, notes = _band_meta(dataset, band, path)
    whole, units, grid_notes = _grid(dataset, path)
    rows, columns = window or (slice(0, whole.shape.rows), slice(0, whole.shape.columns))
    grid = whole.part(rows, columns)
    values, void = _read_values(path, band, meta, rows, columns, heard, progress)
    if mask is not None:
        void |= _masked(os.fspath(mask), whole, path)[rows, columns]
    finder = VoidFinder(
        meta,
        **rules,
        metres=metres_per_unit(meta.unit, units.vertical_unit),
        earth=units.on_earth,
    )
    step = _rows_per_block(band, grid.shape)
    for start in range(0, grid.shape.rows, step):
        rows = slice(start, start + step)
        finder.find(values[rows], void[rows])
        checkpoint(progress, 0.8 + 0.2 * start / grid.shape.rows)
    _refuse_inexact(path, values, void)
    notes = (*grid_notes, *notes, *finder.notes())
    return Raster(values, void, grid, meta, tuple(f"'{path}': {note}" for note in notes), path)


def _masked(path, grid, source):
    """Read which cells of a raster on ``grid`` the mask at ``path`` calls voids."""
    mask = read(path)
    check_same_grid(
        mask.grid, grid, what=f"mask '{path}'", whose=f"'{source}'", tolerance=_MASK_TOLERANCE
    )
    return (mask.values != 0) & ~mask.void


def _read_values(path, band, meta, rows, columns, heard, progress):
    """Read a window's values and file-made mask, a strip of whole blocks at a time."""
    gdal = load().gdal
    shape = Shape(rows.stop - rows.start, columns.stop - columns.start)
    try:
        values = np.empty(shape, dtype=meta.dtype)
        void = np.zeros(shape, dtype=bool)
    except MemoryError:
        raise InputError(
            f"'{path}' has {shape.rows} × {shape.columns} cells, more than the memory holds; "
            "work on parts of it"
        ) from None
    flags = band.GetMaskFlags()
    masked = not flags & (gdal.GMF_ALL_VALID | gdal.GMF_NODATA)
    mask_band = band.GetMaskBand() if masked else None
    step = _rows_per_block(band, shape)
    for start in range(0, shape.rows, step):
        strip = slice(start, min(start + step, shape.rows))
        _read_strip(path, band, rows.start + start, columns.start, values[strip], heard)
        if mask_band is not None:
            valid = np.empty(void[strip].shape, dtype=np.uint8)
            _read_strip(path, mask_band, rows.start + start, columns.start, valid, heard)
            np.equal(valid, 0, out=void[strip])
        checkpoint(progress, 0.8 * strip.stop / shape.rows)
    return values, void


def _read_strip(path, band, row, column, target, heard):
    """Read the cells of a band from ``row`` and ``column`` on that fill ``target``."""
    gdal = load().gdal
    count, columns = target.shape
    kind = gdal.GDT_Float32 if target.dtype == np.float32 else band.DataType
    done = heard.attempt(
        band.ReadRaster, column, row, columns, count, buf_type=kind, buf_obj=target
    )
    if done is None:
        raise InputError(
            f"'{path}' cannot be read between rows {row} and {row + count - 1}, "
            f"truncated or damaged: {heard.reason}"
        )


def _rows_per_block(band, shape):
    block_rows = max(1, band.GetBlockSize()[1])
    blocks = max(1, _BLOCK_CELLS // (shape.columns * block_rows))
    return min(shape.rows, blocks * block_rows)


def _refuse_inexact(path, values, void):
    if values.dtype.kind in "iu" and values.dtype.itemsize == 8:
        known = values[~void]
        if known.size and max(int(known.max()), -int(known.min())) > _EXACT_INTEGERS:
            raise InputError(
                f"'{path}' holds integers beyond 2^53, which no elevation needs and floating "
                "point cannot hold: convert it, or name them as nodata"
            )


def _grid(dataset, path):
    notes = []
    geotransform = dataset.GetGeoTransform(can_return_null=True) or NO_GEOTRANSFORM
    reference = dataset.GetSpatialRef()
    crs = reference.ExportToWkt(["FORMAT=WKT2_2019"]) if reference is not None else ""
    try:
        grid = Grid((dataset.RasterYSize, dataset.RasterXSize), geotransform, crs)
        units = crs_units(crs)
    except InputError as error:
        raise InputError(f"'{path}' cannot be used: {error}") from None
    if not grid.georeferenced:
        how = "no georeference"
        if dataset.GetGCPCount():
            how = "ground control points but no geotransform"
        elif dataset.GetMetadata("RPC"):
            how = "rational polynomials (RPC) but no geotransform"
        notes.append(f"has {how}; distances are counted in pixels, as if one were a metre")
    elif not crs:
        looks = _looks_like_degrees(grid)
        notes.append(
            "has no CRS; its coordinates are taken as metres"
            + (", but look like degrees: give it its CRS, for example EPSG:4326" if looks else "")
        )
    elif units.mercator:
        notes.append(
            "is in a Mercator projection, whose metres are longer than the ground's away from "
            "the equator; reproject it if distances matter"
        )
    return grid, units, notes


def _looks_like_degrees(grid):
    first, last = grid.xy(0, 0), grid.xy(grid.shape.rows - 1, grid.shape.columns - 1)
    return (
        max(abs(first.x), abs(last.x)) <= 181
        and max(abs(first.y), abs(last.y)) <= 91
        and abs(grid.geotransform[1]) < 0.1
    )


def _band_meta(dataset, band, path):
    gdal = load().gdal
    dtype = numpy_type(band)
    if dtype is None:
        kind = gdal.GetDataTypeName(band.DataType)
        raise InputError(f"'{path}' holds {kind} numbers, which are no elevations")
    notes = []
    nodata = band.GetNoDataValue()
    if nodata is not None and dtype.kind in "iu":
        limits = np.iinfo(dtype)
        if nodata == nodata and limits.min <= nodata <= limits.max and int(nodata) == nodata:
            nodata = int(nodata)
        else:
            notes.append(f"is tagged with nodata {nodata:g}, which {dtype} cannot hold; ignored")
            nodata = None
    dataset_metadata = dict(dataset.GetMetadata())
    area_or_point = dataset_metadata.pop("AREA_OR_POINT", "")
    color_table = band.GetRasterColorTable()
    reference = dataset.GetSpatialRef()
    scale, offset = band.GetScale(), band.GetOffset()
    meta = BandMeta(
        dtype=dtype,
        nodata=nodata,
        scale=1.0 if scale is None else scale,
        offset=0.0 if offset is None else offset,
        unit=band.GetUnitType() or "",
        description=band.GetDescription(),
        area_or_point=area_or_point,
        dataset_metadata=_without_statistics(dataset_metadata),
        band_metadata=_without_statistics(band.GetMetadata()),
        color_table={
            value: color_table.GetColorEntry(value) for value in range(color_table.GetCount())
        } if color_table is not None else {},
        categories=tuple(band.GetCategoryNames() or ()),
        epoch=reference.GetCoordinateEpoch() if reference is not None else 0.0,
        gcps=tuple(
            (point.GCPLine, point.GCPPixel, point.GCPX, point.GCPY, point.GCPZ)
            for point in dataset.GetGCPs()
        ),
        gcp_crs=dataset.GetGCPProjection() or "",
        rpc=dict(dataset.GetMetadata("RPC") or {}),
    )  # fmt: skip
    return meta, notes


def _without_statistics(metadata):
    """Metadata items but those that tell of the values, which do not outlive a change of them."""
    stale = ("STATISTICS_", "TIFFTAG_MINSAMPLEVALUE", "TIFFTAG_MAXSAMPLEVALUE")
    return {key: value for key, value in metadata.items() if not key.startswith(stale)}
