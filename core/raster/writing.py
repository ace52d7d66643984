"""Writing bands as GeoTIFF, with all that their input said, whole or not at all."""

import os
from typing import NamedTuple

import numpy as np

from demsmith.core.errors import InputError, OutputError
from demsmith.core.progress import SILENT, checkpoint
from demsmith.core.raster._gdal import gdal_type, load, session
from demsmith.core.raster.creation import creation_options as complete_options
from demsmith.core.raster.nodata import as_stored
from demsmith.core.raster.outputs import cannot_write, check_output, whole_or_nothing
from demsmith.core.raster.raster import BandMeta

SAME = object()
"""As nodata: the input's tag, where the new data type can hold it."""

_BLOCK_CELLS = 1 << 21
_COLORED = (np.dtype(np.uint8), np.dtype(np.uint16))
# Bands that come one after another are written one after another.
_BY_BAND = ("INTERLEAVE=BAND",)


class Written(NamedTuple):
    """An output: its path, and the nodata value it is tagged with."""

    path: str
    nodata: float | int | None


def write(
    path, values, *, like, void=None, dtype=None, nodata=SAME, overwrite=False,
    creation_options=(), description=None, unit="", same_quantity=True, color_table=None,
    categories=(), threads=None, progress=SILENT,
):  # fmt: skip
    """Write values as a one-band GeoTIFF, tiled and compressed, with the input's properties.

    The file appears under its name only when it is complete.

    Parameters
    ----------
    path : str or path-like
        A file ending in ``.tif`` or ``.tiff``.
    values : ndarray, shape (rows, columns)
        Stored values. Floats written as integers are rounded to the nearest, and cut to the
        type's range.
    like : Raster
        Where place, CRS, area-or-point and metadata come from, and which may not be
        overwritten.
    void : ndarray of bool, same shape
        Cells written as nodata, whatever ``values`` holds there.
    dtype : numpy.dtype
        Data type of the file; that of ``like`` if not given.
    nodata : float or None
        Its nodata tag. If voids are given and another cell has this value, the tag gives way:
        it is left out where no void needs it, else another value is chosen.
    overwrite : bool
        Whether an existing file may be replaced.
    creation_options : iterable of str
        GDAL's for GeoTIFF, ``KEY=VALUE``; they win over ours.
    description : str
        Name of the band; the input's if not given.
    unit : str
        Unit of values that are of another kind than the input's.
    same_quantity : bool
        Whether the values are of the kind of the input's: then its unit, scale, offset, colours
        and band metadata are kept. Not so for a source map, whose colours are given.
    color_table : dict
        Colours (red, green, blue[, alpha]; 0 to 255) by value, for uint8 and uint16.
    categories : tuple of str
        Names of the values 0, 1, ...; GDAL keeps them in a sidecar (``.aux.xml``).
    threads : int
        Threads that compress; all cores if not given.
    progress : Progress
        Told how much has been written.

    Returns
    -------
    Written

    Raises
    ------
    InputError
        If an option is wrong, or the output is the input.
    OutputError
        If the file cannot be written there, or not to its end.
    Cancelled
        If ``progress`` says so; nothing is left behind.
    """
    path = os.fspath(path)
    check_output(path, inputs=[like.source] if like.source else [], overwrite=overwrite)
    dtype = np.dtype(like.meta.dtype if dtype is None else dtype)
    _check_values(values, void, like, dtype)
    meta = _output_meta(like.meta, dtype, description, unit, same_quantity, color_table, categories)
    blocks = _Blocks(values, void, dtype)
    tag = _nodata_tag(like.meta.nodata if nodata is SAME else nodata, blocks)
    options = complete_options(dtype, creation_options, threads=threads)
    _write_file(path, [blocks], [meta], tag, like.grid, options, progress)
    return Written(path, tag)


