"""Blocks a report is made of: numbers, facts, tables, pictures, charts, notes."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import repeat

from demsmith.core.report.markup import Markup, element, joined
from demsmith.core.report.numbers import is_number, written

_UNITS = {"_m_per_km": "m/km", "_m2": "m²", "_m": "m", "_s": "s", "_percent": "%"}
"""Ends of keys that tell a unit."""


@dataclass(frozen=True)
class Numbers:
    """A few large numbers.

    Attributes
    ----------
    items : sequence of (label, text, note)
    """

    items: Sequence

    def markup(self):
        """Write the block as HTML."""
        return element("dl", (_number(*item) for item in self.items), class_="numbers")


def _number(label, text, note):
    below = element("dd", note, class_="note") if note else None
    return element("div", element("dt", label), element("dd", text, class_="value"), below)


@dataclass(frozen=True)
class Facts:
    """Names and what they are, in two columns.

    Attributes
    ----------
    items : mapping of str to value
    """

    items: dict

    def markup(self):
        """Write the block as HTML."""
        rows = (
            element("tr", element("th", name, scope="row"), element("td", written(value)))
            for name, value in self.items.items()
        )
        return element("table", element("tbody", rows), class_="facts")


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    name : str
        Key of its values in the rows.
    title : str
    digits : int or None
        Decimals of real numbers, as in `demsmith.core.report.numbers.written`.
    """

    name: str
    title: str
    digits: int | None = None


@dataclass(frozen=True)
class Table:
    """A table with a header.

    Attributes
    ----------
    columns : sequence of Column
    rows : sequence of mappings
        Values by the columns' names.
    caption : str
    best : set of (int, str)
        Row numbers and column names of the cells to mark as the best ones.
    """

    columns: Sequence
    rows: Sequence
    caption: str = ""
    best: frozenset = frozenset()

    def markup(self):
        """Write the block as HTML."""
        kinds = [self._kind(column) for column in self.columns]
        head = (
            element("th", column.title, scope="col", class_=kind)
            for column, kind in zip(self.columns, kinds, strict=True)
        )
        body = (
            element("tr", map(self._cell, self.columns, kinds, repeat((number, row))))
            for number, row in enumerate(self.rows)
        )
        caption = element("caption", self.caption) if self.caption else None
        table = element(
            "table", caption, element("thead", element("tr", head)), element("tbody", body)
        )
        return element("div", table, class_="scroll")

    def _kind(self, column):
        """Class of a column's cells: one with a number is a column of numbers."""
        numeric = any(is_number(row.get(column.name)) for row in self.rows)
        return "number" if numeric else None

    def _cell(self, column, kind, numbered_row):
        number, row = numbered_row
        text = written(row.get(column.name), column.digits)
        if (number, column.name) in self.best:
            return element("td", "★ ", element("strong", text), class_=f"{kind} best")
        return element("td", text, class_=kind)


def table_of(rows, titles=None, *, caption=""):
    """Make a table of rows whose columns are whatever keys they have.

    Parameters
    ----------
    rows : sequence of mappings
    titles : mapping of str to str, optional
        Titles by key, in the order of the columns. Keys that are not named follow; theirs are
        made of the keys.
    caption : str

    Returns
    -------
    Table

    Examples
    --------
    >>> table = table_of([{"rim_rmse_m": 2.0}, {"why": "flat"}], {"why": "Reason"})
    >>> [column.title for column in table.columns]
    ['Reason', 'Rim rmse [m]']
    """
    titles = titles or {}
    found = dict.fromkeys(key for row in rows for key in row)
    names = [name for name in titles if name in found]
    names += [name for name in found if name not in titles]
    columns = [Column(name, titles.get(name) or _title(name)) for name in names]
    return Table(columns, list(rows), caption)


def _title(key):
    """Make a title of a key such as ``shift_east_m``, whose end may be a unit."""
    for end, unit in _UNITS.items():
        if key.endswith(end):
            return f"{_title(key.removesuffix(end))} [{unit}]"
    words = key.replace("_", " ")
    return words[:1].upper() + words[1:]


@dataclass(frozen=True)
class Picture:
    """A picture with a caption.

    Attributes
    ----------
    jpeg : bytes
    alt : str
        What it shows, for those who cannot see it.
    caption : str
    below : Markup or None
        A legend, if it needs one.
    """

    jpeg: bytes
    alt: str
    caption: str
    below: Markup | None = None

    def markup(self):
        """Write the block as HTML."""
        source = "data:image/jpeg;base64," + base64.b64encode(self.jpeg).decode("ascii")
        shown = element("img", src=source, alt=self.alt)
        caption = element("figcaption", self.caption, self.below)
        return element("figure", shown, caption)


@dataclass(frozen=True)
class Gallery:
    """Pictures side by side.

    Attributes
    ----------
    pictures : sequence of Picture
    columns : int
        As many beside each other where the page is wide enough.
    """

    pictures: Sequence
    columns: int = 2

    def markup(self):
        """Write the block as HTML."""
        shown = (picture.markup() for picture in self.pictures)
        return element("div", shown, class_=f"gallery of-{self.columns}")


@dataclass(frozen=True)
class Chart:
    """A drawing with a caption.

    Attributes
    ----------
    drawing : Markup
        From `demsmith.core.report.charts`.
    caption : str
    """

    drawing: Markup
    caption: str

    def markup(self):
        """Write the block as HTML."""
        return element("figure", self.drawing, element("figcaption", self.caption), class_="chart")


@dataclass(frozen=True)
class Note:
    """A paragraph.

    Attributes
    ----------
    text : str
    warning : bool
    """

    text: str
    warning: bool = False

    def markup(self):
        """Write the block as HTML."""
        return element("p", self.text, class_="warning" if self.warning else None)


@dataclass(frozen=True)
class Section:
    """A heading and the blocks below it.

    Attributes
    ----------
    title : str
        Empty for none.
    blocks : sequence
    """

    title: str
    blocks: Sequence

    def markup(self):
        """Write the section as HTML."""
        heading = element("h2", self.title) if self.title else None
        return element("section", heading, joined(block.markup() for block in self.blocks))
