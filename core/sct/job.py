"""From raster to `.sct` file and back, as the command line and QGIS do it."""

import operator
import os
import time
from dataclasses import dataclass, fields

import numpy as np

import demsmith
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.options import validate
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.sct.coding import coded
from demsmith.core.sct.file import open_sct, write_sct
from demsmith.core.sct.options import CompressOptions, DecompressOptions
from demsmith.core.sct.scaling import decoded_at
from demsmith.core.sct.virtual import virtual_path, write_virtual

EXTENSION = ".sct"


@dataclass(frozen=True)
class CompressResult:
    """What a compression did.

    Attributes
    ----------
    output, vrt : str or None
        Paths of what was written.
    seconds : float
    version : str
        Demsmith's.
    cells, cells_known : int
        Number of cells in all, and with an elevation.
    bytes, bytes_raw : int
        Of the file with all that is in it, and of the raster's cells as they are in memory.
    ratio : float
        Raw by written bytes.
    bits_per_cell : float
    tree : str
        ``pyramid`` or ``patches``.
    mode : str
        ``max-error``, ``ratio``, ``psnr`` or ``tree``: what was asked for.
    max_error : float or None
        The bound that the file keeps, in the raster's unit; None where it keeps none.
    max_error_measured, rmse : float
        Of the file as it decodes, in the raster's unit.
    psnr : float or None
        Against the raster's range [dB]; None where nothing is wrong.
    warnings : tuple of str
        One sentence each.
    """

    output: str
    vrt: str | None
    seconds: float
    version: str
    cells: int
    cells_known: int
    bytes: int
    bytes_raw: int
    ratio: float
    bits_per_cell: float
    tree: str
    mode: str
    max_error: float | None
    max_error_measured: float
    rmse: float
    psnr: float | None
    warnings: tuple

    def as_dict(self):
        """Give everything as a dict that JSON can hold."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def compress_file(
    input, output, *, options=None, dictionary=None, band=1, nodata=(), below=None,  # noqa: A002
    above=None, mask=None, threads=None, overwrite=False, progress=SILENT,
):  # fmt: skip
    """Compress a raster file into a Sparse Construction Tree.

    Everything asked for is written, or nothing is; the input is never changed. Before the file is
    put in place it is decoded, and its error measured.

    Parameters
    ----------
    input : path
        Anything `demsmith.read_raster` reads, which also explains ``band``, ``nodata``,
        ``below``, ``above`` and ``mask``.
    output : path
        ``.sct`` file. It keeps data type, nodata tag, what every void cell holds, CRS,
        geotransform, area-or-point, unit, scale, offset, description and metadata.
    options : CompressOptions, optional
    dictionary : path, optional
        Dictionary (``.dsd``) for a tree of patches; default: one is learned from the raster.
    threads : int, optional
        Default: one for each core. The output does not depend on it.
    overwrite : bool
        Whether existing outputs may be replaced.
    progress : Progress

    Returns
    -------
    CompressResult

    Raises
    ------
    InputError
        If the input cannot be used, has nothing but voids, or an option is out of range.
    OutputError
        If an output cannot be written.
    Cancelled
        If ``progress`` asks to stop.
    """
    begin = time.perf_counter()
    options = options or CompressOptions()
    validate(options)
    outputs = {"output": os.fspath(output), "vrt": virtual_path(output) if options.vrt else None}
    inputs = [path for path in (input, mask, dictionary) if path is not None]
    _check_outputs(outputs, inputs, overwrite)
    source = raster.read(
        input, band=band, nodata=nodata, below=below, above=above, mask=mask,
        progress=Span(progress, 0, 0.1),
    )  # fmt: skip
    try:
        made = coded(source, options, dictionary, threads, Span(progress, 0.1, 0.95))
    except InputError as error:
        raise InputError(f"'{source.source}': {error}") from None
    with raster.all_or_nothing(outputs) as part:
        write_sct(part["output"], **made.parts())
        size = os.path.getsize(part["output"])
        if options.vrt:
            write_virtual(part["vrt"], outputs["output"], made.grid, made.meta)
        checkpoint(progress, 1.0)
    notes = [*source.notes, *(f"'{source.source}': {note}" for note in made.notes)]
    beside = virtual_path(output)
    if not options.vrt and os.path.exists(beside):
        notes.append(
            f"'{beside}' describes the file that was here before: delete it, or write a new one"
        )
    raw = source.values.nbytes
    return CompressResult(
        **outputs,
        seconds=round(time.perf_counter() - begin, 3),
        version=demsmith.__version__,
        cells=source.values.size,
        cells_known=int(np.count_nonzero(~source.void)),
        bytes=size,
        bytes_raw=raw,
        ratio=raw / size,
        bits_per_cell=8 * size / source.values.size,
        tree=made.encoded.params["tree"],
        mode=made.made.mode,
        max_error=made.made.wanted if made.made.mode == "max-error" else None,
        max_error_measured=made.made.max_error,
        rmse=made.made.rmse,
        psnr=made.made.psnr,
        warnings=tuple(notes),
    )


def _check_outputs(outputs, inputs, overwrite):
    if not outputs["output"].lower().endswith(EXTENSION):
        raise InputError(f"output '{outputs['output']}' must end in {EXTENSION}")
    for path in filter(None, outputs.values()):
        raster.check_place(path, inputs=inputs, overwrite=overwrite)


@dataclass(frozen=True)
class DecompressResult:
    """What a decompression did.

    Attributes
    ----------
    output : str
        Path of what was written.
    seconds : float
    version : str
        Demsmith's.
    rows, columns : int
        Of the output.
    cells, cells_known : int
        Number of its cells in all, and with an elevation; of a virtual raster, of the file.
    max_error : float or None
        By which they may differ from the raster that was compressed, in its unit; None at another
        scale, or where the file was made without a bound.
    warnings : tuple of str
        One sentence each.
    """

    output: str
    seconds: float
    version: str
    rows: int
    columns: int
    cells: int
    cells_known: int
    max_error: float | None
    warnings: tuple

    def as_dict(self):
        """Give everything as a dict that JSON can hold."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def decompress_file(
    input, output, *, options=None, window=None, threads=None, overwrite=False,  # noqa: A002
    creation_options=(), progress=SILENT,
):  # fmt: skip
    """Decompress an `.sct` file, or a window of it, at any scale, into a raster file.

    Parameters
    ----------
    input : path
        ``.sct`` file.
    output : path
        GeoTIFF with all that the compressed raster said, in its data type; at a scale other than 1
        in floating point. Or ``.vrt``: a virtual raster by which GDAL reads the file itself.
    options : DecompressOptions, optional
    window : (int, int, int, int), optional
        First column and row, number of columns and rows. Default: all.
    threads : int, optional
        Default: one for each core. The output does not depend on it.
    overwrite : bool
        Whether an existing output may be replaced.
    creation_options : iterable of str
        GDAL's for GeoTIFF, ``KEY=VALUE``.
    progress : Progress

    Returns
    -------
    DecompressResult

    Raises
    ------
    InputError
        If the input is no `.sct` file, or damaged, the window not in it, or an option out of range.
    OutputError
        If the output cannot be written.
    Cancelled
        If ``progress`` asks to stop.
    """
    begin = time.perf_counter()
    options = options or DecompressOptions()
    validate(options)
    virtual = os.fspath(output).lower().endswith(".vrt")
    check = raster.check_place if virtual else raster.check_output
    check(output, inputs=[input], overwrite=overwrite)
    with open_sct(input, threads=threads) as file:
        known = file.made.cells_known
        if virtual:
            if options.scale != 1 or window is not None:
                raise InputError("a virtual raster is of the whole file at its own scale")
            write_virtual(output, input, file.grid, file.meta)
            grid, notes = file.grid, []
        else:
            rows, columns = _window(file, window)
            decoded, notes = decoded_at(
                file, rows, columns, options.scale, threads=threads,
                progress=Span(progress, 0, 0.7),
            )  # fmt: skip
            grid, known = decoded.grid, int(np.count_nonzero(~decoded.void))
            raster.write(
                output, decoded.values, like=decoded, void=decoded.void if options.scale != 1
                else None, overwrite=overwrite, threads=threads,
                creation_options=creation_options, progress=Span(progress, 0.7, 1),
            )  # fmt: skip
        made = file.made
    exact = made.mode == "max-error" and options.scale == 1
    return DecompressResult(
        output=os.fspath(output),
        seconds=round(time.perf_counter() - begin, 3),
        version=demsmith.__version__,
        rows=grid.shape.rows,
        columns=grid.shape.columns,
        cells=grid.shape.rows * grid.shape.columns,
        cells_known=known,
        max_error=made.wanted if exact else None,
        warnings=tuple(f"'{os.fspath(input)}': {note}" for note in notes),
    )


def _window(file, window):
    """Give the rows and columns of a window, which `Grid.part` checks."""
    if window is None:
        return slice(0, file.grid.shape.rows), slice(0, file.grid.shape.columns)
    try:
        column, row, width, height = map(operator.index, window)
    except (TypeError, ValueError):
        raise InputError(
            f"window is {window!r}; give four whole numbers: first column, first row, number of "
            "columns and number of rows"
        ) from None
    return slice(row, row + height), slice(column, column + width)
