"""Options: each one's range, kind and words, checked where it is defined."""

import dataclasses
import math

import numpy as np
import pytest

from demsmith.core.errors import InputError
from demsmith.core.mcmd import McmdOptions
from demsmith.core.options import Specification, option, options_from, specifications, validate
from demsmith.core.voids import FillOptions

ALL = {spec.name: spec for spec in specifications(FillOptions)}
RANGED = [
    (name, side) for name, spec in ALL.items() for side in ("minimum", "maximum")
    if getattr(spec, side) is not None
]  # fmt: skip


def with_value(name, value):
    return FillOptions(**{name: value})


def test_defaults_are_valid():
    validate(FillOptions())
    validate(McmdOptions())


def test_the_options_there_are():
    """Names are an interface: of the command line, of Processing, of Python."""
    assert set(ALL) == {
        "variant", "scheme", "l", "l_bu", "datum", "tension", "h", "r_s", "r_t", "relief", "seed",
        "method", "natural_roughness", "tune", "interior_only", "max_size", "float_output",
    }  # fmt: skip
    assert ALL["float_output"].flag == "float"
    assert ALL["variant"].choices == ("relaxed", "weighted", "paper")


@pytest.mark.parametrize("name", ALL)
def test_every_option_explains_itself(name):
    spec = ALL[name]
    assert isinstance(spec, Specification)
    assert spec.title and spec.title[0].isupper() and not spec.title.endswith(".")
    assert spec.help.endswith(".")
    assert spec.kind in (bool, int, float, str)
    if spec.default is None:
        assert "ot given" in spec.help
    else:
        assert isinstance(spec.default, spec.kind)
    if spec.kind is str:
        assert spec.default in spec.choices


@pytest.mark.parametrize(("name", "side"), RANGED)
def test_ranges(name, side):
    spec = ALL[name]
    bound = getattr(spec, side)
    validate(with_value(name, spec.kind(bound) if spec.kind is int else float(bound)))
    step = 1 if spec.kind is int else max(abs(bound), 1.0) * 1e-6
    beyond = bound - step if side == "minimum" else bound + step
    words = "at least" if side == "minimum" else "at most"
    with pytest.raises(InputError, match=rf"^{name} is .*; it must be {words} "):
        validate(with_value(name, beyond))


@pytest.mark.parametrize("name", [n for n, spec in ALL.items() if spec.kind in (int, float)])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, "three", (), [1.0]])
def test_what_is_no_finite_number(name, value):
    with pytest.raises(InputError, match=f"^{name} is .*; it must be"):
        validate(with_value(name, value))


@pytest.mark.parametrize("name", [n for n, spec in ALL.items() if spec.kind is int])
def test_whole_numbers(name):
    validate(with_value(name, 3))
    validate(with_value(name, np.int64(3)))
    with pytest.raises(InputError, match=f"^{name} is 2.5; it must be a whole number"):
        validate(with_value(name, 2.5))


@pytest.mark.parametrize("name", [n for n, spec in ALL.items() if spec.kind is bool])
def test_truths(name):
    validate(with_value(name, True))
    for value in (1, 0, "yes", None):
        with pytest.raises(InputError, match=f"^{name} is {value!r}; it is either true or false"):
            validate(with_value(name, value))


@pytest.mark.parametrize("name", [n for n, spec in ALL.items() if spec.kind is str])
def test_words(name):
    for word in ALL[name].choices:
        validate(with_value(name, word))
    for word in ("", "Relaxed", None, 3):
        with pytest.raises(InputError, match=f"^{name} is {word!r}; choose one of "):
            validate(with_value(name, word))


def test_none_is_only_for_what_has_no_default():
    for name, spec in ALL.items():
        if spec.default is None:
            validate(with_value(name, None))
        elif spec.kind in (int, float):
            with pytest.raises(InputError, match=f"^{name} is None"):
                validate(with_value(name, None))


def test_unknown_keywords_and_places():
    with pytest.raises(TypeError, match="colour"):
        FillOptions(colour="red")
    with pytest.raises(TypeError):
        FillOptions("relaxed")
    with pytest.raises(dataclasses.FrozenInstanceError):
        FillOptions().seed = 3


def test_options_whole_or_as_keywords():
    given = FillOptions(seed=5)
    assert options_from(FillOptions, given, {}, "fill") is given
    assert options_from(FillOptions, None, {"seed": 5}, "fill") == given
    with pytest.raises(InputError, match="^give options or seed, r_s, not both$"):
        options_from(FillOptions, given, {"seed": 5, "r_s": 1}, "fill")
    with pytest.raises(InputError, match="^fill got an unexpected keyword argument 'colour'$"):
        options_from(FillOptions, None, {"colour": "red"}, "fill")
    with pytest.raises(InputError, match="seed is -1"):
        options_from(FillOptions, None, {"seed": -1}, "fill")
    with pytest.raises(InputError, match="seed is -1"):
        options_from(FillOptions, FillOptions(seed=-1), {}, "fill")


def test_options_of_ones_own():
    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Own:
        size: int = option(int, 3, "Size", "How large.", minimum=1)
        name: str = option(str, "", "Name", "Any text.")
        plain: int = 7  # no option

    specs = specifications(Own)
    assert [spec.name for spec in specs] == ["size", "name"]
    assert specs[0] == Specification("size", int, 3, "How large.", "Size", minimum=1)
    validate(Own(name="anything", plain="whatever"))
    with pytest.raises(InputError, match="size is 0; it must be at least 1"):
        validate(Own(size=0))
