"""Files of procedural terrain, ``.dsp``, in the container of `demsmith.core.sectioned`.

The header holds ``shape``, ``geotransform`` and ``crs`` of the modelled raster, ``unit`` and
``area_or_point`` of its band, ``side`` and ``step`` of the discs (cells along rows and columns of
a disc's block), ``cell`` (metres east-west, north-south) and ``atoms``, ``terms``, ``sparsity``.
Each section is one part, a little-endian array, deflated:

functions
    float64, (atoms, 4 + 2 terms): family, seed, mean, norm, amplitudes, wavelengths.
heights
    float32, a number a disc, row by row.
indices, coefficients
    uint16 and float32, (discs, sparsity).
void
    A bit for each cell of the raster, row by row, the first in the highest bit of a byte.

A file is not trusted: whatever it holds, reading it takes no more than `MEMORY_BOUND` bytes or
raises `InputError`.
"""

import math
import zlib
from dataclasses import dataclass

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.noise import MOST_TERMS, NoiseSums
from demsmith.core.procedural.terrain import ProceduralTerrain
from demsmith.core.progress import SILENT
from demsmith.core.raster import BandMeta, Grid, Raster
from demsmith.core.sectioned import TERRAIN as KIND
from demsmith.core.sectioned import open_sectioned, write_sectioned
from demsmith.core.sparse import PatchGrid

EXTENSION = ".dsp"

MEMORY_BOUND = 2 << 30
"""Bytes that reading a file never exceeds."""

_MOST_STORED = 1 << 27
_MOST_CELLS = 1 << 29
_MOST_ATOMS, _MOST_SPARSITY = 4096, 16
_LONGEST_TEXT = 1 << 16


@dataclass(frozen=True, eq=False)
class PlacedTerrain:
    """A procedural terrain, and where it lies.

    Attributes
    ----------
    terrain : ProceduralTerrain
    grid : Grid
        Of the raster that was modelled.
    unit : str
        Unit of the elevations; empty if unknown.
    area_or_point : str
        As in `BandMeta`.
    """

    terrain: ProceduralTerrain
    grid: Grid
    unit: str = ""
    area_or_point: str = ""

    def raster(self, *, scale=1.0, threads=None, progress=SILENT):
        """Evaluate the terrain as a raster; see `ProceduralTerrain.evaluate`."""
        values = self.terrain.evaluate(scale=scale, threads=threads, progress=progress)
        x, width, _, y, _, height = self.grid.geotransform
        geotransform = (x, width / scale, 0.0, y, 0.0, height / scale)
        if not self.grid.georeferenced:
            geotransform = self.grid.geotransform
        meta = BandMeta(
            nodata=float("nan"), unit=self.unit, area_or_point=self.area_or_point
        )  # fmt: skip
        grid = Grid(values.shape, geotransform, self.grid.crs)
        return Raster(values, np.isnan(values), grid, meta)


def write_terrain(path, placed):
    """Write a procedural terrain to a file, whole or not at all.

    Parameters
    ----------
    path : path
        Ending in ``.dsp``. An existing file is replaced.
    placed : PlacedTerrain

    Raises
    ------
    InputError
        If it is too large for a file.
    OutputError
        If the file cannot be written.
    """
    terrain, sums = placed.terrain, placed.terrain.functions
    header = {
        "shape": list(terrain.grid.shape),
        "geotransform": list(placed.grid.geotransform),
        "crs": placed.grid.crs,
        "unit": placed.unit,
        "area_or_point": placed.area_or_point,
        "side": [terrain.grid.side_rows, terrain.grid.side_columns],
        "step": [terrain.grid.step_rows, terrain.grid.step_columns],
        "cell": [float(size) for size in terrain.cell_size],
        "atoms": len(sums),
        "terms": sums.amplitudes.shape[1],
        "sparsity": terrain.indices.shape[1],
    }
    functions = np.column_stack(
        [sums.families, sums.seeds, terrain.means, terrain.norms, sums.amplitudes,
         sums.wavelengths]
    )  # fmt: skip
    arrays = {
        "functions": functions.astype("<f8"),
        "heights": np.asarray(terrain.heights, "<f4"),
        "indices": np.asarray(terrain.indices, "<u2"),
        "coefficients": np.asarray(terrain.coefficients, "<f4"),
        "void": np.packbits(terrain.void),
    }
    stored = sum(array.nbytes for array in arrays.values())
    if stored > _MOST_STORED or terrain.void.size > _MOST_CELLS:
        raise InputError(
            f"a model of {terrain.void.size} cells by {terrain.grid.count} discs is larger than a "
            "file may hold: model a part of the raster, or make the radius larger"
        )
    sections = {name: [zlib.compress(array.tobytes())] for name, array in arrays.items()}
    write_sectioned(path, KIND, header=header, sections=sections)


