"""Tables of points: text files with a column each for x, y and z."""

import codecs
import contextlib
import csv
import itertools
import os
from typing import NamedTuple

import numpy as np

from demsmith.core.errors import InputError
from demsmith.core.progress import SILENT, Span, checkpoint
from demsmith.core.raster.features import ELEVATION_NAMES, Features, columns_named, in_crs
from demsmith.core.raster.opening import check_there

_EXTENSIONS = (".csv", ".tsv", ".txt", ".xyz", ".dat")
_X_NAMES = (
    "x", "lon", "long", "longitude", "lng", "easting", "east", "e", "xcoord", "x_coord", "point_x",
)  # fmt: skip
_Y_NAMES = (
    "y", "lat", "latitude", "northing", "north", "n", "ycoord", "y_coord", "point_y",
)  # fmt: skip
_DELIMITERS = (";", "\t", ",", None)  # None: blanks; a comma may also be the decimal mark
_UNKNOWN = ("", "nan", "na", "n/a", "null", "none", "-")
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16")
)  # fmt: skip
_BYTES_SNIFFED = 1 << 16
_LINES_SNIFFED = 50
_LINES_AT_ONCE = 50_000
_LINES_NAMED = 5


def is_table(path):
    """Whether a file's name is one of a table of points."""
    return os.fspath(path).lower().endswith(_EXTENSIONS)


def read_table(path, *, x=None, y=None, z=None, crs="", source_crs="", progress=SILENT):
    """Read a table of points.

    Columns are parted by semicolons, tabs, commas or blanks; where not by commas, a decimal
    comma is understood. What follows a ``#`` is a comment. The first line may name the columns;
    where it names none that is known, or is not there, the first three are x, y and z. Rows
    whose z is empty or not a number are left out and counted in the notes.

    Parameters
    ----------
    path : str or path-like
        Text in UTF-8, UTF-16 with byte order mark, or any one-byte code.
    x, y, z : str or int
        Name of a column in any case, or its number from 1 on.
    crs : str
        CRS to reproject to; elevations stay as they are.
    source_crs : str
        CRS of the table's coordinates, as a table cannot tell it.
    progress : Progress
        Told how much has been read.

    Returns
    -------
    Features
        With points only.

    Raises
    ------
    InputError
        If the file is missing, no text or no table, has no such column, or rows that cannot be
        read: they are named by line number.
    Cancelled
        If ``progress`` says so.
    """
    path = os.fspath(path)
    with _text_lines(path) as (lines, fraction_read):
        beginning = list(itertools.islice(lines, _LINES_SNIFFED))
        layout, notes = _layout(beginning, (x, y, z), path)
        rows = _read_rows(
            itertools.chain(beginning, lines), layout, path, fraction_read,
            Span(progress, 0.0, 0.9),
        )  # fmt: skip
    places, crs, crs_notes = in_crs(
        rows, source=source_crs, target=crs, progress=Span(progress, 0.9, 1.0)
    )
    known = np.isfinite(places).all(axis=1)
    if not known.any():
        raise InputError(f"'{path}' has no row with x, y and z within the reach of the CRS")
    notes += crs_notes
    if not known.all():
        missing = len(known) - np.count_nonzero(known)
        notes.append(f"{missing} of {len(known)} rows have no elevation or place and were left out")
    return Features(places[known], (), crs, tuple(f"'{path}': {note}" for note in notes))


class _Layout(NamedTuple):
    """How a table is written, and which columns are x, y, z."""

    delimiter: str | None
    columns: tuple
    header_line: int  # its number from 1 on, 0 if there is none


@contextlib.contextmanager
def _text_lines(path):
    """Open a text; yields an iterator over its lines, and how much of it has been read."""
    check_there(path)
    try:
        with open(path, "rb") as binary:
            encoding = _encoding(binary.read(_BYTES_SNIFFED), path)
        # Numbers are the same in every code: a wrong letter elsewhere does no harm.
        with open(path, encoding=encoding, errors="replace") as text:
            size = os.fstat(text.fileno()).st_size
            yield text, lambda: min(text.buffer.tell() / size, 1.0)
    except OSError as error:
        raise InputError(f"'{path}' cannot be read: {error.strerror}") from None


def _encoding(beginning, path):
    for mark, encoding in _BYTE_ORDER_MARKS:
        if beginning.startswith(mark):
            return encoding
    if b"\0" in beginning:
        raise InputError(f"'{path}' is no text, so no table of points")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(beginning)
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def _layout(beginning, wanted, path):
    """Tell from its first lines how a table is written; and notes on what was guessed."""
    rows = [number for number, line in enumerate(beginning) if _without_comment(line)]
    fitting = {
        delimiter: sum(_numbers_in(beginning[row], delimiter) >= 3 for row in rows)
        for delimiter in _DELIMITERS
    }
    delimiter = max(fitting, key=fitting.get)
    if not fitting[delimiter]:
        raise InputError(
            f"'{path}' is no table of points: its rows need three numbers, x, y and z, parted by "
            "semicolons, tabs, commas or blanks"
        )
    header = rows[0] if _numbers_in(beginning[rows[0]], delimiter) == 0 else -1
    names = _column_names(beginning, rows[0], header, delimiter)
    columns, notes = _columns(names, wanted, path)
    return _Layout(delimiter, columns, header + 1), notes


