"""The tool *Solar irradiance*."""

from qgis.core import (
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterDateTime,
    QgsProcessingParameterEnum,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameters,
)
from qgis.PyQt.QtCore import Qt

from demsmith.algorithms import styling
from demsmith.algorithms.parameters import (
    add,
    add_options,
    number,
    read_number,
    read_options,
    tr,
)
from demsmith.algorithms.source import BandTool

_HELP = """
<p>Computes how much sunlight falls on terrain under a clear sky, with the shadows that terrain
throws: at an instant [W/m²], on a day, or on the mean of a range of days or of a year
[Wh/m² a day].</p>
<p><b>When.</b> <i>day</i>: the day of the date. <i>range</i>: from the date to the last date.
<i>annual</i>: the year of the date. <i>instant</i>: the date and the time, in UTC. A day is that of
the Sun at the raster's middle, whatever the time zone; it is looked at in steps of half an hour
unless told otherwise.</p>
<p><b>Light</b> comes straight from the Sun (beam), from the sky (diffuse) and from the ground
around (reflected). The Sun's place is that of every cell's longitude and latitude, by the
algorithm of the NREL. The sky is that of GRASS r.sun (<i>linke</i>) or of pvlib (<i>ineichen</i>).
</p>
<p><b>Elevations</b> are brought to metres by the band's unit; distances are metres on the ground,
also in geographic coordinates. Terrain outside the raster throws no shadow: give a raster that
reaches beyond what you need.</p>
<p><b>Further outputs</b>: the parts of the light, hours of sun, the shadows of an instant (1:
shadow), the sky-view factor (1: all of the sky is seen), and the elevation of the horizon in
degrees, a band for each direction.</p>
"""

_WHEN = ("day", "range", "annual", "instant")

# Name, title, help of the further outputs, and how their layers look.
_OUTPUTS = (
    ("BEAM", "Light from the Sun", "GeoTIFF.", styling.style_irradiance),
    ("DIFFUSE", "Light from the sky", "GeoTIFF.", styling.style_irradiance),
    ("REFLECTED", "Light from the ground", "GeoTIFF.", styling.style_irradiance),
    ("HOURS", "Hours of sun a day", "GeoTIFF; not of an instant.", styling.style_hours),
    ("SHADOW", "Shadows", "GeoTIFF, 1 where the Sun does not shine; of an instant only.", None),
    ("SKY_VIEW", "Sky-view factor", "GeoTIFF, from 0 to 1.", styling.style_sky_view),
    ("HORIZONS", "Elevation of the horizon", "GeoTIFF in degrees, a band for each direction of "
     "the horizon, clockwise from the grid's north.", None),
)  # fmt: skip
_COUNTS = (
    ("MINIMUM", "minimum", "Least light"),
    ("MEAN", "mean", "Mean light"),
    ("MAXIMUM", "maximum", "Most light"),
    ("INSTANTS", "instants", "Instants with the Sun up"),
    ("SECONDS", "seconds", "Run time [s]"),
)


