"""``demsmith solar``."""

from dataclasses import dataclass
from typing import Annotated

from cyclopts import App, Group, Parameter

from demsmith.core.cli.common import VERB, InputFile, OutputFile, Run, Source
from demsmith.core.cli.parameters import parameters, whole_number
from demsmith.core.solar import SolarOptions, When, solar_file

_WHEN = Group("When (one of the first five)", sort_key=0)
_MORE = Group("Further outputs, GeoTIFF", sort_key=1.5)

_Options = parameters(SolarOptions, group=VERB, advanced=VERB)

app = App(
    name="solar",
    help_epilogue="""\
Light is given in W/m² for an instant, and in Wh/m² a day for days (the mean of several).

Examples:
  demsmith solar N37W004.hgt june.tif --date 2024-06-20 --hours hours.tif
  demsmith solar dem.tif now.tif --instant 2024-12-21T09:00+01:00 --shadow s.tif
  demsmith solar dem.tif year.tif --annual --every 5 --watts
  demsmith solar heightmap.png light.tif --day 172 --latitude 46.5
""",
)


def _when(help_text, **more):
    return Parameter(group=_WHEN, negative=(), show_default=False, help=help_text, **more)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class _When(When):
    """`When` on the command line."""

    instant: Annotated[
        str | None,
        _when("Date and time, such as 2024-06-20T09:30+02:00; without a zone it is UTC."),
    ] = None
    day: Annotated[
        int | None, _when("Number of a day in its year, from 1.", converter=whole_number)
    ] = None
    date: Annotated[str | None, _when("A day, such as 2024-06-20.")] = None
    range: Annotated[
        tuple[str, str] | None, _when("First and last day, of which the mean is given.")
    ] = None
    annual: Annotated[bool, _when("All days of a year, of which the mean is given.")] = False
    year: Annotated[
        int | None, _when("Year of --day and --annual. Default: 2024.", converter=whole_number)
    ] = None
    every: Annotated[
        int,
        _when(
            "Of --range and --annual, look at one of so many days. Default: all.",
            converter=whole_number,
        ),
    ] = 1


def _output(help_text):
    return Parameter(group=_MORE, show_default=False, help=help_text)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class _Outputs:
    """The paths of `solar_file`'s further outputs, named as its parameters."""

    beam: Annotated[str | None, _output("Light straight from the sun.")] = None
    diffuse: Annotated[str | None, _output("Light of the sky.")] = None
    reflected: Annotated[str | None, _output("Light from the ground around.")] = None
    hours: Annotated[str | None, _output("Hours of sun a day.")] = None
    shadow: Annotated[
        str | None, _output("Of --instant: 1 where the sun does not shine, 0 where it does.")
    ] = None
    sky_view: Annotated[str | None, _output("Sky-view factor, from 0 to 1.")] = None
    horizons: Annotated[
        str | None,
        _output("Elevation of the horizon [°], a band for each of --directions, from north on."),
    ] = None


@app.default
def solar(
    input: InputFile,  # noqa: A002
    output: OutputFile,
    /,
    *,
    when: _When = _When(),
    options: _Options = _Options(),  # noqa: B008, frozen
    watts: Annotated[
        bool,
        Parameter(
            group=VERB, negative=(), show_default=False,
            help="Give the mean power over the day's 24 hours [W/m²] instead of its sum.",
        ),
    ] = False,
    latitude: Annotated[
        float | None,
        Parameter(
            group=VERB, allow_leading_hyphen=True,
            help="Of the middle of a raster that has no CRS [degrees].",
        ),
    ] = None,
    longitude: Annotated[
        float | None,
        Parameter(
            group=VERB, allow_leading_hyphen=True,
            help="With --latitude. Not given: 0, where UTC is local time.",
        ),
    ] = None,
    outputs: _Outputs = _Outputs(),
    source: Source = Source(),  # noqa: B008, frozen
    run: Run = Run(),  # noqa: B008, frozen
):  # fmt: skip
    """Compute the sunlight on terrain, with its shadows."""
    with run.progress("sunlight") as progress:
        result = solar_file(
            input, output, when=when, options=options, watts=watts,
            latitude=latitude, longitude=longitude, **vars(outputs),
            band=source.band, nodata=source.nodata, below=source.below, above=source.above,
            mask=source.mask, threads=run.threads, overwrite=run.overwrite,
            creation_options=run.creation_option, progress=progress,
        )  # fmt: skip
    run.tell(result, _summary(result))


def _summary(result):
    """Tell in a line what was done."""
    return (
        f"sunlight {result.minimum:.4g} to {result.maximum:.4g} {result.unit}, mean "
        f"{result.mean:.4g}, by {result.instants} instants in {result.seconds:.1f} s "
        f"-> {result.output}"
    )