def write_bands(
    path, layers, *, like, descriptions, nodata, void=None, unit="", overwrite=False,
    creation_options=(), threads=None, progress=SILENT,
):  # fmt: skip
    """Write layers of one quantity, another than the input's, as the bands of a float32 GeoTIFF.

    Parameters
    ----------
    path, like, overwrite, creation_options, threads, progress
        As in `write`.
    layers : iterable of ndarray, shape (rows, columns)
        One for each band. Each is written before the next is asked for, so that they need not
        be in memory together.
    descriptions : sequence of str
        Names of the bands.
    nodata : float
        The bands' nodata tag, which no other cell must have.
    void : ndarray of bool, shape (rows, columns)
        Cells written as nodata in every band.
    unit : str
        Unit of the values.

    Returns
    -------
    Written

    Raises
    ------
    InputError, OutputError, Cancelled
        As `write` does.
    """
    path = os.fspath(path)
    check_output(path, inputs=[like.source] if like.source else [], overwrite=overwrite)
    dtype = np.dtype(np.float32)
    metas = [
        _output_meta(like.meta, dtype, description, unit, False, None, ())
        for description in descriptions
    ]
    options = complete_options(dtype, [*_BY_BAND, *creation_options], threads=threads)
    blocks = (_checked_blocks(layer, void, like, dtype) for layer in layers)
    _write_file(path, blocks, metas, float(nodata), like.grid, options, progress)
    return Written(path, float(nodata))


def _checked_blocks(values, void, like, dtype):
    _check_values(values, void, like, dtype)
    return _Blocks(values, void, dtype)


