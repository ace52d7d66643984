"""What an `.sct` file tells of its raster, written to a header and read from an untrusted one."""

import math
import struct
from typing import NamedTuple

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.raster import BandMeta, Grid
from demsmith.core.raster.codes import crs_code, is_plain_crs
from demsmith.core.raster.grid import NO_GEOTRANSFORM
from demsmith.core.raster.nodata import as_stored
from demsmith.core.sct.marks import MOST_MARKS, Marks
from demsmith.core.sct.quantisation import Quantisation

_DTYPES = (
    "uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float32", "float64",
)  # fmt: skip
_TEXTS = ("unit", "description", "area_or_point")
_TABLES = ("dataset_metadata", "band_metadata", "rpc")
_NUMBERS = ("scale", "offset", "epoch")
_LONGEST_SIDE = 1 << 31
_LARGEST_FIRST = 1 << 62
_COLOR = struct.Struct("<i4H")
_GCP = struct.Struct("<5d")


class Made(NamedTuple):
    """How a file was made, and how far it is from its raster.

    Attributes
    ----------
    mode : str
        ``max-error``, ``ratio``, ``psnr`` or ``tree``.
    wanted : float or None
        What was asked for: the maximum error in the raster's unit, the ratio or the PSNR [dB].
    max_error, rmse : float
        Largest and root-mean-square error, measured, in the raster's unit.
    psnr : float or None
        Against the raster's range [dB]; None where there is no error, or no range.
    low, high : float
        Range of the values, in the raster's unit.
    cells_known : int
    tree_rmse : float
        Root-mean-square error of the tree alone, without the residual, in the raster's unit.
    """

    mode: str
    wanted: float | None
    max_error: float
    rmse: float
    psnr: float | None
    low: float
    high: float
    cells_known: int
    tree_rmse: float


MODES = ("max-error", "ratio", "psnr", "tree")


def packed(grid, meta, quantisation, marks, made):
    """Put what is told of a raster in a dictionary of plain types.

    Parameters
    ----------
    grid : Grid
    meta : BandMeta
        Its data type is told by the quantisation.
    quantisation : Quantisation
    marks : Marks
    made : Made

    Returns
    -------
    dict
    """
    header = {
        "shape": list(grid.shape),
        "type": str(quantisation.dtype),
        "steps": [quantisation.unit, quantisation.divisor, quantisation.first],
        "made": list(made),
    }
    if grid.georeferenced:
        header["geotransform"] = list(grid.geotransform)
    if grid.crs:
        header["crs"] = crs_code(grid.crs)
    if meta.nodata is not None:
        header["nodata"] = meta.nodata
    if marks.values.size:
        header["marks"] = [mark.item() for mark in marks.values]
    return header | _packed_meta(meta)


def _packed_meta(meta):
    plain = BandMeta()
    header = {
        name: getattr(meta, name)
        for name in (*_TEXTS, *_TABLES, *_NUMBERS, "gcp_crs")
        if getattr(meta, name) != getattr(plain, name)
    }
    if meta.categories:
        header["categories"] = list(meta.categories)
    if meta.color_table:
        header["colors"] = b"".join(
            _COLOR.pack(value, *(*color, 255)[:4]) for value, color in meta.color_table.items()
        )
    if meta.gcps:
        header["gcps"] = b"".join(_GCP.pack(*point) for point in meta.gcps)
    return _encodable(header)


