"""HTML and SVG elements, every text and attribute of which is escaped."""

import html
import unicodedata

_EMPTY = frozenset(["meta", "img", "line", "rect", "circle", "polyline", "stop"])


class Markup(str):
    """Text that is markup already, and is not escaped again."""

    __slots__ = ()


def element(name, /, *content, **attributes):
    """Make an element.

    Parameters
    ----------
    name : str
        Of the tag.
    content : str, number, Markup, None, or an iterable of these
        What is in it; all but `Markup` is escaped, ``None`` left out.
    attributes
        An underscore at the end is dropped, others become hyphens: ``class_``, ``stroke_width``.
        Those that are ``None`` are left out.

    Returns
    -------
    Markup

    Examples
    --------
    >>> print(element("td", "a < b", class_="number"))
    <td class="number">a &lt; b</td>
    """
    told = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{html.escape(_text(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    if name in _EMPTY and not content:
        return Markup(f"<{name}{told}/>")
    return Markup(f"<{name}{told}>{_inner(content)}</{name}>")


def joined(*content):
    """Make one `Markup` of several pieces, escaped as in `element`."""
    return Markup(_inner(content))


def _inner(content):
    if content is None:
        return ""
    if isinstance(content, Markup):
        return content
    if isinstance(content, (str, int, float)):
        return html.escape(_text(content))
    return "".join(map(_inner, content))


def _text(value):
    """Write a number with no more digits than a drawing needs; drop what turns or hides text."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return "".join(
        sign for sign in str(value) if sign in "\n\t" or unicodedata.category(sign)[0] != "C"
    )
