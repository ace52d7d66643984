"""Command-line parameters made from an operation's options, which are defined in the core."""

import dataclasses
import math
from typing import Annotated, Literal

from cyclopts import Parameter

from demsmith.core.options import specifications


def parameters(options_class, *, group, advanced):
    """Make a type whose fields are the command-line options of an options class.

    Parameters
    ----------
    options_class : type
        Dataclass with `demsmith.core.options.option` fields.
    group, advanced : cyclopts.Group
        Under which the help lists the common and the advanced ones.

    Returns
    -------
    type
        Subclass of ``options_class`` for an annotation that Cyclopts reads; its values are
        accepted wherever ``options_class`` is.
    """
    fields = {field.name: field for field in dataclasses.fields(options_class)}
    return Parameter(name="*")(
        dataclasses.make_dataclass(
            options_class.__name__,
            [
                (spec.name, _annotation(spec, advanced if spec.advanced else group),
                 dataclasses.field(default=spec.default, metadata=fields[spec.name].metadata))
                for spec in specifications(options_class)
            ],
            bases=(options_class,),
            namespace={"__module__": __name__},  # Cyclopts takes those of "types" for built in
            frozen=True,
            kw_only=True,
        )
    )  # fmt: skip


def whole_number(_, tokens):
    """Read one whole number; Cyclopts by itself would round any other.

    Raises
    ------
    ValueError
        If it is none.
    """
    word = tokens[0].value
    try:
        number = float(word)
    except ValueError:
        number = math.nan
    if not number.is_integer():
        raise ValueError(f"'{word}' is no whole number")
    return int(number)


def flag(spec):
    """Give the word of an option on the command line.

    Examples
    --------
    >>> from demsmith.core.options import Specification
    >>> flag(Specification("r_s", float, 0.0, "", ""))
    '--r-s'
    """
    return "--" + (spec.flag or spec.name).replace("_", "-")


def _annotation(spec, group):
    kind = Literal[spec.choices] if spec.choices else spec.kind
    if spec.default is None:
        kind = kind | None
    return Annotated[
        kind,
        Parameter(
            name=flag(spec),
            group=group,
            negative=_negative(spec),
            show_default=spec.kind is not bool and spec.default is not None,
            converter=whole_number if spec.kind is int else None,
            help=_help(spec),
        ),
    ]


def _negative(spec):
    """Give the word that turns off what is on by default."""
    return "--no-" + flag(spec)[2:] if spec.kind is bool and spec.default else ()


def _help(spec):
    """Give the help with the range; Cyclopts adds choices and default, and checks choices.

    The range itself is checked by the operation, as everywhere.
    """
    low, high = spec.minimum, spec.maximum
    if low is not None and high is not None:
        return f"{spec.help} Range: {low:.10g} to {high:.10g}."
    if low is not None:
        return f"{spec.help} At least {low:.10g}."
    if high is not None:
        return f"{spec.help} At most {high:.10g}."
    return spec.help