class SolarIrradiance(BandTool):
    """Sunlight on terrain: `demsmith.core.solar.solar_file` in Processing."""

    def name(self):
        """Name the tool in ids."""
        return "solarirradiance"

    def displayName(self):
        """Name the tool in the toolbox."""
        return tr("Solar irradiance")

    def group(self):
        """Name the tool's group in the toolbox."""
        return tr("Sunlight")

    def groupId(self):
        """Name the tool's group in ids."""
        return "sunlight"

    def tags(self):
        """List words under which the tool is found."""
        return tr(
            "sun,solar,sunlight,irradiance,irradiation,insolation,radiation,energy,photovoltaic,"
            "shadow,shade,sunshine,hours,horizon,sky view factor,svf,linke,clear sky,r.sun,albedo,"
            "dem,dtm,dsm,srtm,elevation,terrain"
        ).split(",")

    def shortDescription(self):
        """Say in a line what the tool does."""
        return tr("Computes the sunlight on terrain under a clear sky, with the terrain's shadows.")

    def shortHelpString(self):
        """Give the help panel's text."""
        return tr(_HELP.replace("\n", " "))

    def initAlgorithm(self, configuration=None):
        """Declare parameters and outputs."""
        from demsmith.core.solar.options import SolarOptions

        self.add_source("Raster on whose terrain the Sun shines. It is never changed.")
        self._add_when()
        add_options(self, SolarOptions)
        self._add_place()
        self.add_running()
        add(self, QgsProcessingParameterRasterDestination("OUTPUT", tr("Solar irradiation")),
            help_text="GeoTIFF of all light: W/m² of an instant, Wh/m² a day of days.",
            )  # fmt: skip
        for name, title, help_text, _ in _OUTPUTS:
            add(self, QgsProcessingParameterRasterDestination(
                    name, tr(title), optional=True, createByDefault=False),
                help_text=help_text)  # fmt: skip
        for name, _, title in _COUNTS:
            self.addOutput(QgsProcessingOutputNumber(name, tr(title)))
        self.addOutput(QgsProcessingOutputString("UNIT", tr("Unit of the light")))
        self.addOutput(QgsProcessingOutputString("WARNINGS", tr("Warnings")))

    def _add_when(self):
        kinds = QgsProcessingParameterDateTime.Type
        add(self, QgsProcessingParameterEnum(
                "WHEN", tr("When"), options=list(_WHEN), defaultValue="day",
                usesStaticStrings=True),
            help_text="day, range (from the date to the last date), annual (the year of the "
            "date), or instant (the date and the time).")  # fmt: skip
        add(self, QgsProcessingParameterDateTime(
                "DATE", tr("Date"), type=kinds.Date, defaultValue="2024-06-20"),
            help_text="The day, or the first one.")  # fmt: skip
        add(self, QgsProcessingParameterDateTime(
                "LAST_DATE", tr("Last date"), type=kinds.Date, optional=True),
            help_text="Of a range.")  # fmt: skip
        add(self, QgsProcessingParameterDateTime(
                "TIME", tr("Time (UTC)"), type=kinds.Time, optional=True),
            help_text="Of an instant, in UTC.")  # fmt: skip
        add(self, number("EVERY", "Days from one to the next", kind=int, default=1, minValue=1),
            advanced=True,
            help_text="Of a range or a year, one of so many days is looked at, spread "
            "evenly.")  # fmt: skip
        add(self, QgsProcessingParameterBoolean(
                "WATTS", tr("Mean power instead of the day's sum"), defaultValue=False),
            advanced=True, help_text="W/m² over a day's 24 hours instead of Wh/m².")  # fmt: skip

    def _add_place(self):
        add(self, number("LATITUDE", "Latitude", optional=True, minValue=-90, maxValue=90),
            advanced=True,
            help_text="Of the middle of a raster that has no CRS [degrees].")  # fmt: skip
        add(self, number("LONGITUDE", "Longitude", optional=True, minValue=-360, maxValue=360),
            advanced=True,
            help_text="With the latitude. Not given: 0, where UTC is local time.")  # fmt: skip

    def compute(self, parameters, context, feedback, progress):
        """Compute the sunlight."""
        from demsmith.core.solar import solar_file
        from demsmith.core.solar.options import SolarOptions

        paths = {
            name: self.parameterAsOutputLayer(parameters, name, context)
            for name in ("OUTPUT", *(name for name, _, _, _ in _OUTPUTS))
        }
        result = solar_file(
            **self.read_source(parameters, context),
            **{name.lower(): path or None for name, path in paths.items()},
            when=self._when(parameters, context),
            options=read_options(self, SolarOptions, parameters, context),
            watts=self.parameterAsBoolean(parameters, "WATTS", context),
            latitude=read_number(self, "LATITUDE", parameters, context),
            longitude=read_number(self, "LONGITUDE", parameters, context),
            **self.read_running(parameters, context),
            progress=progress,
        )
        for warning in result.warnings:
            feedback.pushWarning(warning)
        feedback.pushInfo(
            tr("{:.4g} to {:.4g} {}, mean {:.4g}").format(
                result.minimum, result.maximum, result.unit, result.mean
            )
        )
        styling.style_irradiance(paths["OUTPUT"], context)
        for name, _, _, style in _OUTPUTS:
            if paths[name] and style:
                style(paths[name], context)
        outputs = {name: getattr(result, field) for name, field, _ in _COUNTS}
        outputs.update({name: path for name, path in paths.items() if path})
        outputs.update(UNIT=result.unit, WARNINGS="\n".join(result.warnings))
        return outputs

    def _when(self, parameters, context):
        from demsmith.core.errors import InputError
        from demsmith.core.solar.when import When

        chosen = self.parameterAsEnumString(parameters, "WHEN", context)
        date = self._date(parameters, "DATE", context)
        if chosen == "range":
            last = self._date(parameters, "LAST_DATE", context)
            if not last:
                raise InputError(tr("give LAST_DATE, the last date of the range"))
            return When(range=(date, last), every=self.parameterAsInt(parameters, "EVERY", context))
        if chosen == "annual":
            return When(
                annual=True, year=int(date.split("-")[0]),
                every=self.parameterAsInt(parameters, "EVERY", context),
            )  # fmt: skip
        if chosen == "instant":
            time = QgsProcessingParameters.parameterAsTime(
                self.parameterDefinition("TIME"), parameters, context
            )
            if not time.isValid():
                raise InputError(tr("give TIME, the time of the instant in UTC"))
            return When(instant=f"{date}T{time.toString('HH:mm:ss')}Z")
        return When(date=date)

    def _date(self, parameters, name, context):
        return self.parameterAsDateTime(parameters, name, context).date().toString(
            Qt.DateFormat.ISODate
        )  # fmt: skip
