"""Options that several verbs have, each defined here once."""

import json
import sys
from dataclasses import dataclass
from typing import Annotated

from cyclopts import Group, Parameter

from demsmith.core.cli.parameters import parameters, whole_number
from demsmith.core.cli.progress import CommandProgress
from demsmith.core.mcmd import MapFiles

VERB = Group("Options", sort_key=1)
SOURCE = Group("What is read", sort_key=2)
RUN = Group("How it runs", sort_key=3)
MCMD = Group(
    "MCMD",
    help="Constrained midpoint displacement (Belhadj 2007), with the paper's names.",
    sort_key=4,
)

Maps = parameters(MapFiles, group=MCMD, advanced=MCMD)

InputFile = Annotated[
    str,
    Parameter(
        name="INPUT",
        help="Elevation raster: .hgt, GeoTIFF, DTED, a zip that holds one, anything GDAL opens.",
    ),
]
OutputFile = Annotated[str, Parameter(name="OUTPUT", help="GeoTIFF to write, .tif.")]


Auxiliaries = Annotated[
    tuple[str, ...],
    Parameter(
        name="--aux",
        group=VERB,
        negative=(),
        show_default=False,
        help="Raster, or folder of tiles, of any CRS and resolution to fill from where it does "
        "better; repeat for more, in the order of trust.",
    ),
]


def _numbers(_, tokens):
    """Read the numbers, separated by commas, of every time the option is given."""
    return tuple(_number(word) for token in tokens for word in token.value.split(","))


def _number(word):
    try:
        return float(word)
    except ValueError:
        raise ValueError(f"'{word}' is not a number") from None


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Cells:
    """Which band is read, and which of its cells are voids besides those the file marks.

    The fields are named as the parameters of `demsmith.core.raster.read`.
    """

    band: Annotated[
        int, Parameter(group=SOURCE, converter=whole_number, help="Band to read, from 1.")
    ] = 1
    nodata: Annotated[
        tuple[float, ...],
        Parameter(
            group=SOURCE,
            help="Further values that mean void, as stored; several by commas or by repeating it.",
            converter=_numbers,
            n_tokens=1,
            allow_leading_hyphen=True,
            negative=(),
            show_default=False,
        ),
    ] = ()
    below: Annotated[
        float | None,
        Parameter(group=SOURCE, help="Cells at or below this elevation are voids."),
    ] = None
    above: Annotated[
        float | None,
        Parameter(group=SOURCE, help="Cells at or above this elevation are voids."),
    ] = None


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Source(Cells):
    """The same of one raster, which can have a mask."""

    mask: Annotated[
        str | None,
        Parameter(group=SOURCE, help="Raster of the same size; where it is not 0 are voids."),
    ] = None


def _flag(help_text):
    return Parameter(group=RUN, negative=(), show_default=False, help=help_text)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class FileRun:
    """How a verb runs, what it may replace, and how it tells what it did."""

    overwrite: Annotated[bool, _flag("Replace outputs that exist already.")] = False
    threads: Annotated[
        int | None,
        Parameter(
            group=RUN,
            converter=whole_number,
            show_default=lambda _: "one for each core",
            help="Threads to compute with; the result does not depend on it.",
        ),
    ] = None
    json: Annotated[bool, _flag("Print the result as JSON on standard output.")] = False
    quiet: Annotated[bool, _flag("Print errors only (and the result of --json).")] = False

    def progress(self, title):
        """Give the progress of this run, a context manager."""
        return CommandProgress(title, quiet=self.quiet)

    def tell(self, result, summary):
        """Print what was done.

        Parameters
        ----------
        result : object
            Has ``warnings`` and ``as_dict()``.
        summary : str
            The same for humans, one line.
        """
        if not self.quiet:
            for warning in result.warnings:
                print(f"warning: {warning}", file=sys.stderr)
        if self.json:
            print(json.dumps(result.as_dict(), allow_nan=False))
        elif not self.quiet:
            print(summary, file=sys.stderr)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Run(FileRun):
    """The same of one that writes GeoTIFFs."""

    creation_option: Annotated[
        tuple[str, ...],
        Parameter(
            group=RUN,
            metavar="KEY=VALUE",
            negative=(),
            show_default=False,
            help="GDAL creation option of the GeoTIFF, such as COMPRESS=LZW; repeat for more.",
        ),
    ] = ()
