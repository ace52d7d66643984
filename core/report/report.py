"""A report: a page that needs nothing but itself, and its numbers as JSON."""

import json
from collections.abc import Sequence
from dataclasses import dataclass

from demsmith.core.raster import check_place, whole_or_nothing
from demsmith.core.raster.outputs import cannot_write
from demsmith.core.report.numbers import plain
from demsmith.core.report.page import page


@dataclass(frozen=True)
class Report:
    """What is told of one piece of work.

    Attributes
    ----------
    title, subtitle : str
    sections : sequence of Section
        What the page shows.
    data : dict
        All numbers of the page and more; what JSON cannot hold is brought to what it can.
    """

    title: str
    subtitle: str
    sections: Sequence
    data: dict

    def write_html(self, path, *, overwrite=False):
        """Write the page: one file, its pictures and charts inside.

        Parameters
        ----------
        path : path
        overwrite : bool
            Whether an existing file may be replaced.

        Raises
        ------
        OutputError
            If it cannot be written there; nothing is left behind.
        """
        _write(path, page(self), overwrite)

    def write_json(self, path, *, overwrite=False):
        """Write the numbers; parameters and errors as in `write_html`."""
        text = json.dumps(plain(self.data), indent=1, allow_nan=False, ensure_ascii=False)
        _write(path, text + "\n", overwrite)


def _write(path, text, overwrite):
    check_place(path, overwrite=overwrite)
    with whole_or_nothing(path) as unfinished:
        try:
            # A name that is no text, as a file system may hold, must not stop a report.
            with open(unfinished, "w", encoding="utf-8", errors="replace", newline="\n") as file:
                file.write(text)
        except OSError as error:
            raise cannot_write(path, error.strerror) from None
