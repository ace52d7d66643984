"""Charts as inline SVG, in the colours of the text around them so that dark pages show them too."""

import math

from demsmith.core.report.markup import element
from demsmith.core.report.numbers import is_number, written

COLORS = (
    "#d6186f", "#2f7ed8", "#e87600", "#1f9e77", "#8a5cc9", "#8c8c8c", "#b8860b", "#00a4be",
)  # fmt: skip
"""Of the series of a chart: apart for colour-blind eyes, readable on white and on black."""

_WIDTH = 1030
_LEFT, _RIGHT, _TOP, _BOTTOM = 56, 16, 26, 44


def bars(groups, series, *, unit, description):
    """Draw grouped bars.

    Parameters
    ----------
    groups : sequence of str
        Below the axis.
    series : mapping of str to sequence of float or None
        A value per group, not negative, by the name of the series.
    unit : str
        Of the values.
    description : str
        What the chart shows, for those who cannot see it.

    Returns
    -------
    Markup
    """
    height = 300
    finite = [value for values in series.values() for value in values if is_number(value)]
    vertical = _Axis.linear(0, max(finite, default=1) or 1, height - _BOTTOM, _TOP)
    room = (_WIDTH - _LEFT - _RIGHT) / max(1, len(groups))
    bar = min(46.0, 0.8 * room / max(1, len(series)))
    marks = [*_grid(vertical, unit), _base(height)]
    for at, group in enumerate(groups):
        middle = _LEFT + (at + 0.5) * room
        marks.append(_text(middle, height - _BOTTOM + 18, group, text_anchor="middle"))
        for number, values in enumerate(series.values()):
            left = middle + (number - len(series) / 2) * bar
            marks += _bar(left, bar, values[at], vertical, number)
    return _drawing(height, marks, list(series), description)


def _bar(left, width, value, vertical, number):
    if not is_number(value):
        return []
    top = vertical.place(value)
    shown = element(
        "rect", x=left + 1, y=top, width=width - 2, height=max(vertical.start - top, 0.5), rx=1.5,
        fill=COLORS[number % len(COLORS)],
    )  # fmt: skip
    if width < 22:
        return [shown]
    return [shown, _text(left + width / 2, top - 5, written(value), text_anchor="middle")]


def scatter(points, *, across, up, unit, description):
    """Draw points over two axes, the horizontal one logarithmic.

    Parameters
    ----------
    points : mapping of str to (sequence, sequence, str)
        Places along both axes and the colour of each series.
    across, up : str
        What the axes show.
    unit : str
        Of the vertical one.
    description : str
        What the chart shows, for those who cannot see it.

    Returns
    -------
    Markup
    """
    height = 320
    places = [place for xs, _, _ in points.values() for place in xs]
    values = [value for _, ys, _ in points.values() for value in ys]
    horizontal = _Axis.logarithmic(1, max(places, default=10), _LEFT + 8, _WIDTH - _RIGHT - 8)
    vertical = _Axis.linear(0, max(values, default=1) or 1, height - _BOTTOM, _TOP)
    marks = [*_grid(vertical, unit), *_ticks(horizontal, height), _base(height)]
    marks.append(_text(_WIDTH - _RIGHT, height - 6, across, text_anchor="end"))
    marks.append(_text(_LEFT, 12, up))
    for xs, ys, colour in points.values():
        dots = [
            element("circle", cx=horizontal.place(_beside(x, at)), cy=vertical.place(y), r=2.6)
            for at, (x, y) in enumerate(zip(xs, ys, strict=True))
        ]
        marks.append(element("g", dots, fill=colour, fill_opacity=0.62))
    colours = [colour for _, _, colour in points.values()]
    return _drawing(height, marks, list(points), description, colours)


def _beside(value, number):
    """Move a point by up to an eighth, each by its own share, so that equal ones are seen."""
    return value * (1 + 0.25 * (number * 0.618034 % 1 - 0.5))


def calibration(nominal, observed, *, description):
    """Draw how much the intervals of an uncertainty hold against what they promise.

    Parameters
    ----------
    nominal : sequence of float
        What they promise, 0 to 1.
    observed : mapping of str to sequence of float or None
        The share of cells they hold, by the name of the series.
    description : str
        What the chart shows, for those who cannot see it.

    Returns
    -------
    Markup
    """
    height = 400
    width = height - _BOTTOM - _TOP + _LEFT + _RIGHT
    horizontal = _Axis.linear(0, 100, _LEFT, width - _RIGHT)
    vertical = _Axis.linear(0, 100, height - _BOTTOM, _TOP)
    marks = [*_grid(vertical, "%", width=width), *_ticks(horizontal, height)]
    corners = [(0, 0), (100, 100)]
    marks.append(
        _path(corners, horizontal, vertical, stroke="currentColor", stroke_dasharray="4 4")
    )
    marks.append(_text(width - _RIGHT, height - 6, "promised [%]", text_anchor="end"))
    marks.append(_text(_LEFT, 12, "held"))
    for number, values in enumerate(observed.values()):
        colour = COLORS[number % len(COLORS)]
        places = [(100 * x, 100 * y) for x, y in zip(nominal, values, strict=True) if is_number(y)]
        marks.append(_path(places, horizontal, vertical, stroke=colour, stroke_width=2))
        marks += [
            element("circle", cx=horizontal.place(x), cy=vertical.place(y), r=3.5, fill=colour)
            for x, y in places
        ]
    return _drawing(height, marks, list(observed), description, width=width)