class _Blocks:
    """The values to be written, converted a strip at a time."""

    def __init__(self, values, void, dtype):
        self.values, self.void, self.dtype = values, void, dtype
        self.any_void = void is not None and bool(void.any())

    def converted(self, rows):
        """Convert rows to the file's data type, contiguous; voids hold anything."""
        block = self.values[rows]
        if np.can_cast(block.dtype, self.dtype, "safe") or self.dtype.kind == "f":
            with np.errstate(over="ignore"):
                return np.ascontiguousarray(block, dtype=self.dtype)
        known = np.isfinite(block)
        if self.void is not None:
            known &= ~self.void[rows]
        limits = np.iinfo(self.dtype)
        block = np.rint(np.where(known, block, 0), dtype=np.float64)
        block = np.clip(block, float(limits.min), float(limits.max), out=block)
        return block.astype(self.dtype)

    def final(self, rows, tag):
        """Convert rows to what is stored, the voids marked by ``tag``."""
        block = self.converted(rows)
        if self.any_void:
            if np.shares_memory(block, self.values):
                block = block.copy()
            block[self.void[rows]] = tag
        return block

    def holds(self, value):
        """Whether any cell that is no void would be stored as this value."""
        return any(
            bool(((self.converted(rows) == value) & ~self.void[rows]).any())
            for rows in self.strips(1)
        )

    def strips(self, multiple):
        """Row slices of about two million cells, a multiple of so many rows each."""
        rows, columns = self.values.shape
        step = max(1, _BLOCK_CELLS // (columns * multiple)) * multiple
        return [slice(start, min(start + step, rows)) for start in range(0, rows, step)]


def _check_values(values, void, like, dtype):
    shape = tuple(like.grid.shape)
    if values.shape != shape or (void is not None and void.shape != shape):
        raise InputError(f"values {values.shape} do not have the grid's shape {shape}")
    try:
        gdal_type(dtype)
    except KeyError:
        raise InputError(f"a GeoTIFF cannot hold {dtype} values") from None
    if dtype.kind in "iu" and values.dtype.kind == "f":
        unknown = ~np.isfinite(values)
        if void is not None:
            unknown &= ~void
        if unknown.any():
            raise InputError(
                f"{np.count_nonzero(unknown)} values are no finite numbers, which {dtype} "
                "cannot hold: flag them as voids, or write floating point"
            )


def _output_meta(meta, dtype, description, unit, same_quantity, color_table, categories):
    """Properties of the output: the input's, as far as they still hold."""
    kept = {
        name: getattr(meta, name)
        for name in ("area_or_point", "dataset_metadata", "epoch", "gcps", "gcp_crs", "rpc")
    }
    kept["unit"] = unit
    if same_quantity:
        for name in (
            "scale", "offset", "unit", "description", "band_metadata", "color_table", "categories",
        ):  # fmt: skip
            kept[name] = getattr(meta, name)
    if dtype not in _COLORED:
        kept["color_table"] = {}
    if color_table:
        if dtype not in _COLORED:
            raise InputError(f"only uint8 and uint16 bands have a colour table, not {dtype}")
        kept["color_table"] = color_table
    if categories:
        kept["categories"] = tuple(categories)
    if description is not None:
        kept["description"] = description
    return BandMeta(dtype=dtype, **kept)


def _nodata_tag(wanted, blocks):
    """Choose the nodata tag: the one wanted, unless it would hide cells that are no voids."""
    tag = None if wanted is None else as_stored(wanted, blocks.dtype)
    if blocks.void is None:
        return _plain(tag)
    if tag is not None and (tag != tag or not blocks.holds(tag)):
        return _plain(tag)
    if not blocks.any_void:
        return None
    if blocks.dtype.kind == "f":
        return float("nan")
    limits = np.iinfo(blocks.dtype)
    for value in (-32768, -32767, limits.max, limits.min):
        tag = as_stored(value, blocks.dtype)
        if tag is not None and not blocks.holds(tag):
            return _plain(tag)
    raise OutputError(
        f"{blocks.dtype} has no value left to mark voids with: write floating point instead"
    )


def _plain(tag):
    return None if tag is None else tag.item()


def _write_file(path, layers, metas, tag, grid, options, progress):
    """Write layers of blocks, each with its band's properties, whole or not at all."""
    with whole_or_nothing(path) as unfinished:
        with session() as heard:
            _write_dataset(unfinished, layers, metas, tag, grid, options, heard, progress)
            # The closed dataset has written its last bytes: now a full disk is known.
            if heard.failures:
                raise cannot_write(path, heard.reason)
        checkpoint(progress, 1.0)


def _write_dataset(path, layers, metas, tag, grid, options, heard, progress):
    gdal = load().gdal
    kind, needed = gdal_type(metas[0].dtype)
    rows, columns = grid.shape
    driver = gdal.GetDriverByName("GTiff")
    dataset = heard.attempt(
        driver.Create, path, columns, rows, len(metas), kind, options + needed
    )  # fmt: skip
    band = None
    try:
        _refuse_wrong_options(heard)
        if dataset is None:
            return
        heard.attempt(_describe, dataset, grid, metas[0])
        for number, meta in enumerate(metas, start=1):
            heard.attempt(_describe_band, dataset.GetRasterBand(number), tag, meta)
        for number, blocks in enumerate(layers):
            band = dataset.GetRasterBand(number + 1)
            for strip in blocks.strips(band.GetBlockSize()[1]):
                block = blocks.final(strip, tag)
                heard.attempt(
                    band.WriteRaster, 0, strip.start, columns, block.shape[0], block,
                    columns, block.shape[0], kind,
                )  # fmt: skip
                # Compress now, where cancelling is heard, and not everything on closing.
                heard.attempt(band.FlushCache)
                if heard.failures:
                    return
                checkpoint(progress, (number + strip.stop / rows) / len(metas))
        heard.attempt(dataset.FlushCache)
    finally:
        # An exception's traceback would keep the file open, and have it written to later.
        band = dataset = None


def _refuse_wrong_options(heard):
    """GDAL only warns of a creation option it does not know, and goes on without it."""
    for warning in heard.warnings:
        if "creation option" in warning:
            raise InputError(f"creation option refused: {warning}")


def _describe(dataset, grid, meta):
    """Set what holds for all bands and goes before the values."""
    gdal, osr = load().gdal, load().osr
    if meta.dataset_metadata:
        dataset.SetMetadata(meta.dataset_metadata)
    if meta.area_or_point:
        dataset.SetMetadataItem("AREA_OR_POINT", meta.area_or_point)
    if meta.rpc:
        dataset.SetMetadata(meta.rpc, "RPC")
    if meta.gcps and not grid.georeferenced:
        points = [gdal.GCP(x, y, z, column, row) for row, column, x, y, z in meta.gcps]
        dataset.SetGCPs(points, meta.gcp_crs)
    if grid.georeferenced:
        dataset.SetGeoTransform(grid.geotransform)
    if grid.crs:
        reference = osr.SpatialReference()
        reference.SetFromUserInput(grid.crs)
        reference.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        if meta.epoch:
            reference.SetCoordinateEpoch(meta.epoch)
        dataset.SetSpatialRef(reference)


def _describe_band(band, tag, meta):
    """Set what goes before a band's values."""
    if meta.color_table:
        band.SetRasterColorTable(_gdal_color_table(meta.color_table))
    if meta.categories:
        band.SetCategoryNames(list(meta.categories))
    if meta.band_metadata:
        band.SetMetadata(meta.band_metadata)
    if meta.description:
        band.SetDescription(meta.description)
    if meta.unit:
        band.SetUnitType(meta.unit)
    if meta.scale != 1:
        band.SetScale(meta.scale)
    if meta.offset != 0:
        band.SetOffset(meta.offset)
    if tag is not None:
        band.SetNoDataValue(tag)


def _gdal_color_table(colors):
    table = load().gdal.ColorTable()
    for value, color in colors.items():
        table.SetColorEntry(int(value), (*color, 255)[:4])
    return table