def read_terrain(path):
    """Read a procedural terrain from a file.

    Parameters
    ----------
    path : path

    Returns
    -------
    PlacedTerrain

    Raises
    ------
    InputError
        If the file is missing, no procedural terrain, truncated, damaged or too large.
    """
    with open_sectioned(path, KIND) as file:
        return _Reader(file).placed()


class _Reader:
    """One file's contents, each checked before it is used."""

    def __init__(self, file):
        self.file, self.header, self.stored = file, file.header, 0

    def placed(self):
        """Read all of it."""
        rows, columns = shape = self._whole("shape", _MOST_CELLS)
        if rows * columns > _MOST_CELLS:
            raise self._damaged("shape")
        atoms, terms, sparsity = (
            self._one(name, most)
            for name, most in (
                ("atoms", _MOST_ATOMS),
                ("terms", MOST_TERMS),
                ("sparsity", _MOST_SPARSITY),
            )
        )
        texts = [self._text(name) for name in ("crs", "unit", "area_or_point")]
        try:
            grid = Grid(shape, self._real("geotransform", 6), texts[0])
            discs = PatchGrid(
                tuple(shape), *self._whole("side", 1 << 16), *self._whole("step", 1 << 16)
            )
            table = self._array("functions", (atoms, 4 + 2 * terms), "<f8")
            sums = self._sums(table, terms)
            terrain = ProceduralTerrain(
                discs, self._cell(), sums, table[:, 2].copy(), table[:, 3].copy(),
                self._array("heights", (discs.count,), "<f4"),
                self._array("indices", (discs.count, sparsity), "<u2").astype(np.int32),
                self._array("coefficients", (discs.count, sparsity), "<f4"),
                self._bits("void", rows, columns),
            )  # fmt: skip
        except InputError as error:
            if str(error).startswith(f"'{self.file.path}'"):
                raise
            raise self._damaged(str(error)) from None
        return PlacedTerrain(terrain, grid, *texts[1:])

    def _sums(self, table, terms):
        whole = table[:, :2]
        if not np.isfinite(table).all() or (whole != np.floor(whole)).any():
            raise self._damaged("a function's numbers make no sense")
        if np.abs(table[:, 1:]).max() > 2.0**53:
            raise self._damaged("a function's numbers are too large")
        return NoiseSums(table[:, 0], table[:, 1], table[:, 4 : 4 + terms], table[:, 4 + terms :])

    def _cell(self):
        cell = self._real("cell", 2)
        if not all(1e-6 < size < 1e9 for size in cell):
            raise self._damaged("cell")
        return tuple(cell)

    def _bits(self, name, rows, columns):
        packed = self._array(name, (-(-rows * columns // 8),), "u1")
        return np.unpackbits(packed, count=rows * columns).reshape(rows, columns).view(bool)

    def _array(self, name, shape, kind):
        """Unpack an array of a size that is known; nothing larger is unpacked."""
        size = math.prod(shape) * np.dtype(kind).itemsize
        self.stored += size
        if self.stored > _MOST_STORED:
            raise self._damaged(f"it tells of more than {_MOST_STORED >> 20} MB")
        inflate = zlib.decompressobj()
        try:
            data = inflate.decompress(self.file.part(name, 0), size + 1)
        except zlib.error:
            raise self._damaged(f"'{name}' cannot be unpacked") from None
        if len(data) != size or not inflate.eof or inflate.unused_data:
            raise self._damaged(f"'{name}' has another size than it should")
        return np.frombuffer(bytearray(data), kind).reshape(shape)  # which can be written to

    def _whole(self, name, most):
        values = self.header.get(name)
        if not isinstance(values, list) or len(values) != 2:
            raise self._damaged(name)
        if not all(type(value) is int and 1 <= value <= most for value in values):
            raise self._damaged(name)
        return values

    def _one(self, name, most):
        value = self.header.get(name)
        if type(value) is not int or not 1 <= value <= most:
            raise self._damaged(name)
        return value

    def _real(self, name, count):
        values = self.header.get(name)
        if not isinstance(values, list) or len(values) != count:
            raise self._damaged(name)
        if not all(type(value) in (int, float) and abs(value) < 1e300 for value in values):
            raise self._damaged(name)
        return [float(value) for value in values]

    def _text(self, name):
        value = self.header.get(name)
        if not isinstance(value, str) or len(value) > _LONGEST_TEXT:
            raise self._damaged(name)
        return value

    def _damaged(self, how):
        return InputError(f"'{self.file.path}' is damaged: {how}")