def shares(parts, *, description):
    """Draw parts of a whole as one bar, with a legend.

    Parameters
    ----------
    parts : sequence of (str, float, str)
        Name, size and colour of each.
    description : str
        What the chart shows, for those who cannot see it.

    Returns
    -------
    Markup
    """
    height, whole, left, drawn = 30, sum(size for _, size, _ in parts) or 1, 0.0, []
    for _, size, colour in parts:
        width = _WIDTH * size / whole
        drawn.append(element("rect", x=left, width=width, height=height, fill=colour))
        left += width
    names = [f"{name}: {written(100.0 * size / whole)} %" for name, size, _ in parts]
    bar = _svg(_WIDTH, height, drawn, description)
    return element("div", bar, legend(names, [colour for _, _, colour in parts]))


def ramp(stops, low, high, unit):
    """Draw the colours of a ramp between the values of its ends.

    Parameters
    ----------
    stops : sequence of (float, (red, green, blue))
        As in `demsmith.core.report.pictures.coloured`.
    low, high : float
    unit : str

    Returns
    -------
    Markup
    """
    width, height = 160, 11
    colours = [
        element("stop", offset=place, stop_color=hexadecimal(colour)) for place, colour in stops
    ]
    gradient = element("linearGradient", colours, id="ramp")
    strip = element("rect", width=width, height=height, rx=2, fill="url(#ramp)")
    drawn = _svg(width, height, [element("defs", gradient), strip], "from low to high")
    return element("span", written(low), drawn, f"{written(high)} {unit}", class_="ramp")


class _Axis:
    """A scale from values to places, and its ticks."""

    def __init__(self, low, high, start, stop, ticks, scale):
        self.low, self.high, self.start, self.stop = low, high, start, stop
        self.ticks, self._scale = ticks, scale

    @classmethod
    def linear(cls, low, high, start, stop):
        step = _round_step((high - low) / 5)
        last = math.ceil((high - low) / step - 1e-9)
        ticks = [low + step * number for number in range(last + 1)]
        return cls(low, ticks[-1], start, stop, ticks, float)

    @classmethod
    def logarithmic(cls, low, high, start, stop):
        last = max(1, math.ceil(math.log10(high) - 1e-9))
        ticks = [10**power for power in range(last + 1)]
        return cls(math.log10(low), last, start, stop, ticks, math.log10)

    def place(self, value):
        share = (self._scale(value) - self.low) / (self.high - self.low)
        return self.start + share * (self.stop - self.start)


def _round_step(step):
    """Give 1, 2 or 5 times a power of ten, at least ``step``."""
    power = 10.0 ** math.floor(math.log10(step))
    return next(power * factor for factor in (1, 2, 5, 10) if power * factor >= step * (1 - 1e-9))


def _grid(axis, unit, *, width=_WIDTH):
    """Lines and labels of a vertical axis; the unit stands at the top."""
    marks = []
    for tick in axis.ticks:
        y = axis.place(tick)
        marks.append(_line(_LEFT, y, width - _RIGHT, y, opacity=0.15))
        label = written(float(tick), 0 if axis.high >= 5 else 2)
        last = tick == axis.ticks[-1]
        shown = f"{label} {unit}" if last else label
        marks.append(_text(_LEFT - 7, y + 4, shown, text_anchor="end"))
    return marks


def _ticks(axis, height):
    """Lines and labels of a horizontal axis."""
    marks = []
    for tick in axis.ticks:
        x = axis.place(tick)
        marks.append(_line(x, _TOP, x, height - _BOTTOM, opacity=0.08))
        label = written(round(tick))
        marks.append(_text(x, height - _BOTTOM + 18, label, text_anchor="middle"))
    return marks


def _base(height):
    return _line(_LEFT, height - _BOTTOM, _WIDTH - _RIGHT, height - _BOTTOM, opacity=0.5)


def _line(x1, y1, x2, y2, *, opacity):
    return element(
        "line", x1=x1, y1=y1, x2=x2, y2=y2, stroke="currentColor", stroke_opacity=opacity
    )


def _path(places, horizontal, vertical, **attributes):
    corners = " ".join(f"{horizontal.place(x):.1f},{vertical.place(y):.1f}" for x, y in places)
    return element("polyline", points=corners, fill="none", **attributes)


def _text(x, y, content, **attributes):
    return element("text", content, x=x, y=y, **attributes)


def _drawing(height, marks, names, description, colours=COLORS, width=_WIDTH):
    """Put a legend above a drawing, if it has more than one series."""
    drawn = _svg(width, height, marks, description)
    return element("div", legend(names, colours), drawn) if len(names) > 1 else drawn


def _svg(width, height, marks, description):
    return element(
        "svg", element("title", description), marks, viewBox=f"0 0 {width} {height}", role="img",
        width=width, height=height, xmlns="http://www.w3.org/2000/svg",
    )  # fmt: skip


def hexadecimal(colour):
    """Write red, green and blue, 0 to 255, as ``#rrggbb``."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def legend(names, colours):
    """List names beside patches of their colours, which repeat."""
    return element(
        "ul",
        (
            element("li", _patch(colours[number % len(colours)]), name)
            for number, name in enumerate(names)
        ),
        class_="legend",
    )


def _patch(colour):
    swatch = element("rect", width=12, height=12, rx=2, fill=colour)
    return element("svg", swatch, width=12, height=12, aria_hidden="true")
