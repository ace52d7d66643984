"""Learning a dictionary from files to a file, as the command line and QGIS do it."""

import os
import time
from dataclasses import dataclass, fields

import numpy as np

import demsmith
from demsmith.core import raster
from demsmith.core.errors import InputError
from demsmith.core.options import validate
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.raster.outputs import check_place
from demsmith.core.sparse.dictionary_file import write_dictionary
from demsmith.core.sparse.learning import learn
from demsmith.core.sparse.options import LearnOptions, StoreOptions

_ALIKE = 0.1
"""Relative difference in the size of cells that exemplars may have without a warning."""


@dataclass(frozen=True)
class LearnResult:
    """What a learning did.

    Attributes
    ----------
    output : str
        Path of what was written.
    seconds : float
    version : str
        Demsmith's.
    bytes : int
        Size of the file.
    atoms : int
    side_rows, side_columns : int
        Cells across a disc.
    cell_size : tuple of float
        Ground metres from cell to cell, east-west and north-south, of the coarser resolution.
    factor : int
        Cells of the finer resolution along one of these; 1: there is none.
    discs, discs_skipped : int
        How many were learned from, and left out for a void in them.
    rmse : float or None
        Root mean square error [m] of the discs at the end; None for a complete dictionary.
    errors : tuple of float
        The same after each iteration.
    blend_errors : tuple of float
        Root mean square error [m] of the blended surface before and after each round of polishing.
    warnings : tuple of str
        One sentence each.
    """

    output: str
    seconds: float
    version: str
    bytes: int
    atoms: int
    side_rows: int
    side_columns: int
    cell_size: tuple
    factor: int
    discs: int
    discs_skipped: int
    rmse: float | None
    errors: tuple
    blend_errors: tuple
    warnings: tuple

    def as_dict(self):
        """Give everything as a dict that JSON can hold."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def learn_file(
    inputs, output, *, options=None, store=None, band=1, nodata=(), below=None, above=None,
    threads=None, overwrite=False, progress=SILENT,
):  # fmt: skip
    """Learn a dictionary from one raster file or several.

    Parameters
    ----------
    inputs : path, or list of paths
        Anything `demsmith.read_raster` reads, which also explains ``band``, ``nodata``, ``below``
        and ``above``; they hold for all.
    output : path
        Dictionary to write, ``.dsd``. It is written whole, or not at all.
    options : LearnOptions, optional
    store : StoreOptions, optional
    threads : int, optional
        Default: one for each core. The output does not depend on it.
    overwrite : bool
        Whether an existing output may be replaced.
    progress : Progress

    Returns
    -------
    LearnResult

    Raises
    ------
    InputError
        If an input cannot be used, there are too few discs without a void, or an option is out of
        range.
    OutputError
        If the output cannot be written.
    Cancelled
        If ``progress`` asks to stop.
    """
    begin = time.perf_counter()
    options, store = options or LearnOptions(), store or StoreOptions()
    validate(options)
    validate(store)
    inputs = [inputs] if isinstance(inputs, (str, os.PathLike)) else list(inputs)
    if not inputs:
        raise InputError("give at least one raster to learn from")
    output = os.fspath(output)
    if not output.lower().endswith(".dsd"):
        raise InputError(f"output '{output}' must be a dictionary: end its name in .dsd")
    check_place(output, inputs=inputs, overwrite=overwrite)
    sources = [
        raster.read(
            path, band=band, nodata=nodata, below=below, above=above,
            progress=Span(progress, 0.15 * number / len(inputs), 0.15 * (number + 1) / len(inputs)),
        )
        for number, path in enumerate(inputs)
    ]  # fmt: skip
    learned = _learn(sources, options, threads, Span(progress, 0.15, 0.95))
    dictionary = learned.dictionary
    with raster.all_or_nothing({"output": output}) as part:
        write_dictionary(part["output"], dictionary, precision=store.precision)
        checkpoint(progress, 1)
    return LearnResult(
        output=output,
        seconds=round(time.perf_counter() - begin, 3),
        version=demsmith.__version__,
        bytes=os.path.getsize(output),
        atoms=len(dictionary),
        side_rows=dictionary.side_rows,
        side_columns=dictionary.side_columns,
        cell_size=dictionary.cell_size,
        factor=dictionary.factor,
        discs=learned.discs,
        discs_skipped=learned.discs_skipped,
        rmse=min(learned.errors, default=None),
        errors=learned.errors,
        blend_errors=learned.blend_errors,
        warnings=(*dict.fromkeys(note for source in sources for note in source.notes),
                  *_unlike(sources)),
    )  # fmt: skip


def _learn(sources, options, threads, progress):
    try:
        return learn(
            [_elevations(source) for source in sources],
            [source.void for source in sources],
            options=options,
            pixel_size=[source.grid.pixel_size_m() for source in sources],
            names=[os.path.basename(os.fspath(source.source)) for source in sources],
            threads=threads,
            progress=progress,
        )
    except InputError as error:
        names = ", ".join(f"'{source.source}'" for source in sources)
        raise InputError(f"{names}: {error}") from None


def _elevations(source):
    """Give elevations in the band's unit; as they are stored, which takes less room, if so."""
    if source.meta.scale == 1 and source.meta.offset == 0:
        return source.values
    return source.meta.real(source.values.astype(np.float64))


def _unlike(sources):
    """Warn of exemplars whose cells measure something else on the ground than the first one's."""
    sizes = [
        [float(size[size.size // 2]) for size in source.grid.pixel_size_m()] for source in sources
    ]
    for source, size in zip(sources[1:], sizes[1:], strict=True):
        if any(abs(a / b - 1) > _ALIKE for a, b in zip(size, sizes[0], strict=True)):
            yield (
                f"cells of '{source.source}' measure {size[0]:.3g} by {size[1]:.3g} m, those of "
                f"'{sources[0].source}' {sizes[0][0]:.3g} by {sizes[0][1]:.3g} m; shapes of "
                "different size are mixed"
            )
