"""Options of an operation, defined once: default, range and help, read by every front end.

An operation's options are a frozen dataclass whose fields are made by `option`. The command
line and the Processing tools build their parameters from `specifications`, and the operation
itself calls `validate`, so that a value means and costs the same wherever it was typed.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

from demsmith.core.errors import InputError


@dataclass(frozen=True)
class Specification:
    """What a front end must know of one option.

    Attributes
    ----------
    name : str
        Python name; ``r_s`` is ``--r-s`` on the command line and ``R_S`` in Processing.
    kind : type
        ``bool``, ``int``, ``float`` or ``str``.
    default : object
        Its default; ``None`` where leaving it out means something of its own, told by ``help``.
    help : str
        One or two sentences for a user.
    title : str
        A few words, as a label in a dialog.
    minimum, maximum : float or None
        Inclusive bounds.
    choices : tuple of str
        The allowed words of a ``str`` option; empty if any text goes.
    advanced : bool
        Whether most users never touch it.
    flag : str or None
        The command line's word for it, where that is not the name.
    """

    name: str
    kind: type
    default: Any
    help: str
    title: str
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple = ()
    advanced: bool = False
    flag: str | None = None


def option(kind, default, title, help_text, **limits):
    """Make a dataclass field that carries its `Specification`."""
    return dataclasses.field(
        default=default, metadata=dict(kind=kind, title=title, help=help_text, **limits)
    )


def same_option(options_class, name):
    """Make a dataclass field that is the same option as another class has."""
    (field,) = (field for field in dataclasses.fields(options_class) if field.name == name)
    return dataclasses.field(default=field.default, metadata=field.metadata)


def specifications(options_class):
    """List the `Specification` of every field of an options class, in order."""
    return [
        Specification(name=field.name, default=field.default, **field.metadata)
        for field in dataclasses.fields(options_class)
        if field.metadata
    ]


def options_from(options_class, options, parameters, function):
    """Give the checked options of a function that takes them whole or as keywords of their own.

    Parameters
    ----------
    options_class : type
    options : object or None
        As given whole.
    parameters : dict
        As given by keywords.
    function : str
        Its name, for messages.

    Raises
    ------
    InputError
        If both were given, a keyword is no option's, or a value is out of range.
    """
    if options is None:
        try:
            options = options_class(**parameters)
        except TypeError as error:
            told = str(error).replace(f"{options_class.__name__}.__init__()", function)
            raise InputError(told) from None
    elif parameters:
        raise InputError(f"give options or {', '.join(parameters)}, not both")
    validate(options)
    return options


def validate(options):
    """Raise `InputError` for the first value that is of the wrong kind or out of range."""
    for spec in specifications(type(options)):
        value = getattr(options, spec.name)
        if value is None and spec.default is None:
            continue
        _validate_one(spec, value)


def _validate_one(spec, value):
    if spec.kind is str:
        if spec.choices and value not in spec.choices:
            raise InputError(f"{spec.name} is {value!r}; choose one of {', '.join(spec.choices)}")
        return
    if spec.kind is bool:
        if not isinstance(value, bool):
            raise InputError(f"{spec.name} is {value!r}; it is either true or false")
        return
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{spec.name} is {value!r}; it must be a number") from None
    if not math.isfinite(number) or (spec.kind is int and number != int(number)):
        needed = "a whole number" if spec.kind is int else "a finite number"
        raise InputError(f"{spec.name} is {value!r}; it must be {needed}")
    if spec.minimum is not None and number < spec.minimum:
        raise InputError(f"{spec.name} is {value!r}; it must be at least {spec.minimum:g}")
    if spec.maximum is not None and number > spec.maximum:
        raise InputError(f"{spec.name} is {value!r}; it must be at most {spec.maximum:g}")
