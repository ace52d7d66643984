"""When the sun shines: an instant, a day, or the mean of many, as front ends give it."""

import datetime
import math
from dataclasses import dataclass

from demsmith.core.errors import InputError

YEAR = 2024
"""The year of a day's number and of the annual mean, if none is given."""

_CHOICES = ("instant", "day", "date", "range", "annual")


@dataclass(frozen=True, kw_only=True)
class When:
    """One instant, one day, or days of which the mean is wanted.

    Exactly one of ``instant``, ``day``, ``date``, ``range`` and ``annual`` is given.

    Attributes
    ----------
    instant : str or None
        Date and time (ISO 8601), such as ``2024-06-20T09:30+02:00``; without a zone it is UTC.
    day : int or None
        Number of the day in its year, from 1.
    date : str or None
        ``2024-06-20``.
    range : (str, str) or ()
        First and last date of a range.
    annual : bool
        All days of a year.
    year : int or None
        Of ``day`` and ``annual``; default: `YEAR`.
    every : int
        Of a range or a year, one of so many days is looked at, spread evenly.

    Examples
    --------
    >>> When(day=60).days()
    [datetime.date(2024, 2, 29)]
    >>> [str(day) for day in When(range=("2024-06-01", "2024-06-12"), every=4).days()]
    ['2024-06-03', '2024-06-07', '2024-06-11']
    """

    instant: str | None = None
    day: int | None = None
    date: str | None = None
    range: tuple = ()
    annual: bool = False
    year: int | None = None
    every: int = 1

    def times(self):
        """Give what `demsmith.solar_irradiance` takes: ``instant`` or ``days``, checked.

        Raises
        ------
        InputError
            If not exactly one choice was made, one makes no sense beside another, or something
            is no date.
        """
        if self._choice() == "instant":
            return {"instant": _instant(self.instant)}
        return {"days": self.days()}

    def days(self):
        """List the days: see `times`."""
        choice = self._choice()
        if choice == "day":
            return [self._numbered_day()]
        if choice == "date":
            return [_date(self.date)]
        if choice == "range":
            return self._between(*_first_and_last(self.range))
        year = self._year()
        return self._between(datetime.date(year, 1, 1), datetime.date(year, 12, 31))

    def _choice(self):
        given = {name: getattr(self, name) for name in _CHOICES}
        chosen = [name for name, it in given.items() if it not in (None, ()) and it is not False]
        if len(chosen) != 1:
            raise InputError(
                "give one of instant, day, date, range and annual, to say when; "
                f"{' and '.join(chosen) or 'nothing'} {'are' if len(chosen) > 1 else 'is'} given"
            )
        if self.year is not None and chosen[0] not in ("day", "annual"):
            raise InputError(f"year goes with day or annual; {chosen[0]} has its own")
        if self.every != 1 and chosen[0] not in ("range", "annual"):
            raise InputError(f"every goes with range or annual, not with {chosen[0]}")
        return chosen[0]

    def _year(self):
        year = YEAR if self.year is None else self.year
        if not datetime.MINYEAR < year < datetime.MAXYEAR:
            raise InputError(f"year is {year}; give one such as {YEAR}")
        return year

    def _numbered_day(self):
        first = datetime.date(self._year(), 1, 1)
        last = datetime.date(self._year(), 12, 31)
        if not 1 <= self.day <= (last - first).days + 1:
            raise InputError(
                f"day is {self.day}; the year {self._year()} has 1 to {(last - first).days + 1}"
            )
        return first + datetime.timedelta(days=self.day - 1)

    def _between(self, first, last):
        if self.every < 1:
            raise InputError(f"every is {self.every}; it must be at least 1")
        days = (last - first).days + 1
        count = math.ceil(days / self.every)
        return [
            first + datetime.timedelta(days=int((n + 0.5) * days / count)) for n in range(count)
        ]


def _first_and_last(dates):
    if len(dates) != 2:
        raise InputError(f"range is {' '.join(dates)}; give its first and its last date")
    first, last = (_date(date) for date in dates)
    if last < first:
        raise InputError(f"the range ends on {last}, before it begins, on {first}")
    return first, last


def _date(text):
    try:
        return datetime.date.fromisoformat(text)
    except ValueError:
        raise InputError(f"'{text}' is no date; give one such as 2024-06-20") from None


def _instant(text):
    try:
        if len(text) <= len("2024-06-20"):  # would be its midnight
            raise ValueError
        instant = datetime.datetime.fromisoformat(text)
    except ValueError:
        raise InputError(
            f"'{text}' is no date and time; give one such as 2024-06-20T09:30+02:00 "
            "(without a zone: UTC)"
        ) from None
    return instant if instant.tzinfo else instant.replace(tzinfo=datetime.UTC)