def _encodable(value):
    """Replace in texts what UTF-8 cannot say, such as bytes of an unknown encoding."""
    if isinstance(value, str):
        return value.encode("utf-8", "replace").decode()
    if isinstance(value, dict):
        return {_encodable(key): _encodable(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_encodable(each) for each in value]
    return value


def unpacked(header):
    """Read what `packed` wrote, checking everything.

    Returns
    -------
    Grid, BandMeta, Quantisation, Marks, Made

    Raises
    ------
    InputError
        If anything is missing or not what it should be.
    """
    told = _Fields(header)
    dtype = np.dtype(told.one_of("type", _DTYPES))
    shape = told.numbers("shape", 2, kind=int, low=1, high=_LONGEST_SIDE)
    geotransform = told.numbers("geotransform", 6, default=NO_GEOTRANSFORM)
    grid = Grid(shape, geotransform, told.crs("crs"))
    unit, divisor = told.numbers("steps", 3)[:2]
    first = told.numbers("steps", 3, kind=(int, float))[2]
    if not (unit > 0 and divisor > 0 and isinstance(first, int) and abs(first) < _LARGEST_FIRST):
        raise told.wrong("steps")
    marks = _marks(told, dtype)
    meta = BandMeta(
        dtype=dtype,
        nodata=header.get("nodata"),
        **{name: told.text(name) for name in _TEXTS},
        gcp_crs=told.crs("gcp_crs"),
        **{name: told.table(name) for name in _TABLES},
        **{name: told.number(name, getattr(BandMeta, name)) for name in _NUMBERS},
        categories=tuple(told.texts("categories")),
        color_table={value: tuple(color) for value, *color in told.records("colors", _COLOR)},
        gcps=tuple(told.records("gcps", _GCP)),
    )
    return grid, meta, Quantisation(dtype, unit, divisor, first), marks, _made(told)


def _marks(told, dtype):
    tag = told.value("nodata", None, (int, float, type(None)))
    listed = told.value("marks", [], (list,))
    if len(listed) > MOST_MARKS + 1 or not all(type(mark) in (int, float) for mark in listed):
        raise told.wrong("marks")
    stored = [None if mark is None else _stored(mark, dtype) for mark in (tag, *listed)]
    if any(mark is None for mark in stored[1:]) or (tag is not None and stored[0] is None):
        raise told.wrong("marks")
    return Marks(np.array(stored[1:], dtype), stored[0])


def _stored(mark, dtype):
    try:
        return as_stored(mark, dtype)
    except OverflowError:
        return None


def _made(told):
    values = told.value("made", None, (list,))
    if len(values) != len(Made._fields):
        raise told.wrong("made")
    made = Made(*values)
    numbers = (made.max_error, made.rmse, made.low, made.high, made.tree_rmse)
    sane = (
        made.mode in MODES
        and (made.wanted is not None or made.mode == "tree")
        and all(type(number) in (int, float) for number in numbers)
        and all(type(number) in (int, float, type(None)) for number in (made.wanted, made.psnr))
        and type(made.cells_known) is int
    )
    if not sane or not all(math.isfinite(each) for each in values[1:] if each is not None):
        raise told.wrong("made")
    return made


class _Fields:
    """Fields of a header, checked as they are read."""

    def __init__(self, header):
        self._header = header

    def wrong(self, name):
        return InputError(f"its header has no proper '{name}'")

    def value(self, name, default, kinds):
        value = self._header.get(name, default)
        if type(value) not in kinds:
            raise self.wrong(name)
        return value

    def one_of(self, name, choices):
        value = self.value(name, None, (str,))
        if value not in choices:
            raise self.wrong(name)
        return value

    def text(self, name):
        return self.value(name, "", (str,))

    def crs(self, name):
        text = self.text(name)
        if not is_plain_crs(text):
            raise self.wrong(name)
        return text

    def texts(self, name):
        return self._all(name, self.value(name, [], (list,)), (str,))

    def table(self, name):
        table = self.value(name, {}, (dict,))
        self._all(name, table.values(), (str,))
        return table

    def number(self, name, default):
        return self._finite(name, self.value(name, default, (int, float)))

    def numbers(self, name, count, *, kind=(int, float), low=None, high=None, default=None):
        if default is not None and name not in self._header:
            return default
        values = self.value(name, None, (list,))
        self._all(name, values, kind if isinstance(kind, tuple) else (kind,))
        if len(values) != count or (low is not None and not low <= min(values)):
            raise self.wrong(name)
        if high is not None and max(values) > high:
            raise self.wrong(name)
        for value in values:
            self._finite(name, value)
        return values

    def records(self, name, layout):
        data = self.value(name, b"", (bytes,))
        if len(data) % layout.size:
            raise self.wrong(name)
        return list(layout.iter_unpack(data))

    def _all(self, name, values, kinds):
        if not all(type(value) in kinds for value in values):
            raise self.wrong(name)
        return values

    def _finite(self, name, value):
        if not math.isfinite(value):
            raise self.wrong(name)
        return value