def _without_comment(line):
    return line.partition("#")[0].strip()


def _fields(line, delimiter):
    """Part a line into its columns, as text."""
    if delimiter is None:
        return line.split()
    try:
        fields = next(csv.reader([line.strip("\r\n ")], delimiter=delimiter))
    except csv.Error:  # larger than a field may be: no row of a table
        return []
    return [field.strip() for field in fields]


def _number(text, delimiter):
    """Return the number a field holds; ``None`` if it holds none."""
    try:
        return float(text if delimiter == "," else text.replace(",", "."))
    except ValueError:
        return None


def _numbers_in(line, delimiter):
    fields = _fields(_without_comment(line), delimiter)
    return sum(_number(field, delimiter) is not None for field in fields)


def _column_names(beginning, first, header, delimiter):
    """Names of the columns from the header, or from a comment before the first row."""
    if header >= 0:
        return _fields(_without_comment(beginning[header]), delimiter)
    for comment in beginning[:first]:
        names = _fields(comment.strip("# \n"), delimiter)
        if all(_usual_columns(names)):
            return names
    return []


def _usual_columns(names):
    """Numbers of the columns that are x, y and z by their names; a list for each of the three."""
    return [columns_named(names, usual) for usual in (_X_NAMES, _Y_NAMES, ELEVATION_NAMES)]


def _columns(names, wanted, path):
    """Choose the columns of x, y and z: those asked for, those named as usual, or the first."""
    usual = _usual_columns(names)
    columns = [
        _asked_column(asked, names, path) if asked is not None else next(iter(found), None)
        for asked, found in zip(wanted, usual, strict=True)
    ]
    notes = []
    listed = ", ".join(f"'{name}'" for name in names)
    if None in columns:
        if any(usual):
            axis = "xyz"[columns.index(None)]
            raise InputError(
                f"which column of '{path}' is {axis}? Tell its name, or call it {axis} in the "
                f"file; there are: {listed}"
            )
        columns = [place if column is None else column for place, column in enumerate(columns)]
        if names and wanted == (None, None, None):
            notes.append(f"x, y, z were taken from the first three of its columns {listed}")
    if len(set(columns)) < 3:
        raise InputError(f"x, y and z of '{path}' must be three different columns")
    return tuple(columns), notes


def _asked_column(asked, names, path):
    found = columns_named(names, [str(asked).strip().lower()])
    if found:
        return found[0]
    if str(asked).isdecimal() and int(asked) > 0:
        return int(asked) - 1
    listed = ", ".join(f"'{name}'" for name in names) or "without names, to be given by number"
    raise InputError(f"'{path}' has no column '{asked}'; its columns are: {listed}")


def _read_rows(lines, layout, path, fraction_read, progress):
    """Read all rows, shape (N, 3); z is NaN where it is empty or says that it is none."""
    blocks = []
    before = layout.header_line
    lines = itertools.islice(lines, before, None)
    while block := list(itertools.islice(lines, _LINES_AT_ONCE)):
        blocks.append(_read_block(block, before, layout, path))
        before += len(block)
        checkpoint(progress, fraction_read())
    return np.concatenate(blocks)


def _read_block(block, before, layout, path):
    """Read rows by NumPy's quick way, or where one is odd, each by itself."""
    rows = [line for line in block if not line.isspace() and not line.startswith("#")]
    if not rows:
        return np.empty((0, 3))
    if layout.delimiter != ",":
        rows = [line.replace(",", ".") for line in rows]
    try:
        return np.loadtxt(
            rows, delimiter=layout.delimiter, usecols=layout.columns, quotechar='"', ndmin=2
        )
    except ValueError:
        return _read_odd_block(block, before, layout, path)


def _read_odd_block(block, before, layout, path):
    rows, bad = [], []
    for number, line in enumerate(block, start=before + 1):
        text = _without_comment(line)
        if not text:
            continue
        row = _row(_fields(text, layout.delimiter), layout)
        if row is None:
            bad.append(f"line {number}: {text[:60]}")
        else:
            rows.append(row)
    if bad:
        more = f"; and {len(bad) - _LINES_NAMED} more" if len(bad) > _LINES_NAMED else ""
        raise InputError(
            f"rows of '{path}' hold no numbers in the columns of x, y and z: "
            f"{'; '.join(bad[:_LINES_NAMED])}{more}"
        )
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def _row(fields, layout):
    """Return x, y, z of a row; ``None`` if it has not got them."""
    if len(fields) <= max(layout.columns):
        return None
    *place, z = (fields[column] for column in layout.columns)
    row = [_number(field, layout.delimiter) for field in place]
    row.append(np.nan if z.lower() in _UNKNOWN else _number(z, layout.delimiter))
    return None if None in row else row
